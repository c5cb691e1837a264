"""The sensors of a satellite file as a loop has them, with the noise of their channels."""

from collections.abc import Mapping

from jaxsat.control.loops.readings import KINDS, Channel, channel
from jaxsat.errors import InputError
from jaxsat.files.units import parsed_unit
from jaxsat.satellites import Satellite

WORDS: Mapping[str, str] = {
    "field": "magnetometer",
    "rate": "gyro",
    "sun": "sun_vector",
    "attitude": "star_tracker",
}
"""Kinds of the satellite file."""


def channels_of(
    satellite: Satellite, wanted: tuple[str, ...], *, period_s: float, dropout: float = 0.0, outliers: float = 0.0
) -> tuple[dict[str, Channel], dict[str, str]]:
    """The first sensor for each of what is `wanted`, and its name in the file.

    Noise, steps and delay are those of its channel, the delay in whole control periods; a gyro has no outliers. Raises
    `InputError` where the file has no such sensor, or one that no loop can use.
    """
    channels: dict[str, Channel] = {}
    names: dict[str, str] = {}
    for sight in wanted:
        found = [name for name, sensor in satellite.model.sensors.items() if isinstance(sensor, KINDS[sight])]
        if not found:
            raise InputError(f'has no sensor of kind "{WORDS[sight]}", which is needed here', file=satellite.path)
        name = found[0]
        settings = satellite.channels[name]
        unit = parsed_unit(settings.unit).factor
        late = float(settings.delay_s.value)
        if late < 0.0:
            raise InputError("expected none below zero", file=satellite.path, field=f"channels.{name}.delay_s")
        try:
            channels[sight] = channel(
                satellite.model.sensors[name],
                sigma=(settings.sigma or 0.0) * unit,
                quantum=(settings.quantum or 0.0) * unit,
                delay=round(late / period_s),
                dropout=dropout,
                outliers=0.0 if sight == "rate" else outliers,
            )
        except ValueError as error:
            raise InputError(str(error), file=satellite.path, field=f"sensors.{name}") from None
        names[sight] = name
    return channels, names


def has_star_tracker(satellite: Satellite) -> bool:
    """Whether a sensor of the file tells the attitude itself."""
    return any(isinstance(sensor, KINDS["attitude"]) for sensor in satellite.model.sensors.values())
