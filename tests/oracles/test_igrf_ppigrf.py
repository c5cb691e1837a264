"""The main field against ppigrf, an independent implementation in spherical coordinates."""

import datetime

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import igrf_coefficients, igrf_field
from jaxsat.environment.magnetic import internal_field
from jaxsat.time import Epoch

ppigrf = pytest.importorskip("ppigrf")

RADIUS_KM = 6371.2
COUNT = 1000


def spherical_axes(colatitude_deg, longitude_deg):
    """Unit vectors up, south and east, [point, axis, component]."""
    theta, phi = np.radians(colatitude_deg), np.radians(longitude_deg)
    st, ct, sp, cp = np.sin(theta), np.cos(theta), np.sin(phi), np.cos(phi)
    return np.stack([[st * cp, st * sp, ct], [ct * cp, ct * sp, -st], [-sp, cp, 0 * phi]]).transpose(2, 0, 1)


def calendar_year(date):
    """Year and elapsed fraction of it; the calendar alone dates the model, there is no UTC before 1960."""
    start, end = (datetime.datetime(year, 1, 1) for year in (date.year, date.year + 1))
    return date.year + (date - start) / (end - start)


@jax.jit
@jax.vmap
def field_at(position, g, h):
    return internal_field(position, g, h, RADIUS_KM * 1e3)


def field_nt(r_km, colatitude_deg, longitude_deg, dates):
    """Up, south and east components [nT] at points and dates in step."""
    axes = spherical_axes(colatitude_deg, longitude_deg)
    g, h = map(np.stack, zip(*(igrf_coefficients(calendar_year(date)) for date in dates), strict=True))
    b_field = field_at(jnp.asarray(1e3 * r_km[:, None] * axes[:, 0]), jnp.asarray(g), jnp.asarray(h))
    return np.einsum("nij,nj->ni", axes, b_field) * 1e9


def random_dates(rng, count):
    start, end = datetime.datetime(1900, 1, 1), datetime.datetime(2030, 1, 1)
    seconds = rng.uniform(0.0, (end - start).total_seconds(), count).round()
    return [start, *(start + datetime.timedelta(seconds=float(s)) for s in seconds[1:-1]), end]


def test_random_points_and_dates():
    """0 to 2000 km and on to 40 000 km; every tenth point from 10 m to 10 km from the axis of the poles."""
    rng = np.random.default_rng(14)
    low, high = rng.uniform(0.0, 2000.0, COUNT // 2), rng.uniform(2000.0, 40000.0, COUNT - COUNT // 2)
    r_km = RADIUS_KM + np.concatenate([low, high])
    colatitude, longitude = np.degrees(np.arccos(rng.uniform(-1.0, 1.0, COUNT))), rng.uniform(-180.0, 180.0, COUNT)
    near = 10.0 ** rng.uniform(-4.0, -1.0, COUNT // 10)
    colatitude[::10] = np.where(np.arange(COUNT // 10) % 2, near, 180.0 - near)
    dates = random_dates(rng, COUNT)

    expected = np.stack([np.diagonal(x) for x in ppigrf.igrf_gc(r_km, colatitude, longitude, dates)], axis=1)
    # The same sum of 195 terms of up to 60 000 nT in double precision; ppigrf divides by sin(colatitude) > 1e-6.
    np.testing.assert_allclose(field_nt(r_km, colatitude, longitude, dates), expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("pole", [0.0, 180.0])
def test_poles(pole):
    """ppigrf has no value on the axis: the mean of its vectors on a circle of 11 m about it is one, to B (11 m/r)^2."""
    date = datetime.datetime(2011, 5, 17, 6)
    longitude = np.arange(8) * 45.0
    colatitude = np.full(8, abs(pole - 1e-4))
    around = np.stack([x[0] for x in ppigrf.igrf_gc(6800.0, colatitude, longitude, date)], axis=1)
    expected = np.einsum("nij,ni->j", spherical_axes(colatitude, longitude), around) / 8
    found = field_nt(np.array([6800.0]), np.array([pole]), np.array([0.0]), [date])[0]
    # The east component is divided by 1.7e-6, so that its rounding grows to 1e-5 nT.
    np.testing.assert_allclose(spherical_axes([pole], [0.0])[0].T @ found, expected, rtol=0, atol=1e-4)


@pytest.mark.parametrize("degree", [1, 2, 5, 12])
def test_cut_off(degree):
    date = datetime.datetime(1999, 12, 31)
    rng = np.random.default_rng(degree)
    r_km, colatitude, longitude = rng.uniform(RADIUS_KM, 9000, 20), rng.uniform(1, 179, 20), rng.uniform(-180, 180, 20)
    expected = np.stack([x[0] for x in ppigrf.igrf_gc(r_km, colatitude, longitude, date, max_degree=degree)], axis=1)
    axes = spherical_axes(colatitude, longitude)
    field = igrf_field(calendar_year(date), degree=degree)
    b_field = jax.jit(jax.vmap(field.__call__))(jnp.asarray(1e3 * r_km[:, None] * axes[:, 0]))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", axes, b_field) * 1e9, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("date", [(1999, 12, 31), (2001, 1, 18), (2012, 2, 29), (2027, 6, 1)])
def test_an_epoch_has_the_year_of_the_calendar(date):
    assert Epoch.from_utc(*date).decimal_year() == pytest.approx(calendar_year(datetime.datetime(*date)), abs=1e-12)
