"""The exponential atmosphere against Vallado's table and example, heights against ERFA's, air that turns with us."""

import equinox as eqx
import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.environment import ExponentialAtmosphere, air_velocity_eci, exponential_density, height_above_ellipsoid

# Vallado 2013, table 8-4: layer from, to [km], density at its foot [kg/m^3], scale height [km].
LAYERS = [
    (0, 25, 1.225, 7.249),
    (25, 30, 3.899e-2, 6.349),
    (50, 60, 1.057e-3, 8.382),
    (100, 110, 5.297e-7, 5.877),
    (150, 180, 2.070e-9, 22.523),
    (200, 250, 2.789e-10, 37.105),
    (350, 400, 9.518e-12, 53.298),
    (400, 450, 3.725e-12, 58.515),
    (500, 600, 6.967e-13, 63.822),
    (700, 800, 3.614e-14, 88.667),
    (900, 1000, 5.245e-15, 181.05),
    (1000, 1500, 3.019e-15, 268.00),
]
RADIUS, FLATTENING = 6378137.0, 1 / 298.257223563
density = jax.jit(exponential_density)


@pytest.mark.parametrize(("low", "high", "foot", "scale"), LAYERS)
def test_published_layers(low, high, foot, scale):
    assert float(density(jnp.asarray(1e3 * low))) == pytest.approx(foot, rel=1e-14)
    heights = np.linspace(low, high, 11)[:-1]
    # Scale heights are printed to five figures: by the end of a layer they leave 1e-4, in the lowest one 1.4e-3.
    tolerance = 1.4e-3 if low == 0 else 1.1e-4
    np.testing.assert_allclose(
        density(jnp.asarray(1e3 * heights)), foot * np.exp(-(heights - low) / scale), rtol=tolerance
    )


def test_published_example():
    """Vallado 2013, example 8-4: 747.2119 km."""
    assert float(density(jnp.asarray(747.2119e3))) == pytest.approx(2.1219854e-14, rel=1e-5)


def test_no_steps_and_always_thinner_with_height():
    heights = 1e3 * np.arange(-5.0, 1600.0, 0.5)
    found = np.asarray(density(jnp.asarray(heights)))
    assert np.all(np.diff(found) < 0)
    # At no height does the density change faster than the smallest scale height allows, 5.38 km.
    assert np.all(-np.diff(np.log(found)) < 0.5 / 5.38)


def test_slope_of_density():
    slope = jax.jit(jax.vmap(jax.grad(exponential_density)))
    heights = jnp.asarray(1e3 * np.array([120.0, 410.0, 523.4, 760.0, 1000.0, 1400.0]))
    h = 1.0
    difference = (density(heights + h) - density(heights - h)) / (2 * h)
    found = np.asarray(slope(heights))
    assert np.all(np.isfinite(found)) and np.all(found < 0)
    # Truncation (1 m / H)^2 and rounding, inside the layers; on their edges the slope of one side.
    inside = np.array([1, 2, 3, 5])
    np.testing.assert_allclose(found[inside], np.asarray(difference)[inside], rtol=1e-7)
    published = 1e3 * np.array([9.473, 58.515, 63.822, 88.667, 268.0, 268.0])
    np.testing.assert_allclose(-density(heights) / found, published, rtol=3e-4)


def test_height_over_the_ellipsoid():
    for height in (0.0, 4e5, 1e6):
        latitude = np.linspace(-np.pi / 2, np.pi / 2, 37)
        position = erfa.gd2gce(RADIUS, FLATTENING, 0.7 + 0 * latitude, latitude, np.full(37, height))
        found = jax.jit(jax.vmap(lambda r: height_above_ellipsoid(r, RADIUS, FLATTENING)))(jnp.asarray(position))
        # The line to the centre leaves the ellipsoid's normal by up to 3.4e-3 rad: up to h (3.4e-3)^2 / 2 more.
        excess = np.asarray(found) - height
        assert np.all(excess > -2e-8) and np.all(excess < 5.8e-6 * abs(height) + 2e-8)
    on_sphere = height_above_ellipsoid(jnp.asarray([0.0, 0.0, 7e6]), 6.4e6, 0.0)
    assert float(on_sphere) == 6e5


def test_atmosphere_over_the_earth():
    atmosphere = ExponentialAtmosphere()
    for latitude in (0.0, 0.6, np.pi / 2):
        position = erfa.gd2gce(RADIUS, FLATTENING, 2.0, latitude, 4e5)
        # 5e-6 x 400 km of 58.5 km.
        assert float(eqx.filter_jit(atmosphere)(jnp.asarray(position))) == pytest.approx(3.725e-12, rel=4e-5)
    # A round Earth, and a dense year.
    sphere = ExponentialAtmosphere(scale=3.0, equatorial_radius=6371e3, flattening=0.0)
    assert float(sphere(jnp.asarray([0.0, 6871e3, 0.0]))) == pytest.approx(3 * 6.967e-13, rel=1e-9)


def test_slopes_of_the_atmosphere():
    position = jnp.asarray([4.1e6, -3.9e6, 3.8e6])
    slope = jax.jit(jax.grad(lambda r: 1e13 * ExponentialAtmosphere()(r)))(position)
    value = jax.jit(lambda r: 1e13 * ExponentialAtmosphere()(r))
    h = 10.0
    difference = [(value(position + h * e) - value(position - h * e)) / (2 * h) for e in jnp.eye(3)]
    np.testing.assert_allclose(slope, difference, rtol=1e-6)
    pole = jax.jit(jax.grad(lambda r: 1e13 * ExponentialAtmosphere()(r)))(jnp.asarray([0.0, 0.0, 6.9e6]))
    assert np.all(np.isfinite(pole)) and float(pole[2]) < 0
    by_scale = jax.grad(lambda s: ExponentialAtmosphere(s)(position))(jnp.asarray(1.0))
    assert float(by_scale) == pytest.approx(float(ExponentialAtmosphere()(position)), rel=1e-14)


def test_air_turns_with_the_earth():
    """A point fixed to the Earth stands still in it; a satellite's velocity is the rate of its Earth-fixed place."""
    rate, h = 7.2921158553e-5, 1.0
    position, velocity = np.array([4.1e6, -3.9e6, 3.8e6]), np.array([5.0e3, 5.5e3, -1.2e3])
    fixed = np.cross([0.0, 0.0, rate], position)
    found = jax.jit(air_velocity_eci)(jnp.asarray(position), jnp.asarray(fixed))
    # The last digit of the rate, times 7000 km.
    np.testing.assert_allclose(found, 0.0, atol=1e-8)
    places = [Rotation.from_rotvec([0, 0, -rate * t]).apply(position + t * velocity) for t in (h, -h)]
    relative = air_velocity_eci(jnp.asarray(position), jnp.asarray(velocity), rate)
    # Truncation v (7e-5 x 1 s)^2 / 2.
    np.testing.assert_allclose(relative, (places[0] - places[1]) / (2 * h), atol=1e-4)
    still = air_velocity_eci(jnp.asarray(position), jnp.asarray(velocity), 0.0)
    np.testing.assert_array_equal(still, velocity)


def test_single_precision_stays_single():
    assert exponential_density(jnp.asarray(4e5, jnp.float32)).dtype == jnp.float32
    position = jnp.asarray([0.0, 7e6, 0.0], jnp.float32)
    atmosphere = jax.tree.map(lambda x: x.astype(jnp.float32), ExponentialAtmosphere())
    assert atmosphere(position).dtype == jnp.float32
    assert air_velocity_eci(position, position).dtype == jnp.float32
