"""The Earth's gravity field: EGM2008, or any in fully normalised coefficients, its central term included."""

import functools
from importlib import resources

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_EQUATORIAL_RADIUS, EARTH_MU
from jaxsat.math import float_array, gradient_coefficients, harmonic_sums

EGM2008_DEGREE = 20
"""Highest degree of the bundled coefficients; the model itself goes to 2190."""


class GravityField(eqx.Module):
    """Attraction of a body that turns with its axes, (mu/r) sum (R/r)^n P_nm (C_nm cos m lambda + S_nm sin m lambda).

    The central term is the coefficient C_00 = 1; with C_00 = 0 what remains is the perturbation of it.
    """

    cosine: Float[Array, "n n"]
    """Coefficients C, fully normalised (mean square of each harmonic on the sphere one), [degree, order]."""
    sine: Float[Array, "n n"]
    """Coefficients S."""
    mu: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_MU)
    """Gravitational parameter of the coefficients [m^3/s^2]."""
    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_EQUATORIAL_RADIUS)
    """Reference radius of the coefficients [m]."""

    def __call__(self, position_ecef: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2] at a position [m], both Earth-fixed (Montenbruck & Gill 2000, eq. 3.33)."""
        coefficients = gradient_coefficients(_schmidt_coefficients(self.cosine, self.sine))
        return self.mu / self.radius**2 * harmonic_sums(position_ecef, coefficients, self.radius)

    def potential(self, position_ecef: Float[Array, "3"]) -> Float[Array, ""]:
        """Return the potential [m^2/s^2], positive, whose gradient is the acceleration."""
        coefficients = _schmidt_coefficients(self.cosine, self.sine)[None]
        return self.mu / self.radius * harmonic_sums(position_ecef, coefficients, self.radius)[0]


def egm2008(degree: int, order: int | None = None) -> GravityField:
    """Return EGM2008, tide-free, cut off at `degree` (0 to 20) and `order` (0 to degree; by default the degree).

    egm2008(2, 0) is the oblate Earth of J2, egm2008(8, 0) a zonal one. ValueError outside these ranges. Source:
    Pavlis et al. (2012).
    """
    if not 0 <= degree <= EGM2008_DEGREE:
        raise ValueError(f"degree must be in 0..{EGM2008_DEGREE} (bundled part of EGM2008), got {degree}")
    order = degree if order is None else order
    if not 0 <= order <= degree:
        raise ValueError(f"order must be in 0..{degree} (the degree), got {order}")
    size = degree + 1
    kept = np.arange(size) <= order
    return GravityField(*(jnp.asarray(np.where(kept, table[:size, :size], 0.0)) for table in _egm2008_table()))


@functools.cache
def _egm2008_table() -> tuple[np.ndarray, np.ndarray]:
    text = resources.files("jaxsat.environment").joinpath("egm2008_20.txt").read_text(encoding="ascii")
    cosine, sine = np.zeros((2, EGM2008_DEGREE + 1, EGM2008_DEGREE + 1))
    cosine[0, 0] = 1.0
    for line in text.splitlines():
        if not line.startswith("#"):
            n, m, c, s = line.split()
            cosine[int(n), int(m)], sine[int(n), int(m)] = float(c), float(s)
    return cosine, sine


def _schmidt_coefficients(cosine: Float[Array, "n n"], sine: Float[Array, "n n"]) -> Float[Array, "2 n n"]:
    """Coefficients of the Schmidt semi-normalised harmonics, sqrt(2 n + 1) times the fully normalised ones."""
    factor = np.sqrt(2.0 * np.arange(cosine.shape[0]) + 1.0)
    return jnp.asarray(factor[None, :, None], cosine.dtype) * jnp.stack([cosine, sine])
