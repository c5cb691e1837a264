"""Mirror albedo: published angles and factors, the polygon mapping it stands for, awkward points."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq

from jaxsat.environment import SpecularAlbedo, reflection_angle, specular_albedo

R = 6371.2e3
RATIO = 1.1975807
SUN = jnp.asarray([0.0, 0.0, 1.0])
LIMIT_DEG = 180 - np.degrees(np.arcsin(1 / RATIO))
angle = jax.jit(reflection_angle)
albedo = jax.jit(lambda position, sun: specular_albedo(position, sun, R))
albedo_gradient = jax.jit(jax.jacrev(lambda position, sun: specular_albedo(position, sun, R), argnums=(0, 1)))


def at(alpha_deg, ratio=RATIO, azimuth=0.4):
    a = np.radians(alpha_deg)
    return jnp.asarray(ratio * R * np.array([np.sin(a) * np.cos(azimuth), np.sin(a) * np.sin(azimuth), np.cos(a)]))


@pytest.mark.parametrize(
    "alpha, theta, factor",
    [
        (30, 25.557455, 0.487903),
        (60, 49.820505, 0.396329),
        (90, 71.090533, 0.223669),
        (120, 88.289428, 0.0223123),
    ],
)
def test_check_values(alpha, theta, factor):
    # The printed ratio has eight digits: one unit of the last moves Theta by 2e-6 deg.
    assert np.degrees(angle(jnp.radians(alpha * 1.0), jnp.asarray(RATIO))) == pytest.approx(theta, abs=4e-6)
    assert float(albedo(at(alpha), SUN)[1]) == pytest.approx(factor, rel=3e-6)


@pytest.mark.parametrize("ratio", [1.005, 1.1, 1.2825, 6.6])
def test_root_of_equation_1_in_its_bracket(ratio):
    alpha = np.linspace(1e-3, np.pi, 301)
    theta = np.asarray(jax.jit(jax.vmap(reflection_angle, (0, None)))(jnp.asarray(alpha), jnp.asarray(ratio)))
    np.testing.assert_allclose(ratio * np.sin(2 * theta - alpha), np.sin(theta), atol=1e-13)
    assert np.all((theta > alpha / 2) & (theta <= alpha))


@pytest.mark.parametrize("ratio", [1.02, 1.2, 1.7, 6.6])
def test_ray_from_the_root_meets_the_satellite(ratio):
    # The reflected ray leaves M0 at 2 Theta: its angle against that of M0 M, before any simplification (Penkov 2009).
    limit = np.pi - np.arcsin(1 / ratio)
    for alpha in np.linspace(0.02, 0.999 * limit, 9):

        def miss(theta, alpha=alpha):
            along, across = ratio * np.cos(alpha) - np.cos(theta), ratio * np.sin(alpha) - np.sin(theta)
            return (2 * theta - np.arctan2(across, along) + np.pi) % (2 * np.pi) - np.pi

        expected = brentq(miss, alpha / 2, min(alpha, np.pi / 2), xtol=1e-14)
        # Close above the surface M0 M is short and its direction the less sure: 1e-16 over 0.02.
        assert float(angle(jnp.asarray(alpha), jnp.asarray(ratio))) == pytest.approx(expected, abs=2e-14)


def test_reflection_obeys_the_mirror_law():
    position = at(75.0)
    direction, _ = albedo(position, SUN)
    r, d = np.asarray(position), np.asarray(direction)
    reach = -(r @ d) - np.sqrt((r @ d) ** 2 - r @ r + R**2)
    normal = (r + reach * d) / R
    assert np.linalg.norm(d) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(2 * (normal @ np.asarray(SUN)) * normal - np.asarray(SUN), -d, atol=1e-12)


def test_factor_is_the_thinning_of_a_beam_of_reflected_rays():
    # Three neighbouring rays: area across the beam at the mirror over that at the satellite.
    theta, h = np.radians(55.0), 1e-5
    sun = np.asarray(SUN)

    def ray(polar, azimuth):
        normal = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
        return R * normal, 2 * (normal @ sun) * normal - sun

    feet, ways = zip(ray(theta, 0.0), ray(theta + h, 0.0), ray(theta, h), strict=True)
    satellite = feet[0] + 1.5e6 * ways[0]
    reach = [(satellite - foot) @ ways[0] / (way @ ways[0]) for foot, way in zip(feet, ways, strict=True)]
    on_plane = [foot + s * way for foot, s, way in zip(feet, reach, ways, strict=True)]
    area = np.linalg.norm(np.cross(on_plane[1] - on_plane[0], on_plane[2] - on_plane[0]))
    source = abs(np.cross(feet[1] - feet[0], feet[2] - feet[0]) @ sun)
    assert float(albedo(jnp.asarray(satellite), SUN)[1]) == pytest.approx(source / area, rel=1e-4)


def test_exactly_dark_beyond_the_limit():
    assert float(albedo(at(LIMIT_DEG - 1e-3), SUN)[1]) > 0.0
    for alpha in (LIMIT_DEG + 1e-6, 150.0, 180.0):
        assert float(albedo(at(alpha), SUN)[1]) == 0.0


@pytest.mark.parametrize(
    "alpha", [0.0, 1e-9, 1e-4, 60.0, LIMIT_DEG - 1e-9, LIMIT_DEG, LIMIT_DEG + 1e-9, 180.0 - 1e-9, 180.0]
)
def test_value_and_gradient_are_finite(alpha):
    position = jnp.asarray([0.0, 0.0, RATIO * R]) if alpha == 0.0 else at(alpha)
    leaves = jax.tree.leaves((albedo(position, SUN), albedo_gradient(position, SUN)))
    assert all(np.all(np.isfinite(x)) for x in leaves)


@pytest.mark.parametrize("ratio", [1.0, 0.998, 0.5, 0.0])
def test_below_the_ground_it_is_the_mirror_at_the_feet(ratio):
    """All of the light, from as far below the horizon as the Sun is above it; at the centre it is finite."""
    for alpha in (0.0, 40.0, 80.0, 100.0, 180.0):
        position = at(alpha, ratio)
        direction, factor = albedo(position, SUN)
        vertical = np.array(
            [np.sin(np.radians(alpha)) * f(0.4) for f in (np.cos, np.sin)] + [np.cos(np.radians(alpha))]
        )
        if ratio > 0.0 and alpha < 90.0:
            # Six metres above the ground, over the cosine: 2 h / R of each factor of the thinning.
            np.testing.assert_allclose(factor, 1.0, atol=1e-4)
            mirrored = SUN - 2.0 * (SUN @ vertical) * vertical
            np.testing.assert_allclose(direction, mirrored, atol=1e-4)
        elif ratio > 0.0:
            assert float(factor) == 0.0
        leaves = jax.tree.leaves((direction, factor, albedo_gradient(position, SUN)))
        assert all(np.all(np.isfinite(x)) for x in leaves)


@pytest.mark.parametrize("alpha", [0.0, 5e-5, 0.01, 40.0, 110.0, 122.0])
def test_gradient_against_differences(alpha):
    position = at(alpha)
    jacobian = [np.asarray(x[0]) for x in albedo_gradient(position, SUN)]
    h = 10.0
    for k in range(3):
        step = h * jnp.eye(3)[k]
        plus, minus = albedo(position + step, SUN), albedo(position - step, SUN)
        for j in range(2):
            difference = (np.asarray(plus[j]) - np.asarray(minus[j])) / (2 * h)
            np.testing.assert_allclose(jacobian[j][..., k], difference, atol=2e-13)


@pytest.mark.slow
def test_batches_forward_mode_and_single_precision():
    positions = jnp.stack([at(0.5), at(70.0), at(150.0)])
    found = jax.jit(jax.vmap(jax.jacfwd(SpecularAlbedo(R)), (0, None)))(positions, SUN)
    for k, position in enumerate(positions):
        for forward, reverse in zip(found, albedo_gradient(position, SUN), strict=True):
            np.testing.assert_allclose(forward[k], reverse[0], rtol=1e-9, atol=1e-20)
    direction, factor = albedo(positions[1].astype(jnp.float32), SUN.astype(jnp.float32))
    assert direction.dtype == factor.dtype == jnp.float32
    assert float(factor) == pytest.approx(float(albedo(positions[1], SUN)[1]), rel=3e-6)


def test_overhead_sun_is_reflected_from_below():
    direction, factor = albedo(jnp.asarray([0.0, 0.0, RATIO * R]), SUN)
    np.testing.assert_allclose(direction, [0, 0, -1], atol=1e-15)
    # A convex mirror of focal length R/2 seen from height h: (1 + 2 h/R)^-2.
    assert float(factor) == pytest.approx((1 + 2 * (RATIO - 1)) ** -2, rel=1e-13)
