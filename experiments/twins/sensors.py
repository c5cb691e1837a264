"""What the sensors of a session would read without noise, and then with it: noise, rounding, gaps and wrong bytes.

A sensor is the dictionary that stands in the truth file. SI throughout; the unit of the table enters in `write`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.twins.earthlight import earthlight
from experiments.twins.motion import Motion, to_inertial
from experiments.twins.world import World

Array = NDArray[np.float64]

FACES = {s + a: (1.0 if s == "+" else -1.0) * np.eye(3)["xyz".index(a)] for a in "xyz" for s in "+-"}
UNITS = {"1": 1.0, "nT": 1e-9, "uT": 1e-6, "deg/s": np.pi / 180.0, "mA": 1e-3}
FLAG, TIMES_RANGE = 999.9, 3.0
"""What wrong bytes look like: a flag in the table's unit, or anything to this many times the largest reading."""


@dataclass(frozen=True)
class Around:
    """A satellite and its surroundings at n instants; vectors in body axes."""

    quaternion: Array
    rate: Array
    field: Array
    sun: Array
    light: Array
    position: Array

    @classmethod
    def at(cls, t: Array, motion: Motion, world: World) -> "Around":
        """Seen at times [n]."""
        quaternion, rate = motion(t)
        inertial = np.stack([world.field(t), world.sun(t)[0], world.position(t)])
        field, sun, position = np.einsum("nij,kni->knj", to_inertial(quaternion), inertial)
        return cls(quaternion, rate, field, sun, world.illumination(t), position)

    def sunlight(self, normals: Array) -> Array:
        """Cosine of the Sun on faces times its visible share [n faces]."""
        return self.light[:, None] * np.maximum(self.sun @ normals.T, 0.0)

    def earthlight(self, normals: Array) -> Array:
        """Scattered light of an Earth of reflectivity one [n faces]."""
        return np.array([earthlight(p, s, normals) for p, s in zip(self.position, self.sun, strict=True)])


def directions(named: list[Any]) -> Array:
    """Unit vectors of faces by name or by components [n 3]."""
    vectors = np.array([FACES[each] if isinstance(each, str) else each for each in named], float)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _normalised(vectors: Array) -> Array:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def magnetometer_vector(sensor: dict[str, Any], around: Around) -> Array:
    """Field as the sensor finds it in its own axes, before noise, loss of size and choice of columns [n 3], T."""
    turned = Rotation.from_rotvec(np.radians(sensor.get("turn_deg", [0.0] * 3))).as_matrix()
    field = around.field @ turned * np.array(sensor.get("scale", [1.0] * 3)) + np.array(sensor["bias"])
    for face, stray in sensor.get("stray", {}).items():
        field = field + around.sunlight(directions([face])) * np.array(stray)
    return field


def response(sensor: dict[str, Any], around: Around, albedo: float) -> Array:
    """Of photodiodes over that to the Sun square on, their gains included [n diodes]."""
    normals = directions(sensor["normals"])
    if sensor["response"] == "power":
        cosine = np.clip(around.sun @ normals.T, -1.0, 1.0)
        rise = 1.0 - (np.arccos(cosine) / np.radians(sensor["limit_deg"])) ** sensor["exponent"]
        direct = around.light[:, None] * np.maximum(rise, 0.0)
    else:
        direct = around.sunlight(normals)
    return np.array(sensor["gain"]) * (direct + albedo * around.earthlight(normals))


def panel_currents(sensor: dict[str, Any], around: Around, albedo: float, t: Array) -> Array:
    """Of panels [n panels], A; while their sum is limited, all are scaled alike."""
    normals = directions(sensor["normals"])
    light = around.sunlight(normals) + albedo * around.earthlight(normals)
    currents = sensor["imax"] * np.array(sensor["gain"]) * light
    start, stop, most = sensor.get("limit", (np.inf, np.inf, np.inf))
    total = currents.sum(axis=1)
    over = (t >= start) & (t < stop) & (total > most)
    return np.where(over, most / np.maximum(total, 1e-12), 1.0)[:, None] * currents


