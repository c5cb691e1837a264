"""A search: first guesses under each convention of axes, and the arcs on which they grow."""

from dataclasses import dataclass

import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from fitting.parameters.free import FreeParameters
from fitting.settings import FitSettings
from fitting.solvers.refine import candidates
from fitting.starts.conventions import Convention, with_axes
from fitting.starts.growing import Run, grow
from fitting.starts.guess import Placed
from fitting.starts.ladder import first_guesses
from fitting.starts.mounting import with_turns
from fitting.starts.multi_start import Progress, rates_of
from fitting.starts.sights import Sights, sights_of
from fitting.starts.silent import Silent
from jaxsat.math.on_host import angles_between

MOST_GIVEN = 8
"""Conventions of axes that are refined along a motion that is given."""


@dataclass(frozen=True)
class Search:
    """From first guesses to motions that explain the whole of what is fitted, on a coarse grid."""

    problem: Problem
    seeing: Samples
    """Those that are fitted, from the problem's first one on."""
    silent: Silent
    seen: np.ndarray
    """Numbers of the samples that see something."""
    use: np.ndarray
    """[samples channels] weight of the measurements."""
    fastest: float
    """[rad/s]"""
    parameters: FreeParameters
    settings: FitSettings
    progress: Progress

    def blind(self, found: list[Convention], effort: int = 1) -> tuple[list[Run], bool]:
        """Motions under each convention of axes, and whether one of them explained the first arc."""
        runs = [self._started(each, self.settings.starts * effort, effort - 1) for each in found]
        return runs, self._grown(runs, effort)

    def from_guess(self, found: list[Convention], placed: Placed) -> list[Run]:
        """Motions near a guess at the first sample, under each convention of axes."""
        rng = np.random.default_rng(self.settings.seed)
        starts = placed.starts(self.parameters, rng)
        runs = [Run(each, with_axes(self.problem, each), starts) for each in found]
        self._grown(runs)
        return runs

    def along_given(self, found: list[Convention]) -> tuple[list[Run], bool]:
        """The likeliest conventions along the motion that is given, sensors mounted as they see it."""
        runs = [self._started(each, 1, 0) for each in found[:MOST_GIVEN]]
        for run in runs:
            run.starts = with_turns(run.starts, run.problem, self.seeing, self.parameters)
        return runs, False

    def spin(self, run: Run) -> float:
        """Fastest of the survivors of a run as they begin, and of the best one on its way [rad/s]."""
        starts, last = run.starts, len(self.seeing.t) - 1
        begin = RATE_UNIT * np.linalg.norm(starts.x[candidates(starts.cost), 3:6], axis=1)
        onward = rates_of(run.problem, self.parameters, last, starts.take(np.array([0])), self.use)
        return float(max(begin.max(), onward.max()))

    def _grown(self, runs: list[Run], effort: int = 1) -> bool:
        last = len(self.seeing.t) - 1
        return grow(runs, self.seen, last, self.parameters, self.use, self.progress, effort=effort)

    def _started(self, convention: Convention, count: int, seed: int) -> Run:
        problem = with_axes(self.problem, convention)
        rng = np.random.default_rng([self.settings.seed, seed])
        guesses = first_guesses(sights_of(problem, self.seeing), 0, count, self.fastest, rng)
        starts = guesses.starts(np.zeros(len(self.parameters.everything)))
        if self.silent.panels:
            sights = sights_of(problem, self.silent.left_out(self.seeing))
            guesses = first_guesses(sights, 0, count, self.fastest, rng)
            starts = starts.followed_by(guesses.starts(self.silent.unknowns(self.parameters)))
        return Run(convention, problem, starts)


def seen_rate(sights: Sights) -> float:
    """A rate that the satellite is not much faster than, as far as gyroscope or finite turns show it [rad/s]."""
    known = np.isfinite(sights.rate).all(axis=1)
    if known.any():
        return 1.3 * float(np.quantile(np.linalg.norm(sights.rate[known], axis=1), 0.9))
    fastest = 0.0
    for directions in sights.directions:
        good = np.flatnonzero(np.isfinite(directions.body).all(axis=1))
        if len(good) > 3:
            angle = angles_between(directions.body[good[1:]], directions.body[good[:-1]])
            # A direction that turns with the body at less than its whole rate: the axis may lie near it.
            fastest = max(fastest, 1.3 * float(np.quantile(angle / np.diff(sights.t[good]), 0.8)))
    return fastest
