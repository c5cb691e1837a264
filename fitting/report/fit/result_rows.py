"""What tables of a fit of any satellite say, as text: channels, parameters and what they buy, facts, alternatives."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from fitting.outcome.diagnostics import REMARKABLE_P, REMARKABLE_Z, Diagnostics, tail_text
from fitting.outcome.result import AMBIGUOUS_VERDICT, FITS, FITS_ONLY, PREDICTS, FitResult
from fitting.parameters.invisible import PRIORS
from fitting.parameters.null_space import Direction, gauge_text
from fitting.report.rows import element_rows, medians, parameter_rows
from jaxsat.report import Verdict
from jaxsat.significant import count_text, spans_text, unit_text, value_text
from jaxsat.telemetry import RejectedRow

VERDICTS: dict[str, Verdict] = {PREDICTS: "good", FITS: "good", FITS_ONLY: "doubtful", AMBIGUOUS_VERDICT: "doubtful"}
"""All others are bad."""
CHANNEL_COLUMNS = ("channel", "fitted", "unit", "rms", "1σ", "held out", "promised", "ratio", "angle")
CHANNEL_NUMBERS = (1, 3, 4, 5, 6, 7, 8)
SHOWN_WEAK = 2


def verdict_text(result: FitResult) -> str:
    """Returns the verdict as the beginning of a sentence."""
    return f"{result.verdict[0].upper()}{result.verdict[1:]}."


def channel_rows(result: FitResult) -> list[tuple[str, ...]]:
    """Returns a row a channel with the columns of `CHANNEL_COLUMNS`; the angle is that of the held-out part, if any."""
    rows = []
    for name, c in result.channels.items():
        held, used = c.holdout, c.used & c.fitted
        angle = c.angle_deg if held is None else held.angle_deg
        rows.append(
            (
                name,
                f"{int(used.sum())}/{len(c.t_s)}",
                unit_text(c.unit),
                "" if c.rms is None else value_text(c.rms, 3),
                value_text(c.sigma, 3),
                *(("", "", "") if held is None else _held(held.rms, held.promised_rms, held.sigma_ratio)),
                "" if angle is None else f"{value_text(angle, 2)}°",
            )
        )
    return rows


def _held(rms: float, promised: float, ratio: float) -> tuple[str, str, str]:
    return value_text(rms, 3), value_text(promised, 3), f"{ratio:.2f}"


def worth_rows(result: FitResult) -> list[tuple[str, str, str, str, str, str]]:
    """Returns (name, value, sigma, unit, what its part buys, note) of the parameters, the fitted before the fixed.

    What a part buys stands beside its first parameter.
    """
    said: set[str] = set()
    free = {p.name for p in result.parameters if p.free}
    rows = []
    for name, value, sigma, unit, note in parameter_rows(result.parameters):
        part = next((part for part in result.buys if name == part or name.startswith(f"{part}.")), "")
        first = name in free and part != "" and part not in said
        said |= {part} if first else set()
        rows.append((name, value, sigma, unit, buys_text(result.buys[part]) if first else "", note))
    return rows


def buys_text(rise: float) -> str:
    """Returns a rise of chi2 as text."""
    return f"{max(rise, 0.0):.0f}" if rise >= 10.0 or rise < 0.05 else f"{rise:.1f}"


def fit_facts(result: FitResult) -> list[tuple[str, str]]:
    """Returns the fit's single numbers as (what, text)."""
    t, fitted = result.t_s, np.asarray(result.fitted, bool)
    facts = [
        ("chi2 / degrees of freedom", f"{result.chi2:.1f} / {result.dof}"),
        ("times", f"{t.size}, t = {t[0]:g} to {t[-1]:g} s"),
    ]
    if not fitted.all():
        later = t[~fitted]
        facts.append(("held out", f"{later.size} times, t = {later[0]:g} to {later[-1]:g} s"))
    if result.illumination is not None:
        facts.append(("in the Earth's shadow", f"{int((result.illumination <= 0.5).sum())} times"))
    if result.limited is not None and result.limited.any():
        out = t[result.limited]
        panels = any(channel.kind == "Panels" for channel in result.channels.values())
        facts.append(
            (
                "left out as limited" if panels else "without light that fits",
                f"{count_text(out.size, 'sample')}, t = {out[0]:g} to {out[-1]:g} s",
            )
        )
    facts.append(("attitude 1σ about x, y, z", f"{medians(result.attitude_sigma_deg[fitted])} deg (median)"))
    if not fitted.all():
        facts.append(("... where it is held out", f"{medians(result.attitude_sigma_deg[~fitted])} deg (median)"))
    facts += _field_angle(result)
    rate = np.degrees(np.linalg.norm(result.angular_velocity_rad_s, axis=1))
    facts.append(("angular rate", f"{rate.min():.3g} to {rate.max():.3g} deg/s"))
    defined = [d for d in result.unseen if d.blind and d.held_by != PRIORS]
    if defined:
        facts.append(("by definition", gauge_text(defined) or ""))
    elif result.gauge and not result.unseen:
        facts.append(("by definition", result.gauge))
    if len(result.unseen) > len(defined):
        facts.append(("held by the priors", weak_text([d for d in result.unseen if d not in defined])))
    facts += [(f"axes of {name}", ", ".join(axes)) for name, axes in result.axes.items()]
    times = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in result.timing_s.items() if seconds > 0.0)
    facts.append(("time", times))
    return facts


