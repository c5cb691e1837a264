"""A motion found from a sample on, carried to what lies before it: to the first sample of the session."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.parameters.free import FreeParameters
from fitting.starts.carry import carried_back
from fitting.starts.cloud import CLOUD, FEW, FEWEST, LARGER, cloud, settled, strange
from fitting.starts.multi_start import CHUNK, Starts
from jaxsat.satellites.model import Model


@dataclass(frozen=True)
class Before:
    """The session that begins before the search does."""

    samples: Samples
    """All of them."""
    model: Model
    around: Around
    parameters: FreeParameters
    problem_from: Callable[[int], Problem]
    """The problem of the samples from that number on."""
    use: np.ndarray
    """[samples channels] weight of the measurements, 0 where held out."""
    seen: np.ndarray
    """Numbers of the samples that see something and are fitted."""
    last: int
    """Number of the last sample that is fitted."""

    def carried(self, starts: Starts, begin: int, max_step: float) -> Starts:
        """Starts at sample `begin`, best first, as starts at the first one; steps of `max_step` [s] at most.

        Where they do not explain what lies before, as when a shadow parts it from them, they grow into it.
        """
        at_once = self._carry(starts, begin, 0, max_step)
        few = at_once.take(np.arange(min(CHUNK, len(at_once.cost))))
        if len(few.cost) and not strange(self._settled(few, 0), len(self.seen)):
            return at_once
        grown = self._grown(starts, begin, max_step)
        return at_once if grown is None else grown

    def _grown(self, starts: Starts, begin: int, max_step: float) -> Starts | None:
        """The same on arcs that begin ever earlier; None where no motion explains one of them."""
        rng = np.random.default_rng(begin)
        more, drawn, seen = FEW, CLOUD, self.seen
        while begin > 0:
            problem, use = self._part(begin)
            around = cloud(problem, self.parameters, self.last - begin, starts, use, rng, drawn)
            before = seen[seen < begin]
            taken = more if 1.5 * more < len(before) else len(before)
            earlier = int(before[-taken]) if taken < len(before) else 0
            found = self._settled(self._carry(around, begin, earlier, max_step), earlier)
            if not strange(found, taken, float(starts.cost[0])):
                starts, begin, more, drawn = found, earlier, 2 * more, CLOUD
            elif taken >= 2 * FEWEST:
                more = taken // 2
            elif drawn == CLOUD:
                drawn = LARGER * CLOUD
            else:
                return None
        return starts

    def _carry(self, starts: Starts, begin: int, earlier: int, max_step: float) -> Starts:
        part = self.samples.part(slice(earlier, None))
        return carried_back(starts, self.parameters, part, begin - earlier, self.model, self.around, max_step)

    def _settled(self, starts: Starts, begin: int) -> Starts:
        problem, use = self._part(begin)
        return settled(problem, self.parameters, starts, self.last - begin, use)

    def _part(self, begin: int) -> tuple[Problem, np.ndarray]:
        """The problem from a sample on, and the weight of its measurements."""
        problem = self.problem_from(begin)
        use = np.zeros((len(problem.valid), self.use.shape[1]))
        own = self.use[begin : len(self.samples.t)]
        use[: len(own)] = own
        return problem, use
