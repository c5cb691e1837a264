"""Unit quaternions of attitude: scalar first, turning body vectors into inertial ones.

`rotate(q, v_body)` is the inertial vector, `rotate_inverse(q, v_inertial)` the body vector, and products compose
from right to left: `multiply(q_inertial_from_body, q_body_from_sensor)` is `q_inertial_from_sensor`.
Rotations take one quaternion and any number of vectors; the other functions act on the last axis, whatever leads.
(Markley & Crassidis 2014, sec. 2.9, written here with the Hamilton product and the scalar in front.)
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math.vector import cross, safe_norm, unit


def multiply(p: Float[Array, "*batch 4"], q: Float[Array, "*batch 4"]) -> Float[Array, "*batch 4"]:
    """Hamilton product p q."""
    pw, px, py, pz = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    qw, qx, qy, qz = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    return jnp.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def conjugate(q: Float[Array, "*batch 4"]) -> Float[Array, "*batch 4"]:
    """Inverse rotation of a unit quaternion."""
    return q * jnp.array([1.0, -1.0, -1.0, -1.0], dtype=q.dtype).reshape((1,) * (q.ndim - 1) + (4,))


def normalize(q: Float[Array, "*batch 4"]) -> Float[Array, "*batch 4"]:
    """The unit quaternion along `q`."""
    return q / jnp.sqrt(jnp.sum(q * q, axis=-1))[..., None]


def to_dcm(q: Float[Array, "*batch 4"]) -> Float[Array, "*batch 3 3"]:
    """Direction cosine matrix `dcm_inertial_from_body` of a unit quaternion."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def from_dcm(dcm: Float[Array, "3 3"]) -> Float[Array, "4"]:
    """Quaternion of a direction cosine matrix, by the largest component (Shepperd 1978), non-negative scalar part."""
    trace = dcm[0, 0] + dcm[1, 1] + dcm[2, 2]
    diagonal = jnp.stack([trace, dcm[0, 0], dcm[1, 1], dcm[2, 2]])
    # Row k holds 4 q_k times the quaternion, so the row of the largest q_k never divides by a small number.
    symmetric = jnp.stack(
        [
            jnp.stack([1.0 + trace, dcm[2, 1] - dcm[1, 2], dcm[0, 2] - dcm[2, 0], dcm[1, 0] - dcm[0, 1]]),
            jnp.stack(
                [dcm[2, 1] - dcm[1, 2], 1.0 + 2.0 * dcm[0, 0] - trace, dcm[0, 1] + dcm[1, 0], dcm[0, 2] + dcm[2, 0]]
            ),
            jnp.stack(
                [dcm[0, 2] - dcm[2, 0], dcm[0, 1] + dcm[1, 0], 1.0 + 2.0 * dcm[1, 1] - trace, dcm[1, 2] + dcm[2, 1]]
            ),
            jnp.stack(
                [dcm[1, 0] - dcm[0, 1], dcm[0, 2] + dcm[2, 0], dcm[1, 2] + dcm[2, 1], 1.0 + 2.0 * dcm[2, 2] - trace]
            ),
        ]
    )
    q = normalize(symmetric[jnp.argmax(diagonal)])
    return jnp.where(q[0] < 0.0, -q, q)


def rotate(q: Float[Array, "4"], vector_body: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Inertial components of body vectors, all turned by one unit quaternion.

    x + s t + v x t with t = 2 v x x, s and v the quaternion's parts (Markley & Crassidis 2014, eq. 2.125, rearranged).
    """
    axis = jnp.broadcast_to(q[1:], vector_body.shape)
    turned = cross(axis, 2.0 * vector_body)
    return vector_body + (q[0] * turned + cross(axis, turned))


def rotate_inverse(q: Float[Array, "4"], vector_inertial: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    """Body components of inertial vectors."""
    return rotate(conjugate(q), vector_inertial)


def times_vector(q: Float[Array, "4"], vector: Float[Array, "3"]) -> Float[Array, "4"]:
    """Product q (0, v): twice the derivative of an attitude q turning at the body rate v."""
    return jnp.concatenate([-(q[1:] @ vector)[None], q[0] * vector + cross(q[1:], vector)])


def from_rotation_vector(rotation: Float[Array, "*batch 3"]) -> Float[Array, "*batch 4"]:
    """Quaternion of a rotation by |rotation| [rad] about its direction, smooth at zero."""
    square = jnp.sum(rotation * rotation, axis=-1)
    small = square < 1e-8
    angle = jnp.sqrt(jnp.where(small, 1.0, square))
    # sin(a/2)/a and cos(a/2) as series in a^2 below 1e-4 rad: the next terms are under 1e-20.
    sinc = jnp.where(small, 0.5 - square / 48.0, jnp.sin(0.5 * angle) / angle)
    cosine = jnp.where(small, 1.0 - square / 8.0 + square * square / 384.0, jnp.cos(0.5 * angle))
    return jnp.concatenate([cosine[..., None], sinc[..., None] * rotation], axis=-1)


def to_rotation_vector(q: Float[Array, "*batch 4"]) -> Float[Array, "*batch 3"]:
    """Rotation vector of a unit quaternion, of length at most pi [rad], smooth at the identity."""
    q = jnp.where(q[..., :1] < 0.0, -q, q)
    sine = safe_norm(q[..., 1:])
    small = sine < 1e-8
    ratio = jnp.where(
        small, 2.0 / jnp.where(small, q[..., 0], 1.0), 2.0 * jnp.arctan2(sine, q[..., 0]) / jnp.where(small, 1.0, sine)
    )
    return ratio[..., None] * q[..., 1:]


def angle_between(p: Float[Array, "*batch 4"], q: Float[Array, "*batch 4"]) -> Float[Array, "*batch"]:
    """Angle of the rotation from one attitude to the other, in [0, pi] [rad]."""
    return safe_norm(to_rotation_vector(multiply(conjugate(p), q)))


def shortest_turn(a: Float[Array, "3"], b: Float[Array, "3"]) -> Float[Array, "4"]:
    """Least rotation that carries unit vector `a` onto unit vector `b`: half a turn about some axis if opposite."""
    # (1 + cos, sin n) is the quaternion of half the angle, but for its length; no angle and no division by its sine.
    w = 1.0 + jnp.sum(a * b)
    opposite = w < 1e-12
    # Across `a`, where a x b vanishes. Chosen by comparisons, which many cases at once do faster than a look-up.
    size = jnp.abs(a)
    x, y, z = jnp.eye(3, dtype=a.dtype)
    x_least = (size[0] <= size[1]) & (size[0] <= size[2])
    least = jnp.where(x_least, x, jnp.where(size[1] > size[2], z, y))
    axis = jnp.where(opposite, unit(cross(a, least)), cross(a, b))
    return normalize(jnp.concatenate([jnp.where(opposite, 0.0, w)[None], axis]))
