"""Photodiodes that send the elevation of the Sun over their planes: the arcsine of the light that they see."""

import math
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, optional_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.noise import Size, normal_noise
from jaxsat.sensors.sunlight.panels import axes_across, turned_across
from jaxsat.sensors.sunlight.sun_of_cells import sun_of_cells
from jaxsat.sensors.view import View

STRAIGHT_FROM = math.radians(89.5)
"""Elevation beyond which the arcsine goes straight to a right angle, where its own slope is infinite [rad]."""


HARMONICS, STEEPNESS = 4, 8
"""Of the azimuth in `SunElevation.rim`, and the power of the sine of the Sun's angle off the axis there."""


def rim_share(normal: Float[Array, "3"], sun: Float[Array, "3"], rim: Float[Array, " waves"]) -> Float[Array, ""]:
    """What stands about a diode adds to its sunlight, over that: sin^8(angle) sum (a_m cos m phi + b_m sin m phi).

    The azimuth phi goes from the first of the body axes across the normal to the second, `rim` is a_1, b_1, a_2, ...
    """
    u, v = axes_across(normal) @ sun
    square, total = u * u + v * v, jnp.zeros(())
    cosine, sine = jnp.ones(()), jnp.zeros(())
    for m in range(1, HARMONICS + 1):
        # Powers of u + iv: smooth also on the axis, where there is no azimuth.
        cosine, sine = cosine * u - sine * v, sine * u + cosine * v
        rest = square ** (0.5 * (STEEPNESS - m))
        total = total + rest * (rim[2 * m - 2] * cosine + rim[2 * m - 1] * sine)
    return total


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
    rim: Float[Array, "n waves"] | None = eqx.field(converter=optional_array, default=None)
    """Of what shades a diode at low elevations, or shines into it (`rim_share`), by direction."""
    earthlight: bool = eqx.field(static=True, default=True)

    def __call__(self, view: View) -> Float[Array, " n"]:
        normals = self.tilted_normals()
        light = view.sunlight(normals)
        if self.rim is not None:
            share = jax.vmap(rim_share, in_axes=(0, None, 0))(normals, view.sun, self.rim)
            light = light * jnp.maximum(1.0 + share, 0.0)
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
