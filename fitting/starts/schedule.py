"""Which arcs, how many starts on each and what is free on them."""

import numpy as np

from fitting.parameters.names import ALBEDO, INERTIA, STATE
from fitting.starts.multi_start import Stage

FIRST_ARC_LIT, ARC_GROWTH = 7, 1.57
"""Lit samples of the first arc, and how much longer each next one is: by 2 it loses sessions, by 1.5 none."""
FIRST_KEEP, KEEP = 128, (64, 48, 32, 24, 16)
"""Starts that enter the second half of the first arc, and the second, third, ... arc."""
ROBUST_SCALE = 5.0
"""Residual in sigmas beyond which a current counts linearly while arcs grow: albedo and wrong parameters abound."""


def arc_schedule(lit: np.ndarray, last: int, free: tuple[str, ...]) -> list[Stage]:
    """Arcs by their number of lit samples; what is free grows with them, under the priors."""
    position = np.flatnonzero(lit)
    names = np.array([*STATE, *free])
    everything = np.ones(len(names), bool)
    state = np.isin(names, [*STATE, *ALBEDO])
    without_inertia = ~np.isin(names, INERTIA)

    def stage(count: int | float, keep: int, iterations: int, active: np.ndarray) -> Stage:
        whole = count * 1.2 >= len(position)
        sample = last if whole else int(position[int(round(count)) - 1])
        return Stage(sample, keep, iterations, ROBUST_SCALE, active)

    # The first arc in two halves: the worse half of the starts shows itself within five steps.
    stages = [stage(FIRST_ARC_LIT, keep, 5, state) for keep in (10**9, FIRST_KEEP)]
    for number, keep in enumerate(KEEP):
        count = FIRST_ARC_LIT * ARC_GROWTH ** (number + 1)
        stages.append(stage(count, keep, 8, without_inertia if number == 0 else everything))
    while stages[-1].last_sample < last:
        count *= ARC_GROWTH
        stages.append(stage(count, KEEP[-1], 8, everything))
    whole = next(number for number, each in enumerate(stages) if each.last_sample == last)
    # However short the arc: both halves, and everything free at the end.
    return stages[: max(whole, 3) + 1]
