"""Limb angles from a CSV file, `utc,distance_deg,turn_deg`, and their places among the samples of a session.

The angles are those of `jaxsat.sensors.limb`. A malformed row ends the reading with an error, as in `raw_sun`.
"""

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL, read_small_file
from jaxsat.satellites.sections.session import ChannelSettings
from jaxsat.telemetry.raw_sun.cleaning import Session
from jaxsat.telemetry.table.session import Channel
from jaxsat.time import Epoch

MAX_FILE_BYTES = 4 * 2**20
"""Room for about ninety thousand rows."""
LARGEST_GAP_S = 0.5
"""Furthest that a row may be in time from the sample that it belongs to."""

KIND = "limb angle"
COLUMNS = ("utc", "distance_deg", "turn_deg")
_LIMITS = {"distance_deg": (-90.0, 180.0), "turn_deg": (-360.0, 360.0)}
_SAME_INSTANT_S = 1e-3


@dataclass(frozen=True)
class LimbAngleFile:
    """Rows of a limb angle file in file order, without those that measure nothing."""

    path: Path
    sha256: str
    """Of the file's bytes."""
    row: np.ndarray
    """[rows] line number in the file, from 1."""
    time: tuple[Epoch, ...]
    distance_deg: np.ndarray
    """[rows] angle from the limb to body x, positive outside the Earth's disk; NaN = not measured."""
    turn_deg: np.ndarray
    """[rows] turn of the limb about body x, counted from +y to +z; NaN = not measured."""


@dataclass(frozen=True)
class MatchedLimbAngles:
    """Limb angles at the samples of a session."""

    file: LimbAngleFile
    angles: np.ndarray
    """[time 2] distance from the limb and turn about it [rad]; NaN = not measured."""
    unmatched: np.ndarray
    """[rows unmatched] line numbers of rows without a sample, or with one that has a nearer row."""

    def remarks(self) -> list[str]:
        """What was left out, in a sentence; none where nothing was."""
        count, total = len(self.unmatched), len(self.file.row)
        if not count:
            return []
        where = ", ".join(map(str, self.unmatched[:5])) + (", ..." if count > 5 else "")
        return [
            f"{self.file.path}: {count} of {total} rows with limb angles are not used, for they are not the nearest "
            f"within {LARGEST_GAP_S:g} s of a sample: line {where}"
        ]


def read_limb_angles(path: str | Path) -> LimbAngleFile:
    """Reads a CSV file with the header `utc,distance_deg,turn_deg`; an empty cell means not measured.

    Instants are ISO, UTC, as 2001-01-18T04:54:15.000, in any order; line ends may be CR LF or LF, blank lines are
    passed over. Raises `InputError` with file, row and field for anything else: no file, too long (4 MiB), another
    header, missing or surplus cells, what is no plain finite number or out of range (distance -90 to 180, turn -360 to
    360 deg), an impossible or a repeated instant, and no angle at all.
    """
    path = Path(path)
    data = read_small_file(path, limit_bytes=MAX_FILE_BYTES, kind=KIND)
    rows, times, angles = [], [], []
    header = False
    for number, raw in enumerate(data.removeprefix(b"\xef\xbb\xbf").split(b"\n"), 1):
        cells = _cells(raw, path, number)
        if cells == [""]:
            continue
        if not header:
            if tuple(cells) != COLUMNS:
                raise InputError(
                    f"expected the header {','.join(COLUMNS)}, found {_shown(','.join(cells))}", file=path, row=number
                )
            header = True
            continue
        if len(cells) != len(COLUMNS):
            reason = f"expected {len(COLUMNS)} cells, {','.join(COLUMNS)}, found {len(cells)}"
            raise InputError(reason, file=path, row=number)
        rows.append(number)
        times.append(_instant(cells[0], path, number))
        angles.append([_angle(text, name, path, number) for text, name in zip(cells[1:], COLUMNS[1:], strict=True)])
    table = np.array(angles, dtype=np.float64).reshape(-1, 2)
    _check_instants(times, rows, path)
    some = np.isfinite(table).any(axis=1)
    if not some.any():
        raise InputError("holds no angle below its header", file=path)
    return LimbAngleFile(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        row=np.array(rows)[some],
        time=tuple(times[k] for k in np.flatnonzero(some)),
        distance_deg=table[some, 0],
        turn_deg=table[some, 1],
    )


