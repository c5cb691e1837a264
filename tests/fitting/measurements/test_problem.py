"""Residuals of any satellite and their exact Jacobian, against differences of the residuals themselves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.assembly import Samples, build_problem, groups_of, usable
from fitting.outcome.looking import look
from fitting.parameters.free import free_parameters
from fitting.surroundings import surroundings
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

pytestmark = pytest.mark.slow

SATELLITE = """
[body]
mass_kg = 1.2
size_m = [0.1, 0.1, 0.12]
inertia_kg_m2 = {value = [[0.0021, 1e-5, 0.0], [1e-5, 0.0023, 0.0], [0.0, 0.0, 0.0017]], sigma = 2e-4}
[magnet]
dipole_A_m2 = {value = [0.01, -0.02, 0.03], sigma = 0.05}
[[rods]]
axis = [1, 0, 0]
Hc = {value = 8.0, sigma = 1.5}
Br = {value = 0.02, sigma = 0.004}
Bs = {value = 0.06, sigma = 0.01}
volume = 7.5e-8
[[coils]]
axis = [0, 0, 1]
area_turns_m2 = {value = 2.0, sigma = 0.1}
column = "coil"
[residual]
torque = {value = [1e-8, 0.0, -1e-8], sigma = 1e-7}
[eddy]
coefficient = {value = 400.0, sigma = 300.0}
[orbit.elements]
a_km = 6871.0
e = 0.001
i_deg = 82.0
raan_deg = 40.0
argp_deg = 10.0
mean_anomaly_deg = 120.0
epoch = "2020-11-21T20:58:01Z"
[albedo]
diffuse = {value = 0.3, sigma = 0.2}
[time]
column = "t"
form = "seconds"
epoch = "2020-11-21T20:58:01Z"
[sensors.mag]
kind = "magnetometer"
unit = "uT"
bias = {value = [0.2, -0.1, 0.4], sigma = 1.0}
turn = {value = [0.02, 0.01, -0.03], sigma = 0.1}
scale = {value = [1.01, 0.98, 1.0], sigma = 0.04}
stray = {by = "faces", sigma = 1.0}
[sensors.gyro]
kind = "gyro"
unit = "deg/s"
bias = {value = [0.1, 0.0, -0.1], sigma = 0.3}
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "+y", "-z", "-x"]
response = "power"
gain = {value = [1.1, 1.0, 0.9, 1.0], sigma = 0.2}
limit_deg = {value = 75.0, sigma = 6.0}
exponent = {value = 2.2, sigma = 1.0}
[sensors.star]
kind = "star_tracker"
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "uT"
sigma = 0.3
delay_s = {value = 0.4, sigma = 1.0}
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.05
[channels.sun]
columns = ["s1", "s2", "s3", "s4"]
unit = "1"
sigma = 0.02
[channels.star]
columns = ["qw", "qx", "qy", "qz"]
unit = "1"
sigma = 0.001
"""
COLUMNS = "t,bx,by,bz,gx,gy,gz,s1,s2,s3,s4,qw,qx,qy,qz,coil"


class Case:
    """A session of made-up readings on unlike times: nothing here depends on their being those of a motion."""

    def __init__(self, folder):
        (folder / "sat.toml").write_text(SATELLITE)
        rng = np.random.default_rng(4)
        lines = [COLUMNS]
        for k in range(12):
            mag = [f"{v:.3f}" for v in rng.normal(0.0, 20.0, 3)] if k % 2 == 0 else [""] * 3
            gyro = [f"{v:.4f}" for v in rng.normal(0.0, 2.0, 3)]
            sun = [f"{v:.4f}" for v in rng.uniform(0.0, 1.0, 4)] if k % 3 else [""] * 4
            q = rng.normal(size=4)
            star = [f"{v:.6f}" for v in q / np.linalg.norm(q)] if k % 4 == 1 else [""] * 4
            lines.append(",".join([str(7 * k), *mag, *gyro, *sun, *star, f"{0.01 * (k // 4):.3f}"]))
        (folder / "table.csv").write_text("\n".join(lines) + "\n")
        satellite = read_satellite(folder / "sat.toml")
        assert isinstance(satellite, Satellite)
        session = read_telemetry(folder / "table.csv", satellite)
        assert isinstance(session, TableSession)
        self.samples = Samples.of(session.channels, session.epoch, session.columns)
        free = [leaf.name for leaf in satellite.leaves if leaf.sigma is not None]
        self.parameters = free_parameters(satellite.model, satellite.leaves, free)
        around, _ = surroundings(satellite, session)
        self.problem = build_problem(
            self.samples, satellite.model, around, delayed=("mag",), max_step=1.0, room_for=1.0
        )
        self.x = 0.2 * rng.normal(size=len(self.parameters.everything)) * self.parameters.everything
        self.x[3:6] = np.radians([1.0, -2.0, 1.5]) * 60.0
        q = rng.normal(size=4)
        self.reference = q / np.linalg.norm(q)
        self.blocks = np.asarray(len(self.problem.grid.step) // 4)

    def look(self, x, reference=None):
        start = jnp.asarray(self.reference if reference is None else reference)
        return [
            np.asarray(array) for array in look(self.problem, self.parameters.tree, jnp.asarray(x), start, self.blocks)
        ]


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return Case(tmp_path_factory.mktemp("fit"))


def test_groups_and_padding(case):
    """A quaternion of four numbers differs by three; what is not measured has no residual and no slope."""
    assert [(g.name, g.width) for g in case.problem.groups] == [("mag", 3), ("gyro", 3), ("sun", 4), ("star", 3)]
    assert [g.width for g in groups_of(case.problem.model, case.samples)] == [3, 3, 4, 3]
    residual, jacobian, *_ = case.look(case.x)
    unknown = ~np.asarray(case.problem.known)
    assert unknown[1, :3].all() and not unknown[0, :3].any() and unknown[12:].all()
    assert not residual[unknown].any() and not jacobian[unknown].any() and np.isfinite(jacobian).all()
    padding = np.array([name == "" for name in case.parameters.names])
    assert padding.any() and not jacobian[..., padding].any()
    assert not usable(case.problem, case.samples)[unknown].any()


def test_jacobian_against_differences(case):
    """Of every free number: state, satellite, rods with their first flux, sensors, delay; to the differences' error."""
    jacobian = case.look(case.x)[1]
    for number, name in enumerate(case.parameters.names):
        if not name:
            continue
        step = 1e-5
        shift = step * (np.arange(len(case.x)) == number)
        high, low = (case.look(case.x + sign * shift)[0] for sign in (1.0, -1.0))
        slope = (high - low) / (2.0 * step)
        scale = max(float(np.abs(slope).max()), 1e-3)
        # Of a rod's numbers RK4 itself is not smooth where the field turns between two steps.
        tolerance = 2e-4 if name.startswith("rods.") else 2e-6
        np.testing.assert_allclose(jacobian[..., number], slope, atol=tolerance * scale, err_msg=name)


