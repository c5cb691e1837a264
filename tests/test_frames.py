"""Frames: ERFA's own chains and ellipsoid, published vectors, closed forms, derivatives at the awkward places."""

import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.frames import (
    GreenwichAngle,
    dcm_eci_from_ecef,
    dcm_eci_from_ecliptic,
    dcm_eci_from_gcrf,
    dcm_eci_from_teme,
    dcm_orbital_from_eci,
    ecef_from_geodetic,
    geodetic_from_ecef,
    greenwich,
    nutation,
)
from jaxsat.time import J2000, Epoch, equinox_difference, greenwich_angle, greenwich_angles

ARCSECOND = np.pi / 648000
VALLADO = Epoch.from_utc(2004, 4, 6, 7, 51, 28.386009)
VALLADO_UT1 = -0.4399619
DAY = 86400.0

angle_at = jax.jit(lambda greenwich_angle, t: greenwich_angle(t))
angles_at = jax.jit(jax.vmap(lambda greenwich_angle, t: greenwich_angle(t), (None, 0)))
rate_at = jax.jit(jax.grad(lambda t, greenwich_angle: greenwich_angle(t)))
ecliptic = jax.jit(jax.vmap(dcm_eci_from_ecliptic))
orbital = jax.jit(dcm_orbital_from_eci)
to_geodetic = jax.jit(jax.vmap(geodetic_from_ecef))
from_geodetic = jax.jit(jax.vmap(ecef_from_geodetic))
geodetic_reverse = jax.jit(jax.jacrev(lambda r: jnp.stack(geodetic_from_ecef(r))))
geodetic_jacobian = jax.jit(jax.jacfwd(lambda r: jnp.stack(geodetic_from_ecef(r))))


def wrapped(angle):
    return (np.asarray(angle) + np.pi) % (2 * np.pi) - np.pi


def test_inertial_to_earth_fixed_is_the_chain_of_the_iers():
    # ERFA's c2t06a goes by the celestial intermediate origin and the Earth rotation angle: another road to the same.
    for epoch, ut1_minus_utc in ((VALLADO, VALLADO_UT1), (Epoch.from_utc(2029, 12, 3, 22), 0.2)):
        chain = erfa.c2t06a(*epoch.tt(), *epoch.ut1(ut1_minus_utc), 0.0, 0.0)
        dcm = dcm_eci_from_ecef(jnp.asarray(greenwich_angle(epoch, ut1_minus_utc))).T @ dcm_eci_from_gcrf(epoch)
        np.testing.assert_allclose(dcm, chain, atol=1e-12)


def test_teme_of_the_published_example():
    # Vallado 2013, example 3-15 and page 233 [km]; PEF is Earth-fixed before polar motion.
    teme, pef = [5094.18016210, 6127.64465950, 6380.34453270], [-1033.4750313, 7901.3055856, 6380.3445327]
    position_eci = dcm_eci_from_teme(equinox_difference(VALLADO, VALLADO_UT1)) @ jnp.asarray(teme)
    position_ecef = dcm_eci_from_ecef(greenwich_angle(VALLADO, VALLADO_UT1)).T @ position_eci
    # A double Julian date in the book's program: 20 us, 10 mm along the parallel.
    np.testing.assert_allclose(position_ecef, pef, atol=2e-5)
    # Their true equinox is that of 1980 without the observed corrections: 0.06" of 8000 km are 2.4 m.
    np.testing.assert_allclose(position_eci, [5094.5147804, 6127.3664612, 6380.3445328], atol=2.4e-3)


def test_nutation_of_the_published_example():
    # Meeus 1998, example 22.a: 1987 April 10, 0h TD.
    longitude, obliquity = jax.jit(nutation)(jnp.asarray(-0.127296372348))
    # The book prints milliarcseconds; the terms left out add up to less than 10.
    assert float(longitude) / ARCSECOND == pytest.approx(-3.788, abs=0.01)
    assert float(obliquity) / ARCSECOND == pytest.approx(9.443, abs=0.01)