def match_limb_angles(file: LimbAngleFile, session: Session) -> MatchedLimbAngles:
    """Gives each row to the sample nearest in time, within `LARGEST_GAP_S`; of several rows the nearest has it.

    An angle is taken as it is: over half a second at 1 deg/s it is half a degree off. Raises `InputError` where no row
    has a sample.
    """
    t = np.array([time.seconds_since(session.epoch) for time in file.time])
    middles = 0.5 * (session.t_s[1:] + session.t_s[:-1])
    sample = np.searchsorted(middles, t)
    gap = np.abs(t - session.t_s[sample])
    order = np.argsort(gap, kind="stable")
    order = order[gap[order] <= LARGEST_GAP_S]
    used, first = np.unique(sample[order], return_index=True)
    if not len(used):
        ends = " to ".join(session.epoch.shifted(float(each)).iso(3) for each in session.t_s[[0, -1]])
        reason = f"none of {len(t)} rows lies within {LARGEST_GAP_S:g} s of a sample of the session, {ends}"
        raise InputError(reason, file=file.path, field="utc")
    chosen = order[first]
    angles = np.full((len(session.t_s), 2), np.nan)
    angles[used] = np.radians(np.column_stack([file.distance_deg, file.turn_deg])[chosen])
    return MatchedLimbAngles(file, angles, np.sort(np.delete(file.row, chosen)))


def limb_channel(
    path: str | Path, session: Session, name: str, settings: ChannelSettings
) -> tuple[Channel, list[str], str]:
    """The angles of a file at the samples of a session as a channel, remarks on rows without a sample, and its SHA-256.

    Raises `InputError` as `read_limb_angles` and `match_limb_angles`.
    """
    matched = match_limb_angles(read_limb_angles(path), session)
    measured = np.isfinite(matched.angles).any(axis=1)
    channel = Channel.of(name, settings, session.t_s[measured], np.degrees(matched.angles[measured]))
    return channel, matched.remarks(), matched.file.sha256


def _cells(line: bytes, path: Path, row: int) -> list[str]:
    try:
        text = line.removesuffix(b"\r").decode("ascii")
    except UnicodeDecodeError as error:
        reason = f"byte 0x{line[error.start]:02x} at column {error.start + 1} is not plain ASCII text"
        raise InputError(reason, file=path, row=row) from None
    return [cell.strip(" \t") for cell in text.split(",")]


def _instant(text: str, path: Path, row: int) -> Epoch:
    try:
        return Epoch.from_iso(text)
    except ValueError as error:
        raise InputError(str(error), file=path, row=row, field="utc") from None


def _angle(text: str, name: str, path: Path, row: int) -> float:
    if not text:
        return math.nan
    if not REAL.fullmatch(text):
        reason = f"expected a plain decimal number, or nothing where it is not measured, found {_shown(text)}"
        raise InputError(reason, file=path, row=row, field=name)
    low, high = _LIMITS[name]
    # An exponent beyond the range of a double is out of range too.
    if not low <= float(text) <= high:
        raise InputError(f"expected {low:g} to {high:g}, found {_shown(text)}", file=path, row=row, field=name)
    return float(text)


def _check_instants(times: list[Epoch], rows: list[int], path: Path) -> None:
    """Refuses two rows of one instant: nothing says which of them to believe."""
    if not times:
        return
    seconds = np.array([time.seconds_since(times[0]) for time in times])
    order = np.argsort(seconds, kind="stable")
    twice = np.flatnonzero(np.diff(seconds[order]) < _SAME_INSTANT_S)
    if len(twice):
        earlier, later = sorted((rows[order[twice[0]]], rows[order[twice[0] + 1]]))
        raise InputError(f"expected each instant once, that of line {earlier} again", file=path, row=later, field="utc")


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:40] + "...")
