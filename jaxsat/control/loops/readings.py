"""What the sensors of a loop say: the sensors of any satellite, with noise, steps, delay, drop-outs, and the dark.

Noise is of unit normal numbers that are given, so that a case is the same in every company. What is read is turned
back into body axes with the calibration that is known on board, which need not be the true one.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

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
GROSS = 20.0
"""Noise of an outlier over that of other readings."""
LIT = 0.5
"""Visible share of the Sun from which on a Sun sensor tells its direction."""


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


class AbstractChannel(eqx.Module):
    """A sensor of a loop with what disturbs it, written for one satellite; `Channel` for those of satellite files."""

    @property
    @abstractmethod
    def numbers(self) -> tuple[int, int]:
        """Random numbers of a reading: unit normal ones, and uniform ones from 0 to 1."""

    @abstractmethod
    def start(self) -> Any:
        """What it remembers before the first reading."""

    @abstractmethod
    def read(
        self,
        memory: Any,
        motion: Motion,
        here: Instant,
        normal: Float[Array, " _"] | None,
        uniform: Float[Array, " _"] | None,
    ) -> tuple[Any, Any]:
        """The memory after the beginning of a control period, and the reading; without numbers nothing is random."""


class Channel(AbstractChannel):
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
    outliers: Float[Array, ""] = eqx.field(converter=float_array, default=0.0)
    """Probability that a reading has `GROSS` times the noise."""

    @property
    def size(self) -> int:
        """Numbers of a reading."""
        return 4 if isinstance(self.sensor, StarTracker) else self.offset.shape[0]

    @property
    def numbers(self) -> tuple[int, int]:
        return (3 if isinstance(self.sensor, StarTracker) else self.size), 1

    def start(self) -> Late:
        late = self.delay + 1
        none = jnp.array([1.0, 0.0, 0.0, 0.0]) if isinstance(self.sensor, StarTracker) else jnp.zeros(3)
        return Late(jnp.zeros((late, self.size)), jnp.zeros(late, bool), none)

    def read(
        self,
        memory: Late,
        motion: Motion,
        here: Instant,
        normal: Float[Array, " _"] | None,
        uniform: Float[Array, " _"] | None,
    ) -> tuple[Late, Reading]:
        fresh = here.illumination > LIT if isinstance(self.sensor, SunVector) else jnp.asarray(True)
        if uniform is not None and normal is not None:
            fresh = fresh & (uniform[0] >= self.dropout)
            normal = normal * jnp.where(uniform[0] < self.dropout + self.outliers, GROSS, 1.0)
        raw = _disturbed(self, self.sensor(_view(motion, here)), normal)
        raws = jnp.concatenate([raw[None], memory.raw[:-1]])
        freshes = jnp.concatenate([fresh[None], memory.fresh[:-1]])
        value = jnp.where(freshes[-1], _on_board(self, raws[-1]), memory.kept)
        return Late(raws, freshes, value), Reading(value, freshes[-1])


def channel(
    sensor: AbstractSensor,
    *,
    sigma: float = 0.0,
    quantum: float = 0.0,
    delay: int = 0,
    dropout: float = 0.0,
    outliers: float = 0.0,
) -> Channel:
    """A channel whose sensor is as its calibration on board says, all SI.

    Raises ValueError for a sensor that tells no loop anything by itself: see `KINDS`.
    """
    if isinstance(sensor, Magnetometer) and (sensor.unit_vector or sensor.stray is not None):
        raise ValueError("channel: a magnetometer that tells all three components, without stray fields, is needed")
    if not isinstance(sensor, tuple(KINDS.values())):
        raise ValueError(f"channel: no loop sees with {type(sensor).__name__}")
    return Channel(sensor, sigma, quantum, dropout, *_calibration(sensor), delay, outliers)


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


def nothing_yet(channels: Mapping[str, AbstractChannel]) -> dict[str, Any]:
    """What they remember before the first reading."""
    return {name: one.start() for name, one in channels.items()}


def numbers_needed(channels: Mapping[str, AbstractChannel]) -> tuple[int, int]:
    """Random numbers of one control period: normal ones, and uniform ones."""
    normals, uniforms = np.array([(0, 0), *(one.numbers for one in channels.values())]).sum(axis=0)
    return int(normals), int(uniforms)


def read(
    channels: Mapping[str, AbstractChannel],
    memory: Mapping[str, Any],
    motion: Motion,
    here: Instant,
    random: Float[Array, " _"] | None,
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Readings at the beginning of a control period; without `random` numbers there are no noise and no drop-outs.

    `random` holds the normal numbers of all channels, then the uniform ones.
    """
    after, found, normal, uniform = {}, {}, 0, numbers_needed(channels)[0]
    for name, one in channels.items():
        normals, uniforms = one.numbers
        own = (None, None)
        if random is not None:
            own = random[normal : normal + normals], random[uniform : uniform + uniforms]
        normal, uniform = normal + normals, uniform + uniforms
        after[name], found[name] = one.read(memory[name], motion, here, *own)
    return after, found


def _view(motion: Motion, here: Instant) -> View:
    none = jnp.zeros(())
    away = jnp.zeros((1, 3))
    light = LightTable(here.sun_eci, here.illumination, here.sun_eci, none, away, jnp.zeros(1))
    return View(
        attitude=motion.quaternion,
        rate=motion.angular_velocity,
        time=here.time,
        position_eci=here.position_eci,
        velocity_eci=here.velocity_eci,
        b_field_eci=here.b_field_eci,
        light=light,
    )


def _disturbed(one: Channel, raw, normal):
    if isinstance(one.sensor, StarTracker):
        if normal is None:
            return raw
        return quaternion.multiply(raw, quaternion.from_rotation_vector(one.sigma * normal))
    if normal is not None:
        raw = raw + one.sigma * normal
        raw = unit(raw) if isinstance(one.sensor, SunVector) and one.size > 2 else raw
    return stepped(raw, one.quantum)


def _on_board(one: Channel, raw):
    if not isinstance(one.sensor, StarTracker):
        value = one.matrix @ (raw - one.offset)
        return unit(value) if isinstance(one.sensor, SunVector) else value
    q = quaternion.conjugate(raw) if one.sensor.body_from_inertial else raw
    return quaternion.normalize(quaternion.multiply(q, quaternion.conjugate(quaternion.from_dcm(one.matrix))))
