"""What the sensors of a loop say: the sensors of any satellite, with noise, steps, delay, drop-outs, and the dark.

Noise is of unit normal numbers that are given, so that a case is the same in every company. What is read is turned
back into body axes with the calibration that is known on board, which need not be the true one.
"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxsat.control.loops.timeline import Instant
from jaxsat.control.loops.vehicle import Motion
from jaxsat.environment import LightTable
from jaxsat.math import float_array, quaternion, unit
from jaxsat.sensors import Gyroscope, Magnetometer, StarTracker, SunVector, View
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import body_from_sensor
from jaxsat.sensors.noise import stepped

KINDS: Mapping[str, type[AbstractSensor]] = {
    "field": Magnetometer,
    "rate": Gyroscope,
    "sun": SunVector,
    "attitude": StarTracker,
}
"""Sensors that a loop can have, by what it sees with them."""
LIT = 0.5
"""Visible share of the Sun from which on a Sun sensor tells its direction."""


class Channel(eqx.Module):
    """A sensor as it is, what disturbs its readings, and the calibration that is known on board."""

    sensor: AbstractSensor
    sigma: Float[Array, ""] = eqx.field(converter=float_array)
    """1-sigma of the noise of each number, SI."""
    quantum: Float[Array, ""] = eqx.field(converter=float_array)
    """Step of the digits, SI; 0 for none."""
    dropout: Float[Array, ""] = eqx.field(converter=float_array)
    """Probability that a reading does not come."""
    matrix: Float[Array, "3 _"] = eqx.field(converter=float_array)
    """Body components of readings less their offset; of an attitude the sensor's turn as a matrix."""
    offset: Float[Array, " _"] = eqx.field(converter=float_array)
    """What is taken off a reading."""
    delay: int = eqx.field(static=True, default=0)
    """Control periods by which a reading is late."""

    @property
    def size(self) -> int:
        """Numbers of a reading."""
        return 4 if isinstance(self.sensor, StarTracker) else self.offset.shape[0]


def channel(
    sensor: AbstractSensor, *, sigma: float = 0.0, quantum: float = 0.0, delay: int = 0, dropout: float = 0.0
) -> Channel:
    """A channel whose sensor is as its calibration on board says, all SI.

    Raises ValueError for a sensor that tells no loop anything by itself: see `KINDS`.
    """
    if isinstance(sensor, Magnetometer) and (sensor.unit_vector or sensor.stray is not None):
        raise ValueError("channel: a magnetometer that tells all three components, without stray fields, is needed")
    if not isinstance(sensor, tuple(KINDS.values())):
        raise ValueError(f"channel: no loop sees with {type(sensor).__name__}")
    return Channel(sensor, sigma, quantum, dropout, *_calibration(sensor), delay)


def _calibration(sensor) -> tuple[np.ndarray, np.ndarray]:
    turn = body_from_sensor(sensor.turn)
    if isinstance(sensor, StarTracker):
        return turn, np.zeros(3)
    rows = np.asarray(sensor.axes, float)
    if np.linalg.matrix_rank(rows) < 3:
        raise ValueError(f"channel: the columns of {type(sensor).__name__} do not span the body's axes")
    if isinstance(sensor, SunVector):
        return turn @ np.linalg.pinv(rows), np.zeros(len(rows))
    scale = np.diag(np.asarray(sensor.scale, float))
    if isinstance(sensor, Magnetometer):
        yz, xz, xy = np.asarray(sensor.shear, float)
        scale = scale + np.array([[0, xy, xz], [xy, 0, yz], [xz, yz, 0]])
    return turn @ np.linalg.inv(scale) @ np.linalg.pinv(rows), rows @ np.asarray(sensor.bias, float)


class Reading(eqx.Module):
    """The last reading of a sensor."""

    value: Float[Array, " _"]
    """Body axes, SI; of an attitude the quaternion inertial-from-body."""
    fresh: Bool[Array, ""]
    """Whether it came in this control period."""


class Late(eqx.Module):
    """Readings under way: the newest first."""

    raw: Float[Array, "late _"]
    fresh: Bool[Array, " late"]
    kept: Float[Array, " _"]
    """The last one that came, as a `Reading` has it."""


def nothing_yet(channels: Mapping[str, Channel]) -> dict[str, Late]:
    """Before the first reading."""
    found = {}
    for name, one in channels.items():
        late = one.delay + 1
        kept = jnp.array([1.0, 0.0, 0.0, 0.0]) if name == "attitude" else jnp.zeros(3)
        found[name] = Late(jnp.zeros((late, one.size)), jnp.zeros(late, bool), kept)
    return found


def numbers_needed(channels: Mapping[str, Channel]) -> int:
    """Random numbers of one control period: a normal one for each number read, a uniform one for each sensor."""
    return sum(_normals(name, one) + 1 for name, one in channels.items())


def _normals(name: str, one: Channel) -> int:
    return 3 if name == "attitude" else one.size


def read(
    channels: Mapping[str, Channel],
    late: Mapping[str, Late],
    motion: Motion,
    here: Instant,
    random: Float[Array, " _"] | None,
) -> tuple[dict[str, Late], dict[str, Reading]]:
    """Readings at the beginning of a control period; without `random` numbers there are no noise and no drop-outs.

    `random` holds the normal numbers of all channels, then the uniform ones.
    """
    none = jnp.zeros(())
    away = jnp.zeros((1, 3))
    light = LightTable(here.sun_eci, here.illumination, here.sun_eci, none, away, jnp.zeros(1))
    view = View(
        attitude=motion.quaternion,
        rate=motion.angular_velocity,
        time=here.time,
        position_eci=here.position_eci,
        velocity_eci=here.velocity_eci,
        b_field_eci=here.b_field_eci,
        light=light,
    )
    taken, after, found = 0, {}, {}
    for number, (name, one) in enumerate(channels.items()):
        count = _normals(name, one)
        raw, fresh = one.sensor(view), jnp.asarray(True)
        if name == "sun":
            fresh = here.illumination > LIT
        raw = _disturbed(name, one, raw, None if random is None else random[taken : taken + count])
        if random is not None:
            fresh = fresh & (random[number - len(channels)] >= one.dropout)
        taken += count
        before = late[name]
        raws = jnp.concatenate([raw[None], before.raw[:-1]])
        freshes = jnp.concatenate([fresh[None], before.fresh[:-1]])
        value = jnp.where(freshes[-1], _on_board(name, one, raws[-1]), before.kept)
        after[name] = Late(raws, freshes, value)
        found[name] = Reading(value, freshes[-1])
    return after, found


def _disturbed(name: str, one: Channel, raw, normal):
    if name == "attitude":
        if normal is None:
            return raw
        return quaternion.multiply(raw, quaternion.from_rotation_vector(one.sigma * normal))
    if normal is not None:
        raw = raw + one.sigma * normal
        raw = unit(raw) if name == "sun" and one.size > 2 else raw
    return stepped(raw, one.quantum)


def _on_board(name: str, one: Channel, raw):
    if name != "attitude":
        value = one.matrix @ (raw - one.offset)
        return unit(value) if name == "sun" else value
    assert isinstance(one.sensor, StarTracker)
    q = quaternion.conjugate(raw) if one.sensor.body_from_inertial else raw
    return quaternion.normalize(quaternion.multiply(q, quaternion.conjugate(quaternion.from_dcm(one.matrix))))
