"""Intervals of curves in closed form, and profiles of a session against an independent least squares of SciPy."""

import json
from typing import Any

import jax
import numpy as np
import pytest
from scipy.optimize import least_squares

from fitting.measurements.abstract import RATE_UNIT
from fitting.outcome.looking import look
from fitting.profile.profile import Z_68, Z_95, check_profile, interval, profile, profile_all
from jaxsat.errors import InputError
from jaxsat.integrators import BLOCK


def profile_of(minimum, name: str) -> Any:
    return profile(minimum.problem, minimum.parameters, minimum.refined, name)


@pytest.fixture(scope="module")
def minimum(true_minimum):
    return true_minimum("imax", "albedo")


@pytest.fixture(scope="module")
def light(minimum):
    return {name: profile_of(minimum, name) for name in ("imax", "albedo.specular", "albedo.diffuse")}


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
    with pytest.raises(InputError, match="unknown parameter 'mass'; expected a single number such as "):
        profile_of(minimum, "mass")
    for wrong in ("magnet", "magnet.xx"):
        with pytest.raises(InputError, match=f"unknown parameter '{wrong}'; did you mean magnet.x?"):
            check_profile(minimum.parameters, wrong)
    rod = "rods.y"
    with pytest.raises(InputError, match=f"{rod} is not free in this fit and has no profile; free are attitude.x, "):
        check_profile(minimum.parameters, rod)
    found, reasons = profile_all(minimum.problem, minimum.parameters, minimum.refined, [rod, rod])
    assert found == [] and len(reasons) == 1 and f"{rod} is not free" in reasons[0]


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
    p = profile_of(minimum, name)
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
    p = profile_of(minimum, "rate.x")
    at = int(np.argmin(np.abs(p.values - (p.best - 2.0 * p.sigma))))
    best = jax.tree.map(lambda leaf: np.asarray(leaf)[0], minimum.refined.points)
    lower, upper = minimum.parameters.bounds()
    names = minimum.parameters.names
    free = np.flatnonzero(minimum.parameters.everything & (np.array(names) != "rate.x"))
    last = np.flatnonzero(minimum.problem.valid)[-1]
    blocks = np.asarray(-(-int(minimum.problem.grid.sample_index[last]) // BLOCK))

    def of_free(values):
        x = np.array(best.x)
        x[names.index("rate.x")] = np.radians(p.values[at]) / RATE_UNIT
        x[free] = values
        residual, *_ = look(minimum.problem, minimum.parameters.tree, x, best.reference, blocks)
        return np.concatenate([(np.asarray(residual) * np.sqrt(minimum.weight)).ravel(), x[6:]])

    # In conditional sigmas from the minimum, so that one step of differences serves all.
    scale = 1.0 / np.sqrt(np.diagonal(best.hessian)[free])
    start, walls = np.array(best.x)[free], [(bound[free] - np.array(best.x)[free]) / scale for bound in (lower, upper)]
    found = least_squares(
        lambda u: of_free(start + scale * u),
        np.zeros(len(free)),
        bounds=walls,
        method="dogbox",
        diff_step=1e-3,
        max_nfev=25,
    )
    assert p.rise[at] == pytest.approx(found.cost - best.cost, abs=2e-3)


@pytest.mark.slow
def test_components_across_the_magnet_have_a_profile_under_the_gauge(true_minimum):
    minimum = true_minimum("magnet", "rods", "imax", "inertia", "albedo")
    p = profile_of(minimum, "magnet.y")
    sigma = p.sigma or np.nan
    assert minimum.parameters.gauged == ("magnet",) and p.settled.all() and p.rise[0] > 4.0 < p.rise[-1]
    for end, sign in zip(p.interval_68, (-1, 1), strict=True):
        assert end is not None and (end - p.best) / sigma == pytest.approx(sign, rel=0.1)
    with pytest.raises(InputError, match="magnet.x has no profile of its own, for the magnet's modulus is held"):
        profile_of(minimum, "magnet.x")


@pytest.mark.slow
def test_angles_of_the_dipole_have_a_profile_and_its_modulus_as_gauge_has_none(true_minimum):
    minimum = true_minimum("magnet.modulus", "magnet.azimuth", "magnet.elevation", "rods", "imax", "inertia", "albedo")
    p = profile_of(minimum, "magnet.azimuth")
    assert p.unit == "deg" and p.settled.all() and p.rise[0] > 4.0 < p.rise[-1] and np.all(np.diff(p.values) < 10.0)
    # The true dipole lies 0.17 deg from body x.
    assert abs(p.best + 0.17) < 3.0 * p.sigma
    for end, sign in zip(p.interval_68, (-1, 1), strict=True):
        assert (end - p.best) / p.sigma == pytest.approx(sign, rel=0.1)
    with pytest.raises(InputError, match="magnet.modulus has no profile: it is held as gauge"):
        profile_of(minimum, "magnet.modulus")
