"""Lambert albedo: published nadir values, direct integration for tilted panels, symmetry, gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import DiffuseAlbedo, diffuse_albedo

R = 6371.2e3
albedo = jax.jit(lambda position, sun: DiffuseAlbedo()(position, sun))


def nadir_current(position, sun, rings, azimuths):
    directions, weights = diffuse_albedo(position, sun, R, rings, azimuths)
    return -weights @ (directions @ position) / jnp.linalg.norm(position)


nadir_gradient = jax.jit(jax.grad(lambda position, sun: nadir_current(position, sun, 10, 20)))
dense_nadir_current = jax.jit(lambda position, sun: nadir_current(position, sun, 40, 60))


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


@pytest.mark.parametrize("sun_deg", [0.0, 1e-10, 35.0, 90.0, 115.0, 170.0, 180.0])
def test_unit_directions_finite_gradients_and_darkness(sun_deg):
    position, sun = scene(700, sun_deg)
    directions, weights = albedo(position, sun)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-13)
    assert np.all(np.asarray(weights) >= 0.0)
    assert bool(np.all(np.asarray(weights) == 0.0)) == (sun_deg > 90 + 25.8)
    assert np.all(np.isfinite(nadir_gradient(position, sun)))


@pytest.mark.parametrize("sun_deg", [10.0, 75.0, 95.0])
def test_gradient_is_that_of_the_integral(sun_deg):
    position, sun = scene(700, sun_deg)
    h = 100.0
    steps = h * np.eye(3)
    ends = [[float(dense_nadir_current(position + s * step, sun)) for s in (-1.0, 1.0)] for step in steps]
    difference = (np.array(ends)[:, 1] - np.array(ends)[:, 0]) / (2 * h)
    gradient = nadir_gradient(position, sun)
    # The slope of a ring's flux has a square-root corner at the terminator, which ten rings resolve to 1 %.
    np.testing.assert_allclose(gradient, difference, atol=1e-2 * float(np.linalg.norm(difference)))


def test_values_turn_with_the_scene():
    position, sun = scene(900, 65)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    directions, weights = albedo(position, sun)
    turned, same = albedo(jnp.asarray(turn @ np.asarray(position)), jnp.asarray(turn @ np.asarray(sun)))
    np.testing.assert_allclose(turned, np.asarray(directions) @ turn.T, atol=1e-12)
    np.testing.assert_allclose(same, weights, atol=1e-14)


def test_refuses_no_rings():
    with pytest.raises(ValueError, match="rings"):
        DiffuseAlbedo(rings=0)
