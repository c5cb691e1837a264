"""Means of the cases' own derivatives, exact and by forward mode through their loops: a check of slopes of means.

Where no case jumps the derivative of the mean is the mean of the derivatives, without smoothing. Where cases switch,
count, or round their readings, as a magnetometer does with its digits, a derivative along the path of a case sees
nothing of the jumps, and in a chaotic motion it is of any size; both show as a difference from the slopes beyond their
error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.sensitivity.means.pairs import MeanSlopes, mean_and_error
from fitting.sensitivity.means.runs import in_chunks
from jaxsat.errors import InputError
from jaxsat.sweep.own_code import CodeError
from jaxsat.sweep.scenario import Scenario


@dataclass(frozen=True)
class ExactSlopes:
    """Mean derivatives of a metric, and how far slopes of its mean are from them."""

    slopes: np.ndarray
    """[knobs], by a move of 1."""
    sigma: np.ndarray
    """[knobs] sampling error, 1-sigma."""
    left_out: np.ndarray
    """[knobs] cases without a finite derivative."""
    apart: np.ndarray
    """[knobs] slope of the mean less this."""
    apart_sigma: np.ndarray
    """[knobs] 1-sigma of that: both are of the same cases."""


@dataclass(frozen=True)
class Derivatives:
    """Of each case."""

    values: np.ndarray
    """[cases knobs]"""
    have: np.ndarray
    """[cases] whether a case has the metric."""

    def beside(self, slopes: MeanSlopes, *, restricted: bool) -> ExactSlopes:
        """The means, beside slopes of the same cases. Where the mean is `restricted`, a case without has no slope."""
        count = self.values.shape[1]
        values = np.where(self.have[:, None], self.values, 0.0 if restricted else np.nan)
        known = np.isfinite(values)
        own = [mean_and_error(values[known[:, k], k]) for k in range(count)]
        both = known & np.isfinite(slopes.influence)
        error = [mean_and_error((slopes.influence - values)[both[:, k], k])[1] for k in range(count)]
        mean = np.array([one[0] for one in own])
        sigma = np.array([one[1] for one in own])
        return ExactSlopes(mean, sigma, (~known).sum(axis=0), slopes.slopes - mean, np.array(error))


def exact_slopes(
    scenario: Scenario,
    seed: int,
    cases: int,
    at: np.ndarray,
    knobs: Sequence[int],
    progress: Callable[[str, int, int], None] = lambda stage, done, total: None,
) -> dict[str, Derivatives]:
    """Derivatives of every metric of each case by the moves of `knobs`, at the moves `at`.

    Raises `InputError` for a scenario through which none can be taken.
    """
    import jax
    import jax.numpy as jnp

    moved = scenario.run_moved
    if moved is None:
        raise ValueError(f"scenario {scenario.name} has no knobs")
    done, total = 0, cases * len(knobs)

    def count(more):
        nonlocal done
        done += more
        progress("exact derivatives", done, total)

    def one_knob(knob):
        def one(numbers, own):
            def metrics(moves):
                found = moved(seed, numbers, moves)
                return {name: jnp.asarray(found[name], moves.dtype) for name in scenario.metrics}

            direction = np.zeros_like(own)
            direction[:, knob] = 1.0
            try:
                values, slopes = jax.jvp(metrics, (jnp.asarray(own),), (jnp.asarray(direction),))
            except (jax.errors.JAXTypeError, CodeError) as error:
                cause = error.__cause__ if isinstance(error, CodeError) else error
                if not isinstance(cause, jax.errors.JAXTypeError):
                    raise
                reason = "has no exact derivatives: its cases are not run in JAX throughout"
                raise InputError(f"scenario {scenario.name} {reason}") from None
            host = {name: np.asarray(each) for name, each in slopes.items()}
            return host | {f"{name} have": np.isfinite(np.asarray(each)) for name, each in values.items()}

        moves = np.broadcast_to(np.asarray(at, float), (cases, len(at)))
        return in_chunks(scenario, [moves], one, done=count)[0]

    progress("exact derivatives", 0, total)
    found = [one_knob(knob) for knob in knobs]
    return {
        name: Derivatives(np.stack([one[name] for one in found], axis=1), found[0][f"{name} have"])
        for name in scenario.metrics
    }
