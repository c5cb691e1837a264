"""Whether readings have the unit that the satellite file says, as far as their size tells: asked before a search."""

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from jaxsat.errors import InputError
from jaxsat.files.units import field_unit
from jaxsat.satellites.model import Model
from jaxsat.sensors import Gyroscope, Magnetometer
from jaxsat.sensors.mounting import vectors_of

OTHER_UNIT = 20.0
"""Times that the field is larger or smaller than bias and scale of a magnetometer can make it."""


def check_field(problem: Problem, samples: Samples) -> None:
    """Raises `InputError` where a magnetometer reads a field that is of another size than IGRF's by far."""
    for name, channel in samples.channels.items():
        ratio = field_ratio(problem, samples, name)
        if ratio is not None and not 1.0 / OTHER_UNIT < ratio < OTHER_UNIT:
            unit = field_unit(ratio, channel.unit)
            hint = f"; as {unit!r} it would be one" if unit else ""
            reason = f"|B| of {name} is {ratio:.3g} times that of IGRF in the unit {channel.unit!r}{hint}"
            raise InputError(reason, field=f"channels.{name}.unit")


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
        rates = np.linalg.norm(channel.values[np.isfinite(channel.values).all(axis=1)], axis=1)
        if isinstance(model.sensors[name], Gyroscope) and len(rates) > 1:
            turn = np.degrees(np.median(rates) * np.median(np.diff(channel.t_s)))
            if turn > 180.0:
                unit = f"is its unit {channel.unit!r} right?"
                found.append(f"by {name} the satellite turns by {turn:.0f} deg between readings: {unit}")
    return found
