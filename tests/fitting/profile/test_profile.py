"""Intervals of curves in closed form, and profiles of a session against an independent least squares of SciPy."""

import json
from dataclasses import replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import least_squares

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.profile.profile import Z_68, Z_95, check_profile, interval, profile, profile_all
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.refine import refine
from fitting.starts.multi_start import Starts
from jaxsat.errors import InputError
from jaxsat.integrators import BLOCK
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "b-specular50.RAW_SUN"
ROOM_S = 6.0  # As a whole fit has it, whose programs are then used.
NOISE = 2.02e-3


class Minimum:
    """The session refined from its true motion, with its first samples only if `samples` are given."""

    def __init__(self, free: str, samples: int | None = None):
        settings = FitSettings(free=free)
        data = prepare_session(read_telemetry(SESSION)).observations()
        if samples is not None:
            data = replace(data, t=data.t[:samples], currents=data.currents[:samples], sun_eci=data.sun_eci[:samples])
        self.problem = build_problem(data, noise=NOISE, max_step=32.0, room_for=ROOM_S)
        self.parameters = parametrization(nominal_model(read_satellite()), settings.free_names, settings.prior_sigma)
        truth = json.loads(SESSION.with_suffix(".truth.json").read_text())
        weight = np.repeat(np.asarray(self.problem.valid).astype(float)[:, None], 6, axis=1)
        n = len(data.t)
        weight[:n][self.problem.bright()[:n] != self.problem.sunlit()[:n]] = 0.0
        self.weight = weight
        x = np.zeros((1, len(self.parameters.names)))
        x[0, 6:] = self.true_shifts(truth["cfg"])
        x[0, 3:6] = np.array(truth["w"][0]) / RATE_UNIT
        starts = Starts(x, np.array(truth["q"][:1]), np.zeros(1))
        self.refined = refine(
            self.problem, self.parameters, starts, weight, likelihood="normal", progress=lambda *_: None
        )

    def true_shifts(self, true) -> np.ndarray:
        """True parameters at the scale of |magnet| = 0.3, less the nominal ones, in units of their prior sigma."""
        scale, J = 0.3 / np.linalg.norm(true["magnet"]), np.array(true["inertia"])
        inertia = [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
        values = [*(scale * np.array([*true["magnet"], *true["rods"], *inertia])), 1e-3 * true["imax"]]
        values += [*true["panel_ratio"], true["albedo_specular"], true["albedo_diffuse"], *np.zeros(12)]
        return self.parameters.shifts(np.array(values))

    def profile(self, name):
        return profile(self.problem, self.parameters, self.refined, name)


@pytest.fixture(scope="module")
def minimum():
    return Minimum("state,imax,albedo")


@pytest.fixture(scope="module")
def light(minimum):
    return {name: minimum.profile(name) for name in ("imax", "albedo.specular", "albedo.diffuse")}


def test_interval_of_a_parabola_and_of_one_whose_minimum_is_behind_a_bound():
    v = np.array([-3.3, -2.0, -0.7, 0.0, 0.9, 1.7, 3.1])
    assert interval(v, 0.5 * v**2, 3, Z_68) == pytest.approx((-1.0, 1.0), abs=1e-12)
    assert interval(v, 0.5 * v**2, 3, Z_95) == pytest.approx((-1.959964, 1.959964), abs=1e-12)
    # 1/2 (v + 1)^2 - 1/2 over v >= 0 is 1/2 at sqrt(2) - 1.
    behind = v[3:]
    assert interval(behind, 0.5 * (behind + 1) ** 2 - 0.5, 0, Z_68, (True, False)) == pytest.approx((0, 2**0.5 - 1))


def test_interval_of_a_skew_curve():
    """exp(v) - 1 - v, the cost of a Poisson mean in its logarithm, at a spacing as in a walk: to 1 % of a sigma."""
    v = np.linspace(-4.0, 2.4, 10)
    v[6] = 0.0
    low, high = interval(v, np.exp(v) - 1.0 - v, 6, Z_68)
    # exp(v) - 1 - v = 1/2 by Newton on paper: -1.198 and 0.858.
    assert low == pytest.approx(-1.1984, abs=0.01) and high == pytest.approx(0.8577, abs=0.01)


def test_interval_that_is_not_reached_is_open_or_ends_at_a_wall():
    v = np.linspace(-1.0, 3.0, 9)
    rise = 0.5 * v**2
    assert interval(v, rise, 2, Z_95) == (None, pytest.approx(1.959964))
    assert interval(v, rise, 2, Z_95, (True, True)) == (-1.0, pytest.approx(1.959964))


@pytest.mark.slow
def test_unknown_and_fixed_parameters_have_no_profile(minimum):
    with pytest.raises(InputError, match="unknown parameter 'mass'; expected a single name such as attitude.x,"):
        minimum.profile("mass")
    with pytest.raises(InputError, match="rods.y is not free in this fit and has no profile; free are attitude.x, "):
        check_profile(minimum.parameters, "rods.y")
    found, reasons = profile_all(minimum.problem, minimum.parameters, minimum.refined, ["rods.y", "rods.y"])
    assert found == [] and len(reasons) == 1 and "rods.y is not free" in reasons[0]


@pytest.mark.slow
def test_profile_rises_from_the_minimum_to_three_sigmas(light):
    for p in light.values():
        assert np.all(np.diff(p.values) > 0) and p.settled.all() and p.note == ""
        assert p.rise.min() >= -1e-6 and p.rise[p.values == p.best] == 0.0
        assert p.rise[-1] >= 4.5 and (p.rise[0] >= 4.5 or p.values[0] == 0.0)
        assert len(p.values) <= 16
    assert light["imax"].unit == "mA" and 240 < light["imax"].best < 260
    document = light["imax"].as_dict()
    assert json.loads(json.dumps(document, allow_nan=False))["interval_68"] == list(light["imax"].interval_68)


@pytest.mark.slow
def test_a_parameter_at_its_bound_has_an_interval_to_one_side(light):
    p = light["albedo.diffuse"]
    assert p.best == 0.0 and p.sigma is None and p.values[0] == 0.0
    assert p.interval_68[0] == p.interval_95[0] == 0.0
    assert 0.0 < p.interval_68[1] < p.interval_95[1] < 0.05


@pytest.mark.slow
def test_a_bound_of_another_parameter_makes_an_interval_lopsided(light):
    """More diffuse light lets the specular be less; with none to give away, more specular light has no such way out."""
    p = light["albedo.specular"]
    below, above = p.best - p.interval_95[0], p.interval_95[1] - p.best
    # Above, diffuse light stays at its bound, as the information matrix has it: the sigmas agree.
    assert above == pytest.approx(1.96 * p.sigma, rel=0.02) and below > 1.5 * above


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rate.y", "attitude.z"])
def test_profile_of_a_well_known_state_is_the_parabola_of_its_sigma(minimum, name):
    p = minimum.profile(name)
    # Over 4500 s the state is known to 0.1 deg: curvature of the model shows in the second digit.
    for end, sign in zip((*p.interval_68, *p.interval_95), (-1, 1, -1.96, 1.96), strict=True):
        assert (end - p.best) / p.sigma == pytest.approx(sign, rel=0.03)
    assert p.best == (0.0 if name == "attitude.z" else pytest.approx(p.best))


@pytest.mark.slow
def test_prior_is_told_apart(minimum, light):
    """Between the curves is the prior of specular light, 0 +- 0.5: x dx of imax, 0.2 x 0.02, is a tenth of it."""
    p, k = light["albedo.specular"], minimum.parameters.names.index("albedo.specular")
    pull = 0.5 * ((p.values / 0.5) ** 2 - (p.best / 0.5) ** 2)
    assert pull[0] < -0.06 < 0.03 < pull[-1]
    np.testing.assert_allclose(p.rise - p.rise_data, pull, atol=0.01)
    assert minimum.refined.points.x[0, k] == pytest.approx(p.best / 0.5)


@pytest.mark.slow
def test_cost_along_a_profile_is_the_lowest_that_scipy_finds(minimum):
    """A rate held 2 sigma off: SciPy on residuals and priors, with derivatives of its own making."""
    p = minimum.profile("rate.x")
    at = int(np.argmin(np.abs(p.values - (p.best - 2.0 * p.sigma))))
    best = jax.tree.map(lambda leaf: leaf[0], minimum.refined.points)
    lower, upper = minimum.parameters.bounds()
    free = np.array([0, 1, 2, 4, 5, 6, 7, 8])
    last = np.flatnonzero(minimum.problem.valid)[-1]
    blocks = jnp.asarray(-(-int(minimum.problem.grid.sample_index[last]) // BLOCK))

    @eqx.filter_jit
    def residuals(x):
        prediction, _ = minimum.problem.predict(minimum.parameters, x, jnp.asarray(best.reference), blocks)
        return prediction.residual

    def of_free(values):
        x = np.array(best.x)
        x[3] = np.radians(p.values[at]) / RATE_UNIT
        x[free] = values
        used = (np.asarray(residuals(jnp.asarray(x))) * np.sqrt(minimum.weight)).ravel()
        return np.concatenate([used, x[6:]])

    # In conditional sigmas from the minimum, so that one step of differences serves all.
    scale = 1.0 / np.sqrt(np.diagonal(best.hessian)[free])
    start, walls = np.array(best.x)[free], [(bound[free] - np.array(best.x)[free]) / scale for bound in (lower, upper)]
    found = least_squares(
        lambda u: of_free(start + scale * u), np.zeros(8), bounds=walls, method="dogbox", diff_step=1e-3, max_nfev=25
    )
    assert p.rise[at] == pytest.approx(found.cost - best.cost, abs=2e-3)


@pytest.mark.slow
def test_components_across_the_magnet_have_a_profile_under_the_gauge():
    minimum = Minimum("state,magnet,rods,imax,inertia,albedo")
    p = minimum.profile("magnet.y")
    sigma = p.sigma or np.nan
    assert minimum.parameters.gauged and p.settled.all() and p.rise[0] > 4.0 < p.rise[-1]
    for end, sign in zip(p.interval_68, (-1, 1), strict=True):
        assert end is not None and (end - p.best) / sigma == pytest.approx(sign, rel=0.1)
    with pytest.raises(InputError, match="magnet.x has no profile of its own, for the magnet's modulus is held"):
        minimum.profile("magnet.x")
