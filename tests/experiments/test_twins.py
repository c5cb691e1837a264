"""The generator of synthetic sessions keeps what physics keeps, reads as a hand formula, and writes its format."""

import csv
import json
import math
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial.transform import Rotation

# Last, so that an installed jaxsat is the one under test.
sys.path.append(str(Path(__file__).parents[2]))

from experiments.twins.draw import EPOCH, draw, start_of
from experiments.twins.earthlight import earthlight
from experiments.twins.motion import MU_0, Motion, right_hand_side, to_inertial
from experiments.twins.presets import PRESETS
from experiments.twins.sensors import Around, magnetometer_vector, response, stamps
from experiments.twins.validate import compare, read_table
from experiments.twins.world import EARTH_RADIUS, World, free_share
from experiments.twins.write import write_session

SOURCES = Path(__file__).parents[2] / "experiments" / "twins"
TLE = (
    "1 99001U 21001A   20326.72226509  .00001924  00000-0  13588-3 0  9993",
    "2 99001  82.1924 107.1117 0028351 295.3535 124.0543 15.40668907    12",
)
INERTIA = [[0.0016, 2e-5, -1e-5], [2e-5, 0.0018, 3e-5], [-1e-5, 3e-5, 0.0021]]


class NoField(World):
    """An orbit far from everything: no torque at all."""

    @property
    def positions(self):
        return np.broadcast_to([1e12, 0.0, 0.0], (len(self.nodes), 3))

    @property
    def fields(self):
        return np.zeros((len(self.nodes), 3))


class SteadyField(NoField):
    """The same in a field that stands still."""

    @property
    def fields(self):
        return np.broadcast_to([1e-5, -2e-5, 3e-5], (len(self.nodes), 3))


def satellite(**changes):
    return {
        "inertia": INERTIA,
        "magnet": [0.0, 0.0, 0.0],
        "q0": [0.5, 0.5, -0.5, 0.5],
        "w0": [0.03, -0.05, 0.02],
    } | changes


def test_it_shares_nothing_with_the_simulator():
    # Only the study fits; it has no part in the sessions.
    for file in set(SOURCES.glob("*.py")) - {SOURCES / "study.py"}:
        assert not re.search(r"^\s*(import|from) (jaxsat|fitting)\b", file.read_text(), re.MULTILINE)


def test_a_free_body_keeps_its_momentum_and_energy():
    motion = Motion(satellite(magnet=[0.1, 0.2, 0.3]), NoField(TLE, EPOCH, 0.0, 600.0))
    q, w = motion(np.linspace(0.0, 600.0, 61))
    momentum = np.einsum("nij,nj->ni", to_inertial(q), w @ np.array(INERTIA))
    np.testing.assert_allclose(
        momentum, np.broadcast_to(momentum[0], (61, 3)), atol=1e-8 * float(np.linalg.norm(momentum[0]))
    )
    energy = np.einsum("ni,ij,nj->n", w, np.array(INERTIA), w)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


def test_a_magnet_in_a_steady_field_keeps_its_energy_and_the_momentum_along_the_field():
    magnet, field = np.array([0.02, -0.01, 0.03]), np.array([1e-5, -2e-5, 3e-5])
    motion = Motion(satellite(magnet=magnet.tolist()), SteadyField(TLE, EPOCH, 0.0, 600.0))
    q, w = motion(np.linspace(0.0, 600.0, 61))
    energy = 0.5 * np.einsum("ni,ij,nj->n", w, np.array(INERTIA), w) - (to_inertial(q) @ magnet) @ field
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)
    along = np.einsum("nij,nj->ni", to_inertial(q), w @ np.array(INERTIA)) @ field
    np.testing.assert_allclose(along, along[0], rtol=1e-7)


def test_eddy_currents_only_take_energy():
    motion = Motion(satellite(eddy=3000.0), SteadyField(TLE, EPOCH, 0.0, 600.0))
    _, w = motion(np.linspace(0.0, 600.0, 61))
    assert (np.diff(np.einsum("ni,ij,nj->n", w, np.array(INERTIA), w)) < 0.0).all()


