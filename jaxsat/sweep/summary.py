"""The numbers that sum a sweep up: how many cases succeeded, and the distribution of each metric."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jaxsat.sweep.merge import read_metric
from jaxsat.sweep.names import title_of
from jaxsat.sweep.plan import SweepPlan
from jaxsat.sweep.scenario import Metric, Scenario, as_numbers

SCHEMA = "jaxsat.sweep/1"
PERCENTILES = {"p05": 5.0, "p50": 50.0, "p95": 95.0}
BINS, FEWEST_BINS = 60, 12
"""Most bins of a histogram and fewest; between them twice the root of the number of cases."""
_WIDE = 50.0
"""A positive metric whose 95th percentile is this many times its 5th is counted in logarithmic bins."""
_NOTHING = 1e-9
"""What is less than so much of the 95th percentile counts as zero for the axis: rounding is no outcome."""
_WHOLE = 1e15
"""Beyond it every number is whole."""
_TAIL = 1.5
"""Bins end this many widths (5th to 95th percentile) beyond the percentiles: one stray case must not squash all."""


@dataclass(frozen=True)
class MetricSummary:
    """Distribution of one metric over the cases that have it."""

    name: str
    unit: str
    percentiles: dict[str, float]
    """p05, p50, p95 and max, NaN where no case has it."""
    missing: int
    """Cases without it: not a finite number."""
    edges: np.ndarray
    """Of the bins, in the metric's unit; empty where no case has it."""
    succeeded: np.ndarray
    """Cases of each bin that succeeded."""
    failed: np.ndarray
    """Those that did not."""
    beyond: int
    """Cases below the first bin or above the last."""
    all_cases: dict[str, float] | None = None
    """p05, p50 and p95 of an endless metric with those cases in it that do not have it, inf for them."""
    over: dict[str, float] | None = None
    """The limit, and the share of all cases that are beyond it, or do not have an endless metric."""
    cases: int = 0
    """Cases that have it: those of the percentiles."""
    meaning: str = ""

    @property
    def whole(self) -> bool:
        """Whether bins end between two whole numbers: then it counts something."""
        return self.edges.size > 1 and bool(np.all((self.edges - 0.5) % 1.0 == 0.0))

    def shown(self, name: str) -> float:
        """A percentile as people read it: zero where it is zero but for rounding."""
        value = self.percentiles[name]
        return 0.0 if abs(value) <= _NOTHING * abs(self.percentiles["p95"]) else value

    @property
    def title(self) -> str:
        """Its name for people, without the unit."""
        return title_of(self.name, self.unit)

    @property
    def logarithmic(self) -> bool:
        """Whether the bins are equal in the logarithm."""
        return self.edges.size > 2 and not math.isclose(
            self.edges[1] - self.edges[0], self.edges[-1] - self.edges[-2], rel_tol=1e-6
        )


def summarise(scenario: Scenario, directory: Path, status: np.ndarray) -> list[MetricSummary]:
    """Distribution of each metric of a merged sweep with the given status numbers [cases]; one column at a time."""
    return [
        summarise_metric(name, metric, read_metric(directory, name), status == 0)
        for name, metric in scenario.metrics.items()
    ]


def summarise_metric(name: str, metric: Metric, values: np.ndarray, success: np.ndarray) -> MetricSummary:
    """Distribution of a metric [cases], apart for cases with and without success."""
    unit, known = metric.unit, np.isfinite(values)
    all_cases, over = None, None
    reached = np.where(known, values, np.inf) if metric.endless else values
    if metric.endless:
        # Those of cases that are there: between a number and infinity is nothing.
        marks = np.percentile(reached, list(PERCENTILES.values()), method="nearest")
        all_cases = dict(zip(PERCENTILES, marks.tolist(), strict=True))
    if metric.limit is not None:
        over = {"limit": metric.limit, "share": float(np.mean(reached > metric.limit))}
    found = values[known]
    missing, none = int(values.size - found.size), np.zeros(0)
    if found.size == 0:
        nothing = dict.fromkeys([*PERCENTILES, "max"], math.nan)
        return MetricSummary(name, unit, nothing, missing, none, none, none, 0, all_cases, over, 0, metric.meaning)
    marks = np.percentile(found, list(PERCENTILES.values()))
    percentiles = dict(zip(PERCENTILES, marks.tolist(), strict=True)) | {"max": float(found.max())}
    edges = _edges(found, marks[0], marks[-1])
    good = np.histogram(found[success[known]], edges)[0]
    bad = np.histogram(found[~success[known]], edges)[0]
    beyond = int(found.size - good.sum() - bad.sum())
    return MetricSummary(
        name, unit, percentiles, missing, edges, good, bad, beyond, all_cases, over, found.size, metric.meaning
    )


