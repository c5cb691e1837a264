"""From tables and what the satellite file says of them to a session: units, stamps, rows left out, channels apart."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.conditions import parsed_condition
from jaxsat.files.units import parsed_unit
from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors import Gyroscope, HorizonVector, Magnetometer, StarTracker, SunVector
from jaxsat.telemetry.table.axes import positions_of_date, quaternions_of_date
from jaxsat.telemetry.table.fillers import fillers, standing
from jaxsat.telemetry.table.raw import read_raw_table
from jaxsat.telemetry.table.rows import Rows, backward, joined, kept, named_columns, rejected, stamped
from jaxsat.telemetry.table.session import Channel, RejectedRow, TableSession
from jaxsat.telemetry.table.stamps import as_epoch, seconds_after
from jaxsat.time import Epoch

REPEATED = "the same reading again"
FILLER = "a number again and again that is no reading"
STANDING = "a number that stands still: the end of the sensor's range, or stuck"
SECOND_READING = "another reading of an instant that has one"

_UNIT_LENGTH = 0.05
_VECTORS = Magnetometer, Gyroscope, SunVector, HorizonVector, StarTracker


def read_tables(paths: str | Path | Sequence[str | Path], satellite: Satellite) -> TableSession:
    """Returns the session of one table or of several, joined by time; see `jaxsat.telemetry.read_telemetry`.

    Every row that is left out is in `rejections`. Raises `InputError` with file, row and column for what is no table
    of this satellite, and where nothing usable is left.
    """
    listed = [paths] if isinstance(paths, str | Path) else list(paths)
    if not listed:
        raise InputError("expected at least one table, got none")
    files = tuple(read_raw_table(path) for path in listed)
    conditions = [parsed_condition(text) for text in satellite.rows.keep]
    rows = joined(files, satellite, conditions)
    rejections: list[RejectedRow] = []
    used = stamped(rows, satellite.time.column, rejections) & kept(rows, conditions, rejections)
    if not used.any():
        raise InputError(f"no row is left of {used.size}: {_why(rejections)}", file=files[0].path)
    order = np.flatnonzero(used)
    t_all = seconds_after(rows.tai, rows.instant(int(order[0])))
    zero = rows.instant(int(order[np.argmin(t_all[order])]))
    t_all = seconds_after(rows.tai, zero)
    remarks = backward(rows, t_all, used)
    order = order[np.argsort(t_all[order], kind="stable")]
    channels = {name: _channel(name, satellite, rows, t_all, order, rejections) for name in satellite.channels}
    if not any(channel.t_s.size for channel in channels.values()):
        raise InputError("holds no reading of any channel", file=files[0].path)
    remarks += [f"{name}: no reading" for name, channel in channels.items() if not channel.t_s.size]
    columns = {
        name: _column(name, parsed_unit(unit).factor, rows, t_all, order) for name, unit in satellite.columns.items()
    }
    for name, (t, _) in columns.items():
        if not t.size:
            raise InputError("holds no number", file=files[0].path, field=name)
    epoch = as_epoch(zero)
    states = _states(satellite, rows, t_all, order, epoch)
    named, named_files = named_columns(satellite, conditions), tuple(file.path for file in files)
    return TableSession(
        paths=named_files,
        sha256=tuple(file.sha256 for file in files),
        epoch=epoch,
        channels=channels,
        columns=columns,
        rejections=tuple(sorted(rejections, key=lambda each: (named_files.index(each.path), each.row))),
        remarks=tuple(remarks),
        motion=_motion(satellite, rows, t_all, order, epoch),
        positions=None if states is None else (states[0], states[1]),
        velocities=None if states is None else states[2],
        unused=tuple(dict.fromkeys(name for file in files for name in file.columns if name not in named)),
        rows=int(used.size),
    )


def _channel(
    name: str, satellite: Satellite, rows: Rows, t_s: np.ndarray, order: np.ndarray, rejections: list[RejectedRow]
) -> Channel:
    settings = satellite.channels[name]
    missing = np.full(rows.row.size, np.nan)
    values = np.stack([rows.columns[column] if column else missing for column in settings.columns], axis=1)
    sensor = satellite.model.sensors[name]
    unread = fillers(values[order], settings.sigma or 0.0, vector=isinstance(sensor, _VECTORS))
    _leave_out(rows, values, order, unread, settings.columns, FILLER, rejections)
    if isinstance(sensor, Gyroscope) or (isinstance(sensor, Magnetometer) and not sensor.unit_vector):
        _leave_out(rows, values, order, standing(values[order]), settings.columns, STANDING, rejections)
    places = order[np.isfinite(values[order]).any(axis=1)]
    places = _once(rows, t_s, values, places, name, rejections)
    return Channel.of(name, settings, t_s[places], values[places])


def _leave_out(
    rows: Rows,
    values: np.ndarray,
    order: np.ndarray,
    which: np.ndarray,
    columns: Sequence[str],
    reason: str,
    rejections: list[RejectedRow],
) -> None:
    """Takes cells [rows in order, columns] out of `values`, and tells of each what it held."""
    for k in np.flatnonzero(which.any(axis=0)).tolist():
        cells = order[which[:, k]]
        told = [f"{number:g}" for number in values[cells, k]]
        rejections += rejected(rows, cells, columns[k], reason, told)
        values[cells, k] = np.nan


def _once(
    rows: Rows, t_s: np.ndarray, values: np.ndarray, places: np.ndarray, name: str, rejections: list[RejectedRow]
) -> np.ndarray:
    """Of several readings of one instant the first; the others are rejected."""
    again = np.flatnonzero(np.diff(t_s[places], prepend=-np.inf) <= 0.0)
    if not again.size:
        return places
    kept = np.setdiff1d(np.arange(places.size), again)
    earlier = kept[np.searchsorted(kept, again, side="right") - 1]
    same = (np.nan_to_num(values[places[again]]) == np.nan_to_num(values[places[earlier]])).all(axis=1)
    for reason, which in ((REPEATED, same), (SECOND_READING, ~same)):
        details = [f"row {rows.row[places[k]]} has {t_s[places[k]]:g} s too" for k in earlier[which]]
        rejections += rejected(rows, places[again[which]], name, reason, details)
    return places[kept]


def _column(name: str, factor: float, rows: Rows, t_s: np.ndarray, order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and SI values where the column is measured; of one instant the last, which is the command that holds."""
    places = order[np.isfinite(rows.columns[name][order])]
    places = places[np.diff(t_s[places], append=np.inf) > 0.0]
    return t_s[places], rows.columns[name][places] * factor


