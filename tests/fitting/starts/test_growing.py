"""Growing arcs where a solver of known answers stands for the real one."""

import dataclasses

import numpy as np

from fitting.measurements.problem import Problem
from fitting.parameters.free import free_parameters
from fitting.starts import growing
from fitting.starts.conventions import Convention
from fitting.starts.growing import STRANGE, TAIL, Run, grow
from fitting.starts.multi_start import NONE, Starts
from jaxsat.satellites import read_satellite


def test_once_an_arc_holds_what_no_motion_makes_outliers_pull_no_more(monkeypatch):
    """From sample 20 on all is off: the way up to there is kept, and so is what has been drawn away."""
    calls = []

    def advance(problem, parameters, stage, starts, weight):
        calls.append((stage.last_sample, stage.tail, len(starts.cost)))
        drawn_away = stage.last_sample >= 20 and stage.tail == NONE
        cost = (1.0 + np.arange(len(starts.cost))) * (2.0 * STRANGE * stage.last_sample if drawn_away else 1.0)
        return dataclasses.replace(starts, x=starts.x + 1.0 * drawn_away, cost=cost)

    monkeypatch.setattr(growing, "advance", advance)
    satellite = read_satellite()
    parameters = free_parameters(satellite.model, satellite.leaves, ["magnet.x"])
    x = np.zeros((3, len(parameters.everything)))
    x[:, 3] = [0.0, 0.1, 0.2]
    problem = object.__new__(Problem)
    run = Run(Convention({}, 0.0), problem, Starts(x, np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)), np.zeros(3)))
    grow([run], np.arange(40), 39, parameters, np.ones((40, 1)), patient=False)
    ends = [6, 6, 10, 16, 26, 39]
    assert [last for last, _, _ in calls] == [*ends[:5], 26, 39]
    assert [tail for _, tail, _ in calls] == [NONE] * 5 + [TAIL] * 2
    # Those that the plain arc has moved, and those that it began with.
    assert calls[5][2] == 6
