"""Lambert albedo: published nadir values, direct integration for tilted panels, symmetry, gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import DiffuseAlbedo, ZonalReflectivity, diffuse_albedo, knocke_albedo
from jaxsat.time import Epoch

R = 6371.2e3
albedo = jax.jit(lambda position, sun: DiffuseAlbedo()(position, sun))
zonal_albedo = jax.jit(lambda zones, position, sun, t: DiffuseAlbedo(reflectivity=zones)(position, sun, t))


def nadir_current(model, position, sun, t):
    directions, weights = model(position, sun, t)
    return -weights @ (directions @ position) / jnp.linalg.norm(position)


nadir_gradient = jax.jit(jax.grad(nadir_current, argnums=(1, 3)))
dense_nadir_current = jax.jit(nadir_current)
GREY = ZonalReflectivity(a0=1.0, c0=0.0, c1=0.0, c2=0.0, a2=0.0, season=0.0)
ZONES = ZonalReflectivity(a0=0.34, c0=0.05, c1=0.1, c2=0.0, a2=0.29, season=0.5)


def scene(height_km, sun_deg):
    s = np.radians(sun_deg)
    return jnp.asarray([0.0, 0.0, R + 1e3 * height_km]), jnp.asarray([np.sin(s), 0.0, np.cos(s)])


def currents(normals, directions, weights):
    return np.maximum(0.0, normals @ np.asarray(directions).T) @ np.asarray(weights)


def integrate_over_the_globe(normals, height_km, sun_deg, n=500):
    """Sum over small equal-area cells of the Earth's surface: no limb, no terminator treated specially."""
    ratio = 1 + height_km * 1e3 / R
    u = 1 / ratio + (1 - 1 / ratio) * (np.arange(n) + 0.5) / n
    psi = 2 * np.pi * (np.arange(n) + 0.5) / n
    u, psi = (c.ravel() for c in np.meshgrid(u, psi))
    s = np.sqrt(1 - u**2)
    ground = np.stack([s * np.cos(psi), s * np.sin(psi), u], axis=1)
    line = ground - [0, 0, ratio]
    rho = np.linalg.norm(line, axis=1)
    cosine = -np.sum(ground * line, axis=1) / rho
    sun = np.array([np.sin(np.radians(sun_deg)), 0, np.cos(np.radians(sun_deg))])
    weights = np.maximum(ground @ sun, 0) * cosine / rho**2 / np.pi * (1 - 1 / ratio) * 2 * np.pi / n**2
    return currents(normals, line / rho[:, None], weights)


@pytest.mark.parametrize(
    "height_km, expected", [(700, (0.2412, 0.2089, 0.1206, 0.0088)), (1791, (0.1767, 0.1530, 0.0884, 0.0128))]
)
def test_plate_facing_nadir(height_km, expected):
    for sun_deg, value in zip((0, 30, 60, 90), expected, strict=True):
        found = 0.3 * currents(np.array([[0.0, 0.0, -1.0]]), *albedo(*scene(height_km, sun_deg)))[0]
        assert found == pytest.approx(value, abs=6e-5)


@pytest.mark.slow
@pytest.mark.parametrize("height_km, sun_deg", [(400, 20), (400, 88), (700, 70), (1791, 50), (1791, 100)])
def test_panels_of_any_orientation(height_km, sun_deg):
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    expected = integrate_over_the_globe(normals, height_km, sun_deg)
    found = currents(normals, *albedo(*scene(height_km, sun_deg)))
    np.testing.assert_allclose(found, expected, atol=1.5e-3 * expected.max())


