"""Sun sensor with photocells on the four faces of a truncated pyramid behind a hood (Zhukov 2019, KIAM preprint 9).

Instrument axes: x out along the axis of the pyramid, y and z along the base, across its edges. Faces 1 to 4 look to
+z, -z, +y, -y. Each function takes one direction of the Sun; batch with `jax.vmap`.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import float_array

FACES, DETECTORS = 4, 2


class PyramidSunSensor(eqx.Module):
    """Geometry and brightness of the sensor; the defaults are those of Zhukov 2019."""

    face_angle: Float[Array, ""] = eqx.field(converter=float_array, default=math.radians(22.0))
    """Elevation of the faces' normals above the base, 22 deg [rad]."""
    cutoff_angle: Float[Array, ""] = eqx.field(converter=float_array, default=math.radians(83.0))
    """Angle of incidence from which a face reflects all light, 83 deg [rad]."""
    hood_angle: Float[Array, ""] = eqx.field(converter=float_array, default=math.radians(74.0))
    """Angle of the Sun from the axis beyond which the hood shades the faces, 74 deg [rad]."""
    max_current: Float[Array, ""] = eqx.field(converter=float_array, default=1.0)
    """Current of a detector that the Sun lights square on [A], or 1 where currents are relative."""

    def normals(self) -> Float[Array, "4 3"]:
        """Unit normals of the faces in instrument axes (eq. 1)."""
        s, c = jnp.sin(self.face_angle), jnp.cos(self.face_angle)
        zero = jnp.zeros_like(s)
        return jnp.stack(
            [jnp.stack(row) for row in ([s, zero, c], [s, zero, -c], [s, c, zero], [s, -c, zero])],
        )

    def hood_distance(self) -> Float[Array, ""]:
        """Distance of the hood's edge from the faces' upper edge, in heights of a face (eq. 4)."""
        return jnp.sin(self.face_angle + self.hood_angle) / jnp.cos(self.hood_angle)


def lit_fraction(sensor: PyramidSunSensor, sun_x: Float[Array, ""]) -> Float[Array, ""]:
    """Share of a face that the hood leaves in sunlight (eq. 6) with the Sun at acos(`sun_x`) from the axis; 0 behind.

    Of the plane across the face; beside it the paper neglects what the greater distance of the hood changes.
    """
    x = jnp.clip(sun_x, 0.0, 1.0)
    shaded = x < jnp.cos(sensor.hood_angle)
    # Taken at the hood's edge where nothing is shaded: on the axis the root has no derivative.
    x = jnp.where(shaded, x, jnp.cos(sensor.hood_angle))
    sine = jnp.sqrt(1.0 - x**2)
    share = sensor.hood_distance() * x / (jnp.sin(sensor.face_angle) * x + jnp.cos(sensor.face_angle) * sine)
    return jnp.where(shaded, share, 1.0)


def face_currents(sensor: PyramidSunSensor, sun: Float[Array, "3"]) -> Float[Array, "4"]:
    """Currents of the faces with the Sun in the direction `sun`, a unit vector in instrument axes [A] (eqs. 2 to 7).

    I_max K cos(incidence) below the angle of total reflection, and zero beyond, or with the Sun behind the base.
    """
    cosine = sensor.normals() @ sun
    seen = (cosine > jnp.cos(sensor.cutoff_angle)) & (sun[0] > 0.0)
    return sensor.max_current * lit_fraction(sensor, sun[0]) * jnp.where(seen, cosine, 0.0)


def safe_sqrt(x: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Square root, 0 of what is negative; its derivative there is zero, not NaN."""
    positive = x > 0.0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


def combine_detectors(readings: Float[Array, "4 2"]) -> Float[Array, "4"]:
    """One current of each face from those of its two detectors, either of which may have failed [A].

    Their mean; the larger one alone where the other has less than half of it, as a detector that has failed reads low.
    """
    low, high = jnp.min(readings, axis=-1), jnp.max(readings, axis=-1)
    return jnp.where(low < 0.5 * high, high, 0.5 * (low + high))


def quantize(currents: Float[Array, "*shape"], step: float | Float[Array, ""]) -> Float[Array, "*shape"]:
    """Currents as an analogue-to-digital converter of this `step` [A] gives them, never below zero."""
    return jnp.maximum(jnp.round(currents / step) * step, 0.0)
