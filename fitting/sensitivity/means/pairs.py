"""Slopes of the mean of a metric, whatever a single case does: differentiable, a staircase, or chaotic.

A loop that switches modes has metrics that are stairs in any gain, and a derivative along its path says nothing of the
steps; from a tumble the derivative is exact and grows without bound. The mean over cases *and* over a small spread of
the knobs is smooth, and its derivative needs none of a case. Every case is run twice, with its knobs moved to both
sides, from the same random numbers (Hammersley & Morton 1956; Glasserman & Yao 1992).

Alone, one knob after the other, it is moved by the same width h to both sides in all cases. That is the slope of the
mean with the knob spread uniformly,

    d/dx  1/(2 h) int E f(x + y) dy  over -h < y < h   =   E[ f(x + h) - f(x - h) ] / (2 h),

without error but that of the sample. It takes two runs a knob.

At once all knobs are moved in two runs, by normal numbers u of each case (Gaussian smoothing: Nesterov & Spokoiny 2017,
eq. 21; in opposite pairs: Salimans et al. 2017),

    d/dx E f(x + s u)  =  E[ (f(x + s u) - f(x - s u)) u ] / (2 s),

and slopes are the least squares of half the differences on s u. What every other knob does is then noise to each
slope, and so is the square of u: it is for a motion whose noise is there whatever moves, as a chaotic one, or for very
many knobs. `experiments/sensitivity/means/slopes.py` has both at an equal number of runs.

Errors need no noise of one size (HC3: MacKinnon & White 1985). What the smoothing is off by grows with the square of
the width.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

WIDTH = 0.05
"""Of a move: to both sides, or the 1-sigma of moves at once."""

Run = Callable[[Float[np.ndarray, "cases knobs"]], Mapping[str, np.ndarray]]
"""Metrics [cases] of cases with these moves of their knobs. A case begins alike in each run. NaN where it has none."""


@dataclass(frozen=True)
class MeanSlopes:
    """Mean of a metric over cases, and its derivatives by the moves of knobs."""

    mean: float
    """Over all pairs of runs, so of the smoothed metric."""
    mean_sigma: float
    slopes: np.ndarray
    """[knobs], by a move of 1; NaN where too few pairs have the metric."""
    sigma: np.ndarray
    """[knobs] sampling error, 1-sigma."""
    left_out: np.ndarray
    """[knobs] pairs of which one side or both have no finite value."""
    influence: np.ndarray
    """[cases knobs] what each case adds to the error of the slope, times their number; NaN where it is left out."""


def pushes(
    cases: int,
    knobs: Sequence[int],
    total: int,
    *,
    width: float | Sequence[float] | np.ndarray,
    seed: int,
    together: bool,
) -> list[np.ndarray]:
    """Moves [cases total] of one side of each pair of runs, of which the chosen `knobs` are moved by the `width`.

    At once they depend on the seed and the number of a case alone, so that two studies have them in common. Raises
    ValueError for widths that are not positive.
    """
    sizes = np.broadcast_to(np.asarray(width, float), (len(knobs),))
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        raise ValueError(f"expected positive widths, got {width}")
    if together:
        made = np.zeros((cases, total))
        made[:, list(knobs)] = sizes * np.random.default_rng(seed).standard_normal((cases, len(knobs)))
        return [made]
    return [np.tile(size * np.eye(total)[knob], (cases, 1)) for size, knob in zip(sizes, knobs, strict=True)]


def slopes_of_pairs(
    moves: Sequence[np.ndarray], high: Sequence[np.ndarray], low: Sequence[np.ndarray], knobs: Sequence[int]
) -> MeanSlopes:
    """Slopes by `knobs` from the metric [cases] on both sides of each of the `pushes`."""
    columns = [list(knobs)] if len(moves) < len(knobs) else [[knob] for knob in knobs]
    parts = [_regressed(push[:, own], up, down) for push, up, down, own in zip(moves, high, low, columns, strict=True)]
    slopes, sigma, left_out, influence = (
        np.concatenate(each, axis=-1) for each in zip(*[part[:4] for part in parts], strict=True)
    )
    middle = np.stack([part[4] for part in parts], axis=1)
    have = np.isfinite(middle)
    some = have.any(axis=1)
    of_cases = np.where(have, middle, 0.0).sum(axis=1)[some] / have.sum(axis=1)[some]
    mean, error = mean_and_error(of_cases)
    return MeanSlopes(mean, error, slopes, sigma, left_out, influence)


def mean_and_error(values: np.ndarray) -> tuple[float, float]:
    """Mean of numbers and its standard error; NaN of too few."""
    mean = float(values.mean()) if len(values) else np.nan
    return mean, float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else np.nan


def _regressed(push, high, low):
    """Slopes, errors, pairs left out [knobs], influence [cases knobs] and middles [cases] of one pair of runs."""
    known = np.isfinite(high) & np.isfinite(low)
    count, own = int(known.sum()), push.shape[1]
    influence, middle = np.full(push.shape, np.nan), np.where(known, 0.5 * (high + low), np.nan)
    left_out = np.full(own, len(push) - count)
    if count < own + 2:
        return np.full(own, np.nan), np.full(own, np.nan), left_out, influence, middle
    x, half = push[known], 0.5 * (high - low)[known]
    slopes = np.linalg.lstsq(x, half, rcond=None)[0]
    # What is left over is no noise of one size: it goes with the push where the metric bends or jumps.
    reach = np.linalg.pinv(x)
    left = (half - x @ slopes) / (1.0 - np.einsum("kn,nk->k", x, reach))
    influence[known] = count * (reach * left).T
    return slopes, np.linalg.norm(reach * left, axis=1), left_out, influence, middle


def slopes_of_runs(
    run: Run,
    knobs: int,
    cases: int,
    *,
    width: float | Sequence[float] | np.ndarray = WIDTH,
    seed: int = 0,
    together: bool = False,
    at: Float[np.ndarray, " knobs"] | None = None,
) -> dict[str, MeanSlopes]:
    """Derivatives of the mean of each metric that `run` gives, by its knobs, at the moves `at` (none by default).

    Raises ValueError for widths that are not positive, for metrics of another shape, and where fewer than two more
    pairs than knobs have a value.
    """
    everyone = list(range(knobs))
    moves = pushes(cases, everyone, knobs, width=width, seed=seed, together=together)
    middle = np.zeros(knobs) if at is None else np.asarray(at, float)
    sides = [[run(middle + sign * push) for push in moves] for sign in (1.0, -1.0)]
    found = {}
    for name in sides[0][0]:
        high, low = ([np.asarray(one[name], float) for one in side] for side in sides)
        wrong = [one.shape for one in (*high, *low) if one.shape != (cases,)]
        if wrong:
            raise ValueError(f"metric {name} has shape {wrong[0]}, expected {(cases,)}")
        found[name] = slopes_of_pairs(moves, high, low, everyone)
        if not np.isfinite(found[name].slopes).all():
            fewest = cases - int(found[name].left_out.max())
            raise ValueError(f"metric {name}: only {fewest} of {cases} cases have a value in both runs")
    return found
