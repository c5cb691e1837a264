"""A simulated session as the table that its satellite file describes: columns, units, stamps."""

import math
from decimal import Decimal

import equinox as eqx
import erfa
import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.files.conditions import parsed_condition
from jaxsat.files.csv_files import csv_numbers
from jaxsat.files.units import parsed_unit
from jaxsat.frames import dcms_eci_from_gcrf
from jaxsat.satellites.sections.session import ChannelSettings
from jaxsat.synthetic.twins.twin import Twin
from jaxsat.telemetry.table.axes import about_pole
from jaxsat.telemetry.table.rows import named_columns
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angles

_UNIX_0 = 2440587.5
_PER_SECOND = {"s": 0, "ms": 3, "us": 6, "ns": 9}
"""Decimal digits between a second and the unit of stamps."""
_FINER = 50.0
"""Numbers without a step are written to a part of their noise that nobody sees."""


def table_text(twin: Twin) -> str:
    """Returns the CSV of a session; a cell is empty where nothing was measured then."""
    satellite = twin.satellite
    commanded = [t[(t >= 0.0) & (t <= twin.settings.duration_s)] for t, _ in twin.columns.values()]
    t = np.unique(np.round(np.concatenate([*(each.stamp_s for each in twin.channels.values()), *commanded]), 9))
    cells = {satellite.time.column: stamps(twin, t)}
    for name, each in twin.channels.items():
        settings = satellite.channels[name]
        # Of two readings with one stamp the later stays, as in a register that is written over.
        places = np.searchsorted(t, each.stamp_s)
        for k, column in enumerate(settings.columns):
            if column:
                cells[column] = _placed(len(t), places, _numbers(each.values[:, k], settings))
    cells |= _motion_cells(twin, t) | _position_cells(twin, t)
    for name, unit in satellite.columns.items():
        cells[name] = _plain(_held(twin, name, t) / parsed_unit(unit).factor)
    # Conditions on rows are met by what is not measured.
    for name in named_columns(satellite, [parsed_condition(text) for text in satellite.rows.keep]):
        cells.setdefault(name, [""] * len(t))
    lines = [",".join(cells), *(",".join(row) for row in zip(*cells.values(), strict=True))]
    return "\n".join(lines) + "\n"


def stamps(twin: Twin, t_s: np.ndarray) -> list[str]:
    """Returns the stamps of times [s] in the form of the satellite file, on its clock."""
    settings = twin.satellite.time
    on_clock = t_s + settings.offset_s
    if settings.form == "iso":
        fine = np.any(np.abs(np.round(on_clock, 3) - on_clock) > 1e-9)
        return [f"{text}Z" for text in twin.epoch.iso_texts(on_clock, 9 if fine else 3)]
    if settings.form == "seconds":
        assert settings.epoch is not None
        seconds = twin.epoch.seconds_since(Epoch.from_iso(settings.epoch)) + on_clock
    else:
        tai1, tai2 = twin.epoch.tai()
        utc1, utc2 = erfa.taiutc(tai1, tai2 + on_clock / SECONDS_PER_DAY)
        seconds = ((utc1 - _UNIX_0) + utc2) * SECONDS_PER_DAY
    digits = _PER_SECOND[settings.unit]
    # Microseconds are what such a number of days has room for.
    return [_short(f"{Decimal(f'{second:.6f}').scaleb(digits):f}") for second in seconds]


def _short(text: str) -> str:
    return text.rstrip("0").rstrip(".") if "." in text else text


def _held(twin: Twin, name: str, t: np.ndarray) -> np.ndarray:
    """A column at the rows: as the satellite follows it."""
    commands = twin.around.commands
    if commands is not None and name in (*commands.held, *commands.linear):
        return np.asarray(commands(t).values[name])
    return np.interp(t, *twin.columns[name])


def _numbers(values: np.ndarray, settings: ChannelSettings) -> list[str]:
    if settings.quantum is not None:
        return _plain(values)
    assert settings.sigma is not None
    digits = max(0, math.ceil(-math.log10(settings.sigma / _FINER)))
    return [f"{value:.{digits}f}" if math.isfinite(value) else "" for value in values]


def _plain(values: np.ndarray) -> list[str]:
    return csv_numbers(values[:, None])


def _placed(size: int, places: np.ndarray, texts: list[str]) -> list[str]:
    cells = [""] * size
    for place, text in zip(places.tolist(), texts, strict=True):
        cells[place] = text
    return cells


def _motion_cells(twin: Twin, t: np.ndarray) -> dict[str, list[str]]:
    """Quaternions as `quaternions_of_date` reads them, where the table tells the motion."""
    settings, known = twin.satellite.motion, np.isin(t, twin.motion.t_s)
    if settings.columns is None:
        return {}
    turn = Rotation.from_quat(twin.motion.at(t[known]).quaternion, scalar_first=True)
    if settings.frame == "gcrf":
        turn = Rotation.from_matrix(np.swapaxes(dcms_eci_from_gcrf(twin.epoch, t[known]), 1, 2)) * turn
    if settings.sense == "body_from_inertial":
        turn = turn.inv()
    numbers = turn.as_quat(scalar_first=settings.scalar == "first")
    places = np.flatnonzero(known)
    return {
        name: _placed(len(t), places, _plain(column)) for name, column in zip(settings.columns, numbers.T, strict=True)
    }


def _position_cells(twin: Twin, t: np.ndarray) -> dict[str, list[str]]:
    """Positions as `positions_of_date` reads them, where the table tells them."""
    settings = twin.satellite.orbit.columns
    if settings is None:
        return {}
    position = np.asarray(eqx.filter_jit(twin.around)(t).position_eci)
    if settings.frame == "gcrf":
        position = np.einsum("nji,nj->ni", dcms_eci_from_gcrf(twin.epoch, t), position)
    elif settings.frame == "ecef":
        position = about_pole(position, -greenwich_angles(twin.epoch, t))
    columns = (position / parsed_unit(settings.unit).factor).T
    return {name: _plain(column) for name, column in zip(settings.position, columns, strict=True)}
