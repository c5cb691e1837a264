"""Whether readings, stamps and commands have the unit that the satellite file says, as far as their size tells."""

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from jaxsat.constants import EARTH_MU
from jaxsat.errors import InputError
from jaxsat.files.units import field_unit
from jaxsat.satellites.model import Model
from jaxsat.sensors import Gyroscope, Magnetometer
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import vectors_of
from jaxsat.telemetry.table.session import Channel
from jaxsat.torques import Coil

OTHER_UNIT = 20.0
"""Times that the field is larger or smaller than bias and scale of a magnetometer can make it."""
MOST_TURNS = 10.0
"""Between two readings, beyond which no motion is followed from one to the other."""
FASTER, LASTS_S = 1.5, 10.0
"""By which a coil may make a satellite turn faster from row to row [rad/s], of rows that are at most so far apart."""


def check_field(problem: Problem, samples: Samples) -> None:
    """Raises `InputError` where a magnetometer reads a field that is of another size than IGRF's by far."""
    for name, channel in samples.channels.items():
        ratio = field_ratio(problem, samples, name)
        if ratio is not None and not 1.0 / OTHER_UNIT < ratio < OTHER_UNIT:
            unit = field_unit(ratio, channel.unit)
            hint = f"; as {unit!r} it would be one" if unit else ""
            reason = f"|B| of {name} is {ratio:.3g} times that of IGRF in the unit {channel.unit!r}{hint}"
            raise InputError(reason, field=f"channels.{name}.unit")


def check_spacing(problem: Problem, samples: Samples) -> None:
    """Raises `InputError` where no motion can be followed from reading to reading, as of stamps in another unit.

    A gyroscope tells of so many turns between two readings that neither its numbers nor the stamps can be right, or
    all readings lie so far apart that the field turns round between them.
    """
    if samples.given is not None or len(samples.t) < 2:
        return
    for name, channel in samples.channels.items():
        turn = _turn_between(channel, problem.model.sensors[name])
        if turn is not None and turn > MOST_TURNS * 2.0 * np.pi:
            apart = float(np.median(np.diff(channel.t_s)))
            reason = (
                f"by {name} the satellite turns {turn / (2.0 * np.pi):.0f} times between readings, which are {apart:g} "
                f's apart: is the unit of the stamps right ([time] unit = "ms"?), or {channel.unit!r}?'
            )
            raise InputError(reason, field="time")
    apart, radius = float(np.median(np.diff(samples.t))), float(np.median(_radius(problem)))
    period = 2.0 * np.pi * float(np.sqrt(radius**3 / EARTH_MU))
    if apart > 0.5 * period:
        reason = f"readings are {apart:g} s apart, in an orbit of {period:.0f} s: is the unit of the stamps right?"
        raise InputError(reason, field="time")


def check_commands(problem: Problem, samples: Samples) -> None:
    """Raises `InputError` where a coil would turn the satellite faster than any turns, as of mA taken for A."""
    craft = problem.model.spacecraft
    slowest = float(np.linalg.eigvalsh(np.asarray(craft.inertia))[0])
    field = float(np.median(np.linalg.norm(np.asarray(problem.sky.b_field_eci)[: len(samples.t)], axis=1)))
    for part in craft.parts:
        if not isinstance(part, Coil):
            continue
        t, current = samples.columns[part.column]
        lasts = min(float(np.median(np.diff(t))) if len(t) > 1 else 0.0, LASTS_S)
        moment = float(np.abs(part.area_turns)) * float(np.abs(current).max())
        faster = moment * field / slowest * lasts
        if faster > FASTER:
            reason = (
                f"the largest command, {np.abs(current).max():g} A, is a dipole of {moment:.3g} A m2, by which the "
                f"satellite turns {np.degrees(faster):.0f} deg/s faster in {lasts:g} s: is the unit of the "
                'column right (unit of its [[coils]], as "mA"), or area_turns_m2?'
            )
            raise InputError(reason, field=part.column)


def _radius(problem: Problem) -> np.ndarray:
    return np.linalg.norm(np.asarray(problem.sky.position_eci), axis=-1)


def _turn_between(channel: Channel, sensor: AbstractSensor) -> float | None:
    """By which the satellite turns between two readings of a gyroscope, in the middle [rad]; None of other sensors."""
    rates = np.linalg.norm(channel.values[np.isfinite(channel.values).all(axis=1)], axis=1)
    if not isinstance(sensor, Gyroscope) or len(rates) < 2:
        return None
    return float(np.median(rates) * np.median(np.diff(channel.t_s)))


def field_ratio(problem: Problem, samples: Samples, name: str) -> float | None:
    """How many times that of IGRF the field of a magnetometer is, in the middle; None where a channel tells no size."""
    sensor = problem.model.sensors[name]
    if not isinstance(sensor, Magnetometer) or sensor.unit_vector:
        return None
    read = vectors_of(samples.values[name], sensor.axes)
    size = np.full(1, np.nan) if read is None else np.linalg.norm(sensor.field_of(read), axis=1)
    if not np.isfinite(size).any():
        return None
    field = np.linalg.norm(np.asarray(problem.sky.b_field_eci)[: len(samples.t)], axis=1)
    return float(np.nanmedian(size / field))


def turns_between(samples: Samples, model: Model) -> list[str]:
    """Remarks on gyroscopes by which the satellite turns by more than half a turn between their readings."""
    found = []
    for name, channel in samples.channels.items():
        turn = _turn_between(channel, model.sensors[name])
        if turn is not None and turn > np.pi:
            unit = f"is its unit {channel.unit!r} right?"
            found.append(f"by {name} the satellite turns by {np.degrees(turn):.0f} deg between readings: {unit}")
    return found
