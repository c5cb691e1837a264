"""Samples between states are NumPy's sums, and their derivatives hold in both modes, in batches and in one function."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.math.one_function import compiled
from jaxsat.math.sample_read import read_samples

RNG = np.random.default_rng(4)
STATES, FIRST, WEIGHTS = RNG.normal(size=(9, 3)), np.array([0, 2, 2, 5]), RNG.normal(size=(4, 4))
MATRIX = np.zeros((4, 9))
for sample, begin in enumerate(FIRST):
    MATRIX[sample, begin : begin + 4] += WEIGHTS[sample]


def test_samples_are_sums_of_their_states():
    np.testing.assert_allclose(read_samples(jnp.asarray(STATES), FIRST, WEIGHTS), MATRIX @ STATES, rtol=1e-14)


def test_derivatives_are_those_of_the_matrix():
    moved, pull = RNG.normal(size=(9, 3)), RNG.normal(size=(4, 3))
    found, slope = jax.jvp(lambda x: read_samples(x, FIRST, WEIGHTS), (jnp.asarray(STATES),), (jnp.asarray(moved),))
    np.testing.assert_allclose(slope, MATRIX @ moved, rtol=1e-13)
    gradient = jax.grad(lambda x: jnp.sum(jnp.sin(read_samples(x, FIRST, WEIGHTS)) * pull))
    truth = MATRIX.T @ (np.cos(MATRIX @ STATES) * pull)
    for found in (gradient(jnp.asarray(STATES)), compiled(gradient)(jnp.asarray(STATES))):
        np.testing.assert_allclose(found, truth, rtol=1e-12)


def test_batches_of_any_argument():
    many = RNG.normal(size=(2, 9, 3))
    found = jax.vmap(lambda x: read_samples(x, FIRST, WEIGHTS))(jnp.asarray(many))
    np.testing.assert_allclose(found, MATRIX @ many, rtol=1e-13)
    found = jax.vmap(lambda x: jax.grad(lambda x: jnp.sum(read_samples(x, FIRST, WEIGHTS) ** 2))(x))(jnp.asarray(many))
    np.testing.assert_allclose(found, 2.0 * MATRIX.T @ (MATRIX @ many), rtol=1e-12)
    weights = np.stack([WEIGHTS, 2.0 * WEIGHTS])
    found = jax.vmap(lambda w: read_samples(jnp.asarray(STATES), FIRST, w))(weights)
    np.testing.assert_allclose(found, [MATRIX @ STATES, 2.0 * MATRIX @ STATES], rtol=1e-13)
