"""Readings whose scale drifts, and noise that is not the stated one."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.lines import lowest
from fitting.doctor.sensors import sunlit
from fitting.doctor.trial import Trial
from fitting.outcome.result import FitResult

DRIFTS = (-0.3, -0.15, -0.07, 0.07, 0.15, 0.3)
"""Changes of scale over the session that are tried."""

WHITE_P = 1e-3
"""Probability of the memory of residuals below which they are no noise."""
LARGEST = 5.0
"""Times the stated noise."""


def drifting_scales(bench: Bench) -> Iterator[Trial]:
    """Faces whose readings all rise or fall with time: divided by it, they are those of a steady scale."""
    t = bench.samples.t
    share = (t - t[0]) / max(float(np.ptp(t)), 1.0)
    for name in sunlit(bench):
        rows = bench.samples.values[name]

        def chi2(change: float, name=name, rows=rows) -> float:
            samples = bench.with_values(name, rows / (1.0 + change * share)[:, None])
            problem = bench.rebuilt(samples, same_sky=True)
            return bench.best_of(problem, bench.refitted(problem))[0]

        change, least = lowest(chi2, DRIFTS, bench.chi2)
        yield Trial(
            "drift",
            f"the scale of {name} drifts by {100.0 * change:+.0f} % over the session",
            "cells that heat up or degrade, or a battery that takes less and less: fit shorter arcs, or divide the "
            "readings by it",
            least,
            1,
        )


def other_noise(bench: Bench, result: FitResult) -> Iterator[Trial]:
    """Noise larger by one factor, where residuals have no mean and no memory: what is wrong with a model has both."""
    for name, channel in result.channels.items():
        ratio, told = channel.chi2_per_reading, [each for each in channel.residuals if each.count]
        if channel.witness or ratio is None or not 1.5 < ratio < LARGEST**2 or not told:
            continue
        if min(1.0 if each.ljung_box_p is None else each.ljung_box_p for each in told) < WHITE_P:
            continue
        yield Trial(
            "noise",
            f"the noise of {name} is {np.sqrt(ratio):.1f} times the stated one",
            "state the noise that the data have",
            # Twice the logarithm of the likelihood of normal residuals at the scale that suits them best; witnesses
            # are off as before.
            bench.readings * (1.0 + float(np.log(ratio))) + bench.of_witnesses,
            1,
            f"channels.{name}.sigma = {channel.sigma * np.sqrt(ratio):.3g}",
        )
