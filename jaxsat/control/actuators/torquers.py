"""Magnetorquers about any axes: from a wanted dipole to what each of them is switched to."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import float_array

Numbers = np.ndarray | Sequence | float | int
"""One for all, or one each."""


class Magnetorquers(eqx.Module):
    """Coils and rods with a dipole up to a largest one, each along its own axis."""

    axes: Float[Array, "torquers 3"] = eqx.field(converter=float_array)
    """Unit vectors of their dipoles, body axes."""
    max_dipole: Float[Array, " torquers"] = eqx.field(converter=float_array)
    """Of each [A m^2]."""
    residual: Float[Array, " torquers"] = eqx.field(converter=float_array)
    """Share of the dipole that is left when one is switched off: 0 of a coil without core."""
    shares: Float[Array, "torquers 3"] = eqx.field(converter=float_array)
    """What each takes of a dipole in body axes, the least squares of all."""

    @staticmethod
    def along(axes: Numbers, max_dipole: Numbers, residual: Numbers = 0.0) -> "Magnetorquers":
        """Those along these axes [torquers 3], which are made unit vectors."""
        units, shares = along_axes(axes)
        count = (len(units),)
        return Magnetorquers(units, np.broadcast_to(max_dipole, count), np.broadcast_to(residual, count), shares)

    def dipole(self, dipoles: Float[Array, " torquers"]) -> Float[Array, "3"]:
        """Sum of their dipoles, body axes [A m^2]."""
        return dipoles @ self.axes


def along_axes(axes: Numbers) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors [actuators 3] of axes, and what each takes of a vector in body axes, the least squares of all."""
    given = np.asarray(axes, float)
    units = given / np.linalg.norm(given, axis=1, keepdims=True)
    return units, np.linalg.pinv(units).T


def torquer_dipoles(torquers: Magnetorquers, dipole_body: Float[Array, "3"]) -> Float[Array, " torquers"]:
    """Dipole of each [A m^2] for a wanted one, each cut at its own largest.

    Of torquers at right angles the power that a damping law takes from the turn keeps its sign so, axis by axis.
    """
    return jnp.clip(torquers.shares @ dipole_body, -torquers.max_dipole, torquers.max_dipole)
