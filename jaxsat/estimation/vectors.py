"""Attitude from directions known in body and in inertial axes: TRIAD, its weighted optimum, and the q-method."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import cross, quaternion, safe_norm, unit

Vectors = Float[Array, "vectors 3"]


def triad(
    first_body: Float[Array, "3"],
    second_body: Float[Array, "3"],
    first_eci: Float[Array, "3"],
    second_eci: Float[Array, "3"],
) -> Float[Array, "4"]:
    """Attitude that carries the first direction exactly and the second into the half-plane of its own (Black 1964).

    The vectors need not be units. Finite but without meaning where two of one frame are parallel. Batch with
    `jax.vmap`.
    """
    return quaternion.from_dcm(_axes(first_eci, second_eci) @ _axes(first_body, second_body).T)


def _axes(first, second):
    """[3 3] columns: the first direction, across it in the plane of both, and their normal."""
    x, z = unit(first), unit(cross(first, second))
    return jnp.stack([x, cross(z, x), z], axis=1)


def two_vector_attitude(
    body: Float[Array, "2 3"], eci: Float[Array, "2 3"], weights: Float[Array, "2"]
) -> Float[Array, "4"]:
    """Attitude of least sum w_k |b_k - A r_k|^2 for two unit directions, in closed form (Markley 2002).

    The optimum carries plane into plane; within it the two angles by which the directions disagree are averaged.
    With weights (1, 0) it is `triad`.
    """
    onto_first = triad(body[0], body[1], eci[0], eci[1])
    between_body = jnp.arctan2(safe_norm(cross(body[0], body[1])), body[0] @ body[1])
    between_eci = jnp.arctan2(safe_norm(cross(eci[0], eci[1])), eci[0] @ eci[1])
    excess = between_eci - between_body
    turn = jnp.arctan2(weights[1] * jnp.sin(excess), weights[0] + weights[1] * jnp.cos(excess))
    return quaternion.multiply(quaternion.from_rotation_vector(turn * unit(cross(eci[0], eci[1]))), onto_first)


def weighted_attitude(body: Vectors, eci: Vectors, weights: Float[Array, " vectors"]) -> Float[Array, "4"]:
    """Attitude of least sum w_k |b_k - A r_k|^2 for two or more unit directions: Davenport's q-method.

    The eigenvector of the largest eigenvalue of Davenport's matrix (Markley & Crassidis 2014, sec. 5.3), with
    non-negative scalar part. Not determined where all directions of one frame are parallel.
    """
    return _largest_eigenvector(davenport_matrix(body, eci, weights))


def davenport_matrix(body: Vectors, eci: Vectors, weights: Float[Array, " vectors"]) -> Float[Array, "4 4"]:
    """K with q K q = sum w_k b_k . A(q) r_k, scalar first."""
    profile = jnp.einsum("k,ki,kj->ij", weights, eci, body)
    trace = profile[0, 0] + profile[1, 1] + profile[2, 2]
    corner = jnp.sum(weights[:, None] * cross(body, eci), axis=0)
    block = profile + profile.T - trace * jnp.eye(3, dtype=profile.dtype)
    return jnp.block([[trace[None, None], corner[None, :]], [corner[:, None], block]])


@jax.custom_jvp
def _largest_eigenvector(matrix):
    q = jnp.linalg.eigh(matrix)[1][:, -1]
    return jnp.where(q[0] < 0.0, -q, q)


@_largest_eigenvector.defjvp
def _largest_eigenvector_jvp(primals, tangents):
    # eigh's own derivative is not finite where two of the other eigenvalues meet, as for equal weights at 90 deg.
    (matrix,), (change,) = primals, tangents
    q = _largest_eigenvector(matrix)
    along = q @ matrix @ q
    forced = change @ q
    forced -= (q @ forced) * q
    # q q is added so that the direction of q itself, where nothing moves, can be divided by.
    square = along * jnp.eye(4, dtype=q.dtype) - matrix + jnp.outer(q, q) * along
    return q, jnp.linalg.solve(square, forced)


def rotation_covariance(body: Vectors, sigma: Float[Array, " vectors"]) -> Float[Array, "3 3"]:
    """Covariance of a small rotation about the body axes [rad^2] for directions with errors `sigma` [rad].

    Inverse of sum (1 - b b^T)/sigma^2 (Shuster & Oh 1981, eq. 70, for the optimal weights 1/sigma^2); grows without
    limit as all directions become parallel.
    """
    eye = jnp.eye(3, dtype=body.dtype)
    across = eye[None] - body[:, :, None] * body[:, None, :]
    return jnp.linalg.inv(jnp.sum(across / sigma[:, None, None] ** 2, axis=0))


def triad_covariance(body: Float[Array, "2 3"], sigma: Float[Array, "2"]) -> Float[Array, "3 3"]:
    """Covariance of a small rotation about the body axes [rad^2] of `triad`, for two unit directions in body axes.

    With errors `sigma` [rad] of the directions (Shuster & Oh 1981, sec. on the TRIAD covariance): s1^2 1 + ((s2^2 -
    s1^2) b1 b1' + s1^2 (b1 . b2) (b1 b2' + b2 b1')) / |b1 x b2|^2. The first direction's own error stays whatever the
    second is, so that it is never below `rotation_covariance`.
    """
    first, second = body
    s1, s2 = sigma[0] ** 2, sigma[1] ** 2
    normal = cross(first, second)
    mixed = jnp.outer(first, second)
    along = (s2 - s1) * jnp.outer(first, first) + s1 * (first @ second) * (mixed + mixed.T)
    return s1 * jnp.eye(3, dtype=body.dtype) + along / (normal @ normal)
