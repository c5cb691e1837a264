"""What changed at some time: the motion, by a kick; or, where each part wants another satellite, a torque is missing.

Both parts of the session are searched as sessions by themselves, for a few times between them; the best of those times
is made finer.
"""

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtrc

from fitting.doctor.bench import Bench
from fitting.doctor.searches import first, searched
from fitting.doctor.trial import Trial
from fitting.measurements.assembly import Samples
from fitting.outcome.uncertainty import covariance
from fitting.parameters.names import STATE
from fitting.solvers.refine import Refined
from fitting.starts.growing import FIRST_ARC
from fitting.starts.ladder import directed_samples
from fitting.starts.multi_start import Starts
from fitting.starts.sights import sights_of

SHARES = (0.2, 0.35, 0.5, 0.65, 0.8)
"""Of the samples that see something, before the change."""
LONG = 3.0
"""Usual intervals: a gap in which a change goes unseen, and is looked for."""
STARTS = 24
OTHER_P = 1e-6
"""Probability of what both parts find for the satellite's numbers below which it is not one satellite."""


def changes(bench: Bench) -> Iterator[Trial]:
    """Another motion from the time on that separates what two motions explain best."""
    samples = bench.samples
    if samples.given is not None:
        return
    sights = sights_of(bench.problem, samples)
    seen = directed_samples(sights)
    seen = seen[seen < bench.found.fitted]
    if len(seen) < 2 * FIRST_ARC:
        return
    costs = {k: _cost(bench, seen, k) for k in _places(samples.t, seen)}
    for near in (2, 1):
        best = min(costs, key=lambda k: costs[k])
        costs |= {k: _cost(bench, seen, k) for k in (best - near, best + near) if k not in costs}
    place = min(costs, key=lambda k: costs[k])
    if not np.isfinite(costs[place]):
        return
    number, before = int(seen[place]), int(seen[place - 1])
    at_s = 0.5 * float(samples.t[before] + samples.t[number])
    told = f"between {samples.t[before]:.0f} and {samples.t[number]:.0f} s"
    parts = [_part(bench, seen, place, later) for later in (False, True)]
    found = [part for part in parts if part is not None]
    if len(found) < 2:
        return
    chi2 = sum(2.0 * float(refined.score[0]) for refined in found)
    added = 7 + int((bench.parameters.columns >= 0).sum())
    if _agree(bench, *found) < OTHER_P:
        yield Trial(
            "parts",
            f"the torque is not that of the model: the parts before and after {at_s:.0f} s want different satellites",
            "hysteresis, eddy currents, a constant torque, coils or air that the satellite file leaves out: give it "
            "such a part",
            chi2,
            added,
        )
        return
    yield Trial(
        "motion",
        f"the motion changes {told}",
        "a kick, a coil or wheel that was switched, stamps that jump: fit the parts by themselves",
        chi2,
        added,
        f"--arc {samples.t[0]:.0f} {at_s:.0f}",
    )


def _agree(bench: Bench, one: Refined, other: Refined) -> float:
    """Probability that the numbers that move the satellite differ as much between two fits of one satellite."""
    moving = np.arange(len(STATE), len(STATE) + bench.parameters.tree.moving)
    moving = moving[bench.parameters.everything[moving]]
    if not len(moving):
        return 1.0
    cov, x = np.zeros((len(moving),) * 2), []
    for refined in (one, other):
        own = covariance(np.asarray(refined.points.hessian)[0], bench.parameters.everything)
        cov += own[np.ix_(moving, moving)]
        x.append(np.asarray(refined.points.x)[0, moving])
    if not np.isfinite(cov).all():
        return 1.0
    apart = x[0] - x[1]
    # The prior of either part would hold both at the same place: it is counted once too often, on the safe side.
    return float(chdtrc(len(moving), apart @ np.linalg.solve(cov, apart)))


def _places(t: np.ndarray, seen: np.ndarray) -> list[int]:
    """Places among the samples that see something: at shares of them, and behind gaps."""
    gaps = np.diff(t[seen])
    places = {int(round(share * len(seen))) for share in SHARES}
    places |= {int(k) + 1 for k in np.flatnonzero(gaps > LONG * np.median(gaps))}
    return sorted(k for k in places if FIRST_ARC <= k <= len(seen) - FIRST_ARC)


def _data(bench: Bench, seen: np.ndarray, place: int, later: bool) -> tuple[Samples, int]:
    """The samples of one part, and the number of its last one among them."""
    if later:
        begin = int(seen[place])
        return bench.samples.part(slice(begin, None)), bench.found.fitted - begin - 1
    return bench.samples, int(seen[place - 1])


def _search(bench: Bench, seen: np.ndarray, place: int, later: bool) -> Starts | None:
    samples, last = _data(bench, seen, place, later)
    return searched(bench, samples, STARTS, same_sky=False, last=last)


def _cost(bench: Bench, seen: np.ndarray, place: int) -> float:
    """Of both parts after a search; infinite where one is too short."""
    if not FIRST_ARC <= place <= len(seen) - FIRST_ARC:
        return np.inf
    found = [_search(bench, seen, place, later) for later in (False, True)]
    return float(sum(np.inf if starts is None else starts.cost[0] for starts in found))


def _part(bench: Bench, seen: np.ndarray, place: int, later: bool) -> Refined | None:
    starts = _search(bench, seen, place, later)
    if starts is None:
        return None
    samples, last = _data(bench, seen, place, later)
    problem = bench.rebuilt(samples)
    weight = bench.weight(problem, samples)
    weight[last + 1 :] = 0.0
    refined = bench.refitted(problem, first(starts), weight=weight)
    return refined if len(refined.score) else None
