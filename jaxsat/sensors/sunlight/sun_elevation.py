"""Photodiodes that send the elevation of the Sun over their planes: the arcsine of the light that they see."""

import math
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, optional_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.noise import Size, normal_noise
from jaxsat.sensors.sunlight.panels import turned_across
from jaxsat.sensors.sunlight.sun_of_cells import sun_of_cells
from jaxsat.sensors.view import View

STRAIGHT_FROM = math.radians(89.5)
"""Elevation beyond which the arcsine goes straight to a right angle, where its own slope is infinite [rad]."""


def elevation_of_light(light: Float[Array, " n"]) -> Float[Array, " n"]:
    """arcsin(light) within [0, pi/2] [rad], with a finite slope up to the axis and none beyond it."""
    most = math.sin(STRAIGHT_FROM)
    below = jnp.arcsin(jnp.clip(light, 0.0, most))
    share = jnp.clip((light - most) / (1.0 - most), 0.0, 1.0)
    return below + (0.5 * jnp.pi - STRAIGHT_FROM) * share


class SunElevation(AbstractSensor):
    """Elevations of the Sun [rad], pi/2 on the axis, as diodes make them of their light: arcsin(gain x light).

    The light is the cosine of the Sun off the axis times the visible share of its disk, and what the Earth returns,
    which therefore raises the elevation: that of a diode that does not see the Sun too.
    """

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    normals: Float[Array, "n 3"] = eqx.field(converter=float_array)
    """Unit vectors along which each diode looks, body axes."""
    gain: Float[Array, " n"] = eqx.field(converter=float_array)
    """Light of the Sun on the axis over what the satellite takes it for."""
    tilts: Float[Array, "n 2"] | None = eqx.field(converter=optional_array, default=None)
    """Turns of each diode off its place about the two body axes across it [rad]."""
    earthlight: bool = eqx.field(static=True, default=True)

    def __call__(self, view: View) -> Float[Array, " n"]:
        normals = self.tilted_normals()
        light = view.sunlight(normals)
        return elevation_of_light(self.gain * (light + view.earthlight(normals) if self.earthlight else light))

    def tilted_normals(self) -> Float[Array, "n 3"]:
        """Normals with the diodes' tilts."""
        return self.normals if self.tilts is None else turned_across(self.normals, self.tilts)

    def noisy(self, reading: Float[Array, " n"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " n"]:
        """An elevation again: no less than zero, no more than a right angle."""
        return jnp.clip(normal_noise(reading, sigma, key), 0.0, 0.5 * jnp.pi)

    def direct(
        self, readings: Float[np.ndarray, "n diodes"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Directions of the Sun, NaN in the dark and of too few diodes (`sun_of_cells`)."""
        gain, normals = np.asarray(self.gain, float), np.asarray(self.tilted_normals(), float)
        return sun_of_cells(
            np.sin(readings) / gain,
            sigma / np.abs(gain),
            lambda sun: np.maximum(sun @ normals.T, 0.0),
            normals,
            earthlight=self.earthlight,
        )
