"""Checks of what readings must be whatever the attitude: size of the field, light and shadow, unit length, rates."""

import math

import numpy as np

from jaxsat.files.units import field_unit
from jaxsat.sensors import Gyroscope, Magnetometer, Panels, Photodiodes, StarTracker, SunVector
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import vectors_of
from jaxsat.significant import count_text
from jaxsat.telemetry.checks.around import Around
from jaxsat.telemetry.checks.finding import Finding, finding, times_text
from jaxsat.telemetry.table.session import Channel

_FASTEST_RAD_S = math.radians(120.0)
_SHIFTS_S = np.arange(-600.0, 601.0, 10.0)
_LEAST_SPAN_S = 900.0


def check_sizes(sensor: AbstractSensor, channel: Channel, around: Around) -> list[Finding]:
    """What the readings of a sensor say by their sizes; nothing for kinds that have none."""
    if not channel.t_s.size:
        return []
    if isinstance(sensor, Magnetometer):
        return _unit_length(channel, channel.values) if sensor.unit_vector else _field(sensor, channel, around)
    if isinstance(sensor, Gyroscope):
        return _rates(channel)
    if isinstance(sensor, Photodiodes):
        return _cells(channel, np.asarray(sensor.gain), around)
    if isinstance(sensor, Panels):
        return _cells(channel, np.asarray(sensor.gain * sensor.max_current), around)
    if isinstance(sensor, SunVector):
        return _unit_length(channel, channel.values) + _in_the_dark(channel, around)
    if isinstance(sensor, StarTracker):
        return _unit_length(channel, channel.values)
    return []


def whole_rows(channel: Channel) -> tuple[np.ndarray, np.ndarray]:
    """Times and readings of which no number is missing."""
    whole = np.isfinite(channel.values).all(axis=1)
    return channel.t_s[whole], channel.values[whole]


def _unit_length(channel: Channel, values: np.ndarray) -> list[Finding]:
    t, values = whole_rows(channel)
    if not t.size:
        return []
    length = np.linalg.norm(values, axis=1)
    tolerance = max(0.02, 5.0 * channel.sigma)
    off = np.abs(length - 1.0) > tolerance
    text = f"length {np.median(length):.4f} in the middle, {length.min():.3f} to {length.max():.3f}; expected 1"
    found = [finding(channel.name, text, odd=abs(np.median(length) - 1.0) > tolerance)]
    if off.any() and not found[0].odd:
        text = f"{count_text(int(off.sum()), 'reading')} of another length, wrong bytes perhaps: {times_text(t[off])}"
        found.append(finding(channel.name, text, odd=True, numbers={"of_another_length": float(off.sum())}))
    return found


def _field(sensor: Magnetometer, channel: Channel, around: Around) -> list[Finding]:
    t, values = whole_rows(channel)
    read = vectors_of(values, sensor.axes)
    if read is None or len(read) < 3:
        return []
    vectors = sensor.field_of(read)
    size, model = np.linalg.norm(vectors, axis=1), np.linalg.norm(around.field_at(t), axis=1)
    ratio = size / model
    middle = float(np.median(ratio))
    spread = 1.4826 * float(np.median(np.abs(ratio - middle)))
    shown = f"|B| over that of IGRF {middle:.3g} in the middle, spread {100 * spread / middle:.1f} %"
    numbers = {"ratio_to_igrf": middle, "spread_of_ratio": spread}
    if not 0.7 < middle < 1.4:
        unit = field_unit(middle, channel.unit)
        hint = f"; as {unit} it would fit" if unit else ""
        return [finding(channel.name, f"{shown}: is the unit {channel.unit!r} right?{hint}", odd=True, numbers=numbers)]
    found = [finding(channel.name, shown, odd=spread > 0.15, numbers=numbers)]
    if spread > 0.15:
        text = "it is not the field alone: a bias, currents on board, another orbit, or another clock"
        found.append(finding(channel.name, text, odd=True))
    off = np.abs(ratio - middle) > 0.2 + 6.0 * spread
    if off.any():
        text = f"{count_text(int(off.sum()), 'reading')} far from the field, wrong bytes perhaps: {times_text(t[off])}"
        found.append(finding(channel.name, text, odd=True, numbers={"far_from_field": float(off.sum())}))
    return found + _shift(channel, t[~off], vectors[~off], around)


