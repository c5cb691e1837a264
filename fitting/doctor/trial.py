"""One thing that may be wrong, tried: how well the data are explained with it."""

from dataclasses import dataclass

import numpy as np

from fitting.outcome.result import Cause

EXPLAINED = 1.6
"""Chi2 per reading up to which a cause explains the data; half of what was beyond the noise must be gone too."""
WORTH = 12.0
"""By which chi2 must fall, beside the price of what a cause adds, for it to be named at all."""


@dataclass(frozen=True)
class Trial:
    """A cause with the chi2 that the data have with it, witnesses and priors included, and large residuals cut off."""

    kind: str
    """Such as `axes`: of the causes of one kind the best is told."""
    cause: str
    """What would be wrong, in words."""
    meaning: str
    """What it would mean, and what to do."""
    chi2: float
    added: int
    """Numbers that were found with it."""
    option: str = ""
    """How a fit is told so."""
    settles: bool = False
    """Whether it leaves nothing to be explained, whatever its chi2: noise of another size."""

    def price(self, readings: int) -> float:
        """What chi2 has to fall by for the numbers that are added (Schwarz 1978)."""
        return self.added * float(np.log(max(readings, 2)))


def ranked(trials: list[Trial], chi2_before: float, readings: int) -> tuple[Cause, ...]:
    """The best of each kind that is worth its price, the best first."""
    best: dict[str, Trial] = {}
    for trial in trials:
        known = best.get(trial.kind)
        if known is None or trial.chi2 + trial.price(readings) < known.chi2 + known.price(readings):
            best[trial.kind] = trial
    worthy = [each for each in best.values() if each.chi2 + each.price(readings) < chi2_before - WORTH]
    worthy.sort(key=lambda each: each.chi2 + each.price(readings))
    return tuple(
        Cause(
            each.kind,
            each.cause,
            each.meaning,
            chi2_before,
            each.chi2,
            each.added,
            bool(each.settles or each.chi2 < min(EXPLAINED * readings, 0.5 * (readings + chi2_before))),
            each.option,
        )
        for each in worthy
    )
