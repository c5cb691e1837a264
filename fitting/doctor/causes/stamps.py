"""Stamps that are wrong: they jump, run fast or slow, or those of one channel are late."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from fitting.doctor.bench import Bench
from fitting.doctor.searches import along, anew
from fitting.doctor.trial import Trial
from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from jaxsat.telemetry.table.stamps import odd_intervals

STARTS = 64
FAST = (-0.01, -0.004, 0.004, 0.01)
MOST_FAST = 0.05
"""Shares by which a clock is tried to run fast, and the largest."""
MOST_LATE_S, LARGEST_GAP = 30.0, 1.5
"""By which the stamps of one channel are tried to be late, and the gap, in usual intervals, that readings are not
carried across."""


def jumping_stamps(bench: Bench) -> Iterator[Trial]:
    """Stamps that are regular but for an interval: from there on they are moved back to the usual pace."""
    t = bench.samples.t
    usual = float(np.median(np.diff(t)))
    for place, odd_s in zip(*odd_intervals(t), strict=True):
        for late_s in (odd_s, odd_s - np.sign(odd_s) * usual):
            moved = t.copy()
            moved[place + 1 :] -= late_s
            if moved[place + 1] - moved[place] < 1.0:
                continue
            yield Trial(
                "clock",
                f"stamps jump by {late_s:+.1f} s between {t[place]:.0f} and {t[place + 1]:.0f} s",
                "the clock was set, or frames were lost: correct the stamps from there on, or fit the parts by "
                "themselves",
                _chi2(bench, replace(bench.samples, t=moved)),
                2,
                f"--as jump:{t[place]:.1f}:{late_s:.1f}",
            )


def _chi2(bench: Bench, samples: Samples) -> float:
    """From the minima of the fit, which may be near; where they are not, by a search."""
    chi2 = bench.chi2_near(bench.rebuilt(samples))
    return chi2 if chi2 < bench.enough else min([chi2, *anew(bench, samples, STARTS, same_sky=False)])


def running_clock(bench: Bench) -> Iterator[Trial]:
    """Stamps that run away from the clock of the orbit by a constant share."""
    t = bench.samples.t

    def changed(share: float) -> Problem:
        return bench.rebuilt(replace(bench.samples, t=t / (1.0 + share)))

    found = along(bench, changed, 5e-4, (-MOST_FAST, MOST_FAST), FAST)
    if found is None:
        return
    share, least = found
    yield Trial(
        "pace",
        f"stamps run {'fast' if share > 0 else 'slow'} by {abs(share) * 100:.2f} %",
        "the clock on board is not the one of the orbit: scale the stamps",
        least,
        1,
        f"--as pace:{share:.5f}",
    )


def late_channels(bench: Bench) -> Iterator[Trial]:
    """Stamps of one of several channels that are late: its readings are carried to the instants that they say."""
    samples = bench.samples
    fitted = [name for name, channel in samples.channels.items() if not channel.witness]
    if len(fitted) < 2:
        return
    for name in fitted:

        def changed(late_s: float, name=name) -> Problem:
            rows = _carried(samples.t, samples.values[name], late_s)
            return bench.rebuilt(bench.with_values(name, rows), same_sky=True)

        found = along(bench, changed, 0.2, (-MOST_LATE_S, MOST_LATE_S))
        if found is None:
            continue
        late_s, least = found
        yield Trial(
            "late",
            f"stamps of {name} are {abs(late_s):.1f} s {'late' if late_s > 0 else 'early'}",
            f"two sensors of one board are often seconds apart: channels.{name}.delay_s = {{value = {late_s:.1f}, "
            "sigma = 1.0}",
            least,
            1,
            f"--as late:{name}:{late_s:.2f}",
        )


def _carried(t: np.ndarray, rows: np.ndarray, late_s: float) -> np.ndarray:
    """Readings that were taken `late_s` before their stamps, at the stamps; a spline through whole rows.

    There are none across a gap: other channels may have stamps of their own between these.
    """
    whole = np.isfinite(rows).all(axis=1)
    own, meant = t[whole], t[whole] + late_s
    after = np.searchsorted(own, meant)
    inside = (after > 0) & (after < len(own))
    apart = own[np.clip(after, 1, len(own) - 1)] - own[np.clip(after, 1, len(own) - 1) - 1]
    inside |= np.isin(meant, own)
    near = inside & (apart <= LARGEST_GAP * np.median(np.diff(own)))
    found = np.full(rows.shape, np.nan)
    found[whole] = np.where(near[:, None], CubicSpline(own, rows[whole])(meant), np.nan)
    return found
