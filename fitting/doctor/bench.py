"""Where causes are tried: the data of a fit with something about them changed, fitted again by the same programs.

Another order of columns, another free set, a shift of stamps, a scale are data to the compiled programs of the fit, so
that a trial costs its solving alone.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np

from fitting.doctor.score import Score
from fitting.doctor.trial import EXPLAINED
from fitting.identify import Identified
from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.groups import columns_of, over_columns
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.outcome.looking import look
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE
from fitting.settings import FitSettings
from fitting.solvers.refine import Refined, refine
from fitting.starts.multi_start import FEW, Starts
from fitting.starts.search import seen_rate
from fitting.starts.sights import sights_of
from jaxsat.given import Given
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession

PATIENCE = 1
"""Rounds more of a refit that is not at its minimum: what explains the data gets there soon."""
WITNESS_LIMIT = 25.0
"""Square of a witness's residual that counts at most [sigma^2]."""
HOPELESS = 12.0
"""Chi2 per reading, large residuals cut off, of what no change nearby explains."""
TOLERANCE = 4e-2
"""Integration error of a search [rad]: as while arcs grow."""


@dataclass(frozen=True)
class Bench:
    """A fit that was denied, with what it was made of."""

    found: Identified
    around: Around
    settings: FitSettings
    delayed: tuple[str, ...]
    satellite: Satellite
    session: TableSession
    """What was read."""
    given: Given | None = None
    missed_m: float | None = None
    """By which positions miss their orbit, RMS of a coordinate."""

    @property
    def samples(self) -> Samples:
        """All that was measured."""
        return self.found.samples

    @property
    def parameters(self) -> FreeParameters:
        """What was free."""
        return self.found.parameters

    @property
    def problem(self) -> Problem:
        """That of the best minimum."""
        return self.found.minima[0].problem

    def of_everything(self) -> "Bench":
        """The same with nothing held out, its minima refitted to all."""
        whole = replace(self, found=replace(self.found, fitted=len(self.samples.t)))
        best = self.found.minima[0]
        refined = whole.refitted(best.problem)
        return replace(whole, found=replace(whole.found, minima=(replace(best, refined=refined),)))

    @cached_property
    def starts(self) -> Starts:
        """The few best minima."""
        points = self.found.minima[0].refined.points
        x, reference = (np.asarray(leaf)[:FEW] for leaf in (points.x, points.reference))
        return Starts(x, reference, np.zeros(len(x)))

    def values_at(self, x: np.ndarray) -> np.ndarray:
        """[leaves] SI, of unknowns."""
        return np.array(self.parameters.tree.values(jnp.asarray(x[len(STATE) :])), float)

    @cached_property
    def chi2(self) -> float:
        """Of the fit as it was."""
        return self.chi2_of(self.problem, self.found.minima[0].refined)

    @cached_property
    def of_witnesses(self) -> float:
        """What witnesses have of it."""
        return self.chi2 - 2.0 * float(self.found.minima[0].refined.score[0])

    @cached_property
    def readings(self) -> int:
        """That were fitted, but for zeros of faces that see nothing."""
        return self.told(self.weight(self.problem))

    def told(self, weight: np.ndarray) -> int:
        """Readings with a weight [samples channels] that are not those."""
        return int(((weight > 0) & (np.asarray(self.problem.floor) == NO_FLOOR)).sum())

    @cached_property
    def step(self) -> float:
        """Longest step of the best minimum's grid [s]."""
        return float(np.max(np.asarray(self.problem.grid.step), initial=0.0))

    def rebuilt(
        self, samples: Samples, around: Around | None = None, *, same_sky: bool = False, coarse: bool = False
    ) -> Problem:
        """The problem of other samples, or under another sky, in the shapes of the fit; `coarse` for a search."""
        return build_problem(
            samples,
            self.problem.model,
            around or self.around,
            whole=self.samples,
            delayed=self.delayed,
            max_step=self._search_step if coarse else self.step,
            room_for=self.found.finest_step,
            sky=self.problem.sky if same_sky else None,
        )

    def weight(self, problem: Problem, samples: Samples | None = None) -> np.ndarray:
        """[samples channels] of the measurements that were fitted."""
        samples = samples or self.samples
        found = usable(problem, samples)
        found[len(samples.t) - (len(self.samples.t) - self.found.fitted) :] = 0.0
        return found

    def refitted(
        self,
        problem: Problem,
        starts: Starts | None = None,
        *,
        weight: np.ndarray | None = None,
        parameters: FreeParameters | None = None,
    ) -> Refined:
        """Minima near the starts, by default those of the fit."""
        return refine(
            problem,
            parameters or self.parameters,
            starts or self.starts,
            self.weight(problem) if weight is None else weight,
            likelihood=self.settings.likelihood,
            patience=PATIENCE,
            progress=lambda *_: None,
        )

    @cached_property
    def fastest(self) -> float:
        """Rate that a search has to follow [rad/s]: that of the settings, or what sensors or the best minimum show.

        A minimum that is none of the data's shows nothing: a search up to its rate would have too few starts.
        """
        at_most = float(np.radians(self.settings.max_rate_deg_s))
        if self.hopeless:
            return max(at_most, seen_rate(sights_of(self.problem, self.samples)))
        rate = np.asarray(self.found.minima[0].refined.points.prediction.angular_velocity)[0]
        return max(at_most, float(np.linalg.norm(rate, axis=1).max()))

    @cached_property
    def _search_step(self) -> float:
        step = step_for(RK4, self.fastest, float(np.ptp(self.samples.t)), TOLERANCE)
        return max(min(self.settings.step_s, step), self.found.finest_step)

    def chi2_of(self, problem: Problem, refined: Refined, number: int = 0) -> float:
        """Twice the truncated cost of a minimum, and what witnesses have."""
        residual = np.asarray(refined.points.prediction.residual)[number]
        asked = np.minimum(residual**2, WITNESS_LIMIT)[self._asked(problem)]
        return float(2.0 * refined.score[number] + asked.sum())

    def _asked(self, problem: Problem) -> np.ndarray:
        """[samples channels] readings of witnesses."""
        found = np.array(problem.known, bool)
        for group, columns in zip(problem.groups, columns_of(problem.groups), strict=True):
            if not self.samples.channels[group.name].witness:
                found[:, columns] = False
        return found

    def best_of(self, problem: Problem, refined: Refined) -> tuple[float, int]:
        """Lowest chi2 with witnesses, and the number of its minimum; infinite where there is none."""
        found = [self.chi2_of(problem, refined, k) for k in range(len(refined.score))] or [np.inf]
        best = int(np.argmin(found))
        return found[best], best

    def chi2_near(
        self, problem: Problem, starts: Starts | None = None, *, parameters: FreeParameters | None = None
    ) -> float:
        """The lowest of the minima near the starts, by default near those of the fit."""
        return self.best_of(problem, self.refitted(problem, starts, parameters=parameters))[0]

    @cached_property
    def score(self) -> Score:
        """The best minimum, linearised, with what witnesses say."""
        residual, jacobian = self.look(self.problem, self.parameters, self.starts.x[0], self.starts.reference[0])
        free = self.parameters.everything
        weight = self.weight(self.problem) + self._asked(self.problem)
        # What is left out counts the same wherever it lies.
        left_out = np.asarray(self.found.minima[0].refined.limited[0])
        weight = np.where(over_columns(left_out, self.problem.groups), 0.0, weight)
        has_prior = (np.arange(len(free)) >= len(STATE))[free]
        x = np.where(has_prior, self.starts.x[0][free], 0.0)
        return Score(residual, jacobian[..., free], weight, np.asarray(self.problem.floor), x, has_prior)

    def look(self, problem: Problem, parameters: FreeParameters, x, reference) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [samples channels] and their Jacobian by all unknowns."""
        last = int(np.flatnonzero(problem.valid)[-1])
        blocks = problem.grid.blocks_to(last)
        return jax.device_get(look(problem, parameters.tree, x, reference, blocks)[:2])

    def columns(self, name: str) -> slice:
        """Of the residuals of a channel."""
        groups = self.problem.groups
        return next(own for group, own in zip(groups, columns_of(groups), strict=True) if group.name == name)

    @property
    def unexplained(self) -> float:
        """Chi2 beyond what noise has."""
        return max(self.chi2 - self.readings, 0.0)

    @property
    def hopeless(self) -> bool:
        """Whether no minimum is near that of the data: small changes help nothing."""
        return bool(self.chi2 > HOPELESS * self.readings)

    @property
    def enough(self) -> float:
        """Chi2 up to which data are explained."""
        return EXPLAINED * self.readings

    @cached_property
    def fits_light(self) -> bool:
        """Whether what was fitted is explained: witnesses alone deny."""
        refined = self.found.minima[0].refined
        return bool(2.0 * refined.score[0] < self.enough)

    def with_values(self, name: str, rows: np.ndarray) -> Samples:
        """The samples with other readings of one channel."""
        return replace(self.samples, values={**self.samples.values, name: rows})
