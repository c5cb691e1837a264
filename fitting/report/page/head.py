"""What the page of a fit says first: the numbers that one looks for, and what to doubt."""

from collections.abc import Iterator, Sequence

import numpy as np

from fitting.outcome.diagnostics import diagnose
from fitting.outcome.result import ChannelFit, FitResult
from fitting.outcome.verdict import HELD_BY_PRIOR, WITHOUT_LIGHT
from fitting.outcome.witness import Witness
from fitting.parameters.invisible import PRIORS
from fitting.report.fit.result_rows import weak_text
from fitting.report.rows import STRONG_CORRELATION, medians, strong_correlations
from jaxsat.report import sentence
from jaxsat.significant import count_text, unit_text, value_text

CLOSE_CHI2 = 25.0
"""Rise of chi2 up to which another motion is worth a word: five sigmas."""
MUCH_LEFT_OUT = 0.02
"""Share of a channel's samples from which on it is worth a word that they were left out."""
SHOWN_NAMES = 4


def key_numbers(result: FitResult) -> list[tuple[str, str, str]]:
    """Returns (what, value, a few words) of the numbers that a reader looks for first."""
    fitted = np.asarray(result.fitted, bool)
    rate = np.degrees(np.linalg.norm(result.angular_velocity_rad_s, axis=1))
    free = sum(p.free for p in result.parameters)
    span = float(result.t_s[-1] - result.t_s[0])
    ratio = f"{result.chi2 / result.dof:.2f}" if result.dof > 0 else "n/a"
    told = [
        ("Attitude 1σ", f"{medians(result.attitude_sigma_deg[fitted])}°", "about body x, y, z, median"),
        ("Angular rate", f"{rate.min():.3g} … {rate.max():.3g} deg/s", "least and largest"),
        ("chi2 / dof", ratio, f"{result.chi2:.1f} / {result.dof}"),
        ("Fitted", count_text(free, "parameter"), f"to {count_text(int(fitted.sum()), 'time')} of {span:.0f} s"),
    ]
    return [*told, *(number for channel in result.channels.values() for number in _of_channel(channel))]


def _of_channel(channel: ChannelFit) -> Iterator[tuple[str, str, str]]:
    unit = unit_text(channel.unit)
    if channel.rms is not None:
        words = f"RMS of {channel.name} where it was fitted, 1σ {value_text(channel.sigma, 3)}"
        yield f"{channel.name} left", f"{value_text(channel.rms, 3)} {unit}".strip(), words
    held = channel.holdout
    if held is not None:
        role = "witness" if channel.witness else "held out"
        told = f"RMS, {held.sigma_ratio:.2f} times what the fit promises"
        yield f"{channel.name}, {role}", f"{value_text(held.rms, 3)} {unit}".strip(), told


def doubts(result: FitResult, warnings: Sequence[str]) -> list[str]:
    """Returns sentences: what the fit, its data and its own diagnostics give reason to doubt."""
    confirmed = set(confirmations(result))
    found = [remark for remark in result.remarks if remark not in confirmed]
    found += list(_own(result))
    return [sentence(text) for text in dict.fromkeys([*found, *warnings])]


def confirmations(result: FitResult) -> list[str]:
    """Returns what witnesses that agree say."""
    asked = (Witness.of(channel) for channel in result.channels.values())
    return [witness.text for witness in asked if witness is not None and not witness.denies]


def _own(result: FitResult) -> Iterator[str]:
    fitted = np.asarray(result.fitted, bool)
    if fitted.all():
        yield "nothing was held out, so that it is not known whether the fit predicts (jaxsat fit --holdout 0.3)"
    if result.causes:
        yield f"the data deny the model; {count_text(len(result.causes), 'cause')} would explain them better, see below"
    close = [a for a in result.alternatives if a["chi2_above_best"] < CLOSE_CHI2]
    if close:
        least = min(a["chi2_above_best"] for a in close)
        yield f"{count_text(len(close), 'other motion')} fit nearly as well, the nearest by {least:.3g} of chi2"
    for note in dict.fromkeys(p.note for p in result.parameters if p.note in NOTES):
        names = [p.name for p in result.parameters if p.note == note]
        if any(all(name in remark for name in names) for remark in result.remarks):
            continue
        more = f" and {len(names) - SHOWN_NAMES} more" if len(names) > SHOWN_NAMES else ""
        yield f"{note}: {', '.join(names[:SHOWN_NAMES])}{more}"
    weak = [d for d in result.unseen if not (d.blind and d.held_by != PRIORS)]
    if weak:
        yield f"the priors, not the data, hold {weak_text(weak)}"
    strong = strong_correlations({name: dict(row) for name, row in result.correlations.items()})
    if strong:
        a, b, value = strong[0]
        pairs = count_text(len(strong), "pair")
        yield f"{pairs} of parameters correlate beyond ±{STRONG_CORRELATION}, most of all {a} with {b}, {value:+.3f}"
    for name, channel in result.channels.items():
        out = int((channel.fitted & ~channel.used).sum())
        said = any(f"samples of {name} left out" in remark for remark in result.remarks)
        if not said and out > MUCH_LEFT_OUT * max(int(channel.fitted.sum()), 1):
            yield f"{out} of {int(channel.fitted.sum())} samples of {name} were left out of the fit"
    yield from diagnose(result).remarks()


NOTES = ("at its bound", HELD_BY_PRIOR, WITHOUT_LIGHT)
"""Of parameters: those that cast doubt, remarks on others having their own sentences."""
