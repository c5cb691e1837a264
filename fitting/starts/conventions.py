"""Axes of sensors that nobody is sure of: which way each column reads, tried out and ranked."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Problem
from fitting.starts.ladder import finite_turn_rates
from fitting.starts.mounting import body_directions
from fitting.starts.sights import sights_of
from jaxsat.math.on_host import angles_between
from jaxsat.sensors.mounting import axes_text, signed_permutations

MOST = 24
"""Combinations of conventions that are searched further."""


@dataclass(frozen=True)
class Convention:
    """One way of reading the columns of the sensors whose axes are unknown."""

    axes: Mapping[str, np.ndarray]
    """[3 3] of each such sensor: row k is the body direction that column k reads."""
    mismatch: float
    """How badly directions and rates agree with each other, before any motion is fitted [sigma, RMS]."""

    def spelt(self) -> dict[str, list[str]]:
        """As a satellite file has them."""
        return {name: axes_text(axes) for name, axes in self.axes.items()}


def with_axes(problem: Problem, convention: Convention) -> Problem:
    """The problem whose sensors read so: other numbers, the same programs."""
    model = problem.model
    for name, axes in convention.axes.items():
        model = eqx.tree_at(lambda m, name=name: m.sensors[name].axes, model, jnp.asarray(axes))
    return eqx.tree_at(lambda p: p.model, problem, model)


def conventions(problem: Problem, samples: Samples, unknown: Mapping[str, str]) -> list[Convention]:
    """Conventions in the order of their mismatch, `MOST` at most; `unknown` maps sensors to unknown or mirrored."""
    if not unknown:
        return [Convention({}, 0.0)]
    # Directions first: rates are compared with the attitudes that follow from them.
    sighted = [name for name in unknown if problem.model.sensors[name].sees != "rate"]
    rates = [name for name in unknown if problem.model.sensors[name].sees == "rate"]
    found = [Convention({}, 0.0)]
    for name in [*sighted, *rates]:
        options = signed_permutations(unknown[name] == "mirrored")
        tried = [Convention({**old.axes, name: axes}, np.nan) for old in found for axes in options]
        tried = [Convention(each.axes, _mismatch(with_axes(problem, each), samples)) for each in tried]
        found = sorted(tried, key=lambda each: each.mismatch)[:MOST]
    return found


def _mismatch(problem: Problem, samples: Samples) -> float:
    sights = sights_of(problem, samples)
    squares = []
    for a, b in itertools.combinations(sights.directions, 2):
        between = [angles_between(a.body, b.body), angles_between(a.inertial, b.inertial)]
        difference = (between[0] - between[1]) / np.hypot(a.sigma, b.sigma).clip(np.radians(5.0))
        squares.append(np.minimum(difference[np.isfinite(difference)] ** 2, 25.0))
    if problem.motion is None:
        attitude, _ = sights.wahba()
    else:
        attitude = np.asarray(problem.motion.quaternion)[: len(sights.t)]
        for each in sights.directions:
            off = angles_between(each.body, body_directions(each, problem.motion))
            difference = off / each.sigma.clip(np.radians(5.0))
            squares.append(np.minimum(difference[np.isfinite(difference)] ** 2, 25.0))
    good = np.flatnonzero(np.isfinite(attitude).all(axis=1) & np.isfinite(sights.rate).all(axis=1))
    if len(good) > 2:
        turned = finite_turn_rates(sights.t[good], attitude[good])
        read = 0.5 * (sights.rate[good[1:]] + sights.rate[good[:-1]])
        scale = 0.3 * np.median(np.linalg.norm(read, axis=1)) + 1e-4
        squares.append(np.minimum(((turned - read) ** 2).sum(axis=1) / scale**2, 25.0))
    found = np.concatenate(squares) if squares else np.zeros(1)
    return float(np.sqrt(found.mean())) if len(found) else 0.0
