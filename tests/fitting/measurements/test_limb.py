"""Limb angles in a fit: residuals and slopes by hand, and a session with limited currents fitted with and without."""

import dataclasses
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fitting
from fitting.settings import FitSettings
from jaxsat.satellites import read_numbers
from jaxsat.satellites.described import LIMB, described
from jaxsat.sensors import Albedo, LimbSensor
from jaxsat.sensors.view import View
from jaxsat.telemetry import Channel, read_telemetry

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "c-specular50-limited.RAW_SUN"
TRUTH = json.loads(SESSION.with_suffix(".truth.json").read_text())
MU, RADIUS = 3.986004418e14, 6371.2e3
NOISE_DEG = 0.3


def true_position(t: float) -> np.ndarray:
    """Of the truth's Kepler elements [m], by fixed-point iteration of Kepler's equation."""
    e = TRUTH["cfg"]["elements"]
    mean = np.sqrt(MU / e["a"] ** 3) * (t - e["t_peri"])
    anomaly = mean
    for _ in range(40):
        anomaly = mean + e["e"] * np.sin(anomaly)
    in_plane = [np.cos(anomaly) - e["e"], np.sqrt(1.0 - e["e"] ** 2) * np.sin(anomaly), 0.0]
    return e["a"] * Rotation.from_euler("ZXZ", [e["raan"], e["i"], e["argp"]], degrees=True).apply(in_plane)


def true_limb_angles() -> tuple[np.ndarray, np.ndarray]:
    """[time 2] distance and turn at the truth's samples [rad], and [time] the angle from body x to the nadir."""
    position = np.array([true_position(t) for t in TRUTH["t"]])
    distance = np.linalg.norm(position, axis=1)
    attitude = Rotation.from_quat(np.array(TRUTH["q"]), scalar_first=True)
    nadir = attitude.inv().apply(-position / distance[:, None])
    from_nadir = np.arccos(nadir[:, 0])
    return np.column_stack(
        [from_nadir - np.arcsin(RADIUS / distance), np.arctan2(nadir[:, 2], nadir[:, 1])]
    ), from_nadir


def noisy_limb_angles() -> np.ndarray:
    """The true ones with noise that is the same angle on the sphere in both."""
    angles, from_nadir = true_limb_angles()
    noise = np.radians(NOISE_DEG) * np.random.default_rng(7).normal(size=angles.shape)
    return angles + noise / np.column_stack([np.ones(len(angles)), np.sin(from_nadir)])


