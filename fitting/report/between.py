"""The motion and the readings between the samples: lines from one sample to the next would cut corners.

All of it is the model's own, by programs that are there from the fit: nothing is compiled. The motion is integrated to
further instants, so many that a spline through them is as good; the sensors are then read along it.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from fitting.identify import Identified
from fitting.measurements.assembly import sky_of
from fitting.measurements.sky import Around
from fitting.outcome.looking import Look, read, returning_no_light
from fitting.outcome.result import Between, FitResult
from jaxsat.math.attitude_between import attitude_between
from jaxsat.sensors import Panels

Looked = Callable[[np.ndarray], Look]
SMOOTH = np.radians(4.0)
"""Turn between two points that a line joins [rad]."""
SURE = np.radians(30.0)
"""Turn between two instants that a spline of the rates joins [rad]."""
MOST_LOOKS, MOST_POINTS = 8, 4000
DIGITS = 7


def between_samples(result: FitResult, found: Identified, around: Around, looked: Looked) -> Between | None:
    """Returns motion and readings at the samples and between them; None where the samples lie close enough.

    None also where the motion is not known at all samples, or nothing was searched for. `looked(times)` is the best of
    what was `found` at other times.
    """
    t, q, rate = result.t_s, result.quaternion_inertial_from_body, result.angular_velocity_rad_s
    if not found.minima or len(t) < 3 or not (np.isfinite(q).all() and np.isfinite(rate).all()):
        return None
    turn = np.maximum(*(np.linalg.norm(rate[side], axis=1) for side in (slice(1, None), slice(-1)))) * np.diff(t)
    if np.quantile(turn, 0.9) <= SMOOTH:
        return None
    model, t, q, rate = _sure(found, looked, t, q, rate, turn)
    largest = max(SMOOTH, float(turn.sum()) / MOST_POINTS)
    nodes, attitude = attitude_between(t, q, rate, largest_turn=largest)
    # It never overshoots: a torque that is switched on has a corner in the rates.
    velocity = PchipInterpolator(t, rate)(nodes)
    readings, direct = _read_along(found, around, model, nodes, attitude, velocity)
    return Between(
        np.round(nodes, 4), np.round(attitude, 7), _short(velocity), _all_short(readings), _all_short(direct)
    )


def _sure(found, looked, t, q, rate, turn):
    """The model, and the motion at the samples and at instants between them, as far apart as a spline may join."""
    count = np.clip(np.ceil(turn / SURE), 1, MOST_LOOKS).astype(int)
    more = np.concatenate(
        [np.zeros(0), *(t[k] + (t[k + 1] - t[k]) * np.arange(1, n) / n for k, n in enumerate(count) if n > 1)]
    )
    if found.minima[0].problem.motion is not None or not more.size:
        return looked(t[1:]).model, t, q, rate
    # Each over the whole arc, in the shape of the session.
    looks = -(-len(more) // (len(t) - 1))
    times, attitudes, rates = [t], [q], [rate]
    for part in (more[k::looks] for k in range(looks)):
        seen = looked(part)
        for rows, own in zip((times, attitudes, rates), (part, seen.quaternion, seen.angular_velocity), strict=True):
            rows.append(own)
    order = np.argsort(np.concatenate(times))
    return seen.model, *(np.concatenate(rows)[order] for rows in (times, attitudes, rates))


def _read_along(found, around, model, nodes, attitude, velocity):
    """Readings of each channel in its unit, and the part of direct sunlight in those of panels."""
    samples, problem = found.samples, found.minima[0].problem
    room = len(problem.valid)
    parts = [slice(k, k + room) for k in range(0, len(nodes), room)]
    panels = [name for name, sensor in model.sensors.items() if isinstance(sensor, Panels)]
    dark = returning_no_light(model)
    told = {"readings": {name: [] for name in samples.channels}, "direct": {name: [] for name in panels}}
    for part in parts:
        pad = room - len(nodes[part])
        t, q, w = (
            np.pad(x[part], [(0, pad), *[(0, 0)] * (x.ndim - 1)], mode="edge") for x in (nodes, attitude, velocity)
        )
        here = replace(problem, sky=sky_of(samples, problem.model, around, t))
        for kind, own in (("readings", model), ("direct", dark)):
            if not told[kind]:
                continue
            values = read(here, own, q, w)
            for name, rows in told[kind].items():
                rows.append(np.asarray(values[name])[: room - pad] * samples.channels[name].to_unit)
    return tuple({name: np.concatenate(rows) for name, rows in kind.items()} for kind in told.values())


def _short(values: np.ndarray) -> np.ndarray:
    """With as many digits as its largest needs to have `DIGITS`: what is read back is then the same."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return np.round(values, DIGITS - 1 - int(np.floor(np.log10(largest)))) if largest > 0.0 else values


def _all_short(readings: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: _short(values) for name, values in readings.items()}
