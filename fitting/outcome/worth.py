"""What each free part buys: the rise of chi2 where it is put back to its nominal values and the rest is fitted anew.

A mask, not another program: the numbers of the part are held at zero shift.
"""

import numpy as np

from fitting.identify import Identified, Minimum
from fitting.parameters.names import STATE, part_of
from fitting.solvers.least_squares import Point
from fitting.solvers.refine import PLAIN
from fitting.starts.multi_start import Stage, solve

ITERATIONS = 12


def worth(found: Identified, best: Minimum, point: Point) -> dict[str, float]:
    """Rise of chi2 for each part, the largest first; `point` is the best minimum without a starts axis."""
    parameters = found.parameters
    names = np.array([part_of(name) if name else "" for name in parameters.names])
    names[: len(STATE)] = ""
    parts = [part for part in dict.fromkeys(names) if part]
    if not parts:
        return {}
    last = int(np.flatnonzero(best.problem.valid)[-1])
    weight = np.asarray(point.weight)
    rises = {}
    base = solve(
        best.problem,
        parameters,
        Stage(last, 1, 2, PLAIN, parameters.everything),
        np.asarray(point.x)[None],
        np.asarray(point.reference)[None],
        weight[None],
    )
    for part in parts:
        held = names == part
        x = np.where(held, 0.0, np.asarray(point.x))[None]
        stage = Stage(last, 1, ITERATIONS, PLAIN, parameters.everything & ~held)
        moved = solve(best.problem, parameters, stage, x, np.asarray(point.reference)[None], weight[None])
        rises[part] = 2.0 * float(moved.cost[0] - base.cost[0])
    return dict(sorted(rises.items(), key=lambda item: -item[1]))
