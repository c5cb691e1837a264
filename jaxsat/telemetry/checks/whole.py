"""All checks of a session, and their document."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment import AbstractOrbit
from jaxsat.errors import InputError
from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors import Gyroscope
from jaxsat.telemetry.checks.angles import check_angles, check_turning
from jaxsat.telemetry.checks.around import Around, tabulated
from jaxsat.telemetry.checks.axes import check_handedness
from jaxsat.telemetry.checks.calibration import check_calibration
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.checks.plane import check_plane
from jaxsat.telemetry.checks.sizes import check_sizes, whole_rows
from jaxsat.telemetry.checks.stamps import check_columns, check_rows, check_spacing, check_turns
from jaxsat.telemetry.table.orbit import MARGIN_S, element_set_for, orbit_for
from jaxsat.telemetry.table.session import TableSession

SCHEMA = "jaxsat.check/1"
_WIDE_MARGIN_S = 600.0
_OLD_DAYS, _FAR_DAYS = 3.0, 60.0


@dataclass(frozen=True)
class SessionCheck:
    """What the checks of a session say."""

    satellite: Satellite
    session: TableSession
    findings: tuple[Finding, ...]

    @property
    def odd(self) -> tuple[Finding, ...]:
        """What somebody should look at before a fit."""
        return tuple(each for each in self.findings if each.odd)

    def document(self) -> dict[str, Any]:
        """Returns the content of check.json."""
        session = self.session
        return {
            "schema": SCHEMA,
            "telemetry": [str(path) for path in session.paths],
            "sha256": list(session.sha256),
            "satellite": str(self.satellite.path),
            "epoch_utc": session.epoch.iso(3),
            "span_s": list(session.span_s),
            "readings": {name: channel.t_s.size for name, channel in session.channels.items()},
            "odd": [f"{each.about}: {each.text}" for each in self.odd],
            "findings": [
                {"about": each.about, "odd": each.odd, "text": each.text, "numbers": dict(each.numbers)}
                for each in self.findings
            ],
            "rejected": session.rejected_by_reason,
            "rejections": [
                {"file": str(each.path), "row": each.row, "column": each.column, "reason": each.reason}
                | {"detail": each.detail}
                for each in session.rejections
            ],
            "unused_columns": list(session.unused),
        }


def check_session(satellite: Satellite, session: TableSession) -> SessionCheck:
    """Returns what is to be said of a session before a fit; raises `InputError` where the orbit cannot be had."""
    orbit, margin = _orbit(satellite, session)
    first, last = session.span_s
    around = tabulated(orbit, session.epoch, start=first - margin, stop=last + margin)
    findings = check_rows(session) + _about_orbit(satellite, session, around)
    rates = _rates(satellite, session)
    for name, channel in session.channels.items():
        findings += check_spacing(channel, satellite) + check_columns(channel)
        findings += check_sizes(satellite.model.sensors[name], channel, around)
        findings += check_calibration(satellite, channel, around)
        findings += check_turns(channel, rates)
    findings += (
        check_handedness(satellite, session)
        + check_turning(satellite, session)
        + check_angles(satellite, session, around)
    )
    return SessionCheck(satellite, session, tuple(findings))


def _orbit(satellite: Satellite, session: TableSession) -> tuple[AbstractOrbit, float]:
    """The orbit, with a margin in which the clock may be looked for where it reaches so far."""
    try:
        return orbit_for(satellite, session, margin=_WIDE_MARGIN_S), _WIDE_MARGIN_S
    except InputError:
        return orbit_for(satellite, session), MARGIN_S


def _about_orbit(satellite: Satellite, session: TableSession, around: Around) -> list[Finding]:
    first, last = session.span_s
    within = (around.t_s >= first) & (around.t_s <= last)
    within = within if within.any() else np.ones_like(within)
    height = (np.linalg.norm(around.position_m[within], axis=1) - EARTH_RADIUS_MEAN) / 1e3
    lit = float(np.mean(around.illumination[within]))
    text = f"{height.min():.0f} to {height.max():.0f} km high, {100 * lit:.0f} % of the time in sunlight"
    numbers = {"lowest_km": float(height.min()), "highest_km": float(height.max()), "sunlit": lit}
    found = [finding("orbit", text, odd=bool(height.min() < 120.0), numbers=numbers)]
    found += check_plane(session)
    if session.elements_epoch is not None:
        days = session.epoch.seconds_since(session.elements_epoch) / 86400.0
        if abs(days) > _FAR_DAYS:
            old = f"{abs(days):.0f} days {'old' if days > 0 else 'ahead'}"
            text = f"the table's own element set is {old}: look at the date"
            found.append(finding("orbit", text, odd=True, numbers={"own_elements_age_days": days}))
    elements = element_set_for(satellite, session)
    if elements is not None:
        days = session.epoch.seconds_since(elements.epoch) / 86400.0
        text = (
            f"element set of satellite {elements.catalog_number}, {abs(days):.1f} days {'old' if days > 0 else 'ahead'}"
        )
        old = abs(days) > _OLD_DAYS
        text += ": a second or more along its track" if old else ""
        found.append(finding("orbit", text, odd=old, numbers={"elements_age_days": days}))
    return found


def _rates(satellite: Satellite, session: TableSession) -> np.ndarray:
    """Sizes of the angular velocity that gyroscopes tell [rad/s]."""
    gyros = [name for name, sensor in satellite.model.sensors.items() if isinstance(sensor, Gyroscope)]
    found = [np.linalg.norm(whole_rows(session.channels[name])[1], axis=1) for name in gyros]
    return np.concatenate(found) if found else np.empty(0)
