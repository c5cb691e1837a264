"""A RAW_SUN session as the table that a satellite file describes: its columns by name."""

import math
from collections.abc import Sequence

import numpy as np

from jaxsat.errors import InputError
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.satellites.satellite import Satellite
from jaxsat.satellites.sections.session import ChannelSettings
from jaxsat.sensors import Panels
from jaxsat.telemetry.elements.tle_lines import international_designator, line_epoch
from jaxsat.telemetry.raw_sun.cleaning import Session
from jaxsat.telemetry.table.session import Channel, RejectedRow, TableSession

CURRENTS = tuple(name.upper() for name in PANEL_NAMES)
POSITION, VELOCITY, FIELD = ("X", "Y", "Z"), ("VX", "VY", "VZ"), ("By", "Bz")
"""Columns of a file by the names that satellite files call them: km, km/s, mA, uT."""


def table_of(session: Session, satellite: Satellite) -> TableSession:
    """The session's channels as `[channels]` of the satellite file name their columns.

    Raises `InputError` naming a column that RAW_SUN files do not have.
    """
    columns = {name: session.currents_mA[:, k] for k, name in enumerate(CURRENTS)}
    columns |= {name: session.b_field_uT[:, k] for k, name in enumerate(FIELD)}
    channels = {
        name: _channel(name, settings, session, columns, satellite) for name, settings in satellite.channels.items()
    }
    if satellite.columns:
        _refuse(next(iter(satellite.columns)), satellite, [*columns])
    rejections = tuple(RejectedRow(session.path, each.row, "", each.reason, each.detail) for each in session.rejections)
    return TableSession(
        paths=(session.path,),
        sha256=(session.sha256,),
        epoch=session.epoch,
        channels=channels,
        columns={},
        rejections=rejections,
        remarks=tuple(f"{name}: no reading" for name, channel in channels.items() if not channel.t_s.size),
        positions=(session.t_s, session.position_eci_m),
        velocities=session.velocity_eci_m_s,
        unused=tuple(name for name in columns if not any(name in each.columns for each in channels.values())),
        rows=session.raw_t_s.size,
        object_name=session.raw.satellite,
        object_id=international_designator(session.raw.tle[0]),
        elements_epoch=line_epoch(session.raw.tle[0]),
    )


def largest_current_sum_mA(satellite: Satellite) -> float | None:
    """The most that the panels of a satellite can show on three faces with an albedo as bright as the Sun."""
    most = [
        float(np.max(np.asarray(sensor.max_current * sensor.gain)))
        for sensor in satellite.model.sensors.values()
        if isinstance(sensor, Panels)
    ]
    return 2.0 * math.sqrt(3.0) * 1e3 * max(most) if most else None


def _channel(
    name: str, settings: ChannelSettings, session: Session, columns: dict[str, np.ndarray], satellite: Satellite
) -> Channel:
    for column in settings.columns:
        if column and column not in columns:
            _refuse(column, satellite, [*columns])
    missing = np.full(session.t_s.size, np.nan)
    values = np.stack([columns[column] if column else missing for column in settings.columns], axis=1)
    there = np.isfinite(values).any(axis=1)
    return Channel.of(name, settings, session.t_s[there], values[there])


def _refuse(column: str, satellite: Satellite, known: Sequence[str]) -> None:
    reason = f"a RAW_SUN file has no column {column!r}; its columns are {', '.join(known)}"
    raise InputError(reason, file=satellite.path, field="columns")
