"""Limb angles in a fit: residuals and slopes by hand, and a session with limited currents fitted with and without."""

import dataclasses
import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.estimate import estimate
from fitting.measurements import limb as limb_model
from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.limb import LimbAngles
from fitting.measurements.observations import build_problem
from fitting.measurements.problem import CURRENTS, LIMB, Problem
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings, PriorSigma
from fitting.solvers import least_squares
from fitting.solvers.least_squares import Settings
from fitting.starts.multi_start import NONE
from jaxsat.errors import InputError
from jaxsat.integrators import BLOCK
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "c-specular50-limited.RAW_SUN"
TRUTH = json.loads(SESSION.with_suffix(".truth.json").read_text())
MU, RADIUS = 3.986004418e14, 6371.2e3
NOISE_DEG = 0.3
limb_residual, limb_residuals = jax.jit(limb_model.limb_residual), jax.jit(limb_model.limb_residuals)
normal_equations = jax.jit(least_squares.normal_equations, static_argnums=5)


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
        self.data = prepare_session(read_telemetry(SESSION)).observations()
        np.testing.assert_allclose(self.data.t, TRUTH["t"], atol=1e-6)
        true, J = TRUTH["cfg"], np.array(TRUTH["cfg"]["inertia"])
        self.nominal = dataclasses.replace(
            nominal_model(read_satellite()),
            magnet=np.array(true["magnet"]),
            rods=np.array(true["rods"]),
            inertia=np.array([J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]),
            max_current=1e-3 * true["imax"],
            albedo=np.array([true["albedo_specular"], true["albedo_diffuse"]]),
        )
        self.settings = FitSettings(free="state", starts=64, limb_sigma_deg=NOISE_DEG)

    def fit(self, limb, **settings):
        data = dataclasses.replace(self.data, limb=limb)
        return estimate(data, self.nominal, self.settings.changed(**settings))


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
    assert with_limb.limb_samples == 71 and with_limb.limb_rms_deg == pytest.approx(NOISE_DEG, rel=0.12)
    assert f"limb angles fit to {with_limb.limb_rms_deg:.2g} deg" in with_limb.message
    assert without.limb_samples == 0 and without.limb_rms_deg is None and "limb" not in without.message


@pytest.mark.slow
def test_chi2_counts_both_channels_and_the_rms_the_currents(without, with_limb):
    limb_chi2 = 142 * (with_limb.limb_rms_deg / NOISE_DEG) ** 2
    noise = np.hypot(2.0, 1.0 / np.sqrt(12.0))
    used = with_limb.weight > 0
    currents_chi2 = np.sum(((with_limb.modelled_mA - with_limb.measured_mA)[used] / noise) ** 2)
    assert with_limb.chi2 == pytest.approx(limb_chi2 + currents_chi2, rel=1e-9)
    assert with_limb.dof == used.sum() + 142 - 6
    assert with_limb.residual_rms_mA == pytest.approx(noise * np.sqrt(currents_chi2 / used.sum()), rel=1e-9)
    assert with_limb.residual_rms_mA == pytest.approx(without.residual_rms_mA, rel=0.05)


@pytest.mark.slow
def test_limited_samples_lose_their_currents_only(without, with_limb):
    """Eight samples left out as limited, and all 71 with their limb angles."""
    np.testing.assert_array_equal(with_limb.limited, without.limited)
    assert with_limb.limited.sum() == 8 and not with_limb.weight[with_limb.limited].any()
    assert with_limb.weight.shape == (71, 6)


@pytest.mark.slow
def test_weight_zero_is_a_fit_without(limited, without):
    result = limited.fit(noisy_limb_angles(), limb_weight=0.0)
    for field in dataclasses.fields(result):
        if field.name != "timing_s":
            np.testing.assert_array_equal(getattr(result, field.name), getattr(without, field.name), field.name)


@pytest.mark.slow
def test_weight_is_a_factor_of_the_inverse_variance(limited, with_limb):
    half = limited.fit(noisy_limb_angles(), limb_sigma_deg=0.5 * NOISE_DEG, limb_weight=0.25)
    np.testing.assert_allclose(half.quaternion_inertial_from_body, with_limb.quaternion_inertial_from_body, atol=1e-12)
    assert half.limb_rms_deg == pytest.approx(with_limb.limb_rms_deg, rel=1e-9)


@pytest.mark.slow
def test_some_angles_are_enough(limited, without):
    """Distances alone, every fourth sample: less is gained, and only what is there is counted."""
    sparse = np.full((71, 2), np.nan)
    sparse[::4, 0] = noisy_limb_angles()[::4, 0]
    result = limited.fit(sparse)
    assert result.status == "converged" and result.limb_samples == 18 == result.dof - without.dof
    assert np.all(np.sum(result.attitude_sigma_deg**2, axis=1) < np.sum(without.attitude_sigma_deg**2, axis=1))


@pytest.mark.slow
def test_no_angle_in_the_arc_is_bad_input(limited):
    with pytest.raises(InputError, match="limb angles: none is measured from the first sunlit sample on, t = 0 s"):
        limited.fit(np.full((71, 2), np.nan))
    with pytest.raises(ValueError, match="expected their limb_sigma"):
        build_problem(dataclasses.replace(limited.data, limb=noisy_limb_angles()), noise=2e-3, max_step=32.0)
    with pytest.raises(ValueError, match=r"limb_weight\n.*greater than or equal to 0"):
        FitSettings(limb_weight=-1.0)


