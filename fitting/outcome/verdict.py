"""The verdict of a fit in words: does it predict, fit, or deny the model, and what would explain the data."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fitting.outcome.result import (
    AMBIGUOUS,
    AMBIGUOUS_VERDICT,
    CONVERGED,
    DENIED_P,
    FITS,
    FITS_ONLY,
    NOT_CONVERGED,
    PREDICTS,
    UNDETERMINED,
    WRONG_MODEL,
    Break,
    ChannelFit,
)
from fitting.outcome.witness import MOST_LEFT_OUT, Witness

STALLED_DECREMENT = 0.1
"""Cost that an undamped step may promise at a minimum."""
MAX_CHI2_PER_READING = 4.0
"""Beyond this, of all readings or of those of one channel, the model does not explain the data."""
REMARKABLE_CHI2_PER_READING = 1.5
UNTESTED_CHI2, UNTESTED_P, UNTESTED_SHARE = 2.25, 1e-5, 0.1
"""Where nothing was held out, chi2 per degree of freedom beyond the one with a probability below the other denies; so
does such a share of the readings of a channel that are left out where the others are larger than its noise."""
TELLING_CHI2, TELLING_LAG = 1.3, 0.2
"""Chi2 per reading and memory of residuals that together deny where nothing was held out, both far beyond chance."""
ORBIT_OFF_KM, ORBIT_ODD_KM = 100.0, 30.0
"""Positions that miss one orbit by so much are none of it, or are remarked on: what Kepler's leaves out is less."""
OLD_DAYS = 60.0
"""Age of a table's own element set that is remarked on."""
WITHIN = 20.0
"""Rise of chi2 (twice the cost) within which other axes or motions explain the data as well, at the stated noise."""
UNKNOWN_DEG = 30.0
"""1-sigma of an attitude that nothing tells."""
MOST_MISFITS = 0.05
"""Share of the bright samples of panels that may be left out without being dimmer than modelled."""
OF_LIGHT = ("Panels", "Photodiodes", "SunVector", "SunAngles")
"""Kinds of sensors whose samples may be left out for what the light is like."""
MOST_CONTRADICTED = 0.2
"""Share of the bright samples of a sensor of light that the computed shadow may contradict."""
HELD_BY_PRIOR, FAR_OFF = "held by its prior", "far off its prior"
WITHOUT_LIGHT = "at zero: a panel without light"
"""Notes on a parameter."""
FEW_OFF, NEARLY_ALL, SIMILAR = 5, 0.9, 1.5
"""Of held-out readings, how many far off, and what share from the first one on, are an event; and the ratio to what is
promised up to which the others are right."""
ALIKE = 1e-4
"""Probability of white noise below which neighbouring residuals are said to agree."""
LATE_SIGMAS = 5.0
"""Of a delay that residuals show, beyond which it is told."""


@dataclass(frozen=True)
class Background:
    """What is known beside the readings."""

    orbit_rms_m: float | None = None
    """By which the positions of the table miss their orbit, RMS of a coordinate."""
    elements_age_days: float | None = None
    """Of the first row after the epoch of the element set that the table itself has."""


@dataclass(frozen=True)
class Evidence:
    """What a verdict is made of."""

    cost: float
    promise: float
    """Cost that an undamped step would still save."""
    ratio: float
    """Chi2 per degree of freedom."""
    hopeless: bool
    """Whether more readings were inexplicable than may be left out."""
    channels: Mapping[str, ChannelFit]
    alternatives: tuple[dict, ...]
    attitude_sigma_deg: float
    notes: Mapping[str, str]
    held_out: bool
    no_body: bool = False
    """Whether the inertia tensor is that of no body."""
    renamed: str = ""
    """Axes of the satellite file that stand as x, y, z of the inertia found, as `y, z, x`; empty: their own."""
    chi2_p: float = 1.0
    """Probability that noise of the stated size gives this chi2 or more."""
    background: Background = Background()


def as_well(ratio: float) -> float:
    """Rise of chi2 within which something else explains the data as well, at `ratio` of chi2 per degree of freedom.

    Residuals larger than stated make all differences of chi2 larger.
    """
    return WITHIN * max(1.0, ratio)


