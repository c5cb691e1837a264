"""Checks of stamps and rows: spacing, gaps, rounding, columns that never change, what was left out."""

import math

import numpy as np

from jaxsat.satellites.satellite import Satellite
from jaxsat.significant import count_text, spans_text, unit_text
from jaxsat.telemetry.checks.finding import Finding, finding, times_text
from jaxsat.telemetry.table.session import Channel, TableSession
from jaxsat.telemetry.table.stamps import odd_intervals

_GAP = 5.0
"""Times the usual spacing."""
_FEW = 10


def check_rows(session: TableSession) -> list[Finding]:
    """What was left out, what is not used, and what the reading of the stamps said."""
    found = [finding("stamps", remark, odd=True) for remark in session.remarks]
    for reason, count in session.rejected_by_reason.items():
        rows = [each.row for each in session.rejections if each.reason == reason]
        text = f"{count_text(count, 'row')} left out, {reason}: {spans_text(rows, 6)}"
        found.append(finding("rows", text, numbers={"left_out": count}))
    if session.unused:
        found.append(finding("rows", "columns that the satellite file does not name: " + ", ".join(session.unused)))
    return found


def check_spacing(channel: Channel, satellite: Satellite) -> list[Finding]:
    """Spacing of a channel's stamps, its gaps, and whether they are rounded without saying so."""
    about, t = channel.name, channel.t_s
    if t.size < 2:
        return [finding(about, count_text(t.size, "reading"), odd=True)]
    spacing = np.diff(t)
    usual = float(np.median(spacing))
    numbers = {"readings": float(t.size), "spacing_s": usual, "shortest_s": float(spacing.min())}
    numbers |= {"longest_s": float(spacing.max()), "span_s": float(t[-1] - t[0])}
    text = f"{t.size} readings over {t[-1] - t[0]:g} s, {usual:g} s apart ({spacing.min():g} to {spacing.max():g})"
    found = [finding(about, text, numbers=numbers)]
    gaps = np.flatnonzero(spacing > _GAP * usual)
    if gaps.size:
        longest = spacing[gaps].max()
        text = f"{count_text(gaps.size, 'gap')} of more than {_GAP:g} times that, up to {longest:g} s, after "
        found.append(finding(about, text + times_text(t[gaps]), odd=longest > 0.1 * (t[-1] - t[0])))
    found += _jumps(channel.name, t)
    step = _rounding(t)
    declared = satellite.time.resolution_s
    # Dropped readings leave whole multiples of the usual spacing.
    uneven = float(np.mean(np.abs(spacing / usual - np.round(spacing / usual)) > 0.05)) > 0.1
    if step is not None and uneven and step >= 0.2 * usual and (declared or 0.0) < step:
        text = f"stamps are multiples of {step:g} s and unevenly spaced: rounded? Then time.resolution_s = {step:g}"
        found.append(finding(about, text, odd=True, numbers={"resolution_s": step}))
    return found


def _jumps(about: str, t: np.ndarray) -> list[Finding]:
    """Of stamps at one pace, intervals that are no multiple of it."""
    if t.size < _FEW:
        return []
    odd = zip(*odd_intervals(t), strict=True)
    told = "; ".join(f"by {late:+.1f} s after {t[k]:g} s (--as jump:{t[k]:.1f}:{late:.1f})" for k, late in odd)
    return [finding(about, f"stamps jump, or rows are lost and the pace with them: {told}", odd=True)] if told else []


def _rounding(t: np.ndarray) -> float | None:
    """The coarsest usual step that all stamps are multiples of."""
    for step in (60.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.1, 0.01):
        if np.allclose(np.remainder(t - t[0] + 0.5 * step, step), 0.5 * step, rtol=0.0, atol=1e-6):
            return step
    return None


def check_columns(channel: Channel) -> list[Finding]:
    """Columns that are empty or never change, and how often none is measured."""
    found = []
    for name, values in zip(channel.columns, channel.values.T, strict=True):
        known = values[np.isfinite(values)]
        if name and not known.size:
            found.append(finding(channel.name, f"column {name} is empty", odd=True))
        elif known.size >= _FEW and np.ptp(known) == 0.0:
            size = " ".join(part for part in (f"{known[0] * channel.to_unit:g}", unit_text(channel.unit)) if part)
            text = f"column {name} is {size} in all rows: not connected?"
            found.append(finding(channel.name, text, odd=True))
    partly = int(np.sum(~np.isfinite(channel.values[:, [bool(name) for name in channel.columns]]).all(axis=1)))
    if partly:
        found.append(finding(channel.name, f"{count_text(partly, 'reading')} with an empty cell"))
    return found


def check_turns(channel: Channel, rate_rad_s: np.ndarray) -> list[Finding]:
    """Whether a satellite of these rates [n] turns far between two readings of a channel."""
    if channel.t_s.size < 2 or not rate_rad_s.size:
        return []
    usual = float(np.median(np.diff(channel.t_s)))
    turn = math.degrees(float(np.median(rate_rad_s)) * usual)
    if turn < 90.0:
        return []
    text = f"the satellite turns by {turn:.0f} deg between readings: attitudes and axes will be ambiguous"
    return [finding(channel.name, text, odd=True, numbers={"turn_between_deg": turn})]
