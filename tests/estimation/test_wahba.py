"""Wahba's problem for many samples: against SciPy, gaps, what scatters against the covariance, slopes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.estimation import quest, rotation_covariance, wahba

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})


def units(rng, *shape):
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def noisy(rng, samples, count, sigma):
    """True attitudes, directions in body axes with errors, and the same outside."""
    true, eci = Rotation.random(samples, rng=rng), units(rng, samples, count)
    body = np.stack([true.inv().apply(eci[:, k]) for k in range(count)], axis=1)
    body += np.asarray(sigma)[..., None] * rng.normal(size=body.shape)
    return true, body / np.linalg.norm(body, axis=-1, keepdims=True), eci


@pytest.mark.parametrize("count", [2, 3, 6])
def test_both_find_the_optimum_of_scipy(count):
    rng = np.random.default_rng(count)
    _, body, eci = noisy(rng, 30, count, 0.3)
    sigma = rng.uniform(0.1, 1.0, (30, count))
    found, _ = wahba(body, eci, sigma)
    fast = quick(quest)(jnp.asarray(body), jnp.asarray(eci), jnp.asarray(1.0 / sigma**2))
    for k in range(30):
        other = Rotation.align_vectors(eci[k], body[k], weights=1.0 / sigma[k] ** 2)[0]
        for q in (found[k], np.asarray(fast)[k]):
            assert (Rotation.from_quat(q, scalar_first=True).inv() * other).magnitude() < 1e-7


def test_no_rotation_near_does_better():
    rng = np.random.default_rng(7)
    _, body, eci = noisy(rng, 1, 4, 0.4)
    weight = rng.uniform(0.2, 2.0, 4)
    best = Rotation.from_quat(wahba(body[0], eci[0], weight**-0.5)[0], scalar_first=True)

    def loss(rotation):
        return np.sum(weight[:, None] * (body[0] - rotation.inv().apply(eci[0])) ** 2)

    others = [loss(best * Rotation.from_rotvec(size * each)) for size in (1e-3, 0.1, 2.0) for each in units(rng, 50)]
    assert min(others) > loss(best)


def test_lengths_do_not_matter_and_leading_axes_stay():
    rng = np.random.default_rng(1)
    true, body, eci = noisy(rng, 6, 3, 0.0)
    body, eci = (rng.uniform(1e-9, 1e9, (6, 3, 1)) * vectors for vectors in (body, eci))
    q, covariance = wahba(body.reshape(2, 3, 3, 3), eci.reshape(2, 3, 3, 3), np.full((2, 3, 3), 0.01))
    assert q.shape == (2, 3, 4) and covariance.shape == (2, 3, 3, 3)
    off = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True).inv() * true
    assert off.magnitude().max() < 1e-10


def test_what_is_not_measured_is_left_out():
    rng = np.random.default_rng(2)
    _, body, eci = noisy(rng, 7, 3, 0.1)
    sigma = np.full((7, 3), 0.1)
    body[1, 2], eci[2, 2], sigma[3, 2], body[4, 2] = np.nan, np.nan, np.inf, 0.0
    pair, pair_covariance = wahba(body[:, :2], eci[:, :2], sigma[:, :2])
    found, covariance = wahba(body, eci, sigma)
    np.testing.assert_allclose(found[1:5], pair[1:5], atol=1e-12)
    np.testing.assert_allclose(covariance[1:5], pair_covariance[1:5], rtol=1e-9, atol=1e-15)
    # One direction alone, and three on one line, say nothing.
    body[5, :2], (body[6], eci[6]) = np.nan, (np.outer([1, -2, 3], body[6, 0]), np.outer([1, -1, 1], eci[6, 0]))
    found, covariance = wahba(body, eci, sigma)
    assert np.isnan(found[5:]).all() and np.isnan(covariance[5:]).all() and np.isfinite(found[:5]).all()


@pytest.mark.parametrize("sigma", [[0.002, 0.02], [0.01, 0.003, 0.05]])
def test_attitudes_scatter_by_the_covariance(sigma):
    rng = np.random.default_rng(3)
    eci = units(rng, len(sigma))
    true = Rotation.random(rng=rng)
    count = 20_000
    body = true.inv().apply(eci) + np.array(sigma)[:, None] * rng.normal(size=(count, len(sigma), 3))
    found, covariance = wahba(body, np.tile(eci, (count, 1, 1)), np.tile(sigma, (count, 1)))
    turns = (true.inv() * Rotation.from_quat(found, scalar_first=True)).as_rotvec()
    ratio = np.linalg.solve(np.linalg.cholesky(covariance[0]), turns.T)
    # 20000 samples tell a variance to one part in a hundred.
    np.testing.assert_allclose(np.cov(ratio), np.eye(3), atol=0.04)
    exact = rotation_covariance(jnp.asarray(true.inv().apply(eci)), jnp.asarray(sigma))
    np.testing.assert_allclose(np.mean(covariance, axis=0), exact, rtol=0.01, atol=2e-3 * np.max(exact))


def test_slopes_of_many_are_those_of_differences():
    rng = np.random.default_rng(4)
    _, body, eci = noisy(rng, 3, 3, 0.2)
    mix = jnp.asarray(rng.normal(size=(3, 4)))
    weights = jnp.asarray(rng.uniform(0.3, 2.0, (3, 3)))

    def total(body, weights):
        return jnp.sum(mix * quest(body, jnp.asarray(eci), weights))

    value = quick(total)
    slopes = quick(jax.grad(total, argnums=(0, 1)))(jnp.asarray(body), weights)
    for _ in range(3):
        d_body, d_weights = rng.normal(size=(3, 3, 3)), rng.normal(size=(3, 3))
        h = 1e-6
        ends = [value(jnp.asarray(body + s * h * d_body), weights + s * h * d_weights) for s in (1.0, -1.0)]
        along = np.sum(np.asarray(slopes[0]) * d_body) + np.sum(np.asarray(slopes[1]) * d_weights)
        assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(along, rel=1e-6, abs=1e-8)
