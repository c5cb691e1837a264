"""Zonal reflectivity: published numbers in SciPy's polynomials, means over the sphere, seasons, gradients."""

import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import eval_legendre

from jaxsat.environment import UniformReflectivity, ZonalReflectivity, knocke_albedo, knocke_emissivity
from jaxsat.time import Epoch

DAY = 86400.0
SOLSTICE = Epoch.from_utc(1981, 12, 22)
reflectivity = jax.jit(lambda model, ground, t: model(ground, t))


def ground(latitude_deg, longitude=0.7):
    latitude = np.radians(np.atleast_1d(latitude_deg))
    east, north = np.cos(latitude) * np.sin(longitude), np.sin(latitude)
    return jnp.asarray(np.stack([np.cos(latitude) * np.cos(longitude), east, north], axis=1))


@pytest.mark.parametrize(
    "make, numbers", [(knocke_albedo, (0.34, 0.10, 0.29)), (knocke_emissivity, (0.68, -0.07, -0.18))]
)
@pytest.mark.parametrize("date, t", [((2001, 1, 18, 4, 54, 15), 0.0), ((2026, 7, 1), 40.5 * DAY)])
def test_published_coefficients(make, numbers, date, t):
    # Numbers and reference date of Knocke, Ries & Tapley (1988), as Orekit, PATRIUS and Tudat hold them.
    latitude = np.linspace(-90.0, 90.0, 19)
    a0, c1, a2 = numbers
    date += (0,) * (6 - len(date))
    days = sum(erfa.dtf2d("UTC", *date)) + t / DAY - sum(erfa.cal2jd(1981, 12, 22))
    a1 = c1 * np.cos(2 * np.pi / 365.25 * days)
    x = np.sin(np.radians(latitude))
    expected = a0 + a1 * eval_legendre(1, x) + a2 * eval_legendre(2, x)
    # A Julian date in one number holds 4e-5 s; leap seconds, which the formula ignores, move the season by 6e-6 rad.
    np.testing.assert_allclose(reflectivity(make(Epoch.from_utc(*date)), ground(latitude), t), expected, atol=1e-6)


def test_winter_pole_is_the_brighter_one():
    north_south = ground([90.0, -90.0])
    model = knocke_albedo(SOLSTICE)
    np.testing.assert_allclose(reflectivity(model, north_south, 0.0), [0.73, 0.53], rtol=1e-12)
    np.testing.assert_allclose(reflectivity(model, north_south, 365.25 / 2 * DAY), [0.53, 0.73], rtol=1e-12)
    np.testing.assert_allclose(reflectivity(model, north_south, 365.25 / 4 * DAY), [0.63, 0.63], rtol=1e-12)


def test_all_coefficients_and_their_gradients():
    numbers = dict(a0=0.3, c0=0.02, c1=0.1, c2=-0.05, a2=0.25, season=1.2)
    places, t = ground([-70.0, -10.0, 35.0, 80.0]), 30.0 * DAY
    x, season = np.asarray(places)[:, 2], 1.2 + 2 * np.pi * 30.0 / 365.25
    value, jacobian = jax.jit(lambda m: (m(places, t), jax.jacrev(lambda m: m(places, t))(m)))(
        ZonalReflectivity(**numbers)
    )
    a1 = 0.02 + 0.1 * np.cos(season) - 0.05 * np.sin(season)
    p2 = eval_legendre(2, x)
    np.testing.assert_allclose(value, 0.3 + a1 * x + 0.25 * p2, rtol=1e-14)
    # Linear in the coefficients: the derivatives are the functions they multiply.
    np.testing.assert_allclose(jacobian.a0, np.ones(4), rtol=1e-15)
    np.testing.assert_allclose(jacobian.c0, x, rtol=1e-14)
    np.testing.assert_allclose(jacobian.c1, x * np.cos(season), rtol=1e-13)
    np.testing.assert_allclose(jacobian.c2, x * np.sin(season), rtol=1e-13)
    np.testing.assert_allclose(jacobian.a2, p2, rtol=1e-13)
    np.testing.assert_allclose(jacobian.season, -x * (0.1 * np.sin(season) + 0.05 * np.cos(season)), rtol=1e-13)


def test_mean_over_the_sphere_and_range_over_a_year():
    nodes, weights = np.polynomial.legendre.leggauss(8)
    places = ground(np.degrees(np.arcsin(nodes)))
    model = knocke_albedo(Epoch.from_utc(2010, 3, 4))
    for t in (0.0, 100.0 * DAY):
        assert 0.5 * weights @ np.asarray(reflectivity(model, places, t)) == pytest.approx(0.34, rel=1e-13)
    year = np.arange(0.0, 366.0) * DAY
    everywhere = jax.jit(jax.vmap(model, (None, 0)))(ground(np.linspace(-90.0, 90.0, 181)), jnp.asarray(year))
    # The smallest value is a0 - a2/2 - a1^2/(6 a2), the largest stands over the winter pole.
    assert float(everywhere.min()) == pytest.approx(0.34 - 0.145 - 0.01 / (6 * 0.29), abs=2e-4)
    assert float(everywhere.max()) == pytest.approx(0.73, abs=1e-4)


def test_uniform_is_one():
    assert np.all(np.asarray(reflectivity(UniformReflectivity(), ground([-80.0, 0.0, 45.0]), 0.0)) == 1.0)
