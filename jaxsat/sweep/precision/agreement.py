"""What single precision does to a sweep: its first cases in double precision too, and how far the two are apart."""

import dataclasses
import math
import multiprocessing
from collections.abc import Mapping
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from jaxsat.errors import InputError
from jaxsat.significant import count_text
from jaxsat.sweep.scenario import Metric, run_cases
from jaxsat.sweep.signals import deaf_children
from jaxsat.sweep.source import Source

OTHERWISE = 0.01
"""Share of the cases that may end otherwise for single precision to be good enough."""
OFF = 0.02
"""Median difference of a metric, over its spread, that is good enough."""
MOVED = 0.1
"""By how much of a metric's spread a percentile may move: cases that turn out otherwise, as chaotic ones, move some."""


def in_double(source: Source, seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
    """Status and metrics of `cases` [cases] in double precision on the CPU: in a process of its own.

    A process has one precision. `source` prepares with precision and device, as `jaxsat.numerics.set_up_jax` takes
    them; ValueError for one that does not. Raises `InputError` where the process ends without numbers.
    """
    if not source.prepare:
        raise ValueError("in_double: the source prepares nothing, so that its process has no precision")
    source = dataclasses.replace(source, arguments=("float64", "cpu"), chunk=0)
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, source, seed, cases), daemon=True)
    with deaf_children():
        process.start()
    sender.close()
    try:
        found = receiver.recv()
    except EOFError:
        found = "its process has died; is there memory enough?"
    finally:
        process.terminate()
        process.join()
    if isinstance(found, str):
        raise InputError(found, field="cases in float64, to compare with")
    return found


def _send(sender: Connection, source: Source, seed: int, cases: np.ndarray) -> None:
    try:
        found = run_cases(source.scenario(), seed, cases)
    except Exception as error:
        sender.send(f"{type(error).__name__}: {error}")
    else:
        sender.send(found)


def agreement(
    metrics: Mapping[str, Metric], double: Mapping[str, np.ndarray], single: Mapping[str, np.ndarray]
) -> dict[str, Any]:
    """How far the same cases are apart in both precisions; `double` and `single` have `status` and the metrics [cases].

    Of each metric the median and largest difference over the cases that have it in both, how many have it in one alone,
    the median over the metric's spread, from its 5th to its 95th percentile, and by how much of that spread the 5th,
    50th or 95th percentile moves at most. `holds` says whether all is within the limits.
    """
    cases = len(double["status"])
    otherwise = int(np.count_nonzero(double["status"] != single["status"]))
    apart = {
        name: {"unit": metric.unit, **_apart(np.asarray(double[name]), np.asarray(single[name]))}
        for name, metric in metrics.items()
    }
    # One of a few cases is no share.
    few = max(1.0, OTHERWISE * cases)
    beyond = [name for name, m in apart.items() if _off(m) > OFF or _moved(m) > MOVED or m["in_one_alone"] > few]
    holds = not beyond and otherwise <= few
    return {
        "cases": cases,
        "ends_otherwise": otherwise,
        "succeeded": {"float64": _succeeded(double), "float32": _succeeded(single)},
        "limits": {
            "ends_otherwise_share": OTHERWISE,
            "median_over_spread": OFF,
            "percentiles_over_spread": MOVED,
        },
        "holds": holds,
        "message": _message(cases, otherwise, apart, beyond, holds),
        "metrics": apart,
    }


def _succeeded(found: Mapping[str, np.ndarray]) -> int:
    return int(np.count_nonzero(found["status"] == 0))


def _apart(double: np.ndarray, single: np.ndarray) -> dict[str, Any]:
    both = np.isfinite(double) & np.isfinite(single)
    alone = int(np.count_nonzero(np.isfinite(double) != np.isfinite(single)))
    if not both.any():
        nothing = dict.fromkeys(("median", "largest"), math.nan)
        return {**nothing, "of": 0, "in_one_alone": alone, "median_over_spread": 0.0, "percentiles_over_spread": 0.0}
    off = np.abs(single - double)[both]
    marks, moved = (np.percentile(found[np.isfinite(found)], (5.0, 50.0, 95.0)) for found in (double, single))
    # What is the same in all cases is measured by itself.
    spread = float(marks[2] - marks[0]) or abs(float(marks[1])) or 1.0
    return {
        "median": float(np.median(off)),
        "largest": float(off.max()),
        "of": int(off.size),
        "in_one_alone": alone,
        "median_over_spread": float(np.median(off)) / spread,
        "percentiles_over_spread": float(np.abs(moved - marks).max()) / spread,
    }


def _message(cases: int, otherwise: int, metrics: Mapping[str, Any], beyond: list[str], holds: bool) -> str:
    some = str(otherwise) if otherwise else "none"
    ends = f"of {count_text(cases, 'case')} run in double precision too {some} end{'s' * (otherwise < 2)} otherwise"
    if holds:
        most, moved = (max(map(of, metrics.values()), default=0.0) for of in (_off, _moved))
        shares = (
            f"the median difference of a metric is at most {_percent(most)} of its spread, percentiles move by at most"
        )
        return f"Single precision holds here: {ends}; {shares} {_percent(moved)} of it."
    off = "".join(
        f"; {name} is off by {_percent(_off(metrics[name]))} of its spread in the median, and a percentile moves by "
        f"{_percent(_moved(metrics[name]))}, {count_text(metrics[name]['in_one_alone'], 'case')} having it in one alone"
        for name in beyond
    )
    limits = f"limits: {_percent(OTHERWISE)} of the cases; {_percent(OFF)}, {_percent(MOVED)}"
    return f"SINGLE PRECISION IS NOT GOOD ENOUGH HERE: {ends}{off} ({limits})."


def _off(metric: Mapping[str, Any]) -> float:
    return metric["median_over_spread"]


def _moved(metric: Mapping[str, Any]) -> float:
    return metric["percentiles_over_spread"]


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"
