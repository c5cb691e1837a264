"""Readings whose scale drifts, and noise that is not the stated one."""

from collections.abc import Iterator

import numpy as np
from scipy.stats import rankdata

from fitting.doctor.bench import Bench
from fitting.doctor.searches import along
from fitting.doctor.sensors import sunlit
from fitting.doctor.trial import Trial
from fitting.measurements.problem import Problem
from fitting.outcome.result import ChannelFit, FitResult
from fitting.outcome.series import panel_residuals, slots
from jaxsat.telemetry.table.as_if import drift, without_offset

MOST_DRIFT = 0.6
"""Largest change of scale over the session that is tried."""
OFFSET = 0.3
"""Of a bright reading, the largest constant that is tried."""
WHITE_P = 1e-3
"""Probability of the memory of residuals below which they are no noise."""
SIZES_P = 1e-10
"""The same of the sizes of residuals, which differ with the light as well."""
CLEAR = 2.25
"""Chi2 per reading beyond which noise of another size is all that is wrong: below it small faults pass for noise."""
LARGEST = 5.0
"""Times the stated noise."""
LEVEL = 3.0
"""Times the stated noise, above which a sample has to read something: in the dark there is no residual."""


def drifting_scales(bench: Bench) -> Iterator[Trial]:
    """Faces whose readings all rise or fall with time: divided by it, they are those of a steady scale."""
    for name in sunlit(bench):
        rows, channel = bench.samples.values[name], bench.samples.channels[name]

        def changed(change: float, name=name, rows=rows, channel=channel) -> Problem:
            steady = rows / drift(channel, bench.samples.t, change)[:, None]
            return bench.rebuilt(bench.with_values(name, steady), same_sky=True)

        found = along(bench, changed, 0.02, (-MOST_DRIFT, MOST_DRIFT))
        if found is None:
            continue
        change, least = found
        yield Trial(
            "drift",
            f"the scale of {name} drifts by {100.0 * change:+.0f} % over the session",
            "cells that heat up or degrade, or a battery that takes less and less: fit shorter arcs, or divide the "
            "readings by it",
            least,
            1,
            f"--as drifting:{name}:{change:.4f}",
        )


def offset_readings(bench: Bench) -> Iterator[Trial]:
    """Faces all of whose readings are too large by a constant, or too small; what was cut off at zero is unknown."""
    for name in sunlit(bench):
        rows, channel = bench.samples.values[name], bench.samples.channels[name]
        brightest = float(np.nanquantile(np.nanmax(rows[np.isfinite(rows).any(axis=1)], axis=1), 0.9))

        def changed(size: float, name=name, rows=rows) -> Problem:
            return bench.rebuilt(bench.with_values(name, without_offset(rows, size)), same_sky=True)

        found = along(bench, changed, channel.sigma, (-OFFSET * brightest, OFFSET * brightest))
        if found is None:
            continue
        size, least = found
        told = f"{size * channel.to_unit:.3g}"
        yield Trial(
            "offset",
            f"readings of {name} are too {'large' if size > 0 else 'small'} by {told.lstrip('-')} {channel.unit}",
            "the amplifier or converter has a zero of its own: take it off",
            least,
            1,
            f"--as offset:{name}:{told}",
        )


def other_noise(bench: Bench, result: FitResult) -> Iterator[Trial]:
    """Noise larger by one factor, where neither residuals nor their sizes have a memory, as they have of a fault."""
    for name, channel in result.channels.items():
        ratio = channel.chi2_per_reading
        if channel.witness or ratio is None or not 1.5 < ratio < LARGEST**2:
            continue
        if channel.memory_p < WHITE_P or _memory_of_sizes(channel) < SIZES_P:
            continue
        yield Trial(
            "noise",
            f"the noise of {name} is {np.sqrt(ratio):.1f} times the stated one",
            "state the noise that the data have",
            # Twice the logarithm of the likelihood of normal residuals at the scale that suits them best; witnesses
            # are off as before.
            bench.readings * (1.0 + float(np.log(ratio))) + bench.of_witnesses,
            1,
            f"--as noise:{name}:{channel.sigma * np.sqrt(ratio):.3g}",
            settles=bool(ratio > CLEAR),
        )


def _memory_of_sizes(channel: ChannelFit) -> float:
    """Probability that noise has such a memory in the size of its residuals; those left out count too."""
    seen = channel.fitted & (np.abs(channel.modelled).max(axis=1) > LEVEL * channel.sigma)
    seen &= np.isfinite(channel.residual).any(axis=1)
    return sizes_p(channel.residual[seen], slots(channel.t_s)[seen])


def sizes_p(residual: np.ndarray, slot: np.ndarray) -> float:
    """The same of residuals [time columns] at whole-numbered times, by ranks (McLeod & Li 1983); 1 where none tells.

    What is wrong with a model is large for a while, whatever its signs do.
    """
    if not len(residual):
        return 1.0
    ranks = rankdata(np.nanmean(residual**2, axis=1))
    found = panel_residuals(ranks - ranks.mean(), slot).ljung_box_p
    return 1.0 if found is None else found
