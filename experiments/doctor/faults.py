"""One fault each: what is done to a session, and what counts as its name.

`truth` faults change the settings of the independent program, `table` faults what the fit reads of its session. Either
answers what the first cause of the table must read like: a regular expression for `kind: cause [option]`.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from jaxsat.telemetry import Channel, TableSession
from jaxsat.time import greenwich_angle

Draw = np.random.Generator
SIDEREAL_RAD_S = 7.292115855e-5
FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


@dataclass(frozen=True)
class Fault:
    """A kind of fault on one kind of session."""

    base: str
    """`munin` or `cube`."""
    truth: Callable[[dict[str, Any], Draw], str] | None = None
    table: Callable[[TableSession, Draw], tuple[TableSession, str]] | None = None
    free: tuple[str, ...] | None = None
    """What is free in place of everything."""
    refused: str = r"(?!)"
    """What a refusal before the fit must say, a regular expression; by default none is right."""
    absorbed: bool = False
    """Whether a converged fit at the truth is right too: the fit takes the fault for what it is."""


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


def dead_face(cfg, draw):
    k = int(draw.integers(6))
    cfg["panel_ratio"][k] = 0.0
    return rf"^column: column {re.escape(FACES[k])} "


def weak_face(cfg, draw):
    k = int(draw.integers(6))
    cfg["panel_ratio"][k] = 0.5
    # One gain that is off is named as such, or by its column.
    return rf"^column: column {re.escape(FACES[k])} |^gains not free"


def gains(cfg, draw):
    cfg["panel_ratio"] = draw.uniform(0.8, 1.2, 6).tolist()
    return r"^gains not free|^parts not free: gains"


def tilts(cfg, draw):
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
    normals = normals + np.radians(3.0) * draw.standard_normal((6, 3))
    cfg["normals"] = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist()
    return r"^tilts not free|^parts not free: tilts"


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


def noisy(cfg, draw):
    cfg["noise"] = float(draw.uniform(5.0, 8.0))
    return r"^noise: the noise of cells"


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


def other_pole(cfg, draw):
    cfg["magnet"] = (-np.array(cfg["magnet"])).tolist()
    return r"^magnet: .*-x|^magnet"


def other_axis(cfg, draw):
    axis = int(draw.integers(1, 3))
    cfg["magnet"] = np.roll(cfg["magnet"], axis).tolist()
    return rf"^magnet: .*{'xyz'[axis]}|^magnet"


def hysteresis(cfg, draw):
    cfg["parts"]["rods"] = [
        {"axis": axis, "Hc": 6.0, "Br": 0.05, "Bs": 0.1, "volume": float(draw.uniform(1.0, 3.0)) * 1e-7}
        for axis in ([0, 1, 0], [0, 0, 1])
    ]
    return r"^torque: .*hysteresis"


def eddy(cfg, draw):
    cfg["parts"]["eddy"] = float(draw.uniform(0.5, 2.0)) * 1e3
    return r"^torque: .*eddy"


def residual(cfg, draw):
    size, direction = 2e-8 * draw.uniform(1.0, 3.0), draw.standard_normal(3)
    cfg["parts"]["residual"] = (size * direction / np.linalg.norm(direction)).tolist()
    return r"^torque: .*constant"


def drag(cfg, draw):
    direction = draw.standard_normal(3)
    # Half of 3e-12 kg/m3 and of a drag coefficient of 2.2, a face of 0.01 m2, 1 to 3 cm.
    cfg["drag"] = (1.1e-14 * draw.uniform(0.01, 0.03) * 3.0 * direction / np.linalg.norm(direction)).tolist()
    return r"^torque: .*(air|drag)"


def kick(cfg, draw):
    at = float(draw.uniform(0.3, 0.7) * cfg["duration"])
    direction = draw.standard_normal(3)
    rate = np.radians(draw.uniform(0.2, 0.5)) * direction / np.linalg.norm(direction)
    cfg["parts"]["kick"] = {"t": at, "rate": rate.tolist()}
    return r"^motion: the motion changes"


def coil(cfg, draw):
    at = float(draw.uniform(0.3, 0.7) * cfg["duration"])
    direction = draw.standard_normal(3)
    moment = 0.1 * direction / np.linalg.norm(direction)
    cfg["parts"] |= {"coils": [{"axis": moment.tolist(), "area_turns_m2": 0.1}]}
    cfg["parts"]["commands"] = {"t": [at], "current": [[1.0]]}
    return r"^motion: the motion changes|^parts: the torque is not that of the model"


def no_albedo(cfg, draw):
    cfg["albedo_diffuse"], cfg["albedo_specular"] = float(draw.uniform(0.2, 0.4)), float(draw.uniform(0.2, 0.6))
    return r"^albedo not free|^parts not free: albedo"


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


FAULTS: dict[str, Fault] = {
    "faces swapped": Fault("munin", table=swapped),
    "faces half turned": Fault("munin", table=half_turned),
    "faces cyclic": Fault("munin", table=turned),
    "face dead": Fault("munin", truth=dead_face),
    "face weak": Fault("munin", truth=weak_face),
    "gains": Fault("munin", truth=gains),
    "tilts": Fault("munin", truth=tilts),
    "offset": Fault("munin", table=offset),
    "imax drifts": Fault("munin", table=fading),
    "noise": Fault("munin", truth=noisy),
    "outliers": Fault("munin", table=outliers, absorbed=True),
    "positions late": Fault("munin", table=late_positions),
    "stamps jump": Fault("munin", table=jumping),
    "clock rate": Fault("munin", table=running_away),
    "positions Earth-fixed": Fault("munin", table=earth_fixed),
    "zone": Fault("munin", table=zone),
    # A few years change field and Sun by less than a fit sees, and the age of the element set is a remark.
    "year": Fault("munin", table=year, absorbed=True),
    "magnet reversed": Fault("munin", truth=other_pole, absorbed=True),
    "magnet's axis": Fault("munin", truth=other_axis, absorbed=True),
    "hysteresis": Fault("munin", truth=hysteresis),
    "eddy currents": Fault("munin", truth=eddy),
    "constant torque": Fault("munin", truth=residual),
    "kick": Fault("munin", truth=kick),
    "coil": Fault("munin", truth=coil),
    "albedo not free": Fault("munin", truth=no_albedo, free=("magnet", "rods", "imax", "inertia")),
    "drag": Fault("cube", truth=drag),
    "magnetometer mirrored": Fault("cube", table=mag_axes),
    "magnetometer turned": Fault("cube", table=mag_turned, absorbed=True),
    "gyro sign": Fault("cube", table=gyro_axes),
    "gyro rad/s": Fault("cube", table=gyro_unit),
    "magnetometer nT": Fault("cube", table=mag_unit, refused=r"mag.unit: .*nT"),
    "diodes swapped": Fault("cube", table=diodes_order),
    "magnetometer late": Fault("cube", table=late_mag, absorbed=True),
}
