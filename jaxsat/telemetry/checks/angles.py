"""Check of angles between what two sensors see: they do not depend on attitude, and are known from the orbit."""

import math
from itertools import combinations

import numpy as np

from jaxsat.math.on_host import angles_between
from jaxsat.satellites.satellite import Satellite
from jaxsat.telemetry.checks.around import Around
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.table.session import TableSession

_SAME_S = 0.01
_LARGEST_DEG = 10.0
_FEW = 5
Sights = tuple[np.ndarray, np.ndarray, np.ndarray, str]
"""Times, directions in body axes, their 1-sigma angles [rad], and what they are of."""


def check_angles(satellite: Satellite, session: TableSession, around: Around) -> list[Finding]:
    """One finding for each pair of sensors that see two directions at the same stamps."""
    sights = {name: seen for name in session.channels if (seen := _seen(name, satellite, session)) is not None}
    found = []
    for one, two in combinations(sights, 2):
        if sights[one][3] != sights[two][3]:
            found += _apart(one, sights[one], two, sights[two], around)
    return found


def _seen(name: str, satellite: Satellite, session: TableSession) -> Sights | None:
    sensor, channel = satellite.model.sensors[name], session.channels[name]
    if sensor.sees not in ("field", "sun", "nadir") or name in satellite.conventions or not channel.t_s.size:
        return None
    told = sensor.direct(channel.values, channel.sigma)
    if told is None:
        return None
    directions, sigma = (np.asarray(each) for each in told)
    known = np.isfinite(directions).all(axis=1)
    return (channel.t_s[known], directions[known], sigma[known], sensor.sees) if known.any() else None


def _apart(one: str, first: Sights, two: str, second: Sights, around: Around) -> list[Finding]:
    (t1, d1, s1, what1), (t2, d2, s2, what2) = first, second
    near = np.clip(np.searchsorted(t2, t1), 0, t2.size - 1)
    before = np.clip(near - 1, 0, None)
    near = np.where(np.abs(t2[before] - t1) < np.abs(t2[near] - t1), before, near)
    same = np.abs(t2[near] - t1) <= _SAME_S
    lit = around.light_at(t1) == 1.0 if "sun" in (what1, what2) else np.ones(t1.size, dtype=bool)
    used = same & lit
    if used.sum() < _FEW:
        return []
    t, places = t1[used], near[used]
    measured = angles_between(d1[used], d2[places])
    expected = angles_between(_expected(what1, around, t), _expected(what2, around, t))
    off = math.degrees(float(np.median(np.abs(measured - expected))))
    noise = math.degrees(float(np.median(np.hypot(s1[used], s2[places]))))
    odd = off > max(_LARGEST_DEG, 3.0 * noise)
    text = (
        f"the angle between {_NAMES[what1]} ({one}) and {_NAMES[what2]} ({two}) is off by {off:.1f} deg in the middle "
        f"of {used.sum()} readings, of which their noise is {noise:.1f}"
    )
    if odd:
        text += ": axes, a sign, a large bias, or stamps of one of them"
    return [finding(f"{one}, {two}", text, odd=odd, numbers={"angle_off_deg": off, "noise_deg": noise})]


_NAMES = {"field": "field", "sun": "Sun", "nadir": "nadir"}


def _expected(what: str, around: Around, t: np.ndarray) -> np.ndarray:
    return {"field": around.field_at, "sun": around.sun_at, "nadir": around.nadir_at}[what](t)