def test_every_number_is_seen_by_something(case):
    """A leaf that changes no residual at any of eight attitudes would be a leaf that stands nowhere."""
    half = np.sqrt(0.5)
    turns = np.vstack([np.eye(4), half * (np.eye(4) + np.roll(np.eye(4), 1, axis=1))])
    largest = np.max([np.abs(case.look(case.x, turn)[1]).max(axis=(0, 1)) for turn in turns], axis=0)
    for number, name in enumerate(case.parameters.names):
        assert not name or largest[number] > 1e-9, name


def test_another_choice_of_what_is_free_is_the_same_program(case):
    whole = jax.tree.structure(case.parameters.tree)
    fewer = free_parameters(case.problem.model, case.parameters.leaves, ["magnet.x", "mag.bias.z", "mag.delay"])
    assert jax.tree.structure(fewer.tree) == whole
    shapes = [[np.shape(leaf) for leaf in jax.tree.leaves(each.tree)] for each in (fewer, case.parameters)]
    assert shapes[0] == shapes[1]
    assert fewer.everything.sum() == 6 + 3


def test_shifts_are_the_inverse_of_values(case):
    values = np.asarray(case.parameters.tree.values(jnp.asarray(case.x[6:])))
    np.testing.assert_allclose(case.parameters.shifts(values), case.x[6:], atol=1e-9)
