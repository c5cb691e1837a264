"""Whether readings have the unit that the satellite file says, as far as their size tells: asked before a search."""

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from jaxsat.errors import InputError
from jaxsat.files.units import FIELD_UNITS, parsed_unit
from jaxsat.satellites.model import Model
from jaxsat.sensors import Gyroscope, Magnetometer
from jaxsat.sensors.mounting import vectors_of

OTHER_UNIT = 20.0
"""Times that the field is larger or smaller than bias and scale of a magnetometer can make it."""


def check_field(problem: Problem, samples: Samples) -> None:
    """Raises `InputError` where a magnetometer reads a field that is of another size than IGRF's by far."""
    field = np.linalg.norm(np.asarray(problem.sky.b_field_eci)[: len(samples.t)], axis=1)
    for name, channel in samples.channels.items():
        sensor = problem.model.sensors[name]
        if not isinstance(sensor, Magnetometer) or sensor.unit_vector:
            continue
        read = vectors_of(samples.values[name], sensor.axes)
        if read is None:
            continue
        size = np.linalg.norm(sensor.field_of(read), axis=1)
        ratio = float(np.nanmedian(size / field)) if np.isfinite(size).any() else 1.0
        if not 1.0 / OTHER_UNIT < ratio < OTHER_UNIT:
            written = parsed_unit(channel.unit).factor
            fits = [unit for unit in FIELD_UNITS if 0.7 < ratio * parsed_unit(unit).factor / written < 1.4]
            hint = f"; as {fits[0]!r} it would be one" if fits else ""
            reason = f"|B| of {name} is {ratio:.3g} times that of IGRF in the unit {channel.unit!r}{hint}"
            raise InputError(reason, field=f"channels.{name}.unit")


def turns_between(samples: Samples, model: Model) -> list[str]:
    """Remarks on gyroscopes by which the satellite turns by more than half a turn between their readings."""
    found = []
    for name, channel in samples.channels.items():
        if isinstance(model.sensors[name], Gyroscope) and len(channel.t_s) > 1:
            rate = np.nanmedian(np.linalg.norm(channel.values, axis=1))
            turn = np.degrees(rate * np.median(np.diff(channel.t_s)))
            if turn > 180.0:
                unit = f"is its unit {channel.unit!r} right?"
                found.append(f"by {name} the satellite turns by {turn:.0f} deg between readings: {unit}")
    return found
