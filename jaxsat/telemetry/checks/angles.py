"""Check of angles between what two sensors see: known from the orbit, or with a star tracker from its attitude."""

import math
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from jaxsat.math.on_host import angle_between_attitudes, angles_between
from jaxsat.satellites.satellite import Satellite
from jaxsat.telemetry.checks.around import Around
from jaxsat.telemetry.checks.axes import other_readings
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.checks.gyros import check_gyroscope
from jaxsat.telemetry.checks.sights import Sight
from jaxsat.telemetry.table.session import TableSession

_LARGEST_DEG = 10.0
_FEW = 5
_TOO_FAR_DEG = 60.0
"""Directions at random are 90 deg apart."""
_NAMES = {"field": "field", "sun": "Sun", "nadir": "nadir"}


def check_angles(satellite: Satellite, session: TableSession, around: Around) -> list[Finding]:
    """One finding for each pair of sensors that see two directions, or a direction and stars, at about one time."""
    sights = [seen for name in session.channels if (seen := _seen(name, satellite, session)) is not None]
    found = []
    for one, two in combinations(sights, 2):
        if "attitude" in (one.of, two.of) and one.of != two.of:
            found += _against_stars(*((two, one) if one.of == "attitude" else (one, two)), around)
        elif one.of != two.of:
            found += _apart(one, two, satellite, session, around)
    lit = [(each, _usable((each,), each.t, around)) for each in sights if each.of in ("sun", "field")]
    directions = [each.part(used) for each, used in lit]
    for name in session.channels:
        if satellite.model.sensors[name].sees == "rate":
            found += check_gyroscope(satellite, session, name, directions)
    return found


def check_turning(satellite: Satellite, session: TableSession) -> list[Finding]:
    """How far each direction or attitude turns between two readings, where no gyroscope tells."""
    if any(
        sensor.sees == "rate" and session.channels[name].t_s.size for name, sensor in satellite.model.sensors.items()
    ):
        return []
    found = []
    for name in session.channels:
        sight = _seen(name, satellite, session)
        if sight is None or sight.t.size < _FEW + 1:
            continue
        step = np.diff(sight.t)
        near = step < 1.5 * np.median(step)
        between = angle_between_attitudes if sight.of == "attitude" else angles_between
        turn = between(sight.seen[:-1], sight.seen[1:])[near]
        middle, rate = _degrees(turn), _degrees(turn / step[near])
        if middle < 3.0 * _degrees(sight.sigma):
            continue
        odd = middle > _TOO_FAR_DEG
        text = (
            f"its {'attitude' if sight.of == 'attitude' else 'direction'} turns by {middle:.3g} deg between readings, "
        )
        text += f"{rate:.3g} deg/s in the middle" + (": too far to tell which way, if not more" if odd else "")
        found.append(finding(name, text, odd=odd, numbers={"turn_deg": middle, "turns_deg_s": rate}))
    return found


def _seen(name: str, satellite: Satellite, session: TableSession) -> Sight | None:
    sensor, channel = satellite.model.sensors[name], session.channels[name]
    what = sensor.sees
    if what is None or what not in (*_NAMES, "attitude") or name in satellite.conventions or not channel.t_s.size:
        return None
    told = sensor.direct(channel.values, channel.sigma)
    if told is None:
        return None
    seen, sigma = (np.asarray(each) for each in told)
    known = np.isfinite(seen).all(axis=1)
    return Sight(name, what, channel.t_s[known], seen[known], sigma[known]) if known.any() else None


def _apart(one: Sight, two: Sight, satellite: Satellite, session: TableSession, around: Around) -> list[Finding]:
    second, second_sigma = two.at(one.t)
    used = np.isfinite(second).all(axis=1) & _usable((one, two), one.t, around)
    if used.sum() < _FEW:
        return []
    measured = angles_between(one.seen[used], second[used])
    expected = angles_between(*(_expected(each.of, around, one.t[used]) for each in (one, two)))
    off = _degrees(measured - expected)
    noise = _degrees(np.hypot(one.sigma[used], second_sigma[used]))
    text = (
        f"the angle between {_NAMES[one.of]} ({one.name}) and {_NAMES[two.of]} ({two.name}) is off by {off:.1f} deg in "
        f"the middle of {used.sum()} readings, of which their noise is {noise:.1f}"
    )
    odd = off > max(_LARGEST_DEG, 3.0 * noise)
    hint = ""
    if off > noise:
        hint = other_readings(satellite, session, (one.name, two.name), (one.seen[used], second[used]), expected)
    if hint:
        text += f"; {hint}"
    elif odd:
        text += ": axes, a sign, a large bias, or stamps of one of them"
    return [
        finding(
            f"{one.name}, {two.name}", text, odd=odd or bool(hint), numbers={"angle_off_deg": off, "noise_deg": noise}
        )
    ]


def _against_stars(one: Sight, stars: Sight, around: Around) -> list[Finding]:
    """Whether a direction is where the attitude of a star tracker puts it."""
    measured, sigma = one.at(stars.t)
    used = np.isfinite(measured).all(axis=1) & _usable((one,), stars.t, around)
    if used.sum() < _FEW:
        return []
    attitude = Rotation.from_quat(stars.seen[used], scalar_first=True)
    known = _expected(one.of, around, stars.t[used])
    off, turned = (_degrees(angles_between(measured[used], way.apply(known))) for way in (attitude.inv(), attitude))
    noise = _degrees(np.hypot(sigma[used], stars.sigma[used]))
    text = (
        f"the {_NAMES[one.of]} ({one.name}) is {off:.1f} deg from where the attitude ({stars.name}) puts it in the "
        f"middle of {used.sum()} readings, of which their noise is {noise:.1f}"
    )
    largest = max(_LARGEST_DEG, 3.0 * noise)
    if off > largest:
        text += (
            f", and {turned:.1f} with its quaternions the other way round, body from inertial"
            if turned < largest
            else ": axes, a sign, a large bias, the order of the quaternion, or stamps of one of them"
        )
    numbers = {"direction_off_deg": off, "noise_deg": noise}
    return [finding(f"{one.name}, {stars.name}", text, odd=off > largest, numbers=numbers)]


def _usable(sights: tuple[Sight, ...], t: Float[np.ndarray, "n"], around: Around) -> Bool[np.ndarray, "n"]:
    """Sensors of the Sun tell nothing in the shadow."""
    if not any(each.of == "sun" for each in sights):
        return np.ones(t.size, dtype=bool)
    return around.light_at(t) == 1.0


def _degrees(angles: Float[np.ndarray, "n"]) -> float:
    return math.degrees(float(np.median(np.abs(angles))))


def _expected(what: str, around: Around, t: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    return {"field": around.field_at, "sun": around.sun_at, "nadir": around.nadir_at}[what](t)
