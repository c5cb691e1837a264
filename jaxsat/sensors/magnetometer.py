"""Magnetometer: the field in the sensor's axes with scale, shear, bias, and what the satellite's own currents add."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from jaxsat.math import float_array, optional_array, unit
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.mounting import (
    BODY_AXES,
    NO_TURN,
    body_from_sensor,
    columns_of,
    directions_of,
    in_sensor,
    vectors_of,
)
from jaxsat.sensors.noise import Size, normal_noise, unit_noise
from jaxsat.sensors.view import View
from jaxsat.spacecraft import box_normals

TYPICAL_FIELD, FIELD_SPREAD = 3.5e-5, 1.2e-5
"""Of the field in low orbits, mean and standard deviation [T]: what a direction alone leaves open."""


class Magnetometer(AbstractSensor):
    """Three components of the field [T], or only its direction.

    With v the field in the sensor's axes: v' = (diag(scale) + shear) v + bias + stray, then v' / |v'| where only a
    direction is sent, then the columns by `axes`.
    """

    sees: ClassVar[Sight | None] = "field"

    bias: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """[T]"""
    scale: Float[Array, "3"] = eqx.field(converter=float_array, default=(1.0, 1.0, 1.0))
    """Reading over field along each axis."""
    shear: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Off-diagonal entries yz, xz, xy of a symmetric matrix, beside which a turn is another thing."""
    turn: Float[Array, "3"] = eqx.field(converter=float_array, default=NO_TURN)
    """Rotation vector of the sensor's axes from those of the body [rad]."""
    axes: Float[Array, "channels 3"] = eqx.field(converter=float_array, default=BODY_AXES)
    """Row k is the direction that column k reads."""
    stray: Float[Array, "sources 3"] | None = eqx.field(converter=optional_array, default=None)
    """What each source adds, sensor axes [T]: the body faces +x -x +y -y +z -z square in the Sun, or a unit of each of
    `stray_columns`."""
    stray_columns: tuple[str, ...] = eqx.field(static=True, default=())
    """Columns of the telemetry that the stray field follows, such as measured currents, in place of the faces."""
    unit_vector: bool = eqx.field(static=True, default=False)
    """Whether only the direction is sent."""

    def __check_init__(self):
        sources = len(self.stray_columns) or 6
        if self.stray is not None and self.stray.shape[0] != sources:
            raise ValueError(f"Magnetometer.stray: expected {sources} rows, one a source, got {self.stray.shape[0]}")

    @property
    def needs(self) -> frozenset[str]:
        """`light` where the stray field follows it."""
        return frozenset({"light"} if self.stray is not None and not self.stray_columns else ())

    def __call__(self, view: View) -> Float[Array, " channels"]:
        v = in_sensor(self.turn, view.field)
        v = self.scale * v + self._sheared(v) + self.bias
        if self.stray is not None:
            v = v + jnp.sum(self._sources(view)[:, None] * self.stray, axis=0)
        return columns_of(self.axes, unit(v) if self.unit_vector else v)

    def noisy(self, reading: Float[Array, " channels"], sigma: Size, key: PRNGKeyArray) -> Float[Array, " channels"]:
        """A unit vector again where only the direction is sent."""
        return unit_noise(reading, sigma, key) if self.unit_vector else normal_noise(reading, sigma, key)

    def _sheared(self, v):
        (yz, xz, xy), (x, y, z) = self.shear, v
        return jnp.stack([xy * y + xz * z, xy * x + yz * z, xz * x + yz * y])

    def _sources(self, view: View) -> Float[Array, " sources"]:
        if self.stray_columns:
            return jnp.stack([view.columns[name] for name in self.stray_columns])
        return view.sunlight(box_normals())

    def direct(
        self, readings: Float[np.ndarray, "n channels"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]] | None:
        """Directions of the field; a stray field is not known here and widens them."""
        read = vectors_of(readings, self.axes)
        if read is None:
            return None
        bias = np.asarray(self.bias, float)
        back = body_from_sensor(self.turn) @ np.linalg.pinv(self._matrix())
        error = sigma
        if self.stray is not None:
            error = np.hypot(error, self._stray_size() / (TYPICAL_FIELD if self.unit_vector else 1.0))
        if self.unit_vector:
            # How much of a direction is bias depends on the length that it does not tell.
            read, bias = read * _length(read, back, bias)[:, None], np.broadcast_to(bias, read.shape)
            error = np.hypot(error * TYPICAL_FIELD, np.linalg.norm(bias[0]) * FIELD_SPREAD / TYPICAL_FIELD)
        return directions_of((read - bias) @ back.T, float(error * np.linalg.norm(back, 2)))

    def field_of(self, read: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """The field in the sensor's axes by bias, scale and shear as they stand, from vectors that it reads there."""
        return (read - np.asarray(self.bias, float)) @ np.linalg.inv(self._matrix())

    def _matrix(self) -> Float[np.ndarray, "3 3"]:
        yz, xz, xy = np.asarray(self.shear, float)
        return np.diag(np.asarray(self.scale, float)) + np.array([[0, xy, xz], [xy, 0, yz], [xz, yz, 0]])

    def _stray_size(self) -> float:
        # Of columns nobody knows here how large they are.
        return 0.0 if self.stray_columns else float(np.max(np.linalg.norm(np.asarray(self.stray), axis=1)))


def _length(read, back, bias):
    """Length that makes the field behind each direction a typical one: |back (length u - bias)| = `TYPICAL_FIELD`."""
    along, aside = read @ back.T, back @ bias
    a, b, c = np.sum(along**2, axis=1), along @ aside, aside @ aside - TYPICAL_FIELD**2
    return (b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a