def _together(names: Sequence[str], rows: Rows, t_s: np.ndarray, order: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and values where all of the columns are measured; of one instant the first."""
    values = np.stack([rows.columns[name] for name in names], axis=1)
    places = order[np.isfinite(values[order]).all(axis=1)]
    places = places[np.diff(t_s[places], prepend=-np.inf) > 0.0]
    return t_s[places], values[places]


def _motion(
    satellite: Satellite, rows: Rows, t_s: np.ndarray, order: np.ndarray, epoch: Epoch
) -> tuple[np.ndarray, np.ndarray] | None:
    """Quaternions that the table tells; `InputError` for one that is not of unit length."""
    settings = satellite.motion
    if settings.columns is None or settings.sense is None:
        return None
    t, found = _together(settings.columns, rows, t_s, order)
    if not t.size:
        raise InputError("holds no quaternion", file=rows.files[0].path, field=settings.columns[0])
    length = np.linalg.norm(found, axis=1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > _UNIT_LENGTH)
    if wrong.size:
        reason = f"expected unit quaternions, found one of length {length[wrong[0]]:.4g} at {t[wrong[0]]:g} s"
        raise InputError(reason, file=rows.files[0].path, field=settings.columns[0])
    turned = quaternions_of_date(epoch, t, found, scalar=settings.scalar, sense=settings.sense, frame=settings.frame)
    return t, turned


def _states(
    satellite: Satellite, rows: Rows, t_s: np.ndarray, order: np.ndarray, epoch: Epoch
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None] | None:
    """Times, positions and, where the table tells them, velocities."""
    settings = satellite.orbit.columns
    if settings is None:
        return None
    t, found = _together([*settings.position, *(settings.velocity or ())], rows, t_s, order)
    if not t.size:
        raise InputError("holds no position", file=rows.files[0].path, field=settings.position[0])
    found = found * parsed_unit(settings.unit).factor
    position = positions_of_date(epoch, t, found[:, :3], settings.frame)
    # Of date as they stand: the settings allow velocities in no other axes.
    return t, position, found[:, 3:] if settings.velocity else None


def _why(rejections: list[RejectedRow]) -> str:
    counts: dict[str, int] = {}
    for each in rejections:
        counts[each.reason] = counts.get(each.reason, 0) + 1
    return ", ".join(f"{reason} ({count})" for reason, count in counts.items())
