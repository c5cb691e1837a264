"""Direction of the Sun from the four currents of a `PyramidSunSensor`, as Zhukov 2019 has it.

Exact within 60.3 deg of the axis. Beyond, two currents have two solutions, of which the nearer one to the axis is taken
if it is possible at all, and the hood is ignored: errors reach 57.7 deg.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxsat.estimation.sun.faces import by_three, by_x, cosines_by_two, mirrored
from jaxsat.math import unit
from jaxsat.sensors.sun_sensor import PyramidSunSensor, safe_sqrt


class SunReading(eqx.Module):
    """What the currents of one instant say."""

    direction: Float[Array, "3"]
    """Unit vector to the Sun in instrument axes; the axis itself where no face is lit."""
    lit: Int[Array, ""]
    """Faces with a current: 0 is a Sun out of the field of view."""


def two_current_limit(sensor: PyramidSunSensor) -> Float[Array, ""]:
    """Least angle from the axis at which only two faces are lit, 20.455 deg [rad] (eq. 12)."""
    a = jnp.sqrt(2.0) * jnp.tan(sensor.face_angle)
    b = jnp.sqrt(2.0) * jnp.cos(sensor.cutoff_angle) / jnp.cos(sensor.face_angle)
    return jnp.arccos((a * b + jnp.sqrt(a**2 - b**2 + 1.0)) / (a**2 + 1.0))


def published_direction(
    sensor: PyramidSunSensor, currents: Float[Array, "4"], *, threshold: float | Float[Array, ""] = 0.0
) -> SunReading:
    """Direction of the Sun by the number of currents above `threshold` [A] (Zhukov 2019, pp. 11-17).

    Four: the faintest is one too many. Three: linear (eq. 7). Two of neighbours: eq. 15 with a plus, failing its checks
    with a minus, failing them again in the plane of the base. One: eq. 20 in the plane of the face. Two of opposite
    faces, which only failures make, leave the component across them unknown: zero is taken.
    """
    s, c = jnp.sin(sensor.face_angle), jnp.cos(sensor.face_angle)
    i = jnp.where(currents > threshold, currents / sensor.max_current, 0.0)
    faces = mirrored(i)
    near, lit = faces.near, faces.lit
    three = by_three(sensor, faces)

    limit = jnp.cos(two_current_limit(sensor))
    inner, outer, solvable = cosines_by_two(sensor, near[0], near[1])
    plus, minus, flat_on_base = (by_x(sensor, near, x) for x in (inner, outer, jnp.zeros_like(inner)))

    def possible(v):
        return solvable & (v[0] >= 0.0) & (v[0] < limit) & (v[1] > 0.0) & (v[2] > 0.0)

    two = jnp.where(possible(plus), plus, jnp.where(possible(minus), minus, flat_on_base))

    only = jnp.maximum(near[0], near[1])
    toward = only * c + s * safe_sqrt(1.0 - only**2)
    x1 = jnp.maximum((only - toward * c) / s, 0.0)
    one = jnp.where(near[0] > near[1], jnp.stack([x1, 0.0 * x1, toward]), jnp.stack([x1, toward, 0.0 * x1]))

    neighbours = (lit == 2) & faces.both()
    opposite = (lit == 2) & ~neighbours
    found = jnp.where(lit >= 3, three, jnp.where(neighbours, two, one))
    flat = jnp.where(near[0] > 0.0, jnp.array([1.0, 0.0, 1.0]), jnp.array([1.0, 1.0, 0.0]))
    found = jnp.where(opposite, three * flat, found) * faces.signs()
    axis = jnp.array([1.0, 0.0, 0.0])
    return SunReading(unit(jnp.where(lit > 0, found, axis)), lit)
