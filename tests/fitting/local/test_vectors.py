"""Attitude from directions: against SciPy's Kabsch solution, exact data, singular pairs, slopes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.estimation.vectors import rotation_covariance, triad, two_vector_attitude, weighted_attitude

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
pair, many = quick(two_vector_attitude), quick(weighted_attitude)


def _total(method):
    def total(body, eci):
        return method(body, eci, jnp.ones(2)) @ jnp.array([0.3, -1.0, 0.7, 0.4])

    return quick(jax.value_and_grad(total, argnums=(0, 1)))


SLOPES = {"pair": _total(two_vector_attitude), "q-method": _total(weighted_attitude)}


def units(rng, *shape):
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def off(q, rotation):
    """Angle between an attitude and a SciPy rotation [rad]."""
    return (Rotation.from_quat(np.asarray(q), scalar_first=True).inv() * rotation).magnitude()


def noisy(rng, count, sigma):
    """True attitude, directions in body axes with errors, and the same outside."""
    true, eci = Rotation.random(rng=rng), units(rng, count)
    body = true.inv().apply(eci) + sigma * rng.normal(size=(count, 3))
    return true, body / np.linalg.norm(body, axis=1, keepdims=True), eci


def test_exact_directions_give_the_attitude():
    rng = np.random.default_rng(0)
    exact = quick(triad)
    for _ in range(20):
        true, body, eci = noisy(rng, 2, 0.0)
        weights = jnp.asarray(rng.uniform(0.1, 2.0, 2))
        for found in (exact(*map(jnp.asarray, (*body, *eci))), *(f(body, eci, weights) for f in (pair, many))):
            # Eigenvectors of gaps down to 0.01 keep 14 digits less two, a pair 1 deg apart as many.
            assert off(found, true) < 1e-11


@pytest.mark.parametrize("count", [2, 5])
def test_the_optimum_is_that_of_scipy(count):
    rng = np.random.default_rng(count)
    for _ in range(20):
        _, body, eci = noisy(rng, count, 0.3)
        weights = rng.uniform(0.1, 3.0, count)
        expected = Rotation.align_vectors(eci, body, weights=weights)[0]
        assert off(many(body, eci, jnp.asarray(weights)), expected) < 1e-7
        if count == 2:
            assert off(pair(body, eci, jnp.asarray(weights)), expected) < 1e-7


def test_triad_keeps_the_first_direction():
    _, body, eci = noisy(np.random.default_rng(4), 2, 0.3)
    found = Rotation.from_quat(np.asarray(triad(*map(jnp.asarray, (*body, *eci)))), scalar_first=True)
    np.testing.assert_allclose(found.apply(body[0]), eci[0], atol=1e-14)
    assert abs(found.apply(body[1]) @ np.cross(eci[0], eci[1])) < 1e-14
    assert found.apply(body[1]) @ eci[1] > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("angle_deg", [90.0, 45.0, 5.0])
@pytest.mark.parametrize("method", SLOPES)
def test_slopes_against_differences(method, angle_deg):
    # Equal weights at 90 deg are where two of Davenport's other eigenvalues meet.
    a = np.radians(angle_deg)
    eci = np.array([[1.0, 0.0, 0.0], [np.cos(a), np.sin(a), 0.0]])
    body = Rotation.from_rotvec([0.3, 0.8, -0.5]).inv().apply(eci)
    along = np.random.default_rng(2).normal(size=(2, 2, 3))

    def value(h):
        return SLOPES[method](body + h * along[0], eci + h * along[1])

    slope = sum(float(np.sum(gradient * part)) for gradient, part in zip(value(0.0)[1], along, strict=True))
    assert slope == pytest.approx(float(value(1e-5)[0] - value(-1e-5)[0]) / 2e-5, rel=1e-7, abs=1e-8)


def test_covariance_is_what_the_errors_do():
    rng = np.random.default_rng(6)
    true, eci = Rotation.random(rng=rng), units(rng, 2)
    exact, sigma = true.inv().apply(eci), np.array([2e-3, 5e-3])
    expected = np.asarray(rotation_covariance(jnp.asarray(exact), jnp.asarray(sigma)))
    solve = quick(jax.vmap(two_vector_attitude, (0, None, None)))
    body = exact + sigma[:, None] * rng.normal(size=(4000, 2, 3))
    body /= np.linalg.norm(body, axis=-1, keepdims=True)
    found = Rotation.from_quat(np.asarray(solve(body, eci, jnp.asarray(1 / sigma**2))), scalar_first=True)
    errors = (true.inv() * found).as_rotvec()
    # 4000 draws: 1-sigma of a variance is 2.2 %.
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(np.cov(errors.T) / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.1)


def test_parallel_directions_are_finite():
    same = jnp.array([[0.6, 0.0, 0.8], [0.6, 0.0, 0.8]])
    assert np.all(np.isfinite(pair(same, same, jnp.ones(2))))
    value, gradients = SLOPES["pair"](same, same)
    assert np.isfinite(value) and all(np.all(np.isfinite(g)) for g in gradients)
