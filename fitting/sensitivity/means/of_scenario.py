"""Slopes of the means of a scenario's metrics by its knobs, for the scenarios of every closed loop alike."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.sensitivity.means.exact import ExactSlopes, exact_slopes
from fitting.sensitivity.means.pairs import WIDTH, MeanSlopes, mean_and_error, pushes, slopes_of_pairs
from fitting.sensitivity.means.runs import run_all
from fitting.sensitivity.means.wording import SUCCESS
from jaxsat.errors import InputError
from jaxsat.sweep.knobs.knob import Knob, places_of
from jaxsat.sweep.scenario import Metric, Scenario

FEWEST = 8
"""Cases that a study takes."""


@dataclass(frozen=True)
class MetricSlopes:
    """What the knobs do to the mean of one metric."""

    metric: Metric
    mean: float
    """Over the cases as they are; `slopes.mean` is that with the knobs spread."""
    mean_sigma: float
    without: dict[str, int]
    """Cases that have no value as they are, by how they ended."""
    horizon_s: float | None
    """Where it is set, cases without it count as this long: the mean is the restricted one."""
    slopes: MeanSlopes
    exact: ExactSlopes | None
    """Means of the cases' own derivatives, where they were asked for."""


@dataclass(frozen=True)
class ScenarioSlopes:
    """What knobs of a scenario do to the means of its metrics."""

    scenario: Scenario
    knobs: tuple[Knob, ...]
    metrics: dict[str, MetricSlopes]
    cases: int
    seed: int
    width: float
    together: bool
    ended: dict[str, int]
    """Cases as they are, by how they ended."""
    seconds: float


def slopes_of_means(
    scenario: Scenario,
    knobs: Sequence[str] | None = None,
    metrics: Sequence[str] | None = None,
    *,
    cases: int = 500,
    seed: int = 0,
    width: float = WIDTH,
    together: bool = False,
    at: Mapping[str, float] | None = None,
    exact: bool = False,
    progress: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> ScenarioSlopes:
    """Mean and slopes of each metric of a scenario, and of `success`, by each knob; all of them where none is named.

    Cases are those of a sweep of the same seed. The `width` is that of a knob's move, so relative of one that is moved
    by factors. Knobs are moved each alone, to both sides by the width, or all of them `together` by normal numbers: see
    `fitting.sensitivity.means.pairs`. Slopes are taken `at` moves of knobs by their names, none by default. With
    `exact` the mean of each case's own derivative stands beside: right where no case jumps, no guide where one does.

    A case that has no value of an endless metric, as a settling time, counts as the scenario's simulated time: that is
    the restricted mean (Royston & Parmar 2013), which every case has. Of any other metric a pair of runs is left out
    where a side has none, and counted. Raises `InputError` for a scenario without knobs, for names that are none, and
    with `exact` for a scenario that is not written in JAX throughout.
    """
    began = time.perf_counter()
    if not scenario.knobs:
        raise InputError(f"scenario {scenario.name} has no knobs, by which means could be differentiated")
    if cases < FEWEST:
        raise InputError(f"expected at least {FEWEST}, found {cases}", field="cases")
    if not (np.isfinite(width) and 0.0 < width <= 1.0):
        raise InputError(f"expected a number above 0 and at most 1, found {width:g}", field="width")
    names = [knob.name for knob in scenario.knobs]
    chosen = list(range(len(names))) if knobs is None else places_of(knobs, names, "knob")
    known = [SUCCESS, *scenario.metrics]
    wanted = known if metrics is None else [known[place] for place in places_of(metrics, known, "metric")]
    middle = np.zeros(len(names))
    middle[places_of(at or {}, names, "knob")] = list((at or {}).values())
    moves = pushes(cases, chosen, len(names), width=width, seed=seed, together=together)
    all_moves = [np.zeros_like(moves[0]), *moves, *(-push for push in moves)]
    total, done = len(all_moves) * cases, 0

    def count(more):
        nonlocal done
        done += more
        progress("running cases", done, total)

    progress("running cases", 0, total)
    plain, *sides = run_all(scenario, seed, [middle + each for each in all_moves], done=count)
    derivatives = exact_slopes(scenario, seed, cases, middle, chosen, progress) if exact else {}
    found = {}
    for name in wanted:
        metric, horizon, values = _reading(scenario, name)
        nominal, *both = (values(one) for one in (plain, *sides))
        high, low = both[: len(moves)], both[len(moves) :]
        slopes = slopes_of_pairs(moves, high, low, chosen)
        if name == SUCCESS:
            slopes = _counted(slopes, width, cases)
        missing = ~np.isfinite(nominal) if horizon is None else ~np.isfinite(plain[name])
        without = _by_status(scenario, plain["status"][missing])
        mean, error = mean_and_error(nominal[np.isfinite(nominal)])
        own = derivatives[name].beside(slopes, restricted=horizon is not None) if name in derivatives else None
        found[name] = MetricSlopes(metric, mean, error, without, horizon, slopes, own)
    picked = tuple(scenario.knobs[place] for place in chosen)
    ended = _by_status(scenario, plain["status"])
    return ScenarioSlopes(scenario, picked, found, cases, seed, width, together, ended, time.perf_counter() - began)


def _reading(scenario: Scenario, name: str):
    """A metric, the horizon of its restricted mean, and its values [cases] from what a run gave."""
    if name == SUCCESS:
        success = Metric("1", "share of the cases that succeeded")
        return success, None, lambda found: (found["status"] == 0).astype(float)
    metric = scenario.metrics[name]
    horizon = scenario.horizon_s if metric.endless and metric.unit == "s" else None
    if horizon is None:
        return metric, None, lambda found: found[name]
    return metric, horizon, lambda found: np.where(np.isfinite(found[name]), found[name], horizon)


def _counted(slopes: MeanSlopes, width: float, cases: int) -> MeanSlopes:
    """Of a metric that counts: no error is less than if one more pair had differed."""
    least = 0.5 / (width * cases)
    sigma = np.maximum(slopes.sigma, least)
    return MeanSlopes(slopes.mean, slopes.mean_sigma, slopes.slopes, sigma, slopes.left_out, slopes.influence)


def _by_status(scenario: Scenario, status: np.ndarray) -> dict[str, int]:
    counts = np.bincount(status.astype(int), minlength=len(scenario.statuses))
    return {name: int(count) for name, count in zip(scenario.statuses, counts, strict=True) if count}
