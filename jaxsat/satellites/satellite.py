"""A satellite as its file describes it: the model that a fit starts from, what may be fitted, how its table is read."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, final

from jaxsat.errors import InputError
from jaxsat.satellites.sections.file import SatelliteFile, checked
from jaxsat.satellites.sections.parts import Coil, Thruster, Wheel
from jaxsat.satellites.sections.session import (
    ChannelSettings,
    MotionSettings,
    OrbitSettings,
    RowSettings,
    TimeSettings,
)

if TYPE_CHECKING:
    from jaxsat.satellites.model import Leaf, Model

Convention = Literal["unknown", "mirrored"]
Shadow = Literal["cone", "cylinder"]


@final
@dataclass(frozen=True)
class Satellite:
    """A satellite with its sensors, nominal values, and what is needed to read its telemetry."""

    name: str
    path: Path
    model: "Model"
    """Nominal values, SI."""
    leaves: tuple["Leaf", ...]
    """Every number of the model that may be fitted, in the order of the file."""
    channels: Mapping[str, ChannelSettings]
    """By the name of the sensor."""
    time: TimeSettings
    rows: RowSettings
    orbit: OrbitSettings
    motion: MotionSettings
    conventions: Mapping[str, Convention] = field(default_factory=dict)
    """Sensors whose axes are not known: which of them are tried. Those of the model are the body's."""
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """What is freed together: names of leaves, or of what they begin with, by a name for all of them."""
    shadow: Shadow = "cone"
    """The Earth's: see `Light`."""
    held: tuple[str, ...] = ()
    """Whose size is held by definition: see `GaugeSettings`."""
    size_m: tuple[float, float, float] | None = None
    """Edges of the body along its axes, where the file gives them."""
    columns: Mapping[str, str] = field(default_factory=dict)
    """Units of further columns that the model reads, commands and measured currents, by name."""
    coils: tuple[Coil, ...] = ()
    wheels: tuple[Wheel, ...] = ()
    thrusters: tuple[Thruster, ...] = ()
    """As the file has them; `jaxsat.satellites.actuators` makes them what control laws command."""
    tables: Mapping[str, Any] = field(default_factory=dict)
    """The file's own, as they were read."""


def describes_sensors(data: Mapping[str, Any]) -> bool:
    """Whether the tables are those of a satellite with sensors of its own, and not of Munin's numbers."""
    return "body" in data or "sensors" in data


def satellite_of(data: Mapping[str, Any], path: Path) -> Satellite:
    """Returns the satellite of a file's tables; raises `InputError` naming every wrong key."""
    file = checked(data, path)
    try:
        return replace(_built(file, path), tables=data)
    except InputError as error:
        raise InputError(error.reason, file=path, field=error.field) from None


def _built(file: SatelliteFile, path: Path) -> Satellite:
    # The keys of a file are checked without JAX: what is wrong with them comes at once.
    from jaxsat.satellites.kinds.own import OwnKeys
    from jaxsat.satellites.kinds.trial import try_sensor
    from jaxsat.satellites.leaves import LeafList, as_array
    from jaxsat.satellites.model import Model
    from jaxsat.satellites.names import with_names
    from jaxsat.satellites.parts import built_albedo, built_spacecraft

    leaves = LeafList()
    craft, albedo = built_spacecraft(file, leaves), built_albedo(file, leaves)
    sensors, delays, columns = {}, {}, _columns(file)
    for name, keys in file.sensor_keys().items():
        sensors[name] = keys.built(name, leaves)
        if isinstance(keys, OwnKeys):
            try_sensor(sensors[name], name, len(file.channels[name].columns), columns)
        delay = file.channels[name].delay_s
        leaves.add(f"{name}.delay", f"delays.{name}", delay, unit="s", loose=1.0)
        delays[name] = as_array(delay)
    model = Model(spacecraft=craft, sensors=sensors, albedo=albedo, delays=delays)
    return Satellite(
        name=file.name or path.name.removesuffix(".toml").removesuffix(".sat"),
        path=path,
        model=model,
        leaves=with_names(leaves.found, file.names, path),
        channels=file.channels,
        time=file.time,
        rows=file.rows,
        orbit=file.orbit,
        motion=file.motion,
        conventions=_conventions(file),
        aliases=file.aliases,
        shadow=file.light.shadow,
        held=file.gauge.hold,
        size_m=file.body.size_m,
        columns=columns,
        coils=file.coils,
        wheels=file.wheels,
        thrusters=file.thrusters,
    )


def _conventions(file: SatelliteFile) -> dict[str, Convention]:
    axes = {name: getattr(keys, "axes", None) for name, keys in file.sensor_keys().items()}
    return {name: found for name, found in axes.items() if found in ("unknown", "mirrored")}


def _columns(file: SatelliteFile) -> dict[str, str]:
    found = {part.column: part.unit for part in (*file.coils, *file.wheels) if part.column is not None}
    for keys in file.sensor_keys().values():
        stray = getattr(keys, "stray", None)
        if stray is not None:
            found |= dict.fromkeys(stray.columns, stray.column_unit)
    return found
