"""The converter of fields: whatever comes in, a floating JAX array of the default precision goes out."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.math import float_array, floating


@pytest.mark.parametrize(
    "x",
    [
        3,
        3.5,
        True,
        np.float32(0.25),
        np.arange(3),
        np.ones((2, 3), np.float32),
        jnp.arange(3),
        jnp.ones(2, jnp.float32),
        jnp.asarray(7.0),
    ],
)
def test_kind_shape_and_value(x):
    found = float_array(x)
    assert isinstance(found, jax.Array) and found.dtype == np.float64 and not found.weak_type
    assert found.shape == np.shape(x)
    np.testing.assert_array_equal(found, np.asarray(x))


def test_traced_values_pass_with_their_derivative():
    assert float(jax.jit(jax.grad(lambda x: float_array(x) ** 2))(jnp.asarray(3.0))) == 6.0
    np.testing.assert_array_equal(jax.vmap(float_array)(jnp.arange(3)), [0.0, 1.0, 2.0])


def test_a_precision_of_its_own_is_kept():
    for x in (np.ones(2, np.float32), jnp.ones(2, jnp.float32)):
        assert floating(x).dtype == np.float32
    for x in ([1, 0], np.array([1, 0]), jnp.array([1, 0]), np.array([1.0, 0.0])):
        assert floating(x).dtype == np.float64
