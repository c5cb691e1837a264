"""Motions that an arc of the data does not tell from the one found: what comes after a gap picks the right one.

Over the Earth's shadow a rate that is known to some thousandths of a degree a second turns into an angle beyond every
basin, and a nearly chaotic motion forgets faster still. A few starts then end in wrong minima, in which they stay; of
many that are drawn from the covariance of the fit so far, some are right on the first samples behind the gap.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.problem import Problem
from fitting.outcome.uncertainty import at_bound, covariance
from fitting.parameters.free import FreeParameters
from fitting.starts.multi_start import NONE, Stage, Starts, advance, distinct, solve

CLOUD, LARGER = 64, 4
"""Motions drawn about the best one, and times as many where those were too few for the fewest samples."""
FEW, FEWEST = 4, 2
"""Samples by which an arc grows behind a gap, then twice as many, half as many where that was too far; at least."""
KEPT, STEPS = 8, 8
"""Motions that are left of a cloud, and the solver's steps for it."""
ROBUST_SCALE = 5.0
STRANGE = 15.0
"""Cost of an arc for each of its samples that see something, above which not all of them are of one motion."""


def cloud(
    problem: Problem,
    parameters: FreeParameters,
    last: int,
    starts: Starts,
    use: np.ndarray,
    rng: np.random.Generator,
    count: int = CLOUD,
) -> Starts:
    """Motions as good as the best of these on the arc up to sample `last`, by its covariance there, and these.

    `use` [samples channels] is the weight of the measurements.
    """
    best = starts.take(np.array([0]))
    stage = Stage(last, 1, STEPS, NONE, parameters.everything)
    point = solve(problem, parameters, stage, best.x, best.reference, use)
    x, gradient, information = (np.asarray(leaf)[0] for leaf in (point.x, point.gradient, point.hessian))
    bounds = parameters.bounds()
    pressed = at_bound(x, gradient, bounds)
    cov = covariance(information, ~pressed & parameters.everything)
    # What nothing tells, not even a prior, stays.
    known = np.isfinite(np.diagonal(cov))
    values, vectors = np.linalg.eigh(np.where(np.outer(known, known), cov, 0.0))
    drawn = x + (rng.normal(size=(count, len(x))) * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    drawn[0] = x
    attitude = Rotation.from_quat(np.asarray(point.reference)[0], scalar_first=True)
    attitude = attitude * Rotation.from_rotvec(drawn[:, :3])
    drawn[:, :3] = 0.0
    found = Starts(np.clip(drawn, *bounds), attitude.as_quat(scalar_first=True), np.zeros(count))
    return found.followed_by(starts)


def settled(problem: Problem, parameters: FreeParameters, starts: Starts, last: int, use: np.ndarray) -> Starts:
    """Where starts end on the arc up to sample `last`, the best of them without repetitions."""
    stage = Stage(last, len(starts.cost), STEPS, ROBUST_SCALE, parameters.everything)
    moved = advance(problem, parameters, stage, starts, use)
    return moved.take(distinct(moved, attitude=2e-3, rate=2e-3)[:KEPT])


def strange(starts: Starts, count: int, known: float = 0.0) -> bool:
    """Whether none of the starts, best first, explains so many samples that see something, of a cost beyond `known`."""
    return len(starts.cost) == 0 or float(starts.cost[0]) - known > STRANGE * count


def grown_slowly(
    problem: Problem,
    parameters: FreeParameters,
    starts: Starts,
    arc: tuple[int, int],
    seen: np.ndarray,
    use: np.ndarray,
) -> Starts | None:
    """Starts of the arc up to the first sample of `arc` on that up to the second; None where no motion explains it.

    The starts are best first, before and after. `seen` are the numbers of the samples that see something.
    """
    first, last = arc
    rng = np.random.default_rng(last)
    count, whole = (int(np.searchsorted(seen, sample, side="right")) for sample in arc)
    more, drawn = FEW, CLOUD
    while count < whole:
        around = cloud(problem, parameters, first, starts, use, rng, drawn)
        further = count + more if count + 1.5 * more < whole else whole
        end = int(seen[further - 1]) if further < whole else last
        found = settled(problem, parameters, around, end, use)
        if not strange(found, further - count, float(starts.cost[0])):
            starts, first, count, more, drawn = found, end, further, 2 * more, CLOUD
        elif further - count >= 2 * FEWEST:
            more = (further - count) // 2
        elif drawn == CLOUD:
            drawn = LARGER * CLOUD
        else:
            return None
    return starts