def test_torques_of_one_instant_are_those_of_the_textbook():
    world = World(TLE, EPOCH, 0.0, 100.0)
    rods = [{"axis": [1.0, 2.0, 2.0], "moment": 0.02}]
    cfg = satellite(magnet=[0.1, -0.2, 0.3], rods=rods, eddy=500.0, residual=[1e-8, 2e-8, -3e-8])
    coils, q, w = np.array([0.016, 0.0, -0.016]), np.array(cfg["q0"]), np.array(cfg["w0"])
    to_body = Rotation.from_quat(q, scalar_first=True).as_matrix().T
    r, b = to_body @ world.position(42.0), to_body @ world.field(42.0)
    axis = np.array([1.0, 2.0, 2.0]) / 3.0
    dipole = np.array([0.1, -0.2, 0.3]) + coils + 0.02 * (b @ axis) / 3.0e-5 * axis + 500.0 * np.cross(w, b)
    up, momentum = r / np.linalg.norm(r), np.array(INERTIA) @ w
    gravity = 3.0 * 3.986004418e14 / np.linalg.norm(r) ** 3 * np.cross(up, np.array(INERTIA) @ up)
    torque = gravity + np.cross(dipole, b) + np.array(cfg["residual"]) - np.cross(w, momentum)
    slope = right_hand_side(cfg, world, coils)(42.0, np.concatenate([q, w]))
    np.testing.assert_allclose(slope[4:], np.linalg.solve(np.array(INERTIA), torque), rtol=1e-9)
    half = np.concatenate([[-q[1:] @ w], q[0] * w + np.cross(q[1:], w)]) / 2.0
    np.testing.assert_allclose(slope[:4], half, rtol=1e-12)


def test_a_demagnetised_rod_rises_with_a_quarter_of_the_slope_of_its_loop():
    rod = {"axis": [0.0, 0.0, 1.0], "Hc": 8.0, "Br": 0.02, "Bs": 0.06, "volume": 7.5e-8}
    world = World(TLE, EPOCH, 0.0, 100.0)
    q = Rotation.align_vectors([world.field(50.0)], [[1.0, 0.0, 0.0]])[0].as_quat(scalar_first=True)
    w = np.array([0.0, 0.05, 0.0])
    slope = right_hand_side(satellite(rods=[rod]), world, np.zeros(3))(50.0, np.array([*q, *w, 0.0]))
    # No field along the rod: it stands in the middle of its loop, F = 1/2.
    inertial = (world.field(50.01) - world.field(49.99)) / 0.02
    field_rate = (Rotation.from_quat(q, scalar_first=True).inv().apply(inertial))[2] + 0.05 * np.linalg.norm(
        world.field(50.0)
    )
    steepness = math.tan(0.5 * math.pi * 0.02 / 0.06) / 8.0
    assert slope[7] == pytest.approx(0.25 * 2.0 / math.pi * 0.06 * steepness * field_rate / MU_0, rel=1e-5)


def test_earthlight_is_that_of_a_double_integral_over_the_globe():
    position, sun = np.array([0.0, 0.0, EARTH_RADIUS + 450e3]), np.array([0.6, 0.0, 0.8])
    normal = np.array([0.0, 0.8, -0.6])
    height = position[2]

    def ground(longitude: float, polar: float) -> float:
        up = np.array([np.sin(polar) * np.cos(longitude), np.sin(polar) * np.sin(longitude), np.cos(polar)])
        away = position - EARTH_RADIUS * up
        size = np.linalg.norm(away)
        seen = max(away @ up / size, 0.0) * max(-(away @ normal) / size, 0.0)
        return seen * max(up @ sun, 0.0) / np.pi * EARTH_RADIUS**2 / size**2 * np.sin(polar)

    edge = math.acos(EARTH_RADIUS / height)
    expected = dblquad(ground, 0.0, edge, 0.0, 2.0 * math.pi, epsabs=1e-5, epsrel=1e-4)[0]
    assert earthlight(position, sun, normal[None])[0] == pytest.approx(expected, rel=1e-3)


def test_half_a_disk_is_free_where_the_edge_of_a_large_one_runs_through_its_centre():
    sun, earth, apart = np.full(3, 0.004), np.full(3, 1.1), np.array([1.0, 1.1, 1.2])
    # The edge bends a little.
    np.testing.assert_allclose(free_share(sun, earth, apart), [0.0, 0.5, 1.0], atol=1e-3)


def test_a_magnetometer_turns_scales_and_shifts_in_that_order():
    around = Around(
        quaternion=np.array([[1.0, 0.0, 0.0, 0.0]]),
        rate=np.zeros((1, 3)),
        field=np.array([[1e-5, 2e-5, 3e-5]]),
        sun=np.array([[0.0, 0.6, -0.8]]),
        light=np.array([0.5]),
        position=np.zeros((1, 3)),
    )
    sensor = {
        "turn_deg": [0.0, 0.0, 90.0],
        "scale": [2.0, 1.0, 1.0],
        "bias": [1e-6, 0.0, 0.0],
        "stray": {"-z": [0.0, 1e-5, 0.0], "+x": [1.0, 1.0, 1.0]},
    }
    # The sensor's x is the body's y, its y is the body's -x.
    np.testing.assert_allclose(magnetometer_vector(sensor, around), [[4.1e-5, -1e-5 + 0.4e-5, 3e-5]], rtol=1e-12)


