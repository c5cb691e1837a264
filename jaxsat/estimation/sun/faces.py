"""Where the Sun is by the lit faces of a `PyramidSunSensor`: as if at positive y and z, and nothing were shaded.

What the published reconstruction and the candidates share; currents are over the largest one.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.sensors.sun_sensor import PyramidSunSensor, safe_sqrt


class Faces(eqx.Module):
    """Currents of one instant, mirrored so that the Sun is on the side of positive y and z."""

    near: Float[Array, "2"]
    """Of the faces that look toward the Sun, z before y."""
    far: Float[Array, "2"]
    """Of those opposite."""
    sign: Float[Array, "2"]
    """Of the Sun's z and y."""
    lit: Int[Array, ""]
    """Faces with a current."""

    def both(self) -> Bool[Array, ""]:
        """Whether faces of both pairs are lit."""
        return (self.near[0] > 0.0) & (self.near[1] > 0.0)

    def signs(self) -> Float[Array, "3"]:
        """Factors that bring a direction back to its own side."""
        return jnp.stack([jnp.ones_like(self.sign[0]), self.sign[1], self.sign[0]])


def mirrored(i: Float[Array, "4"]) -> Faces:
    """Faces by their currents; of a dark pair, or of one whose currents are equal, the sign is positive."""
    # Chosen, not taken as extremes: where both currents of a pair are equal, those would halve the derivative.
    turned = jnp.stack([i[1] > i[0], i[3] > i[2]])
    near, far = jnp.where(turned, i[1::2], i[::2]), jnp.where(turned, i[::2], i[1::2])
    return Faces(near, far, jnp.where(turned, -1.0, 1.0), jnp.sum(i > 0.0))


def by_three(sensor: PyramidSunSensor, faces: Faces) -> Float[Array, "3"]:
    """Direction by both faces of one pair and the nearer one of the other, all but the faintest of four (eq. 7)."""
    near, far = faces.near, faces.far
    pair = jnp.where(far[0] > far[1], near[0] + far[0], near[1] + far[1])
    return by_x(sensor, near, pair / (2.0 * jnp.sin(sensor.face_angle)))


def by_x(sensor: PyramidSunSensor, near: Float[Array, "2"], x: Float[Array, ""]) -> Float[Array, "3"]:
    """Direction of cosine `x` from the axis with these currents of the near faces (eq. 7)."""
    across = (near - x * jnp.sin(sensor.face_angle)) / jnp.cos(sensor.face_angle)
    return jnp.stack([x, across[1], across[0]])


def cosines_by_two(
    sensor: PyramidSunSensor, z_current: Float[Array, ""], y_current: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""], Bool[Array, ""]]:
    """Cosines from the axis, the greater first, at which faces of z and y have these currents, and if any has (15)."""
    s, c = jnp.sin(sensor.face_angle), jnp.cos(sensor.face_angle)
    root = 2.0 * z_current * y_current * s**2 + c**2 * (1.0 + s**2) - z_current**2 - y_current**2
    middle, swing = (z_current + y_current) * s, safe_sqrt(root)
    return (middle + swing) / (1.0 + s**2), (middle - swing) / (1.0 + s**2), root >= 0.0
