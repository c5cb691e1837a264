"""A weighted sum against NumPy's product, and its derivatives in both modes, alone and over batches."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsat.math.weighted_sum import weighted_sum

RNG = np.random.default_rng(3)
WEIGHTS = jnp.asarray(RNG.normal(size=5))


@pytest.mark.parametrize("rest", [(), (4,), (2, 3)])
def test_is_a_product(rest):
    terms = RNG.normal(size=(5, *rest))
    expected = np.tensordot(np.asarray(WEIGHTS), terms, axes=1)
    compiled = jax.jit(weighted_sum)
    np.testing.assert_allclose(compiled(WEIGHTS, jnp.asarray(terms)), expected, rtol=1e-14, atol=1e-15)
    given = (WEIGHTS, jnp.asarray(terms))
    check_grads(compiled, given, order=2, modes=("fwd", "rev"))


@pytest.mark.parametrize("axes", [(None, 0), (0, None), (0, 0), (None, 2), (1, 1)])
def test_over_a_batch(axes):
    """Batches anywhere, on either argument, as the same sums one by one."""
    weights, terms = RNG.normal(size=(4, 5)), RNG.normal(size=(4, 5, 3))
    given = [x if axis is not None else x[0] for x, axis in zip((weights, terms), axes, strict=True)]
    one_by_one = [
        np.tensordot(weights[k if axes[0] is not None else 0], terms[k if axes[1] is not None else 0], axes=1)
        for k in range(4)
    ]
    moved = [x if axis is None else np.moveaxis(x, 0, axis) for x, axis in zip(given, axes, strict=True)]
    arrays = [jnp.asarray(x) for x in moved]
    np.testing.assert_allclose(jax.jit(jax.vmap(weighted_sum, axes))(*arrays), one_by_one, rtol=1e-13, atol=1e-14)
    slope = jax.jit(jax.vmap(jax.grad(lambda w, t: jnp.sum(weighted_sum(w, t) ** 2), argnums=1), axes))(*arrays)
    expected = [
        2.0 * np.multiply.outer(weights[k if axes[0] is not None else 0], found) for k, found in enumerate(one_by_one)
    ]
    np.testing.assert_allclose(slope, expected, rtol=1e-13, atol=1e-13)


def test_transpose_is_no_larger_than_the_terms():
    """The reverse mode has no zeros of the size of all terms for each of them."""

    def loss(terms):
        return jnp.sum(weighted_sum(WEIGHTS, terms) * jnp.arange(100.0))

    text = str(jax.make_jaxpr(jax.grad(loss))(jnp.ones((5, 100))))
    assert "pad" not in text and "scatter" not in text and "weighted_sum" in text
