"""Vector functions against NumPy and closed forms, with the singular points of norm, direction and angle."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.math import angle_between, cross, safe_norm, unit

RNG = np.random.default_rng(5)
A, B = RNG.normal(size=(2, 50, 3))
EPS = np.finfo(float).eps

norm_gradient = jax.jit(jax.grad(safe_norm))
unit_jacobian = jax.jit(jax.jacfwd(unit))
angle = jax.jit(angle_between)
angle_gradient = jax.jit(jax.grad(angle_between, argnums=(0, 1)))


def at_angle(theta):
    """Two vectors of unequal length, `theta` apart in a plane that holds no axis; sines and cosines are NumPy's."""
    first, second = np.array([2.0, 1.0, -2.0]) / 3, np.array([1.0, 2.0, 2.0]) / 3
    return jnp.asarray(3.0 * first), jnp.asarray(0.2 * (np.cos(theta) * first + np.sin(theta) * second))


def test_cross_is_that_of_numpy():
    np.testing.assert_allclose(cross(jnp.asarray(A), jnp.asarray(B)), np.cross(A, B), rtol=0, atol=8 * EPS)
    np.testing.assert_array_equal(
        jax.vmap(cross)(jnp.asarray(A), jnp.asarray(B)), cross(jnp.asarray(A), jnp.asarray(B))
    )


def test_norm_and_direction():
    length = np.linalg.norm(A, axis=1)
    np.testing.assert_allclose(safe_norm(jnp.asarray(A)), length, rtol=4 * EPS)
    np.testing.assert_allclose(unit(jnp.asarray(A)), A / length[:, None], rtol=0, atol=4 * EPS)
    np.testing.assert_allclose(jax.vmap(unit)(jnp.asarray(A)), A / length[:, None], rtol=0, atol=4 * EPS)


def test_zero_vector_has_zero_length_no_direction_and_finite_slopes():
    zero = jnp.zeros(3)
    assert float(safe_norm(zero)) == 0.0
    np.testing.assert_array_equal(norm_gradient(zero), 0.0)
    np.testing.assert_array_equal(unit(zero), 0.0)
    assert np.all(np.isfinite(unit_jacobian(zero)))


def test_slopes_of_norm_and_direction():
    for v in A[:5]:
        length = np.linalg.norm(v)
        np.testing.assert_allclose(norm_gradient(jnp.asarray(v)), v / length, atol=8 * EPS)
        projector = (np.eye(3) - np.outer(v, v) / length**2) / length
        np.testing.assert_allclose(unit_jacobian(jnp.asarray(v)), projector, atol=20 * EPS / length)


# Both ends keep all their digits: the error is that of the two vectors, rounded once, not its square root (1.5e-8).
@pytest.mark.parametrize("theta", [0.0, 1e-12, 1e-8, 1e-3, 0.7, np.pi / 2, 3.0, np.pi - 1e-6, np.pi - 1e-12, np.pi])
def test_angle_from_zero_to_pi(theta):
    a, b = at_angle(theta)
    assert float(angle(a, b)) == pytest.approx(theta, abs=8 * EPS)
    assert float(angle(b, a)) == pytest.approx(theta, abs=8 * EPS)


def test_angle_of_a_batch():
    expected = np.arccos(np.sum(A * B, axis=1) / np.linalg.norm(A, axis=1) / np.linalg.norm(B, axis=1))
    # The inverse cosine of the oracle loses digits as 1/sin(angle), which stays below 10 in this batch.
    assert np.min(np.sin(expected)) > 0.1
    np.testing.assert_allclose(angle_between(jnp.asarray(A), jnp.asarray(B)), expected, atol=1e-14)
    np.testing.assert_allclose(jax.vmap(angle_between)(jnp.asarray(A), jnp.asarray(B)), expected, atol=1e-14)


@pytest.mark.parametrize("theta", [1e-6, 0.4, np.pi / 2, 2.8, np.pi - 1e-6])
def test_slope_of_the_angle_is_along_the_great_circle(theta):
    a, b = at_angle(theta)
    first, second = np.array([2.0, 1.0, -2.0]) / 3, np.array([1.0, 2.0, 2.0]) / 3
    forward_a, forward_b = second, np.cos(theta) * second - np.sin(theta) * first
    by_a, by_b = angle_gradient(a, b)
    # Directions at 1e-6 rad from the singular point are good to eps / 1e-6.
    np.testing.assert_allclose(by_a, -forward_a / 3.0, atol=1e-9)
    np.testing.assert_allclose(by_b, forward_b / 0.2, atol=1e-8)


@pytest.mark.parametrize("theta", [0.0, np.pi])
def test_slope_of_the_angle_is_finite_at_its_ends(theta):
    a = jnp.asarray([0.0, 0.0, 2.0])
    b = jnp.asarray([0.0, 0.0, 2.0 if theta == 0.0 else -2.0])
    assert float(angle(a, b)) == theta
    assert all(np.all(np.isfinite(g)) for g in angle_gradient(a, b))
