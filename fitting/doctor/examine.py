"""The usual causes tried one after the other, where a fit is denied: cheap ones first, until one explains all."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from fitting.doctor.bench import Bench
from fitting.doctor.causes.axes import other_orders
from fitting.doctor.causes.changes import changes
from fitting.doctor.causes.columns import dead_columns
from fitting.doctor.causes.dates import other_year, other_zone
from fitting.doctor.causes.freeing import freed_parts
from fitting.doctor.causes.magnets import other_commands, other_magnets
from fitting.doctor.causes.mountings import other_axes
from fitting.doctor.causes.outliers import outlying_readings
from fitting.doctor.causes.positions import earth_fixed, late_clock, late_positions
from fitting.doctor.causes.rates import faster_turns
from fitting.doctor.causes.scales import drifting_scales, offset_readings, other_noise
from fitting.doctor.causes.stamps import jumping_stamps, late_channels, running_clock
from fitting.doctor.causes.torques import missing_torques
from fitting.doctor.causes.units import other_units
from fitting.doctor.trial import Trial, ranked
from fitting.outcome.believable import without_sigmas
from fitting.outcome.result import FITS, FITS_ONLY, NOT_CONVERGED, UNDETERMINED, WRONG_MODEL, Cause, FitResult
from fitting.starts.multi_start import Progress
from jaxsat.errors import InputError

NOISE = 1.2
"""Chi2 per reading with a cause that leaves nothing to be explained: no other is tried."""
LEFT = 0.25
"""Of what was unexplained, that may be left then."""
DOUBT_P, DENIES = 2e-3, 40.0
"""Probability of chi2 below which a fit is doubtful, and the fall of chi2 by a cause, beside 2 for each number it adds,
that denies it: noise makes one of that size in a thousand million fits."""
DENIED = (WRONG_MODEL, FITS_ONLY, UNDETERMINED)
"""Verdicts after which causes are looked for."""
Kind = Callable[[], Iterator[Trial]]


def examine(bench: Bench, result: FitResult, progress: Progress) -> tuple[Cause, ...]:
    """Causes that would explain the data better, the best first; none where the motion is given and not found.

    Where the data are explained but the attitude is not told, or the solver stopped short, there is no cause to find.
    """
    if bench.samples.given is not None or bench.settings.adaptive.on:
        return ()
    if result.verdict == FITS_ONLY:
        bench = bench.of_everything()
    if result.verdict == UNDETERMINED and bench.chi2 < NOISE * bench.readings:
        return ()
    orders: list[Kind] = [lambda: other_orders(bench)]
    local = [
        *_nearby(bench),
        lambda: offset_readings(bench),
        lambda: other_noise(bench, result),
    ]
    kinds: list[Kind] = [
        lambda: outlying_readings(bench, result),
        lambda: earth_fixed(bench),
        lambda: other_year(bench),
        lambda: jumping_stamps(bench),
        lambda: other_axes(bench),
        lambda: other_units(bench),
        lambda: other_commands(bench),
        lambda: dead_columns(bench),
        # Near a minimum that is none of the data's, small changes help nothing.
        *(orders + local if bench.hopeless else local + orders),
        lambda: faster_turns(bench),
        lambda: other_zone(bench),
        lambda: missing_torques(bench),
        lambda: running_clock(bench),
        lambda: other_magnets(bench),
        lambda: changes(bench),
    ]
    # Of what is little over the noise most has to go.
    enough = min(NOISE * bench.readings, bench.readings + LEFT * bench.unexplained)
    return _tried(bench, kinds, enough, progress)


def doubtful(result: FitResult) -> bool:
    """Whether a fit that nothing denied, and of which nothing was held out, has a chi2 that noise hardly gives."""
    return result.verdict == FITS and float(chdtrc(result.dof, result.chi2)) < DOUBT_P


def reconsidered(bench: Bench, result: FitResult, progress: Progress) -> FitResult:
    """A doubtful fit, denied where some small change near its minimum explains the doubt beyond chance."""
    if bench.samples.given is not None or bench.settings.adaptive.on:
        return result
    causes = _tried(bench, _nearby(bench), 0.0, progress)
    best = next((cause for cause in causes if cause.chi2_before - cause.chi2_after > DENIES + 2.0 * cause.added), None)
    if best is None:
        return result
    message = (
        f"chi2 is doubtful ({result.chi2 / result.dof:.2f} per degree of freedom), and something else explains it: "
        f"{best.cause} (chi2 falls from {best.chi2_before:.0f} to {best.chi2_after:.0f})"
    )
    return replace(without_sigmas(result), status=NOT_CONVERGED, verdict=WRONG_MODEL, message=message, causes=causes)


def _nearby(bench: Bench) -> list[Kind]:
    """What changes little, for minima that are near those of the data."""
    return [
        lambda: freed_parts(bench),
        lambda: drifting_scales(bench),
        lambda: late_positions(bench),
        lambda: late_clock(bench),
        lambda: late_channels(bench),
    ]


def _tried(bench: Bench, kinds: list[Kind], enough: float, progress: Progress) -> tuple[Cause, ...]:
    """The causes of these kinds, the best first; no further kind where a chi2 is below `enough`."""
    trials: list[Trial] = []
    count = len(kinds)
    for number, kind in enumerate(kinds):
        progress("looking for causes", number, count)
        trials += _of(kind)
        if any(trial.chi2 < enough for trial in trials):
            break
        if trials and min(trials, key=lambda trial: trial.chi2 + trial.price(bench.readings)).settles:
            break
    progress("looking for causes", count, count)
    return ranked(trials, bench.chi2, bench.readings)


def _of(kind: Kind) -> list[Trial]:
    """What one kind of cause gives; what cannot be tried with these data says nothing."""
    found: list[Trial] = []
    try:
        for trial in kind():
            found += [trial] if np.isfinite(trial.chi2) else []
    except (InputError, np.linalg.LinAlgError):
        pass
    return found
