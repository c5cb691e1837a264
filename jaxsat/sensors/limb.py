"""Angles of the Earth's limb as a sensor looking along body x gives them (Penkov et al. 2009, file `tABlimb`).

The paper names the two angles and gives no formula; the zero of the turn and its sign are ours. The Earth is a sphere.
Each function takes one attitude and one position; batch with `jax.vmap`.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.math import angle_between, float_array, quaternion, safe_norm, unit
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import BODY_AXES, NO_TURN, columns_of, in_sensor, shorter_way
from jaxsat.sensors.view import View


def nadir_body(q_inertial_from_body: Float[Array, "4"], position_eci: Float[Array, "3"]) -> Float[Array, "3"]:
    """Unit vector to the Earth's centre, body axes; the position is inertial [m]."""
    return quaternion.rotate_inverse(q_inertial_from_body, -unit(position_eci))


def limb_distance(
    q_inertial_from_body: Float[Array, "4"], position_eci: Float[Array, "3"], earth_radius: float | Float[Array, ""]
) -> Float[Array, ""]:
    """Angle from the limb to body x, angle(x, nadir) - asin(R / r) [rad]: positive outside the Earth's disk.

    Its gradient by the attitude is zero where x points at the nadir or away from it: there the angle has a cusp.
    NaN for a position inside the Earth, which has no limb.
    """
    return _distance(nadir_body(q_inertial_from_body, position_eci), position_eci, earth_radius)


def _distance(nadir, position_eci, earth_radius):
    x_axis = jnp.array([1.0, 0.0, 0.0], dtype=nadir.dtype)
    return angle_between(x_axis, nadir) - jnp.arcsin(earth_radius / safe_norm(position_eci))


def limb_turn(q_inertial_from_body: Float[Array, "4"], position_eci: Float[Array, "3"]) -> Float[Array, ""]:
    """Turn of the limb about body x, atan2(nadir_z, nadir_y) in (-pi, pi] [rad].

    It is zero where the nadir is on the side of body +y, pi/2 on that of +z, and falls as the satellite turns about
    +x. Where x points at the nadir or away from it, to within rounding, there is no such angle: zero, with a zero
    gradient, is returned.
    """
    return _turn(nadir_body(q_inertial_from_body, position_eci))


def _turn(nadir):
    _, y, z = nadir
    pole = y * y + z * z <= jnp.finfo(y.dtype).eps ** 2
    return jnp.arctan2(jnp.where(pole, 0.0, z), jnp.where(pole, 1.0, y))


class LimbSensor(AbstractSensor):
    """The two angles of the limb [rad], `limb_distance` and `limb_turn`, of a sensor that looks along its own x."""

    earth_radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Of the limb, the height of what the sensor sees of the air included [m]."""
    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "3 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Rows are the directions x, y and z of the angles."""
    on_sphere: bool = eqx.field(static=True, default=False)
    """Whether the noise of the turn is that of an angle on the sphere, as that of the distance: a degree of turn moves
    the limb by less the nearer x is to the nadir."""

    def __call__(self, view: View) -> Float[Array, "2"]:
        nadir = columns_of(self.axes, in_sensor(self.turn, view.nadir))
        return jnp.stack([_distance(nadir, view.position_eci, self.earth_radius), _turn(nadir)])

    def difference(self, modelled: Float[Array, "2"], reading: Float[Array, "2"]) -> Float[Array, "2"]:
        """The turn the shorter way round [rad]."""
        return shorter_way(modelled - reading)

    def sharpness(self, view: View) -> float | Float[Array, "2"]:
        """Sine of angle(x, nadir) for the turn: where x points at the nadir there is none, and nothing is asked."""
        if not self.on_sphere:
            return 1.0
        _, y, z = columns_of(self.axes, in_sensor(self.turn, view.nadir))
        return jnp.stack([jnp.ones_like(y), safe_norm(jnp.stack([y, z]))])