@pytest.mark.slow
def test_jacobians_are_central_differences(limited):
    """All eight channels over the first samples, by the state and a parameter that limb angles do not feel."""
    count = 6
    cut = {name: getattr(limited.data, name)[:count] for name in ("t", "currents", "sun_eci")}
    data = dataclasses.replace(limited.data, **cut, limb=noisy_limb_angles()[:count])
    problem = build_problem(data, noise=2e-3, max_step=32.0, limb_sigma=np.radians(0.5))
    parameters = parametrization(limited.nominal, ("albedo.specular",), PriorSigma())
    x = np.concatenate([[0.05, -0.1, 0.02], np.array(TRUTH["w"][0]) / RATE_UNIT + 0.02, [0.4]])
    call = eqx.filter_jit(Problem.predict)

    def at(x):
        reference, blocks = (
            jnp.asarray(TRUTH["q"][0]),
            jnp.asarray(int(problem.grid.sample_index[count - 1]) // BLOCK + 1),
        )
        prediction, jacobian = call(problem, parameters, jnp.asarray(x), reference, blocks)
        return np.asarray(prediction.residual)[:count], np.asarray(jacobian)[:count]

    residual, jacobian = at(x)
    assert residual.shape == (count, 8) and jacobian.shape == (count, 8, 7)
    h = 1e-5
    for k, shift in enumerate(h * np.eye(7)):
        numeric = (at(x + shift)[0] - at(x - shift)[0]) / (2.0 * h)
        # h^2 of curvature, and 1e-13 / h of rounding of residuals of some tens of sigmas.
        np.testing.assert_allclose(jacobian[..., k], numeric, atol=2e-6 * max(np.abs(numeric).max(), 1.0))
    assert not jacobian[:, 6:, 6].any() and np.all(np.abs(jacobian[:, 6:, :3]).max(axis=2) > 1.0)


def looking(from_nadir_deg: float, turn_deg: float) -> Rotation:
    """Attitude above inertial +z whose body x is `from_nadir_deg` off the nadir, turned so that B is `turn_deg`."""
    # Upright, the nadir lies towards body -z, at a turn of -90 deg; a turn of the body by +x takes it back.
    tilt = Rotation.from_euler("y", 90.0 - from_nadir_deg, degrees=True)
    return tilt * Rotation.from_euler("x", -90.0 - turn_deg, degrees=True)


def residual_deg(attitude: Rotation, measured_deg) -> np.ndarray:
    q, position = jnp.asarray(attitude.as_quat(scalar_first=True)), jnp.asarray([0.0, 0.0, 2.0 * RADIUS])
    return np.degrees(limb_residual(q, position, jnp.radians(jnp.asarray(measured_deg)), jnp.asarray(RADIUS)))


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
    np.testing.assert_allclose(residual_deg(looking(from_nadir, turn), measured), expected, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("from_nadir", [0.0, 180.0, 1e-9])
def test_slopes_are_finite_where_there_is_no_turn(from_nadir):
    q = jnp.asarray(looking(from_nadir, 40.0).as_quat(scalar_first=True))[None]
    position = jnp.asarray([[0.0, 0.0, 2.0 * RADIUS]])
    sigma, radius = jnp.asarray(0.01), jnp.asarray(RADIUS)
    limb = LimbAngles(jnp.asarray([[0.3, 2.0]]), jnp.ones((1, 2), bool), sigma, radius)
    residual, slope = limb_residuals(limb, q, position, jnp.asarray(limb.measured))
    # One radian of turn about a transverse axis moves no angle on the sphere by more than one and the mismatch, pi.
    assert np.all(np.isfinite(residual)) and np.all(np.abs(slope) < (1.0 + np.pi) / 0.01)


@pytest.mark.slow
def test_what_is_wrong_with_currents_is_nothing_to_limb_angles():
    """A sample under the ceiling of the mixture: its currents lose their weight, its limb angles keep it."""
    residual = np.zeros((2, 8))
    residual[0, :6], residual[:, 6:] = 20.0, [[1.0, -2.0], [0.5, 0.0]]
    J = np.random.default_rng(3).normal(size=(2, 8, 6))
    none = jnp.asarray(NONE)
    settings = Settings(jnp.asarray(0), jnp.asarray(1), none, jnp.ones(6, bool), none, jnp.asarray(1.0))
    arrays = (jnp.asarray(residual), jnp.asarray(J), jnp.ones((2, 8)))
    cost, gradient, hessian = normal_equations(*arrays, settings, jnp.full((2, 8), NO_FLOOR), (CURRENTS, LIMB))
    kept = np.ones((2, 8))
    kept[0, :6] = 0.0
    # Each limb angle is robust by itself, a pseudo-Huber loss of scale 5, in place of a state of the sample.
    kept[:, 6:] = 1.0 / np.sqrt(1.0 + (residual[:, 6:] / 5.0) ** 2)
    weighted = J * kept[..., None]
    np.testing.assert_allclose(gradient, np.einsum("sc,scu->u", residual, weighted), atol=1e-12)
    # The mixture takes exp(-15) of the weight of a sample without residuals too.
    np.testing.assert_allclose(hessian, np.einsum("scu,scv->uv", weighted, J), atol=1e-5)
    huber = 50.0 * (np.sqrt(1.0 + (residual[:, 6:] / 5.0) ** 2) - 1.0).sum()
    assert float(cost) == pytest.approx(0.5 * (30.0 + huber), abs=1e-5)
