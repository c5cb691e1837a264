"""Maps between what a solver may move without limits and what a body can have."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.spacecraft import symmetric_tensor

ENTRIES = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
"""Rows and columns of a tensor's entries xx yy zz xy xz yz."""


def tensor_of(inertia: np.ndarray) -> np.ndarray:
    """[3 3] symmetric tensor from its `ENTRIES` [6], on the host."""
    xx, yy, zz, xy, xz, yz = np.asarray(inertia, dtype=float)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _second_moment(inertia: np.ndarray) -> np.ndarray:
    """[3 3] S = tr(J)/2 I - J of J [6] as xx yy zz xy xz yz."""
    tensor = tensor_of(inertia)
    return 0.5 * np.trace(tensor) * np.eye(3) - tensor


def thinnest(inertia: np.ndarray) -> float:
    """Least principal second moment of mass over the mean one: 1 of a sphere, 0 of a flat body, below that of none."""
    moments = np.linalg.eigvalsh(_second_moment(inertia))
    return float(moments[0] / moments.mean())


def second_moment_root(inertia: np.ndarray) -> np.ndarray:
    """[3 3] lower root L of the second moment of mass S = tr(J)/2 I - J = L L^T; `inertia` [6] as xx yy zz xy xz yz.

    S is positive definite exactly where J is that of a body: positive, and no principal moment above the sum of the
    other two (Wensing, Kim & Slotine 2018). Raises numpy.linalg.LinAlgError where it is not.
    """
    return np.linalg.cholesky(_second_moment(inertia))


def physical_inertia(
    root: Float[Array, "3 3"], root_inverse: Float[Array, "3 3"], shift: Float[Array, "6"]
) -> Float[Array, "6"]:
    """Inertia of a body, to first order `shift` [kg m^2] away from the one whose `second_moment_root` is `root`.

    With S = L (I + X/2)^2 L^T, X = L^-1 dS L^-T, every shift gives a body, and every body is reached. Differentiable.
    """
    change = symmetric_tensor(shift)
    identity = jnp.eye(3, dtype=shift.dtype)
    change = 0.5 * jnp.trace(change) * identity - change
    stretch = root @ (identity + 0.5 * root_inverse @ change @ root_inverse.T)
    second_moment = stretch @ stretch.T
    tensor = jnp.trace(second_moment) * identity - second_moment
    return tensor[ENTRIES]


def inertia_shift(root: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """[6] the shift that `physical_inertia` turns into `inertia` [6], which must be that of a body."""
    inverse = np.linalg.inv(root)
    target = second_moment_root(inertia)
    values, vectors = np.linalg.eigh(inverse @ target @ target.T @ inverse.T)
    change = root @ ((vectors * 2.0 * (np.sqrt(values) - 1.0)) @ vectors.T) @ root.T
    change = np.trace(change) * np.eye(3) - change
    return change[ENTRIES]


def dipole_from_polar(polar: Float[Array, "3"]) -> Float[Array, "3"]:
    """Vector of a dipole from its modulus, azimuth from x towards y, elevation above the xy plane [A m^2, rad, rad]."""
    modulus, azimuth, elevation = polar[0], polar[1], polar[2]
    across = jnp.cos(elevation)
    return modulus * jnp.stack([across * jnp.cos(azimuth), across * jnp.sin(azimuth), jnp.sin(elevation)])


def polar_from_dipole(dipole: Float[Array, "3"]) -> Float[Array, "3"]:
    """The inverse of `dipole_from_polar`; along z the azimuth is 0 and has no slope, at zero no number has one."""
    square = dipole[0] ** 2 + dipole[1] ** 2
    tilted = square > 0.0
    across = jnp.sqrt(jnp.where(tilted, square, 1.0))
    x = jnp.where(tilted, dipole[0], 1.0)
    azimuth = jnp.arctan2(jnp.where(tilted, dipole[1], 0.0), x)
    exists = tilted | (dipole[2] != 0.0)
    modulus = jnp.sqrt(jnp.where(exists, square + dipole[2] ** 2, 1.0))
    elevation = jnp.arctan2(jnp.where(exists, dipole[2], 0.0), jnp.where(tilted, across, jnp.where(exists, 0.0, 1.0)))
    return jnp.stack([jnp.where(exists, modulus, 0.0), azimuth, elevation])


def dipole_from_polar_slopes(polar: np.ndarray) -> np.ndarray:
    """[3 3] derivatives of `dipole_from_polar` by modulus, azimuth and elevation, on the host."""
    modulus, azimuth, elevation = np.asarray(polar, float)
    (sa, ca), (se, ce) = ((np.sin(angle), np.cos(angle)) for angle in (azimuth, elevation))
    by_azimuth, by_elevation = np.array([-ce * sa, ce * ca, 0.0]), np.array([-se * ca, -se * sa, ce])
    return np.column_stack([[ce * ca, ce * sa, se], modulus * by_azimuth, modulus * by_elevation])
