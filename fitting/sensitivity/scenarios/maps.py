"""Sigmas of many starts: a sweep's scenario whose cases are starts of one plan, one compiled program for all.

Cases of one instant share orbit, field and Sun, which are worked out once and kept as long as there is room.
"""

import functools
import threading
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from fitting.measurements.assembly import build_problem
from fitting.measurements.problem import Problem
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.quoted import quoted_names, quoted_slopes, quoted_units
from fitting.sensitivity.choice import slopes_at_nominal
from fitting.sensitivity.plan import Columns, around_at, planned_samples, planned_weight, step_of
from fitting.sensitivity.scenarios.draws import EACH, Drawn, Draws, drawn
from fitting.sensitivity.scenarios.program import BATCH, sums
from fitting.sensitivity.sums import Sigmas, sigmas_of
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import MAGNET_PLACE, POLAR_PLACE, Leaf
from jaxsat.sweep import Input, Metric, Scenario
from jaxsat.synthetic.twins import TwinSettings
from jaxsat.synthetic.twins.source import epoch_of

CHUNK = 8 * EACH
"""Scenarios of a chunk: eight instants."""
ROOM_BYTES = 2**28
"""For what belongs to instants."""
TOLERANCE = 5e-3
"""Error of the integrated attitude at the fastest spin [rad]: a sigma is off by 2e-4 in the median and by 2 % in the
worst of 512 cases that were tried with steps five times as short."""
NAME = "sensitivity"
OWN = {
    "sun_deg": Metric("deg", "of the Sun above the orbit's plane"),
    "lit": Metric("1", "share of the arc in sunlight"),
    "attitude_sigma_deg": Metric("deg", "1-sigma of the attitude, RMS over the arc of three axes together", True),
    "attitude_sigma_noise_deg": Metric("deg", "the same from noise and priors alone", True),
    "attitude_sigma_assumed_deg": Metric("deg", "the same from the considered numbers alone"),
}


@dataclass(frozen=True)
class Spread:
    """A number of the satellite that differs from case to case."""

    leaf: Leaf
    """With the sigma that it is drawn with."""
    place: int
    """Among the leaves."""


@dataclass(frozen=True)
class Instant:
    """What the cases of one instant share."""

    problem: Problem
    weight: np.ndarray
    blocks: np.ndarray
    samples: int
    sun_deg: float
    lit: float