def judge(evidence: Evidence) -> tuple[str, str, str, tuple[str, ...]]:
    """Status, verdict, its reason in a sentence, and remarks."""
    remarks = tuple(_remarks(evidence))
    found = _wrong(evidence)
    if found is not None:
        return NOT_CONVERGED, WRONG_MODEL, found, remarks
    if not (np.isfinite(evidence.cost) and evidence.promise <= STALLED_DECREMENT):
        reason = f"the solver stopped short of the minimum (a step would still save {evidence.promise:.2g})"
        return NOT_CONVERGED, UNDETERMINED, reason, remarks
    denied = [*_doubts(evidence), *(witness.text for witness in _witnesses(evidence) if witness.denies)]
    if denied:
        reason = "; ".join(denied)
        return NOT_CONVERGED, WRONG_MODEL, reason, remarks
    if evidence.renamed:
        reason = (
            f"the data fit, but by the inertia found x, y, z of the sensors are the axes {evidence.renamed} of [body] "
            "in the satellite file: columns or sensors' axes in another order, all alike, or an inertia in "
            "another order; attitude and numbers are those of the sensors' axes"
        )
        return AMBIGUOUS, AMBIGUOUS_VERDICT, reason, remarks
    equals = [a for a in evidence.alternatives if a["chi2_above_best"] < as_well(evidence.ratio)]
    if equals:
        axes = sum(bool(a["axes"]) for a in equals)
        what = "conventions of axes" if axes else "motions"
        return AMBIGUOUS, AMBIGUOUS_VERDICT, f"{len(equals) + 1} {what} explain the data equally well", remarks
    if not evidence.attitude_sigma_deg < UNKNOWN_DEG:
        reason = f"the attitude is known to {evidence.attitude_sigma_deg:.0f} deg only: the sensors do not tell it"
        return NOT_CONVERGED, UNDETERMINED, reason, remarks
    if not evidence.held_out:
        return (
            CONVERGED,
            FITS,
            "one motion explains the data; hold a part of them out to see whether it predicts",
            remarks,
        )
    bad = [
        f"{name} {channel.holdout.sigma_ratio:.1f} times, {100 * lost:.0f} % of it far off{_since(channel)}"
        for name, channel in evidence.channels.items()
        if channel.holdout and not channel.witness
        for lost in [float(np.mean(~channel.used[~channel.fitted]))]
        if channel.holdout.too_far or lost > MOST_LEFT_OUT
    ]
    if bad:
        reason = f"held-out readings are farther off than the fit promises ({'; '.join(bad)})"
        # A witness against the model: scripts that ask for the status alone must not take it for a good fit.
        return NOT_CONVERGED, FITS_ONLY, reason + ": look for a missing term of a sensor, or a break", remarks
    return CONVERGED, PREDICTS, "one motion explains the data and predicts what was held out", remarks


def _since(channel: ChannelFit) -> str:
    """From when on nearly all held-out readings of a channel are far off, where those before are not; else empty."""
    later = ~channel.fitted
    t, off = channel.t_s[later], ~channel.used[later]
    if off.sum() < FEW_OFF or off.mean() <= MOST_LEFT_OUT:
        return ""
    first = int(np.argmax(off))
    # Twice in a row is no chance; what was right before makes it an event and not a motion that is lost.
    if off[first:].mean() < NEARLY_ALL or channel.holdout is None or channel.holdout.sigma_ratio > SIMILAR:
        return ""
    return (
        f", nearly all of it from {t[first]:.0f} s on while the others are as promised: its unit, its axes or the "
        "sensor changed there, or it reads what is not there (light in the shadow)"
    )


def _wrong(evidence: Evidence) -> str | None:
    """Why the model is not that of the data; None where it may be."""
    missed = evidence.background.orbit_rms_m
    if missed is not None and missed > 1e3 * ORBIT_OFF_KM:
        return (
            f"the orbit denies the positions: they miss it by {1e-3 * missed:.0f} km (RMS of a coordinate), as "
            "positions in axes that turn with the Earth, in another unit or at other times do"
        )
    for name, channel in evidence.channels.items():
        if channel.contradicted > MOST_CONTRADICTED * channel.bright:
            return (
                f"the computed shadow contradicts {channel.contradicted} samples of {name}, which has {channel.bright} "
                "bright ones: check epoch, orbit and Sun"
            )
    for name, channel in evidence.channels.items():
        chi2 = channel.chi2_per_reading
        if chi2 is not None and chi2 > MAX_CHI2_PER_READING:
            return (
                f"{name} does not fit: its residuals are {np.sqrt(chi2):.1f} times the stated noise; free more of "
                f"the satellite or of {name} (bias, turn, scale, stray, delay), or state the noise it deserves"
            )
        if channel.misfits > MOST_MISFITS:
            return (
                f"{100 * channel.misfits:.0f} % of the bright samples of {name} fit no attitude, and no limited "
                "current dims them: the model is wrong; free more of the satellite (rods, inertia, magnet)"
            )
        if channel.fitted.any():
            lost = 1.0 - float(channel.used[channel.fitted].mean())
            if lost > MOST_LEFT_OUT and channel.kind not in OF_LIGHT:
                return f"{100 * lost:.0f} % of the readings of {name} fit no motion of this model"
    if evidence.hopeless or evidence.ratio > MAX_CHI2_PER_READING:
        return "the best minimum found does not explain the data; free more parameters, or state the noise they deserve"
    return None