def readings(sensor: dict[str, Any], t: Array, motion: Motion, world: World, albedo: float) -> Array:
    """Without noise at instants of measurement [n], columns in the table's order; NaN where nothing is to be seen."""
    return _columns(sensor, _means(sensor, t, motion, world, albedo))


def _means(sensor: dict[str, Any], t: Array, motion: Motion, world: World, albedo: float) -> Array:
    around = Around.at(t, motion, world)
    match sensor["kind"]:
        case "magnetometer":
            return magnetometer_vector(sensor, around)
        case "gyro":
            return around.rate + np.array(sensor["bias"])
        case "photodiodes":
            return response(sensor, around, albedo)
        case "panels":
            return panel_currents(sensor, around, albedo, t)
        case "sun_vector":
            return np.where(around.light[:, None] > 0.0, around.sun, np.nan)
        case "star_tracker":
            return around.quaternion
    raise ValueError(f"no such kind of sensor: {sensor['kind']}")


def _columns(sensor: dict[str, Any], means: Array) -> Array:
    if sensor.get("unit_vector") or sensor["kind"] == "sun_vector":
        means = _normalised(means)
    return means @ directions(sensor.get("axes", ["+x", "+y", "+z"])).T if sensor["kind"] == "magnetometer" else means


def _noisy(sensor: dict[str, Any], means: Array, rng: np.random.Generator) -> Array:
    noise = sensor["sigma"] * rng.standard_normal(means.shape)
    if sensor["kind"] == "star_tracker":
        # An angle about each body axis.
        turned = Rotation.from_quat(means, scalar_first=True) * Rotation.from_rotvec(noise[:, 1:])
        return turned.as_quat(canonical=True, scalar_first=True)
    if sensor.get("unit_vector"):
        noise = noise * np.linalg.norm(means, axis=1, keepdims=True)
    noisy = means + noise
    return np.maximum(noisy, 0.0) if sensor["kind"] == "panels" else noisy


def _spoil(sensor: dict[str, Any], values: Array, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Puts wrong bytes into some rows of `values`, and says which."""
    spoilt = rng.random(len(values)) < sensor.get("corrupt", 0.0)
    most = np.nanmax(np.abs(values))
    for row in np.flatnonzero(spoilt):
        column = rng.integers(values.shape[1])
        match rng.integers(3):
            case 0:
                values[row, column] = FLAG * UNITS[sensor["unit"]]
            case 1:
                values[row] = -values[row]
            case _:
                values[row, column] = rng.uniform(-TIMES_RANGE, TIMES_RANGE) * most
    return spoilt


def stamps(sensor: dict[str, Any], duration: float) -> Array:
    """Times of a sensor's rows [n], s: every `cadence`, or by turns where that is a list, from its `offset` on."""
    steps = np.atleast_1d(sensor["cadence"])
    t = sensor.get("offset", 0.0) + np.arange(0.0, duration + 1e-9, steps[0])
    if len(steps) > 1:
        t = np.cumsum(np.tile(steps, int(duration / steps.sum()) + 1))
    return t[t <= duration + 1e-9]


def measure(
    sensor: dict[str, Any], motion: Motion, world: World, *, albedo: float, duration: float, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Stamps [n] of the rows due, what the table says there [n columns] (NaN: empty), and the stamps of spoilt ones."""
    t = stamps(sensor, duration)
    values = _columns(sensor, _noisy(sensor, _means(sensor, t - sensor.get("late", 0.0), motion, world, albedo), rng))
    spoilt = _spoil(sensor, values, rng)
    lost = rng.random(len(t)) < sensor.get("dropout", 0.0)
    values[lost] = np.nan
    return t, values, t[spoilt & ~lost]