class StartsMap:
    """Starts of a plan's arc, and what would be known of each."""

    def __init__(
        self,
        satellite: Satellite,
        flown: Satellite,
        plan: TwinSettings,
        draws: Draws,
        *,
        names: Sequence[str],
        considered: dict[str, float],
        spread: dict[str, float],
        columns: Columns,
    ):
        """`flown` is the satellite on its orbit, `names` are fitted, `considered` and `spread` have their sigmas [SI].

        Raises `InputError` for a motion that is given: it has no start.
        """
        if satellite.motion.kind != "free":
            reason = "the motion is given: there is no start to be drawn"
            raise InputError(reason, file=satellite.path, field="motion.kind")
        self.satellite, self.flown, self.plan, self.draws, self.commanded = satellite, flown, plan, draws, columns
        self.first = epoch_of(flown, plan)
        self.step = step_of(np.radians(draws.fastest_deg_s), np.array([0.0, plan.duration_s]), TOLERANCE)
        numbers = {leaf.name: k for k, leaf in enumerate(satellite.leaves)}
        self.spread = [
            Spread(replace(satellite.leaves[numbers[name]], sigma=sigma), numbers[name])
            for name, sigma in spread.items()
        ]
        self.parameters, self.unknowns = _unknowns(satellite, names, tuple(considered))
        self.considered = considered
        self.columns = _columns(satellite, self.parameters, self.unknowns, considered)
        kept = {name for name, on in zip(self.parameters.names, self.parameters.everything, strict=True) if on}
        quoted = zip(quoted_names(self.parameters), quoted_units(self.parameters), strict=True)
        self.rows = [(name, unit) for name, unit in quoted if name in kept]
        late = {satellite.leaves[k].place for k in (numbers[n] for n in (*names, *considered, *spread))}
        self.delayed = tuple(name for name in satellite.channels if f"delays.{name}" in late)
        self._instants: OrderedDict[int, Instant] = OrderedDict()
        self._lock = threading.Lock()
        self._most = 1
        self._drawn = functools.lru_cache(maxsize=8)(self._draw)

    @property
    def scenario(self) -> Scenario:
        """What a sweep runs."""
        metrics = OWN | {
            column_of(name, unit): Metric(unit, f"1-sigma of {name}", endless=True) for name, unit in self.rows
        }
        inputs = [
            Input("instant", "s", "of the start, after that of the plan", self._instants_s),
            Input("attitude", "1", "inertial from body, scalar first", lambda d: d.attitude, ("w", "x", "y", "z")),
            Input("rate", "deg/s", "body axes", lambda d: np.degrees(d.rate), ("x", "y", "z")),
        ]
        for row, each in enumerate(self.spread):
            name, factor = each.leaf.name.replace(".", "_"), each.leaf.to_unit
            about = f"{each.leaf.name} of the satellite"
            inputs.append(Input(name, each.leaf.unit, about, lambda d, r=row, f=factor: f * d.numbers[:, r]))
        return Scenario(
            NAME,
            ("told", "attitude unknown"),
            metrics,
            CHUNK,
            self.run,
            inputs=tuple(inputs),
            draw=lambda seed, cases: self._drawn(seed, int(cases[0]), len(cases)),
            only_float64="information matrices need its digits",
        )

    def _instants_s(self, found: Drawn) -> np.ndarray:
        return self.draws.instants_s[found.instant]

    def _draw(self, seed: int, first: int, count: int) -> Drawn:
        spread = [each.leaf for each in self.spread]
        return drawn(self.draws, self.satellite, spread, seed, np.arange(first, first + count))

    def run(self, seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        """Status and metrics of consecutive cases, whole instants of `EACH`."""
        starts = self._drawn(seed, int(cases[0]), len(cases))
        parts = [self._of_instant(Drawn(*(each[k : k + EACH] for each in starts))) for k in range(0, len(cases), EACH)]
        found = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        return {"status": np.where(np.isfinite(found["attitude_sigma_deg"]), 0, 1), **found}

    def _of_instant(self, starts: Drawn) -> dict[str, np.ndarray]:
        at = self.instant(int(starts.instant[0]))
        nominal = np.asarray(self.unknowns.tree.nominal, float)
        if self.spread:
            nominal = np.tile(nominal, (len(starts.rate), 1))
            nominal[:, [each.place for each in self.spread]] = starts.numbers
        parts = []
        for k in range(0, len(starts.rate), BATCH):
            own = slice(k, k + BATCH)
            given = (starts.rate[own], starts.attitude[own], nominal[own] if self.spread else nominal, at.blocks)
            parts.append(jax.device_get(sums(at.problem, self.unknowns.tree, at.weight, *given)))
        told, turned = (np.concatenate(each) for each in zip(*parts, strict=True))
        if self._own_columns:
            each = [
                _sigmas(G, M, at.samples, self._columns_at(row))
                for G, M, row in zip(told, turned, nominal, strict=True)
            ]
            found = Sigmas(*(np.stack(group) for group in zip(*(vars(one).values() for one in each), strict=True)))
        else:
            found = _sigmas(told, turned, at.samples, self.columns)
        own = {
            "attitude_sigma_deg": np.degrees(found.attitude),
            "attitude_sigma_noise_deg": np.degrees(found.attitude_noise),
            "attitude_sigma_assumed_deg": np.degrees(found.attitude_assumed),
        }
        both = {"sun_deg": np.full(len(told), at.sun_deg), "lit": np.full(len(told), at.lit)}
        return both | own | {column_of(*row): found.total[:, k] for k, row in enumerate(self.rows)}

    @property
    def _own_columns(self) -> bool:
        """Whether the fit's unknowns move other numbers otherwise where the spread ones are elsewhere."""
        tree = self.parameters.tree
        curved = {
            k for gauge, on in zip(tree.gauges, np.asarray(tree.gauge_on), strict=True) if on for k in gauge.leaves
        }
        if float(np.asarray(tree.by_angles)) > 0.0:
            curved |= {k for k, leaf in enumerate(self.parameters.leaves) if leaf.place == MAGNET_PLACE}
        return any(each.place in curved for each in self.spread)

    def _columns_at(self, nominal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        values = dict(enumerate(nominal.tolist()))
        leaves = self.parameters.leaves
        polar = [k for k, leaf in enumerate(leaves) if leaf.place == POLAR_PLACE]
        if polar:
            x, y, z = nominal[[k for k, leaf in enumerate(leaves) if leaf.place == MAGNET_PLACE]]
            across = np.hypot(x, y)
            values |= dict(zip(polar, (np.hypot(across, z), np.arctan2(y, x), np.arctan2(z, across)), strict=True))
        return _columns(self.satellite, self.parameters.with_nominal(values), self.unknowns, self.considered)

    def instant(self, number: int) -> Instant:
        """What belongs to an instant, kept while there is room for it."""
        # One at a time: the first one traces, and who wants the same one next waits for it.
        with self._lock:
            if number not in self._instants:
                self._instants[number] = made = self._made(number)
                size = sum(np.asarray(leaf).nbytes for leaf in jax.tree.leaves((made.problem, made.weight)))
                self._most = max(1, ROOM_BYTES // max(size, 1))
            self._instants.move_to_end(number)
            while len(self._instants) > self._most:
                self._instants.popitem(last=False)
            return self._instants[number]

    def _made(self, number: int) -> Instant:
        epoch = self.first.shifted(float(self.draws.instants_s[number]))
        around = around_at(self.flown, epoch, self.plan.duration_s)
        samples = planned_samples(self.satellite, self.plan, epoch, self.commanded)
        step = self.step
        problem = build_problem(
            samples, self.satellite.model, around, delayed=self.delayed, max_step=step, room_for=step
        )
        blocks = problem.grid.blocks_to(int(np.flatnonzero(problem.valid)[-1]))
        sun = _sun(problem, around.sun_eci(samples.epoch, samples.t[:1])[0])
        return Instant(problem, planned_weight(problem, samples), blocks, len(samples.t), *sun)


def column_of(name: str, unit: str) -> str:
    """Of the sigma of a number, the unit in its name."""
    return f"{name}_sigma" + ("" if unit == "1" else "_" + unit.replace("/", "_").replace(" ", "_"))


def _unknowns(
    satellite: Satellite, free: Sequence[str], considered: Sequence[str]
) -> tuple[FreeParameters, FreeParameters]:
    """Those of the fit, and those that derivatives are taken by: each leaf of the choice by itself."""
    about = satellite.model, satellite.leaves
    parameters = free_parameters(*about, free, held=satellite.held)
    restated = {leaf.name for leaf in satellite.leaves if leaf.restates}
    own = {*free, *considered} - restated
    own |= {leaf.name for leaf in satellite.leaves if leaf.name in parameters.restated}
    found = free_parameters(*about, tuple(own))
    off = np.asarray(0.0)
    return parameters, replace(found, tree=replace(found.tree, keeps_body=off, by_angles=off))


def _columns(
    satellite: Satellite, parameters: FreeParameters, unknowns: FreeParameters, sigmas: dict[str, float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """[unknowns, fitted + considered] of the program's unknowns, [fitted] priors, and slopes of what is quoted."""
    jacobian, kept = slopes_at_nominal(parameters), parameters.everything
    known = unknowns.columns >= 0
    place = {int(k): len(STATE) + n for n, k in enumerate(unknowns.columns) if k >= 0}
    found = np.zeros((len(STATE) + len(known), len(kept)))
    found[: len(STATE), : len(STATE)] = np.eye(len(STATE))
    scale = unknowns.sigma()
    for k, row in place.items():
        found[row, len(STATE) :] = jacobian[k] / scale[row - len(STATE)]
    considered = np.zeros((len(found), len(sigmas)))
    numbers = {leaf.name: k for k, leaf in enumerate(satellite.leaves)}
    for column, (name, sigma) in enumerate(sigmas.items()):
        row = place[numbers[name]]
        considered[row, column] = sigma / scale[row - len(STATE)]
    own = _kept(parameters.names, kept)
    rows = [k for k, name in enumerate(quoted_names(parameters)) if name in own]
    slopes = quoted_slopes(parameters, jacobian)[rows][:, kept]
    prior = (np.flatnonzero(kept) >= len(STATE)).astype(float)
    return np.hstack([found[:, kept], considered]), prior, slopes


def _kept(names: Iterable[str], kept: np.ndarray) -> set[str]:
    return {name for name, on in zip(names, kept, strict=True) if on}


def _sigmas(told: np.ndarray, turned: np.ndarray, samples: int, columns) -> Sigmas:
    choice, prior, slopes = columns
    told, turned = (choice.T @ each @ choice for each in (told, turned))
    finite = np.isfinite(told).all(axis=(-2, -1)) & np.isfinite(turned).all(axis=(-2, -1))
    # A motion that its steps cannot follow tells nothing.
    mask = np.asarray(finite)[..., None, None]
    told, turned = (np.where(mask, each, 0.0) for each in (told, turned))
    found = sigmas_of(told, turned, np.full(told.shape[:-2], samples), prior, slopes)
    return replace(
        found,
        noise=np.where(mask[..., 0], found.noise, np.inf),
        attitude_noise=np.where(finite, found.attitude_noise, np.inf),
    )


def _sun(problem: Problem, sun: np.ndarray) -> tuple[float, float]:
    """Angle of the Sun above the orbit's plane [deg], and the share of the arc that is lit; 1 where nobody looks."""
    r, v = (np.asarray(each)[0] for each in (problem.sky.position_eci, problem.sky.velocity_eci))
    normal = np.cross(r, v)
    beta = float(np.degrees(np.arcsin(np.clip(normal @ sun / np.linalg.norm(normal), -1.0, 1.0))))
    if problem.sky.light is None:
        return beta, 1.0
    return beta, float(np.asarray(problem.sky.light.illumination)[np.asarray(problem.valid)].mean())