def _shift(channel: Channel, t: np.ndarray, vectors: np.ndarray, around: Around) -> list[Finding]:
    """Whether |B| fits better with the clock moved: that of stamps, or of the orbit along its track.

    A bias, which changes |B| in proportion to its component along the reading, must not pass for that.
    """
    size = np.linalg.norm(vectors, axis=1)
    own = np.column_stack([np.ones(t.size), vectors / np.maximum(size, 1e-300)[:, None]])
    shifts = _SHIFTS_S[(t[0] + _SHIFTS_S >= around.t_s[0]) & (t[-1] + _SHIFTS_S <= around.t_s[-1])] if t.size else []
    if t.size < 20 or t[-1] - t[0] < _LEAST_SPAN_S or len(shifts) < 3:
        return []
    cost = []
    for shift in shifts:
        columns = np.column_stack([np.linalg.norm(around.field_at(t + shift), axis=1), own])
        left = size - columns @ np.linalg.lstsq(columns, size, rcond=None)[0]
        # The median: single wrong readings have no say.
        cost.append(float(np.median(left**2)))
    best, still = int(np.argmin(cost)), int(np.argmin(np.abs(shifts)))
    moved = float(shifts[best])
    if abs(moved) < 20.0 or cost[best] > 0.5 * cost[still]:
        return []
    where = f"{abs(moved):g} s {'later' if moved > 0 else 'earlier'}"
    text = f"|B| fits IGRF better {where}: stamps or orbit are off by so much?"
    return [finding(channel.name, text, odd=True, numbers={"shift_s": moved})]


def _rates(channel: Channel) -> list[Finding]:
    _, values = whole_rows(channel)
    if not values.size:
        return []
    size = np.linalg.norm(values, axis=1)
    middle, most = float(np.median(size)), float(size.max())
    text = f"rates of {math.degrees(middle):.3g} deg/s in the middle, {math.degrees(most):.3g} at most"
    odd = most > _FASTEST_RAD_S
    return [
        finding(
            channel.name,
            text + (f": is the unit {channel.unit!r} right?" if odd else ""),
            odd=odd,
            numbers={"rate_deg_s": math.degrees(middle), "fastest_deg_s": math.degrees(most)},
        )
    ]


def _cells(channel: Channel, full: np.ndarray, around: Around) -> list[Finding]:
    share = channel.values / full
    known = np.isfinite(share).any(axis=1)
    t, share = channel.t_s[known], share[known]
    brightest = np.nanmax(share, axis=1)
    noise = channel.sigma / float(np.min(np.abs(full)))
    seen = brightest > max(0.1, 5.0 * noise)
    wrong = (np.nanmin(share, axis=1) < -max(0.1, 6.0 * noise)) | (brightest > 2.5)
    # Where most are too bright it is the gain that is wrong, and not the bytes.
    credible = brightest if wrong.mean() > 0.5 else brightest[~wrong]
    most = float(np.quantile(credible, 0.98))
    numbers = {"seen_light": float(seen.mean()), "brightest_of_full": most}
    found = [finding(channel.name, f"light seen in {seen.sum()} of {seen.size} readings", numbers=numbers)]
    if 0 < wrong.sum() and credible is not brightest:
        text = f"{count_text(int(wrong.sum()), 'reading')} below zero or beyond what light can do: "
        text += times_text(t[wrong])
        found.append(finding(channel.name, text, odd=True, numbers={"impossible": float(wrong.sum())}))
    if most > 1.6 or (seen.any() and most < 0.4):
        word = "more" if most > 1.6 else "less"
        text = (
            f"the brightest readings are {most:.2g} of that with the Sun square on, {word} than can be: gain or unit?"
        )
        found.append(finding(channel.name, text, odd=True))
    return found + _against_shadow(channel, t, seen, around)


def _in_the_dark(channel: Channel, around: Around) -> list[Finding]:
    t, _ = whole_rows(channel)
    return _against_shadow(channel, t, np.ones(t.size, dtype=bool), around, gaps=False)


def _against_shadow(
    channel: Channel, t: np.ndarray, seen: np.ndarray, around: Around, *, gaps: bool = True
) -> list[Finding]:
    light = around.light_at(t)
    dark, lit = light == 0.0, light == 1.0
    found = []
    if dark.any():
        wrong = dark & seen
        text = f"{wrong.sum()} of {dark.sum()} readings in the computed shadow see light"
        where = f": {times_text(t[wrong])}; another orbit or clock?" if wrong.any() else ""
        found.append(finding(channel.name, text + where, odd=wrong.sum() > 0.02 * dark.sum() + 2))
    if gaps and lit.any() and not seen[lit].all():
        wrong = lit & ~seen
        text = f"{wrong.sum()} of {lit.sum()} readings in computed sunlight see none"
        found.append(finding(channel.name, text, odd=wrong.sum() > 0.7 * lit.sum()))
    return found