class Limited:
    """The session, its satellite and the Earth's light known."""

    def __init__(self):
        true, J = TRUTH["cfg"], np.array(TRUTH["cfg"]["inertia"])
        inertia = {f"{a}{b}": float(J["xyz".index(a), "xyz".index(b)]) for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
        self.numbers = read_numbers(
            changed={
                "spacecraft.magnet_A_m2": true["magnet"],
                "spacecraft.rods_A_m2": true["rods"],
                "spacecraft.inertia_kg_m2": inertia,
                "spacecraft.imax_mA": true["imax"],
                "albedo.specular": true["albedo_specular"],
                "albedo.diffuse": true["albedo_diffuse"],
            }
        )
        self.session = read_telemetry(SESSION, described(self.numbers))
        np.testing.assert_allclose(self.session.channels["cells"].t_s, TRUTH["t"], atol=1e-6)

    def fit(self, limb: np.ndarray | None, sigma_deg: float = NOISE_DEG):
        """With angles [time 2, rad] at the samples, NaN where not measured."""
        satellite = described(self.numbers, limb_sigma_deg=None if limb is None else sigma_deg)
        channels = dict(self.session.channels)
        if limb is not None:
            there = np.isfinite(limb).any(axis=1)
            t, values = channels["cells"].t_s[there], np.degrees(limb[there])
            channels[LIMB] = Channel.of(LIMB, satellite.channels[LIMB], t, values)
        session = dataclasses.replace(self.session, channels=channels)
        return fitting.fit(satellite, session, free="state", settings=FitSettings(starts=64), causes=False).result


@pytest.fixture(scope="module")
def limited():
    return Limited()


@pytest.fixture(scope="module")
def without(limited):
    return limited.fit(None)


@pytest.fixture(scope="module")
def with_limb(limited):
    return limited.fit(noisy_limb_angles())


def attitude_rms_deg(result) -> float:
    overlap = np.abs(np.sum(result.quaternion_inertial_from_body * np.array(TRUTH["q"]), axis=1))
    return float(np.degrees(np.sqrt(np.mean((2.0 * np.arccos(np.minimum(overlap, 1.0))) ** 2))))


@pytest.mark.slow
def test_limb_angles_improve_the_attitude_and_its_sigmas(without, with_limb):
    assert with_limb.status == without.status == "converged"
    assert attitude_rms_deg(with_limb) < 0.8 * attitude_rms_deg(without)
    assert np.all(with_limb.attitude_sigma_deg < without.attitude_sigma_deg)
    # Two sigmas of the noise of 142 angles.
    limb = with_limb.channels[LIMB]
    assert len(limb.t_s) == 71 and limb.rms == pytest.approx(NOISE_DEG, rel=0.12)
    assert LIMB not in without.channels


@pytest.mark.slow
def test_chi2_counts_both_channels_and_the_rms_the_currents(without, with_limb):
    limb, cells = with_limb.channels[LIMB], with_limb.channels["cells"]
    limb_chi2 = 142 * (limb.rms / NOISE_DEG) ** 2
    noise = np.hypot(2.0, 1.0 / np.sqrt(12.0))
    used = cells.weight > 0
    currents_chi2 = np.sum(((cells.modelled - cells.measured)[used] / noise) ** 2)
    assert with_limb.chi2 == pytest.approx(limb_chi2 + currents_chi2, rel=1e-9)
    assert with_limb.dof == used.sum() + 142 - 6
    assert with_limb.residual_rms_mA == pytest.approx(noise * np.sqrt(currents_chi2 / used.sum()), rel=1e-9)
    assert with_limb.residual_rms_mA == pytest.approx(without.residual_rms_mA, rel=0.05)


@pytest.mark.slow
def test_limited_samples_lose_their_currents_only(without, with_limb):
    """Eight samples left out as limited, and all 71 with their limb angles."""
    cells = with_limb.channels["cells"]
    np.testing.assert_array_equal(cells.used, without.channels["cells"].used)
    assert (~cells.used).sum() == 8 and with_limb.channels[LIMB].used.all()


@pytest.mark.slow
def test_some_angles_are_enough(limited, without):
    """Distances alone, every fourth sample: less is gained, and only what is there is counted."""
    sparse = np.full((71, 2), np.nan)
    sparse[::4, 0] = noisy_limb_angles()[::4, 0]
    result = limited.fit(sparse)
    assert result.status == "converged" and len(result.channels[LIMB].t_s) == 18 == result.dof - without.dof
    assert np.all(np.sum(result.attitude_sigma_deg**2, axis=1) < np.sum(without.attitude_sigma_deg**2, axis=1))


def looking(from_nadir_deg: float, turn_deg: float) -> Rotation:
    """Attitude above inertial +z whose body x is `from_nadir_deg` off the nadir, turned so that B is `turn_deg`."""
    # Upright, the nadir lies towards body -z, at a turn of -90 deg; a turn of the body by +x takes it back.
    tilt = Rotation.from_euler("y", 90.0 - from_nadir_deg, degrees=True)
    return tilt * Rotation.from_euler("x", -90.0 - turn_deg, degrees=True)


def view_of(q) -> View:
    """Above inertial +z at twice the Earth's radius."""
    zero = jnp.zeros(3)
    none = Albedo(jnp.zeros(()), jnp.zeros(()))
    return View(q, zero, jnp.zeros(()), jnp.asarray([0.0, 0.0, 2.0 * RADIUS]), zero, zero, None, none, {})


def residual_deg(q, measured_deg):
    """Differences as their noise counts them."""
    sensor, view = LimbSensor(earth_radius=jnp.asarray(RADIUS), on_sphere=True), view_of(q)
    return jnp.degrees(sensor.difference(sensor(view), jnp.radians(jnp.asarray(measured_deg))) * sensor.sharpness(view))


@pytest.mark.parametrize(
    ("from_nadir", "turn", "measured", "expected"),
    [
        (90.0, 20.0, (58.0, 23.0), (2.0, -3.0)),
        # Across +-180 deg the short way, and the sphere's angle is half of the turn at 30 deg.
        (30.0, 179.0, (0.0, -179.0), (0.0, -1.0)),
        (30.0, -179.0, (0.0, 179.0), (0.0, 1.0)),
        (30.0, 10.0, (0.0, 370.0), (0.0, 0.0)),
        # At the nadir there is no turn, and nothing of it is asked.
        (0.0, 0.0, (-31.0, 77.0), (1.0, 0.0)),
    ],
)
def test_residuals_by_hand(from_nadir, turn, measured, expected):
    q = jnp.asarray(looking(from_nadir, turn).as_quat(scalar_first=True))
    np.testing.assert_allclose(jax.jit(residual_deg)(q, jnp.asarray(measured)), expected, atol=1e-9)


@pytest.mark.parametrize("from_nadir", [0.0, 180.0, 1e-9])
def test_slopes_are_finite_where_there_is_no_turn(from_nadir):
    q = jnp.asarray(looking(from_nadir, 40.0).as_quat(scalar_first=True))
    slope = jax.jit(jax.jacfwd(residual_deg))(q, jnp.asarray([17.0, 115.0]))
    # A radian of turn is two of the quaternion's; it moves no angle by more than itself and the mismatch, pi.
    assert np.all(np.isfinite(slope)) and np.all(np.abs(np.radians(slope)) < 2.0 * (1.0 + np.pi))
