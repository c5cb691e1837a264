"""The usual causes tried one after the other, where a fit is denied: cheap ones first, until one explains all."""

from collections.abc import Callable, Iterator

import numpy as np

from fitting.doctor.axes import other_orders
from fitting.doctor.bench import Bench
from fitting.doctor.changes import changes
from fitting.doctor.columns import dead_columns
from fitting.doctor.freeing import freed_parts
from fitting.doctor.scales import drifting_scales, other_noise
from fitting.doctor.stamps import jumping_stamps, late_positions, other_year
from fitting.doctor.trial import Trial, ranked
from fitting.outcome.result import Cause, FitResult
from fitting.starts.multi_start import Progress
from jaxsat.errors import InputError
from jaxsat.time import Epoch

HOPELESS = 12.0
"""Chi2 per reading, large residuals cut off, of what no change nearby explains."""
NOISE = 1.2
"""Chi2 per reading with a cause that leaves nothing to be explained: no other is tried."""
Kind = Callable[[], Iterator[Trial]]


def examine(bench: Bench, result: FitResult, elements_epoch: Epoch | None, progress: Progress) -> tuple[Cause, ...]:
    """Causes that would explain the data better, the best first; none where the motion is given and not found.

    `elements_epoch` is that of the element set which stands in the table itself.
    """
    if bench.samples.given is not None or bench.settings.adaptive.on:
        return ()
    orders: list[Kind] = [lambda: other_orders(bench)]
    local: list[Kind] = [
        lambda: freed_parts(bench),
        lambda: drifting_scales(bench),
        lambda: late_positions(bench),
        lambda: other_noise(bench, result),
    ]
    kinds: list[Kind] = [
        lambda: other_year(bench, elements_epoch),
        lambda: jumping_stamps(bench),
        lambda: dead_columns(bench),
        # Near a minimum that is none of the data's, small changes help nothing.
        *(orders + local if bench.chi2 > HOPELESS * bench.readings else local + orders),
        lambda: changes(bench),
    ]
    trials: list[Trial] = []
    for number, kind in enumerate(kinds):
        progress("looking for causes", number, len(kinds))
        trials += _of(kind)
        if any(trial.chi2 < NOISE * bench.readings for trial in trials):
            break
    count = len(kinds)
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