def _doubts(evidence: Evidence) -> list[str]:
    """What the size of chi2 says against a fit of which nothing was held out."""
    ratio, p = evidence.ratio, evidence.chi2_p
    if evidence.held_out or p >= UNTESTED_P:
        return []
    for name, channel in evidence.channels.items():
        lost = 1.0 - float(channel.used[channel.fitted].mean()) if channel.fitted.any() else 0.0
        chi2 = channel.chi2_per_reading or 0.0
        if chi2 > REMARKABLE_CHI2_PER_READING and lost > UNTESTED_SHARE and channel.kind not in OF_LIGHT:
            return [
                f"{100 * lost:.0f} % of the readings of {name} are left out, and the others are farther off than its "
                "noise: late stamps, a turn or scale of it, or a torque that is missing"
            ]
        lag = _memory(channel, ALIKE)
        if p < DENIED_P and chi2 > TELLING_CHI2 and abs(lag) > TELLING_LAG:
            return [
                f"residuals of {name} are {np.sqrt(chi2):.2f} times its noise and agree with their neighbours (lag 1: "
                f"{lag:+.2f}), which noise of any size does not: a torque or a term of a sensor is missing"
            ]
    if ratio <= UNTESTED_CHI2:
        return []
    return [
        f"chi2 denies the fit: {ratio:.1f} per degree of freedom (p = {p:.1g} at the stated noise); free more, or "
        "state the noise that the data deserve"
    ]


def _memory(channel: ChannelFit, chance: float) -> float:
    """Largest correlation of neighbouring residuals among columns whose memory is less likely by chance; else zero."""
    found = [one.lag1 or 0.0 for one in channel.residuals if one.ljung_box_p is not None and one.ljung_box_p < chance]
    return max(found, key=abs, default=0.0)


def _background(evidence: Evidence):
    missed, age = evidence.background.orbit_rms_m, evidence.background.elements_age_days
    if missed is not None and 1e3 * ORBIT_ODD_KM < missed <= 1e3 * ORBIT_OFF_KM:
        yield f"positions miss their orbit by {1e-3 * missed:.0f} km (RMS of a coordinate)"
    if age is not None and abs(age) > OLD_DAYS:
        yield (
            f"the first row is {abs(age):.0f} days {'after' if age > 0 else 'before'} the epoch of the table's own "
            "element set: look at the date"
        )


def _witnesses(evidence: Evidence) -> list[Witness]:
    found = map(Witness.of, evidence.channels.values())
    return [witness for witness in found if witness is not None]


def _remarks(evidence: Evidence):
    yield from _background(evidence)
    yield from (witness.text for witness in _witnesses(evidence) if not witness.denies)
    for name, channel in evidence.channels.items():
        count = int((~channel.used & channel.fitted).sum()) - channel.contradicted
        if channel.contradicted:
            all_of = f"{channel.contradicted} of {int(channel.fitted.sum())} samples of {name}"
            yield f"{all_of} left out where light and computed shadow disagree"
        if count > 0:
            why = "outliers or in doubtful light" if channel.kind in OF_LIGHT else "outliers"
            yield f"{count} of {int(channel.fitted.sum())} samples of {name} left out as {why}"
        chi2 = channel.chi2_per_reading
        if chi2 is not None and REMARKABLE_CHI2_PER_READING < chi2 <= MAX_CHI2_PER_READING:
            yield f"residuals of {name} are {np.sqrt(chi2):.2f} times the stated noise"
        delay, sigma = channel.delay_s, channel.delay_sigma_s
        if delay is not None and sigma is not None and abs(delay) > LATE_SIGMAS * sigma:
            late = "late" if delay > 0 else "early"
            yield f"stamps of {name} look {abs(delay):.2g} s {late}: give channels.{name}.delay_s a sigma"
        lag = _memory(channel, ALIKE)
        if lag:
            yield f"neighbouring residuals of {name} agree beyond chance (lag 1: {lag:+.2f})"
        for each in channel.breaks:
            yield (
                f"{name} breaks at {each.t_s:.0f} s: from there on a turn of {each.turn_deg:.1f} deg and a change of "
                f"bias by {each.bias:.2g} {channel.unit} explain what is off{_left(each, channel)}"
            )
    held, far = ([name for name, note in evidence.notes.items() if note == which] for which in (HELD_BY_PRIOR, FAR_OFF))
    if held:
        yield f"held by their priors, the data say nothing of them: {', '.join(held)}"
    if far:
        yield (
            f"further from the file's values than its sigmas allow: {', '.join(far)}; look at what scales with them "
            "(a coil's area, a unit) or passes for them (a late stamp for a turn, a stray field for a bias)"
        )
    if evidence.no_body:
        yield "the inertia tensor is not that of a body (triangle inequality)"
    yield from (f"{name} is {note}" for name, note in evidence.notes.items() if note not in (HELD_BY_PRIOR, FAR_OFF))


def _left(found: Break, channel: ChannelFit) -> str:
    if not found.left:
        return ""
    return f", but for {', '.join(f'{rms:.2g}' for rms in found.left)} {channel.unit} RMS"