def test_a_panel_that_cannot_see_the_earth_has_exactly_none():
    height_km = 1258.8
    tilt = np.arccos(R / (R + 1e3 * height_km)) - 1e-6
    azimuth = np.linspace(0.0, 6.0, 9)
    normals = np.stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt) + 0 * azimuth], 1)
    assert np.all(currents(normals, *albedo(*scene(height_km, 40))) == 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("sun_deg", [0.0, 1e-10, 35.0, 90.0, 115.0, 170.0, 180.0])
def test_unit_directions_finite_gradients_and_darkness(sun_deg):
    position, sun = scene(700, sun_deg)
    directions, weights = albedo(position, sun)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-13)
    assert np.all(np.asarray(weights) >= 0.0)
    assert bool(np.all(np.asarray(weights) == 0.0)) == (sun_deg > 90 + 25.8)
    assert all(np.all(np.isfinite(g)) for g in nadir_gradient(DiffuseAlbedo(reflectivity=GREY), position, sun, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("sun_deg", [10.0, 75.0, 95.0])
@pytest.mark.parametrize("zones", [GREY, ZONES], ids=["grey", "zones"])
def test_gradient_is_that_of_the_integral(sun_deg, zones):
    tilt = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    position, sun = (jnp.asarray(tilt @ np.asarray(v)) for v in scene(700, sun_deg))
    t, h = 1e6, 100.0
    dense = DiffuseAlbedo(rings=40, azimuths=60, reflectivity=zones)
    d_position, d_t = nadir_gradient(DiffuseAlbedo(reflectivity=zones), position, sun, t)
    ends = [[float(dense_nadir_current(dense, position + s * e, sun, t)) for s in (-h, h)] for e in np.eye(3)]
    difference = (np.array(ends)[:, 1] - np.array(ends)[:, 0]) / (2 * h)
    # The slope of a ring's flux has a square-root corner at the terminator, which ten rings resolve to 1 %.
    np.testing.assert_allclose(d_position, difference, atol=1e-2 * float(np.linalg.norm(difference)))
    later, earlier = (float(dense_nadir_current(dense, position, sun, t + s)) for s in (1e5, -1e5))
    assert float(d_t) == pytest.approx((later - earlier) / 2e5, rel=5e-3, abs=0)


def test_values_turn_with_the_scene():
    position, sun = scene(900, 65)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    directions, weights = albedo(position, sun)
    turned, same = albedo(jnp.asarray(turn @ np.asarray(position)), jnp.asarray(turn @ np.asarray(sun)))
    np.testing.assert_allclose(turned, np.asarray(directions) @ turn.T, atol=1e-12)
    np.testing.assert_allclose(same, weights, atol=1e-14)


def integrate_over_latitudes(normals, position, sun, a1, n=600):
    """Sum over n x n cells of latitude and longitude with Knocke's zones; what is dark or out of view is left out."""
    latitude, longitude = np.pi * (np.arange(n) + 0.5) / n - 0.5 * np.pi, 2 * np.pi * (np.arange(n) + 0.5) / n
    b, c = (x.ravel() for x in np.meshgrid(latitude, longitude))
    z = np.sin(b)
    ground = np.stack([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), z], axis=1)
    line = ground - position / R
    rho = np.linalg.norm(line, axis=1)
    emission = -np.sum(ground * line, axis=1) / rho
    lit = (emission > 0) & (ground @ sun > 0)
    zones = 0.34 + a1 * z + 0.29 * (3 * z**2 - 1) / 2
    weights = (ground @ sun * emission / rho**2 * zones / np.pi * np.cos(b) * 2 * np.pi**2 / n**2)[lit]
    return currents(normals, (line / rho[:, None])[lit], weights)


@pytest.mark.parametrize(
    "latitude, longitude, height_km, sun_deg",
    [(88, 0, 700, 85), (-50, 70, 700, 100), (10, -30, 1791, 40), (35, 200, 20000, 75)],
)
def test_zones_of_knocke(latitude, longitude, height_km, sun_deg):
    rng = np.random.default_rng(latitude + 90)
    b, c = np.radians([latitude, longitude])
    zenith = np.array([np.cos(b) * np.cos(c), np.cos(b) * np.sin(c), np.sin(b)])
    side = np.cross(zenith, rng.normal(size=3))
    side /= np.linalg.norm(side)
    sun = np.cos(np.radians(sun_deg)) * zenith + np.sin(np.radians(sun_deg)) * side
    position = (R + 1e3 * height_km) * zenith
    normals = rng.normal(size=(50, 3))
    normals[:20] -= 2 * zenith
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    day = 20.0
    expected = integrate_over_latitudes(normals, position, sun, 0.1 * np.cos(2 * np.pi * day / 365.25))
    zones = knocke_albedo(Epoch.from_utc(1981, 12, 22))
    found = currents(normals, *zonal_albedo(zones, jnp.asarray(position), jnp.asarray(sun), day * 86400.0))
    # 0.1 % of the best panel's current is what 10 x 20 patches reach; the cells' own error is below 0.03 %.
    np.testing.assert_allclose(found, expected, atol=1.5e-3 * expected.max())


def test_equal_zones_are_a_uniform_earth():
    position, sun = scene(700, 95)
    zones = ZonalReflectivity(a0=0.34, c0=0.0, c1=0.0, c2=0.0, a2=0.0, season=1.0)
    directions, weights = albedo(position, sun)
    same, scaled = zonal_albedo(zones, position, sun, 1e6)
    np.testing.assert_allclose(same, directions, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(scaled, 0.34 * np.asarray(weights), rtol=1e-12)


def test_single_precision_stays_single():
    position, sun = (x.astype(jnp.float32) for x in scene(700, 80))
    directions, weights = jax.jit(lambda p, s: diffuse_albedo(p, s, R, 10, 20))(position, sun)
    assert directions.dtype == weights.dtype == jnp.float32
    nadir = np.array([[0.0, 0.0, -1.0]])
    assert currents(nadir, directions, weights) == pytest.approx(currents(nadir, *albedo(*scene(700, 80))), rel=1e-5)


def test_refuses_no_rings():
    with pytest.raises(ValueError, match="rings"):
        DiffuseAlbedo(rings=0)


@pytest.mark.parametrize("height_km", [0.0, -20.0, -3000.0, -6371.2])
def test_below_the_ground_it_is_the_light_at_the_ground(height_km):
    """Of a plain lit by the Sun: a plate that faces it has the cosine of the Sun's zenith distance (Lambert)."""
    for sun_deg in (0, 60, 90, 180):
        directions, weights = albedo(*scene(height_km, sun_deg))
        if height_km > -6371.0:
            found = currents(np.array([[0.0, 0.0, -1.0]]), directions, weights)[0]
            # 2e-6 of the light passes by at 6 m above the ground, where it is taken.
            assert found == pytest.approx(max(np.cos(np.radians(sun_deg)), 0.0), abs=4e-6)
        assert np.all(np.isfinite(directions)) and np.all(np.isfinite(weights))