def test_ecliptic_against_erfa():
    t = np.random.default_rng(3).uniform(-0.1, 0.31, 300)
    date = (np.full(t.shape, J2000), 36525.0 * t)
    expected = erfa.pnm06a(*date) @ np.transpose(erfa.ecm06(*date), (0, 2, 1))
    # 0.02" between the 35 terms of 1980 and the thousand of 2000, as the docstring says; 0.03" is promised.
    np.testing.assert_allclose(ecliptic(jnp.asarray(t)), expected, atol=0.03 * ARCSECOND)


def test_orbital_axes():
    position, velocity = jnp.asarray([0.0, 7e6, 0.0]), jnp.asarray([-5e3, 1e3, 5e3])
    dcm = np.asarray(orbital(position, velocity))
    np.testing.assert_allclose(dcm @ dcm.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(dcm @ np.asarray(position), [7e6, 0.0, 0.0], atol=1e-8)
    # Radial and transverse speed, none across; the orbit's normal is r x v.
    np.testing.assert_allclose(dcm @ np.asarray(velocity), [1e3, 5e3 * np.sqrt(2), 0.0], atol=1e-11)
    assert np.linalg.det(dcm) == pytest.approx(1.0, abs=1e-14)
    straight = jax.jit(jax.jacfwd(dcm_orbital_from_eci))(position, 1e-3 * position)
    assert np.all(np.isfinite(straight))


@pytest.mark.parametrize("span_days", [0.05, 10.0, 30.0])
def test_greenwich_over_a_span(span_days):
    epoch, stop = Epoch.from_utc(2003, 5, 17, 3), span_days * DAY
    found = greenwich(epoch, start=-600.0, stop=stop, ut1_minus_utc=-0.35)
    t_s = np.concatenate([[-600.0, 0.0, stop], np.random.default_rng(1).uniform(-600.0, stop, 97)])
    away = wrapped(angles_at(found, jnp.asarray(t_s)) - greenwich_angles(epoch, t_s, -0.35))
    assert np.max(np.abs(away)) < 1e-9


def test_greenwich_ends_and_derivative():
    epoch = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
    found = greenwich(epoch, stop=10 * DAY)
    for t in (0.0, 1.0, 0.5 * DAY, 3.3 * DAY, 10 * DAY):
        h = 3600.0
        ends = greenwich_angles(epoch, np.array([t - h, t + h]))
        difference = EARTH_ROTATION_RATE + wrapped(ends[1] - ends[0] - 2 * h * EARTH_ROTATION_RATE) / (2 * h)
        # Nutation moves the rate by 1e-11 rad/s; the difference rounds to 1e-19, the spline bends by 1e-14.
        assert float(rate_at(jnp.asarray(t), found)) == pytest.approx(difference, abs=2e-14)
    # Outside the span the Earth turns uniformly and the angle goes on without a jump.
    beyond = angle_at(found, jnp.asarray(12 * DAY)) - angle_at(found, jnp.asarray(10 * DAY))
    assert float(beyond) == pytest.approx(2 * DAY * EARTH_ROTATION_RATE, abs=1e-12)
    assert float(rate_at(jnp.asarray(-5.0), found)) == EARTH_ROTATION_RATE


def test_uniform_greenwich_and_its_stated_drift():
    epoch = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
    uniform = GreenwichAngle(greenwich_angle(epoch))
    t_s = np.linspace(0.0, 30 * DAY, 121)
    found = np.asarray(angles_at(uniform, jnp.asarray(t_s)))
    np.testing.assert_allclose(found, greenwich_angle(epoch) + EARTH_ROTATION_RATE * t_s, rtol=1e-15)
    drift = np.abs(wrapped(found - greenwich_angles(epoch, t_s)))
    # The largest over 1990-2030 are 1e-6, 4e-6 and 9e-6 rad; this month is an ordinary one.
    for days, most in ((1.0, 1e-6), (10.0, 4e-6), (30.0, 9e-6)):
        assert most / 30 < np.max(drift[t_s <= days * DAY]) < most


def test_greenwich_in_single_precision():
    found = jax.tree.map(lambda x: x.astype(jnp.float32), greenwich(VALLADO, stop=10 * DAY))
    angle = angle_at(found, jnp.asarray(4500.0, jnp.float32))
    assert angle.dtype == jnp.float32
    # Angles of 5 rad resolve 5e-7.
    assert wrapped(float(angle) - greenwich_angles(VALLADO, np.array([4500.0])))[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("start, stop", [(0.0, 0.0), (5.0, 1.0), (0.0, np.inf), (0.0, np.nan)])
def test_greenwich_refuses_an_empty_span(start, stop):
    with pytest.raises(ValueError, match="^stop must"):
        greenwich(VALLADO, start=start, stop=stop)


def places():
    rng = np.random.default_rng(7)
    longitude, latitude = rng.uniform(-np.pi, np.pi, 400), np.arcsin(rng.uniform(-1, 1, 400))
    height = np.concatenate([rng.uniform(-1e6, 0, 100), rng.uniform(0, 2e6, 200), 10 ** rng.uniform(6, 9, 100)])
    latitude[:6] = [np.pi / 2, -np.pi / 2, 0.0, 1e-9, np.pi / 2 - 1e-7, -np.pi / 2 + 1e-4]
    return longitude, latitude, height


def test_geodetic_against_erfa():
    longitude, latitude, height = places()
    expected = erfa.gd2gc(1, longitude, latitude, np.maximum(height, -1e6))
    found = from_geodetic(*(jnp.asarray(x) for x in (longitude, latitude, height)))
    np.testing.assert_allclose(found, expected, rtol=1e-15, atol=1e-9)

    back = [np.asarray(x) for x in to_geodetic(jnp.asarray(expected))]
    theirs = erfa.gc2gd(1, expected)
    # Neither knows the longitude at a pole; ERFA's positions there are 1e-10 m off the axis.
    off_axis = np.hypot(*expected.T[:2]) > 1e-3
    np.testing.assert_allclose(wrapped(back[0] - theirs[0])[off_axis], 0.0, atol=1e-14)
    np.testing.assert_allclose(back[1], theirs[1], atol=1e-12)
    np.testing.assert_allclose(back[1], latitude, atol=1e-12)
    # Heights are differences of lengths up to 1e9 m.
    np.testing.assert_allclose(back[2], height, rtol=1e-15, atol=5e-9)


def test_geodetic_derivative():
    a, e2 = 6378137.0, 0.0066943799901413165
    for longitude, latitude, height in (
        (0.3, 1.2, 7e5),
        (-3.1, -0.4, 0.0),
        (2.0, 0.0, 1.2e6),
        (1.0, np.pi / 2 - 1e-4, 3e5),
    ):
        (sl, sb), (cl, cb) = np.sin([longitude, latitude]), np.cos([longitude, latitude])
        east, north, up = [-sl, cl, 0], [-sb * cl, -sb * sl, cb], [cb * cl, cb * sl, sb]
        curvature = a / np.sqrt(1 - e2 * sb**2)
        meridian = curvature * (1 - e2) / (1 - e2 * sb**2)
        # Closed form: a step east, north or up changes one coordinate alone.
        expected = np.array([east, north, up]) / [[(curvature + height) * cb], [meridian + height], [1.0]]
        position = jnp.asarray(erfa.gd2gc(1, longitude, latitude, height))
        np.testing.assert_allclose(geodetic_jacobian(position), expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


def test_geodetic_at_the_poles():
    poles = jnp.asarray([[0.0, 0.0, 6.4e6], [0.0, 0.0, -7e6]])
    longitude, latitude, height = to_geodetic(poles)
    np.testing.assert_array_equal(longitude, [0.0, 0.0])
    np.testing.assert_array_equal(latitude, [np.pi / 2, -np.pi / 2])
    # The semi-minor axis of WGS 84 is 6356752.314245 m.
    np.testing.assert_allclose(height, [6.4e6 - 6356752.314245, 7e6 - 6356752.314245], atol=1e-6)
    for pole, up in zip(poles, (1.0, -1.0), strict=True):
        forward, reverse = geodetic_jacobian(pole), geodetic_reverse(pole)
        assert np.all(np.isfinite(forward))
        np.testing.assert_allclose(forward[2], [0.0, 0.0, up], atol=1e-12)
        np.testing.assert_allclose(reverse, forward, atol=1e-12)