def weak_text(weak: Sequence[Direction]) -> str:
    """Returns how many combinations the priors hold, and those of them that the data see least."""
    weakest = sorted(weak, key=lambda d: d.information)[:SHOWN_WEAK]
    more = ", the weakest " if len(weak) > 1 else ": "
    return f"{count_text(len(weak), 'combination')} of parameters{more}{'; '.join(d.name for d in weakest)}"


def _field_angle(result: FitResult) -> list[tuple[str, str]]:
    angle, sigma = result.field_angle_deg, result.field_angle_sigma_deg
    if angle is None or sigma is None or not np.isfinite(angle).any():
        return []
    text = f"{np.nanmin(angle):.1f} to {np.nanmax(angle):.1f} deg, 1σ {medians(sigma)} deg (median)"
    return [("angle of x to the field", text)]


def diagnostic_rows(diagnostics: Diagnostics) -> list[tuple[str, ...]]:
    """Returns (channel, column, residuals, RMS, mean, its z, lag 1, its z, p) as text."""
    rows = []
    for name, channel in diagnostics.channels.items():
        for column, each in channel.columns.items():
            signed = (each.mean, each.mean_z, each.lag1, each.lag1_z)
            rows.append(
                (
                    name,
                    column,
                    str(each.count),
                    "" if each.rms is None else f"{each.rms:.2f}",
                    *("" if number is None else f"{number:+.2f}" for number in signed),
                    "" if each.ljung_box_p is None else value_text(each.ljung_box_p, 2),
                )
            )
    return rows


def diagnostic_note(diagnostics: Diagnostics) -> str:
    """Returns chi2, tails and remarks in sentences."""
    ratio, p = diagnostics.chi2_per_dof, diagnostics.chi2_p
    parts = [] if ratio is None else [f"chi2 per degree of freedom {ratio:.3f} (p = {value_text(p or 0.0, 2)})"]
    parts += [f"{name}: {tail_text(channel.tails)}" for name, channel in diagnostics.channels.items()]
    beyond = f"no mean or size beyond {REMARKABLE_Z:g} σ, no memory with p below {REMARKABLE_P:g}"
    return "; ".join([*parts, *(diagnostics.remarks() or [beyond])]) + "."


def unseen_rows(result: FitResult) -> list[tuple[str, str, str, str]]:
    """Returns (direction, information, what holds it, components) of what the data hardly see."""
    units = {p.name: unit_text(p.unit) for p in result.parameters}
    rows = []
    for direction in result.unseen:
        parts = [f"{name} {change:+.3g} {units.get(name, '')}".strip() for name, change in direction.components.items()]
        seen = "none" if direction.blind else value_text(direction.information, 2)
        rows.append((direction.name, seen, direction.held_by, ", ".join(parts)))
    return rows


def orbit_rows(orbit: Mapping[str, Mapping[str, Any]] | None) -> list[tuple[str, str, str, str]]:
    """Returns (element, value, sigma, unit) of an orbit that was fitted to positions."""
    found = orbit or {}
    values = {name: element["value"] for name, element in found.items()}
    sigmas = {name: math.nan if element["sigma"] is None else element["sigma"] for name, element in found.items()}
    return element_rows(values, sigmas)


def alternative_rows(result: FitResult) -> list[tuple[str, str, str, str]]:
    """Returns (chi2 above the best, distance of attitude, rate, axes) of the other motions and conventions."""
    rows = []
    for other in result.alternatives:
        axes = "; ".join(f"{name} {', '.join(found)}" for name, found in other.get("axes", {}).items())
        rate = ", ".join(f"{w:.3g}" for w in other.get("rate_deg_s", ()))
        rise, distance = other["chi2_above_best"], other["attitude_distance_deg"]
        rows.append((value_text(rise, 3), f"{value_text(distance, 3)}°", rate, axes))
    return rows


def cause_rows(result: FitResult) -> list[tuple[str, str, str, str, str]]:
    """Returns (cause, chi2 before, after, what it would mean, option) of what would explain the data better."""
    return [
        (
            cause.cause if cause.explains else f"{cause.cause} (in part)",
            value_text(cause.chi2_before, 3),
            value_text(cause.chi2_after, 3),
            cause.meaning,
            cause.option,
        )
        for cause in result.causes
    ]


def rejected_rows(rejections: Iterable[RejectedRow]) -> list[tuple[str, str, str, str, str]]:
    """Returns (reason, count, columns, rows of the file, first example) for each reason, most frequent first."""
    by_reason: dict[str, list[RejectedRow]] = {}
    for rejection in rejections:
        by_reason.setdefault(rejection.reason, []).append(rejection)
    rows = []
    for reason, group in sorted(by_reason.items(), key=lambda item: -len(item[1])):
        columns = ", ".join(dict.fromkeys(r.column or "all" for r in group))
        rows.append((reason, str(len(group)), columns, spans_text([r.row for r in group]), group[0].detail))
    return rows


def left_out_text(rejections: Iterable[RejectedRow]) -> str:
    """Returns how much of the table was left out, and why, in a line; empty where nothing was."""
    rows = rejected_rows(rejections)
    return "; ".join(
        f"{count_text(int(count), 'cell or row', 'cells or rows')}: {reason}" for reason, count, *_ in rows
    )
