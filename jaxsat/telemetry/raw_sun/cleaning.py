"""From raw rows to a session: date filter, absurd sums, time order, averaging of equal instants, magnetometer filter.

What the program `Start` does (Penkov et al. 2009, section 3.1). Every row or reading that is left out is returned with
its reason. The sum filter comes before the averaging, so that one spoilt row does not take its good repeats with it.
"""

import dataclasses
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxsat.errors import InputError
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.telemetry.raw_sun.reading import RawSunFile
from jaxsat.telemetry.raw_sun.settings import PANELS, CleaningSettings
from jaxsat.time import Epoch

DATE = "date far from that of the first row"
SUM = "absurd sum of currents"
MISMATCH = "sum of currents disagrees with the six currents"
DROPPED = "left out by hand"
NO_READING = ("magnetometer By: no reading", "magnetometer Bz: no reading")

_SAME_INSTANT_S = 1e-3
"""Rows closer in time than the file's last digit are one instant."""


@dataclass(frozen=True)
class Rejection:
    """A row, or one magnetometer reading of it, that is not used."""

    row: int
    """Line number in the file, from 1."""
    reason: str
    """One of this module's reasons, to be counted."""
    detail: str
    """What was found."""


@dataclass(frozen=True)
class Session:
    """A cleaned session: one sample an instant, in order of time, SI orbit, panels in natural order."""

    name: str
    """The file's name without its ending."""
    path: Path
    sha256: str
    epoch: Epoch
    """Time zero: the earliest sample that passed the filters, kept even if that sample is then left out by hand."""
    t_s: np.ndarray
    """[time] seconds after the epoch, strictly increasing."""
    position_eci_m: np.ndarray
    """[time 3] equatorial of date."""
    velocity_eci_m_s: np.ndarray
    """[time 3]"""
    currents_mA: np.ndarray
    """[time 6] panels +X -X +Y -Y +Z -Z."""
    b_field_uT: np.ndarray
    """[time 2] magnetometer, body y and z; NaN = no valid reading."""
    repeats: np.ndarray
    """[time] rows averaged into the sample."""
    rejections: tuple[Rejection, ...]
    cleaning: CleaningSettings
    """How it was cleaned."""
    raw: RawSunFile
    """The file as read, for pictures of before and after."""
    raw_t_s: np.ndarray
    """[rows] session time of the raw rows."""
    raw_currents_mA: np.ndarray
    """[rows 6] in natural panel order."""
    raw_used: np.ndarray
    """[rows] True where the row went into a sample."""

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Number of rejections of each reason, most frequent first."""
        return dict(Counter(rejection.reason for rejection in self.rejections).most_common())

    def with_time_zero(self, zero_s: float) -> "Session":
        """The same session with time zero moved by `zero_s` seconds (`t00`, the start of a new time scale)."""
        return dataclasses.replace(
            self, epoch=self.epoch.shifted(zero_s), t_s=self.t_s - zero_s, raw_t_s=self.raw_t_s - zero_s
        )


def clean(
    raw: RawSunFile, settings: CleaningSettings | None = None, satellite: SatelliteNumbers | None = None
) -> Session:
    """Returns the session of a raw file; the panels of `satellite` limit the sum of currents where the settings do not.

    Raises `InputError` where nothing is left, and where the date filter would drop most rows: then the first row's
    date, on which it rests, is the likely error.
    """
    settings, satellite = settings or CleaningSettings(), satellite or SatelliteNumbers()
    max_current_sum_mA = settings.max_current_sum_mA or satellite.largest_current_sum_mA
    t = _seconds_since_first_row(raw.sample_time)
    currents = raw.currents_mA[:, [settings.panel_order.index(panel) for panel in PANELS]]
    used = np.ones(t.size, dtype=bool)
    rejections: list[Rejection] = []

    def reject(bad: np.ndarray, reason: str, found: np.ndarray, unit: str) -> np.ndarray:
        bad = bad & used
        rejections.extend(Rejection(int(raw.row[k]), reason, f"{found[k]:g} {unit}") for k in np.flatnonzero(bad))
        return ~bad

    days = t / 86400.0
    far = np.abs(days) > settings.max_date_difference_days
    if 2 * np.sum(far) > far.size:
        reason = (
            f"is more than {settings.max_date_difference_days:g} days from {np.sum(far)} of the {far.size} rows; "
            "correct the first row's date, or raise cleaning.max_date_difference_days"
        )
        raise InputError(reason, file=raw.path, row=int(raw.row[0]), field="sample date")
    used &= reject(far, DATE, days, "days")

    total = np.maximum(np.sum(np.abs(currents), axis=1), np.abs(raw.current_sum_mA))
    used &= reject(total > max_current_sum_mA, SUM, total, "mA")
    mismatch = raw.current_sum_mA - np.sum(currents, axis=1)
    used &= reject(np.abs(mismatch) > settings.max_sum_mismatch_mA, MISMATCH, mismatch, "mA")
    _require_some(used, rejections, raw)

    earliest = int(np.argmin(np.where(used, t, np.inf)))
    epoch = _epoch(raw.sample_time[earliest])
    t = np.round(t - t[earliest], 6)
    for t0, t1 in settings.drop_s:
        used &= reject((t >= t0) & (t <= t1), DROPPED, t, "s")
    _require_some(used, rejections, raw)

    b_field = raw.magnetometer_uT.copy()
    for axis, reason in enumerate(NO_READING):
        failed = np.abs(b_field[:, axis]) > settings.max_field_uT
        reject(failed, reason, raw.magnetometer_uT[:, axis], "uT")
        b_field[failed, axis] = np.nan

    order = np.flatnonzero(used)
    order = order[np.argsort(t[order], kind="stable")]
    starts = np.flatnonzero(np.diff(t[order], prepend=-np.inf) >= _SAME_INSTANT_S)

    def average(rows: np.ndarray) -> np.ndarray:
        """Over the rows of each instant that have a value; NaN where none has."""
        rows = rows[order]
        valid = np.add.reduceat(np.isfinite(rows).astype(np.float64), starts, axis=0)
        total = np.add.reduceat(np.nan_to_num(rows), starts, axis=0)
        return np.where(valid > 0.0, total, np.nan) / np.maximum(valid, 1.0)

    return Session(
        name=raw.path.stem,
        path=raw.path,
        sha256=raw.sha256,
        epoch=epoch,
        t_s=t[order][starts],
        position_eci_m=average(raw.position_eci_km) * 1e3,
        velocity_eci_m_s=average(raw.velocity_eci_km_s) * 1e3,
        currents_mA=average(currents),
        b_field_uT=average(b_field),
        repeats=np.diff(starts, append=order.size),
        rejections=tuple(sorted(rejections, key=lambda rejection: rejection.row)),
        cleaning=settings,
        raw=raw,
        raw_t_s=t,
        raw_currents_mA=currents,
        raw_used=used,
    )


def _require_some(used: np.ndarray, rejections: list[Rejection], raw: RawSunFile) -> None:
    if not np.any(used):
        counts = Counter(rejection.reason for rejection in rejections)
        why = ", ".join(f"{reason} ({count})" for reason, count in counts.most_common())
        raise InputError(f"no sample is left of {used.size} rows: {why}", file=raw.path)


def _epoch(fields: np.ndarray) -> Epoch:
    year, month, day, hour, minute = (int(x) for x in fields[:5])
    return Epoch.from_utc(year, month, day, hour, minute, float(fields[5]))


def _seconds_since_first_row(time: np.ndarray) -> np.ndarray:
    """SI seconds from the first row to each row, leap seconds counted: one midnight a date, then the clock."""
    first = _epoch(time[0])
    dates = [(int(y), int(m), int(d)) for y, m, d in time[:, :3]]
    midnight = {date: Epoch.from_utc(*date).seconds_since(first) for date in set(dates)}
    return np.array([midnight[date] for date in dates]) + time[:, 3:] @ np.array([3600.0, 60.0, 1.0])


def check_usable(session: Session, *, lit_threshold_mA: float = 2.0) -> None:
    """Raises `InputError` where no current exceeds the threshold: in the shadow panels tell no attitude."""
    if not np.any(session.currents_mA > lit_threshold_mA):
        reason = f"all {session.t_s.size} samples are in shadow: no current exceeds {lit_threshold_mA:g} mA"
        raise InputError(reason, file=session.path, field="currents")
