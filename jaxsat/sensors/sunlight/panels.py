"""Currents of any number of solar panels as a sensor of the Sun."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, optional_array, quaternion
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.noise import Size, normal_noise
from jaxsat.sensors.sunlight.sun_of_cells import sun_of_cells
from jaxsat.sensors.view import View

DIMMING = 0.3
"""1-sigma of what a full battery takes off all currents alike, over the Sun's: for directions alone."""


def axes_across(normal: Float[Array, "3"]) -> Float[Array, "2 3"]:
    """The two body axes that are farthest from a normal, x before y before z, without their parts along it.

    For a panel of a box they are its `TILT_AXES`.
    """
    size = jnp.abs(normal)
    x, y, z = jnp.eye(3, dtype=normal.dtype)
    # By comparisons: no sort can stand in a program of one function.
    z_nearest = (size[2] >= size[0]) & (size[2] >= size[1])
    x_nearest = ~z_nearest & (size[0] > size[1])
    two = jnp.stack([jnp.where(x_nearest, y, x), jnp.where(z_nearest, y, z)])
    return two - (two @ normal)[:, None] * normal[None, :]


def turned_across(normals: Float[Array, "n 3"], tilts: Float[Array, "n 2"]) -> Float[Array, "n 3"]:
    """Unit vectors, each turned about its `axes_across` by its tilts [rad]."""
    turns = jnp.sum(tilts[:, :, None] * jax.vmap(axes_across)(normals), axis=1)
    return jax.vmap(quaternion.rotate)(quaternion.from_rotation_vector(turns), normals)


class Panels(AbstractSensor):
    """Currents of flat panels [A]: largest current x gain x (cosine of the Sun x share of its disk + earthlight)."""

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    normals: Float[Array, "n 3"] = eqx.field(converter=float_array)
    """Outward unit normals, body axes."""
    max_current: Float[Array, ""] = eqx.field(converter=float_array)
    """Current of a panel of gain one that faces the Sun [A]."""
    gain: Float[Array, " n"] = eqx.field(converter=float_array)
    """Current of each over that, at equal light."""
    tilts: Float[Array, "n 2"] | None = eqx.field(converter=optional_array, default=None)
    """Turns of each panel off its place about its `axes_across` [rad]."""
    earthlight: bool = eqx.field(static=True, default=True)

    def __call__(self, view: View) -> Float[Array, " n"]:
        normals = self.tilted_normals()
        light = view.sunlight(normals)
        return self.max_current * self.gain * (light + view.earthlight(normals) if self.earthlight else light)

    def noisy(self, reading: Float[Array, " n"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " n"]:
        """No current is below zero, and panels without light tell zero, as those of `current_readings`."""
        return jnp.maximum(jnp.where(reading > 0.0, normal_noise(reading, sigma, key), 0.0), 0.0)

    def tilted_normals(self) -> Float[Array, "n 3"]:
        """Normals with the panels' tilts."""
        return self.normals if self.tilts is None else turned_across(self.normals, self.tilts)

    def direct(
        self, readings: Float[np.ndarray, "n panels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Directions of the Sun, NaN in the dark (`sun_of_cells`): by the currents' ratios more than by their sizes."""
        full = np.asarray(self.max_current, float) * np.asarray(self.gain, float)
        # Most have no tilt, and JAX outside a compiled program takes a tenth of a second to turn by nothing.
        flat = self.tilts is None or not np.any(np.asarray(self.tilts))
        normals = np.asarray(self.normals if flat else self.tilted_normals(), float)
        return sun_of_cells(
            readings / full,
            sigma / np.abs(full),
            lambda sun: np.maximum(sun @ normals.T, 0.0),
            normals,
            earthlight=self.earthlight,
            dimming=DIMMING,
        )
