"""Faults of the data: what a fit reads of a session changed; each answers that, and what its name is like."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from jaxsat.telemetry import Channel, TableSession
from jaxsat.time import greenwich_angle

SIDEREAL_RAD_S = 7.292115855e-5
FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


def _changed(session: TableSession, name: str, change: Callable[[np.ndarray], np.ndarray]) -> TableSession:
    channel = session.channels[name]
    return _with(session, replace(channel, values=change(channel.values)))


def _with(session: TableSession, channel: Channel) -> TableSession:
    return replace(session, channels={**session.channels, channel.name: channel})


def _restamped(session: TableSession, change: Callable[[np.ndarray], np.ndarray], *, positions: bool) -> TableSession:
    channels = {name: replace(each, t_s=change(each.t_s)) for name, each in session.channels.items()}
    columns = {name: (change(t), values) for name, (t, values) in session.columns.items()}
    moved = session.positions
    if positions and moved is not None:
        moved = change(moved[0]), moved[1]
    return replace(session, channels=channels, columns=columns, positions=moved)


def _span(session: TableSession) -> tuple[float, float]:
    return session.span_s


def swapped(session, draw):
    """Two faces of an axis exchanged."""
    k = 2 * int(draw.integers(3))
    order = list(range(6))
    order[k], order[k + 1] = k + 1, k
    found = _changed(session, "cells", lambda rows: rows[:, order])
    return found, re.escape(f"{FACES[k]} and {FACES[k + 1]} exchanged")


def turned(session, draw):
    """The axes of all faces by turns: X stands for Y, Y for Z, Z for X, or the other way round."""
    order = [2, 3, 4, 5, 0, 1] if draw.random() < 0.5 else [4, 5, 0, 1, 2, 3]
    found = _changed(session, "cells", lambda rows: rows[:, order])
    # The column that holds what face k reads.
    told = ", ".join(f"{FACES[order.index(k)]} for {FACES[k]}" for k in range(6))
    return found, re.escape(told)


def half_turned(session, draw):
    """Both faces of two axes exchanged: a turn of 180 deg."""
    still = 2 * int(draw.integers(3))
    order = [k if k in (still, still + 1) else k ^ 1 for k in range(6)]
    found = _changed(session, "cells", lambda rows: rows[:, order])
    pairs = [f"{FACES[k]} and {FACES[k + 1]}" for k in range(0, 6, 2) if k != still]
    return found, re.escape(f"{pairs[0]}, {pairs[1]} exchanged")


def offset(session, draw):
    size = 1e-3 * draw.choice([-1.0, 1.0]) * draw.uniform(12.0, 25.0)
    found = _changed(session, "cells", lambda rows: np.maximum(rows + size, 0.0))
    return found, r"^offset: "


def fading(session, draw):
    fall = draw.uniform(0.08, 0.2)
    t = session.channels["cells"].t_s
    share = (t - t[0]) / np.ptp(t)
    found = _changed(session, "cells", lambda rows: np.round(1e3 * rows * (1.0 - fall * share)[:, None]) / 1e3)
    return found, r"^drift: the scale of cells drifts by -"


def outliers(session, draw):
    def change(rows):
        wrong = draw.random(len(rows)) < 0.1
        return np.where(wrong[:, None], 1e-3 * draw.integers(0, 250, rows.shape), rows)

    return _changed(session, "cells", change), r"^outliers: "


def late_positions(session, draw):
    late = draw.choice([-1.0, 1.0]) * draw.uniform(10.0, 30.0)
    t, position = session.positions
    path = CubicHermiteSpline(t, position, session.velocities)
    inside = np.clip(t + late, t[0], t[-1])
    kept = inside == t + late
    channels = {
        name: replace(each, t_s=each.t_s[kept], values=each.values[kept]) for name, each in session.channels.items()
    }
    velocities = path(inside, 1)[kept]
    word = "after" if late > 0.0 else "before"
    found = replace(session, channels=channels, positions=(t[kept], path(inside)[kept]), velocities=velocities)
    return found, rf"^positions: .* s {word} their stamps"


def jumping(session, draw):
    first, last = _span(session)
    at = draw.uniform(first + 0.3 * (last - first), first + 0.7 * (last - first))
    size = draw.choice([-1.0, 1.0]) * draw.uniform(12.0, 40.0)
    found = _restamped(session, lambda t: np.where(t > at, t + size, t), positions=False)
    return found, rf"^clock: stamps jump by {'[+]' if size > 0 else '-'}{abs(size):.0f}[.]|^clock: stamps jump by "


def running_away(session, draw):
    rate = draw.choice([-1.0, 1.0]) * draw.uniform(0.002, 0.01)
    found = _restamped(session, lambda t: t * (1.0 + rate), positions=False)
    return found, r"^pace: "


def earth_fixed(session, draw):
    t, position = session.positions
    angle = greenwich_angle(session.epoch) + SIDEREAL_RAD_S * t

    def turned_by(vectors):
        c, s = np.cos(angle), np.sin(angle)
        x, y, z = vectors.T
        return np.stack([c * x + s * y, c * y - s * x, z], axis=1)

    fixed = turned_by(position)
    velocity = turned_by(session.velocities) - np.cross([0.0, 0.0, SIDEREAL_RAD_S], fixed)
    return replace(session, positions=(t, fixed), velocities=velocity), r"^frame: "


def zone(session, draw):
    hours = int(draw.choice([-9, -5, -3, 3, 5, 9]))
    return replace(session, epoch=session.epoch.shifted(3600.0 * hours)), rf"^date: .*{abs(hours)} h"


def year(session, draw):
    years = int(draw.choice([-4, -2, 2, 4, 8]))
    iso = session.epoch.iso(3)
    moved = type(session.epoch).from_iso(f"{int(iso[:4]) + years}{iso[4:]}")
    return replace(session, epoch=moved), rf"^date: .*{abs(years)} years?"


def mag_axes(session, draw):
    """Two columns exchanged, or one of the other sign: a left-handed set."""
    k = int(draw.integers(3))
    if draw.random() < 0.5:
        order = [0, 1, 2]
        order[k], order[(k + 1) % 3] = order[(k + 1) % 3], order[k]
        return _changed(session, "mag", lambda rows: rows[:, order]), r"^axes: .*of mag"
    signs = np.where(np.arange(3) == k, -1.0, 1.0)
    return _changed(session, "mag", lambda rows: rows * signs), r"^axes: .*of mag"


def mag_turned(session, draw):
    """The columns of a magnetometer that stands at 90 deg."""
    order, signs = [1, 0, 2], np.array([1.0, -1.0, 1.0])
    shift = int(draw.integers(3))
    order, signs = [(each + shift) % 3 for each in np.roll(order, shift)], np.roll(signs, shift)
    return _changed(session, "mag", lambda rows: rows[:, order] * signs), r"^axes: .*of mag"


def gyro_axes(session, draw):
    k = int(draw.integers(3))
    signs = np.where(np.arange(3) == k, -1.0, 1.0)
    return _changed(session, "gyro", lambda rows: rows * signs), r"^axes: .*of gyro"


def gyro_unit(session, draw):
    return _changed(session, "gyro", lambda rows: rows * np.pi / 180.0), r"^unit: .*gyro"


def mag_unit(session, draw):
    return _changed(session, "mag", lambda rows: rows * 1e3), r"^unit: .*mag"


def diodes_order(session, draw):
    k = 2 * int(draw.integers(3))
    order = list(range(6))
    order[k], order[k + 1] = k + 1, k
    return _changed(session, "sun", lambda rows: rows[:, order]), rf"s{k + 1} and s{k + 2} exchanged"


def late_mag(session, draw):
    channel, late = session.channels["mag"], draw.uniform(3.0, 6.0)
    found = _with(session, replace(channel, t_s=channel.t_s + late))
    return found, r"^late: .*mag|^mag.delay|^parts not free: mag.delay"