def _edges(values: np.ndarray, p05: float, p95: float) -> np.ndarray:
    low, high = float(values.min()), float(values.max())
    bins = min(BINS, max(FEWEST_BINS, math.ceil(2.0 * math.sqrt(values.size))))
    if np.all(values == np.round(values)) and abs(low) < _WHOLE and abs(high) < _WHOLE:
        return _whole_edges(low, high, p05, p95, bins)
    # No axis goes down into rounding, as of an angle that is zero but for the last bits.
    wide = low > _NOTHING * p95 and p95 > _WIDE * p05
    if wide:
        low, high, p05, p95 = (math.log(x) for x in (low, high, p05, p95))
    tail = _TAIL * (p95 - p05)
    low, high = max(low, p05 - tail), min(high, p95 + tail)
    if not high > low:
        # All alike: one bar in the middle.
        half = 0.5 * abs(low) or 0.5
        low, high = low - half, high + half
    edges = np.linspace(low, high, bins + 1)
    return np.exp(edges) if wide else edges


def _whole_edges(low: float, high: float, p05: float, p95: float, bins: int) -> np.ndarray:
    """Of numbers that are whole: each bin holds as many of them, and ends between two."""
    tail = _TAIL * (p95 - p05)
    first, last = max(low, math.floor(p05 - tail)), min(high, math.ceil(p95 + tail))
    width = math.ceil((last - first + 1.0) / bins)
    count = math.ceil((last - first + 1.0) / width)
    return first - 0.5 + width * np.arange(count + 1.0)


def interval_of(count: int, cases: int, share: float = 0.95) -> tuple[float, float]:
    """Within which the true share lies of which `count` of `cases` came out (Clopper & Pearson 1934)."""
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - share)
    low = 0.0 if count == 0 else float(betaincinv(count, cases - count + 1, tail))
    high = 1.0 if count == cases else float(betaincinv(count + 1, cases - count, 1.0 - tail))
    return low, high


def document(
    scenario: Scenario, plan: SweepPlan, status: np.ndarray, metrics: list[MetricSummary], **timing: Any
) -> dict[str, Any]:
    """Content of summary.json; `timing` holds timing_s, cases_per_s and whatever else the run says of itself."""
    counts = np.bincount(status, minlength=len(scenario.statuses))
    low, high = interval_of(int(counts[0]), plan.cases)
    return {
        "schema": SCHEMA,
        "scenario": plan.scenario,
        "cases": plan.cases,
        "seed": plan.seed,
        "options": as_numbers(plan.options),
        "assumptions": list(scenario.assumptions),
        "chunk": plan.chunk,
        "precision": plan.precision,
        "succeeded": int(counts[0]),
        "success": {"share": int(counts[0]) / plan.cases, "low": low, "high": high, "of": plan.cases},
        "statuses": dict(zip(scenario.statuses, counts.tolist(), strict=True)),
        "failed": np.flatnonzero(status).tolist(),
        "metrics": {m.name: _told(m) for m in metrics},
        **timing,
    }


def _told(metric: MetricSummary) -> dict[str, Any]:
    found: dict[str, Any] = {"unit": metric.unit, **metric.percentiles, "of": metric.cases, "missing": metric.missing}
    cases = metric.cases + metric.missing
    more = {
        name: part and {**part, "of": cases} for name, part in (("all_cases", metric.all_cases), ("over", metric.over))
    }
    return found | {key: value for key, value in more.items() if value is not None}
