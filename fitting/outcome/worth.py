"""What each free part buys: the rise of chi2 where it is put back to its nominal values and the rest is fitted anew.

A mask, not another program: the numbers of the part are held at zero shift.
"""

import numpy as np

from fitting.identify import Identified, Minimum
from fitting.parameters.names import STATE
from fitting.solvers.least_squares import Point
from fitting.solvers.refine import PLAIN
from fitting.starts.multi_start import Stage, Starts, advance

ITERATIONS = 12


def worth(found: Identified, best: Minimum, point: Point) -> dict[str, float]:
    """Rise of chi2 for each part, the largest first; `point` is the best minimum without a starts axis."""
    parameters = found.parameters
    names = np.array([""] * len(STATE) + [parameters.leaves[k].part if k >= 0 else "" for k in parameters.columns])
    parts = [part for part in dict.fromkeys(names) if part]
    if not parts:
        return {}
    last = int(np.flatnonzero(best.problem.valid)[-1])
    # The first one holds nothing: what the others are compared with.
    held = np.array([np.zeros(len(names), bool), *(names == part for part in parts)])
    x = np.where(held, 0.0, np.asarray(point.x))
    count = len(held)
    reference, weight = (np.repeat(np.asarray(leaf)[None], count, 0) for leaf in (point.reference, point.weight))
    stage = Stage(last, count, ITERATIONS, PLAIN, parameters.everything & ~held)
    moved = advance(best.problem, parameters, stage, Starts(x, reference, np.zeros(count)), weight)
    rises = 2.0 * (moved.cost[1:] - moved.cost[0])
    return {str(parts[k]): float(rises[k]) for k in np.argsort(-rises)}
