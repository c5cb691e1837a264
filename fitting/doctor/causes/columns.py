"""A column of panels or diodes that tells nothing: left out, the others searched anew."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.sensors import sunlit
from fitting.doctor.trial import Trial

DARK = 0.1
"""Of what the brightest column has at most, below which a column looks dead."""
STARTS = 64


def dead_columns(bench: Bench) -> Iterator[Trial]:
    """Columns that hardly read anything, and else the one that the model would have brightest against its readings.

    Where no minimum is near that of the data the model tells nothing: one after the other, the dimmest first.
    """
    for name in sunlit(bench):
        rows = bench.samples.values[name]
        labels = bench.samples.channels[name].columns
        told = bench.weight(bench.problem)
        if rows.shape[1] < 3:
            continue
        most = np.nanmax(np.abs(rows), axis=0)
        dark = np.flatnonzero(most < DARK * most.max())
        suspects = dark if len(dark) else np.argsort(most) if bench.hopeless else [_dimmest(bench, name)]
        for k in suspects:
            masked = rows.copy()
            masked[:, k] = np.nan
            samples = bench.with_values(name, masked)
            own = np.zeros_like(told)
            own[:, bench.columns(name).start + k] = told[:, bench.columns(name).start + k]
            # What is left out would have had the chi2 of noise.
            chi2 = min(anew(bench, samples, STARTS), default=np.inf) + bench.told(own)
            yield Trial(
                "column",
                f"column {labels[k]} of {name} is {'dead' if k in dark else 'weak or wrong'}",
                "the panel, its wire or its amplifier gives no reading to be believed: leave the column out",
                chi2,
                1,
                f"--as without:{labels[k]}",
            )
            if chi2 < bench.enough:
                break


def _dimmest(bench: Bench, name: str) -> int:
    """The column whose squared residuals are largest at the best minimum."""
    residual = np.asarray(bench.found.minima[0].refined.points.prediction.residual)[0]
    known = bench.weight(bench.problem) > 0
    return int(np.argmax(((residual**2) * known)[:, bench.columns(name)].sum(axis=0)))
