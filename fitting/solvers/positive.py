"""Systems of a few dozen equations with a symmetric positive definite matrix, many at once."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def solve_positive(matrix: Float[Array, "n n"], right: Float[Array, " n"]) -> Float[Array, " n"]:
    """The solution of `matrix` x = `right` by elimination without pivoting; NaN where the matrix is not positive.

    In place of LAPACK's Cholesky factorisation, which JAX runs in parallel over a batch inside XLA's own threads: two
    calls at once, as a fit makes them, may wait for each other for good (jaxlib 0.10).
    """
    number = jnp.arange(right.shape[0])

    def eliminate(k, carry):
        matrix, right = carry
        pivot = matrix[k, k]
        pivot = jnp.where(pivot > 0.0, pivot, jnp.nan)
        factor = jnp.where(number == k, 0.0, matrix[:, k] / pivot)
        return matrix - factor[:, None] * matrix[k][None, :], right - factor * right[k]

    matrix, right = jax.lax.fori_loop(0, right.shape[0], eliminate, (matrix, right))
    return right / jnp.diagonal(matrix)