def test_a_diode_of_power_law_reads_the_hand_formula_and_the_earth_beside():
    sun = np.array([[math.cos(math.radians(36.0)), math.sin(math.radians(36.0)), 0.0]])
    position = np.array([[0.0, 0.0, EARTH_RADIUS + 450e3]])
    around = Around(np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, 3)), np.zeros((1, 3)), sun, np.ones(1), position)
    sensor = {"normals": ["+x", "-x"], "gain": [1.2, 1.1], "response": "power", "limit_deg": 72.0, "exponent": 2.0}
    np.testing.assert_allclose(response(sensor, around, 0.0), [[1.2 * 0.75, 0.0]], rtol=1e-12)
    scattered = response(sensor, around, 0.3) - response(sensor, around, 0.0)
    alone = earthlight(position[0], sun[0], np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(scattered[0], 0.3 * np.array([1.2, 1.1]) * alone)


def test_stamps_take_turns_and_offsets():
    np.testing.assert_array_equal(stamps({"cadence": [1.0, 3.0]}, 9.0), [1.0, 4.0, 5.0, 8.0, 9.0])
    np.testing.assert_array_equal(stamps({"cadence": 3.0, "offset": 0.5}, 7.0), [0.5, 3.5, 6.5])


@pytest.mark.parametrize("kind", PRESETS)
def test_drawn_sessions_are_physical_and_their_own(kind):
    cfg, same, other = draw(kind, 3), draw(kind, 3), draw(kind, 4)
    assert cfg == same and cfg["q0"] != other["q0"] and cfg["orbit"] != other["orbit"]
    moments = np.linalg.eigvalsh(np.array(cfg["inertia"]))
    assert 0.0 < moments[2] < moments[0] + moments[1]
    for line in cfg["orbit"]["tle"]:
        assert len(line) == 69


def test_files_agree_with_each_other_and_the_seed_decides_them(tmp_path):
    for folder in ("first", "second"):
        write_session(draw("1u-axes", 5), tmp_path / folder)
    names = sorted(file.name for file in (tmp_path / "first").iterdir())
    assert names == [f"1u-axes-5{end}" for end in (".csv", ".sat.toml", ".tle", ".truth.json")]
    for name in names:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()
    truth = json.loads((tmp_path / "first" / "1u-axes-5.truth.json").read_text())
    file = tomllib.loads((tmp_path / "first" / "1u-axes-5.sat.toml").read_text())
    assert file["orbit"]["tle"] == "1u-axes-5.tle" and file["sensors"]["mag"]["axes"] == "unknown"
    axes = np.array([{"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}[a[1]] for a in truth["sensors"]["mag"]["axes"]])
    signs = [1 if a[0] == "+" else -1 for a in truth["sensors"]["mag"]["axes"]]
    assert np.linalg.det(axes * np.array(signs)[:, None]) == pytest.approx(1.0)
    assert {"t", "q", "w", "fine", "parameters", "spoilt", "illumination", "cfg"} <= set(truth)
    assert len(truth["t"]) == len(truth["q"]) == len(truth["w"]) == len(truth["illumination"])
    assert truth["parameters"]["mag.delay"]["value"] == truth["cfg"]["sensors"]["mag"]["late"]
    assert start_of(truth["cfg"]) < 0.0
    found = compare(truth, tmp_path / "first" / "1u-axes-5.csv")
    assert found["attitude_rad"] < 1e-12
    assert found["residual_over_sigma"]["mag"] == pytest.approx(math.sqrt(2.0 / 3.0), abs=0.12)
    assert found["residual_over_sigma"]["sun"] == pytest.approx(1.0, abs=0.12)


def test_columns_of_several_rates_and_of_commands(tmp_path):
    table = write_session(draw("1u-coils", 2), tmp_path)
    truth = json.loads(table.with_name("1u-coils-2.truth.json").read_text())
    t, columns = read_table(table, "iso", EPOCH)
    np.testing.assert_array_equal(t, truth["t"])
    currents = np.stack([columns[f"coil_{axis}_A"] for axis in "xyz"], axis=1)
    assert not currents[0].any() and not currents[-1].any() and set(np.unique(currents)) == {-0.008, 0.0, 0.008}
    assert truth["absolute_scale"]
    mixed = write_session(draw("3u-mix", 2), tmp_path)
    with mixed.open(newline="") as stream:
        head, *rows = csv.reader(stream)
    known = {name: sum(row[k] != "" for row in rows) for k, name in enumerate(head)}
    assert known["gx"] == 1201 and known["bx"] == 301 and known["svx"] == 400 and 60 < known["qw"] < 105
    quaternions = np.array([[float(cell) for cell in row[-4:]] for row in rows if row[-1]])
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-6)
