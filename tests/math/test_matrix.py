"""Inverse of a 3 x 3 matrix against LAPACK and the closed form of its derivative."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.math import inverse_3x3

EPS = np.finfo(float).eps
RNG = np.random.default_rng(2)
GENERAL = RNG.normal(size=(40, 3, 3))
INERTIA = np.array([[0.0514, 0.0004, -0.0002], [0.0004, 0.0549, 0.0001], [-0.0002, 0.0001, 0.0578]])


def test_inverse_of_an_inertia_tensor():
    inverse = np.asarray(inverse_3x3(jnp.asarray(INERTIA)))
    np.testing.assert_allclose(inverse, np.linalg.inv(INERTIA), rtol=1e-14, atol=20 * EPS / 0.05)
    np.testing.assert_allclose(inverse, inverse.T, rtol=0, atol=EPS / 0.05)


def test_inverse_of_matrices_without_symmetry():
    found = jax.jit(jax.vmap(inverse_3x3))(jnp.asarray(GENERAL))
    for matrix, inverse in zip(GENERAL, np.asarray(found), strict=True):
        # The adjugate loses at most the square of the condition number (below 1e3 here); usually only the number.
        bound = 10 * EPS * np.linalg.cond(matrix) ** 2
        assert bound < 1e-8
        np.testing.assert_allclose(inverse @ matrix, np.eye(3), atol=bound)
        np.testing.assert_allclose(matrix @ inverse, np.eye(3), atol=bound)


def test_derivative_is_minus_inverse_change_inverse():
    for matrix, change in ((INERTIA, 1e-2 * GENERAL[0]), (GENERAL[1], GENERAL[2])):
        inverse = np.linalg.inv(matrix)
        _, slope = jax.jvp(inverse_3x3, (jnp.asarray(matrix),), (jnp.asarray(change),))
        expected = -inverse @ change @ inverse
        np.testing.assert_allclose(slope, expected, rtol=1e-11, atol=1e-12 * np.abs(expected).max())
