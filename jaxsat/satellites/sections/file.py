"""The whole of a satellite file, checked: every wrong key is told at once."""

import difflib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, create_model

from jaxsat.errors import InputError
from jaxsat.files.toml_files import validated, wrong_keys
from jaxsat.files.units import parsed_unit
from jaxsat.satellites.kinds import KINDS
from jaxsat.satellites.kinds.common import SensorKeys
from jaxsat.satellites.kinds.own import own_class, own_keys
from jaxsat.satellites.sections.parts import (
    Body,
    Coil,
    Eddy,
    Light,
    Magnet,
    Reflectivity,
    Residual,
    Rod,
    Surface,
    Thruster,
    Wheel,
)
from jaxsat.satellites.sections.session import (
    ChannelSettings,
    GaugeSettings,
    MotionSettings,
    OrbitSettings,
    RowSettings,
    TimeSettings,
)
from jaxsat.setting_types import Section

MOTION = ("state", "attitude", "rate")
"""Beginnings of names that are those of the motion."""


def _new_name(text: str) -> str:
    if not re.fullmatch(r"[^\s.,]+(\.[^\s.,]+)*", text):
        raise ValueError("expected a name such as gains or rods.y, without spaces and commas")
    if text.split(".")[0] in MOTION:
        raise ValueError(f"{', '.join(MOTION)} are names of the motion")
    return text


Many = Field(strict=False)
NewName = Annotated[str, AfterValidator(_new_name)]


class SatelliteFile(Section):
    """Tables of a satellite file; those of `sensors` are made for each file from the kinds that stand there."""

    name: str | None = None
    body: Body
    magnet: Magnet = Magnet()
    rods: Annotated[tuple[Rod, ...], Many] = ()
    coils: Annotated[tuple[Coil, ...], Many] = ()
    wheels: Annotated[tuple[Wheel, ...], Many] = ()
    thrusters: Annotated[tuple[Thruster, ...], Many] = ()
    residual: Residual | None = None
    eddy: Eddy | None = None
    surface: Surface | None = None
    light: Light = Light()
    albedo: Reflectivity = Reflectivity()
    gauge: GaugeSettings = GaugeSettings()
    orbit: OrbitSettings
    motion: MotionSettings = MotionSettings()
    time: TimeSettings
    rows: RowSettings = RowSettings()
    sensors: Any = Field(default_factory=dict)
    channels: dict[str, ChannelSettings] = Field(default_factory=dict)
    names: dict[str, NewName] = Field(default_factory=dict)
    """What results quote instead of a leaf, or of what leaves begin with, as "cells.gain" = "gains"."""
    aliases: dict[str, Annotated[tuple[str, ...], Many]] = Field(default_factory=dict)
    """What is freed together, whatever the case of its letters."""

    def sensor_keys(self) -> dict[str, SensorKeys]:
        """Sections of the sensors by name."""
        return dict(self.sensors)


def checked(data: Mapping[str, Any], path: Path) -> SatelliteFile:
    """Returns the tables of a file; raises `InputError` with every wrong key."""
    tables = data.get("sensors", {})
    if not isinstance(tables, dict):
        raise InputError("expected tables [sensors.NAME]", file=path, field="sensors")
    kinds, wrong = {}, []
    for name, table in tables.items():
        try:
            kinds[name] = (_keys_of(table, path.parent), ...)
        except ValueError as error:
            wrong.append((f"sensors.{name}.kind", str(error)))
    sensors = create_model("Sensors", __base__=Section, **kinds)
    # What a sensor of no known kind says cannot be checked; all the rest is.
    known = {name: table for name, table in tables.items() if name in kinds}
    model = create_model("SatelliteTables", __base__=SatelliteFile, sensors=(sensors, ...))
    tables_known = {**data, "sensors": known}
    wrong += wrong_keys(model, tables_known)
    if wrong:
        raise_all(wrong, path)
    found = validated(model, tables_known, path)
    wrong = _contradictions(found, set(tables))
    if wrong:
        raise_all(wrong, path)
    return found


def _keys_of(table: Any, folder: Path) -> type[SensorKeys]:
    kind = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(kind, str):
        raise ValueError(f'expected kind = one of {", ".join(KINDS)}, or "module:Class"')
    if ":" in kind:
        return own_keys(own_class(kind, folder))
    if kind not in KINDS:
        raise ValueError(f"unknown kind {kind!r}" + suggestion(kind, KINDS) + ', or "module:Class" of your own')
    return KINDS[kind]


def _contradictions(found: SatelliteFile, names: set[str]) -> list[tuple[str, str]]:
    """What each table allows and the file as a whole does not, as path and reason."""
    wrong = []
    sensors = found.sensor_keys()
    for name in sensors:
        if name not in found.channels:
            wrong.append((f"sensors.{name}", f"has no [channels.{name}], which tells its columns"))
        if "." in name or not name:
            wrong.append((f"sensors.{name}", "a name of a sensor has no dot"))
    for name, channel in found.channels.items():
        if name not in names:
            wrong.append((f"channels.{name}", "belongs to no sensor" + suggestion(name, names)))
        elif name in sensors:
            wrong += [(f"channels.{name}.{key}", reason) for key, reason in _misfits(sensors[name], channel)]
    gauged = ["magnet", *(f"{name}.gain" for name, sensor in sensors.items() if sensor.kind == "panels")]
    for name in found.gauge.hold:
        if name not in gauged:
            wrong.append(("gauge.hold", f"cannot hold {name!r}" + suggestion(name, gauged)))
    if "magnet" in found.gauge.hold and not any(np.ravel(found.magnet.dipole_A_m2.value)):
        wrong.append(("gauge.hold", "a nominal dipole above zero must hold the common scale of inertia and magnet"))
    folded: dict[str, str] = {}
    for name in found.aliases:
        if folded.setdefault(name.casefold(), name) != name:
            wrong.append((f"aliases.{name}", f"is {folded[name.casefold()]!r} but for the case of its letters"))
    if all(found.channels[name].role == "witness" for name in found.channels):
        wrong.append(("channels", "all are witnesses: nothing is left to fit"))
    return wrong


def _misfits(sensor: SensorKeys, channel: ChannelSettings) -> list[tuple[str, str]]:
    wrong = []
    if sensor.columns is not None and len(channel.columns) != sensor.columns:
        wrong.append(("columns", f"expected {sensor.columns} for a {sensor.kind}, found {len(channel.columns)}"))
    wanted, unit = sensor.reading_unit(), parsed_unit(channel.unit)
    if wanted is not None and unit.quantity != wanted:
        hint = "; say what one count is, as in '12.5 nT'" if unit.quantity == "1" and wanted != "1" else ""
        wrong.append(("unit", f"expected a unit of {wanted} for a {sensor.kind}, found {channel.unit!r}{hint}"))
    return wrong


def suggestion(word: str, known: Any) -> str:
    """ "; did you mean ...?" or what there is."""
    close = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {close[0]!r}?" if close else f"; expected one of {', '.join(known)}"


def raise_all(wrong: list[tuple[str, str]], path: Path) -> None:
    """One error that tells all."""
    (field, reason), *others = wrong
    tail = "".join(f"; {place}: {why}" for place, why in others)
    raise InputError(reason + tail, file=path, field=field)
