"""What a gain, a dead band, the inertia or the sensor's shape does to settling time, impulse and error, on average.

A case is a chain of modes and pulses that switch at control periods: its settling time is a staircase in any gain, and
a derivative along its path is zero or says nothing of the steps. The mean over many cases is smooth as soon as the
parameters themselves are a little uncertain, and its derivative needs no derivative of a case (Rechenberg 1973;
Nesterov & Spokoiny 2017): with log-parameters spread by sigma e, e normal, in opposite pairs (Salimans et al. 2017),

    d/d log p  E[f]  =  E[ (f(p exp(sigma e)) - f(p exp(-sigma e))) e ] / (2 sigma).

Each parameter is moved alone, in all cases by numbers of their own and the same for every parameter: moved together,
the steps that one of them makes are noise to all others, and it takes a hundred times the cases.
"""

from collections.abc import Callable
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxsat.control.loops import LoopState
from jaxsat.control.sun_pointing.cases import Cases, run_cases
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.sensing import LoopSettings
from jaxsat.math import angle_between, quaternion

LAW_PARAMETERS = ("attitude_gain", "rate_gain", "slew_rate", "search_rate", "rate_dead_band", "damped_rate")
VEHICLE_PARAMETERS = ("inertia", "torque", "min_pulse", "face_angle", "hood_angle")
PARAMETERS = LAW_PARAMETERS + VEHICLE_PARAMETERS
"""What may be scaled; `inertia` is that of the vehicle and of its computer, the angles those of the sensor."""

Metric = Callable[[LoopState], Float[Array, " cases"]]


@dataclass(frozen=True)
class Sensitivity:
    """Derivative of the mean of a metric over the cases by the logarithm of each parameter."""

    mean: float
    """Of the metric, over all runs."""
    gradient: np.ndarray
    """[parameters] in units of the metric for a change by a factor e; a hundredth of it is that of one percent."""
    standard_error: np.ndarray
    """[parameters] of `gradient`, from the scatter over the cases."""


def scaled(
    law: SunPointingLaw, cases: Cases, names: tuple[str, ...], log_factor: Float[Array, "cases parameters"]
) -> tuple[SunPointingLaw, Cases]:
    """Law and cases with parameters times exp(`log_factor`), of each case its own; raises ValueError for a name."""
    unknown = [name for name in names if name not in PARAMETERS]
    if unknown:
        raise ValueError(f"no parameter {unknown[0]!r}; there are {', '.join(PARAMETERS)}")
    vehicle = cases.vehicle
    for k, name in enumerate(names):
        factor = jnp.exp(log_factor[:, k])
        if name in LAW_PARAMETERS:
            law = _times(law, lambda law, name=name: getattr(law, name), factor)
        elif name == "inertia":
            for matrix in (lambda v: v.inertia, lambda v: v.assumed_inertia):
                vehicle = _times(vehicle, matrix, factor, rank=2)
            vehicle = _times(vehicle, lambda v: v.inverse_inertia, 1.0 / factor, rank=2)
        elif name == "torque":
            vehicle = _times(vehicle, lambda v: v.thrusters.torque, factor, rank=1)
        elif name == "min_pulse":
            vehicle = _times(vehicle, lambda v: v.thrusters.min_pulse, factor)
        else:
            vehicle = _times(vehicle, lambda v, name=name: getattr(v.sensor, name), factor)
    return law, eqx.tree_at(lambda c: c.vehicle, cases, vehicle)


def _times(tree, where, factor, rank=0):
    """A tree with one leaf, of this rank in one case, times the factor of each case."""
    leaf = jnp.asarray(where(tree))
    of_cases = jnp.broadcast_to(leaf, (len(factor), *leaf.shape[leaf.ndim - rank :]))
    return eqx.tree_at(where, tree, of_cases * factor.reshape(-1, *[1] * rank))


def sensitivities(
    settings: LoopSettings,
    law: SunPointingLaw,
    cases: Cases,
    sun_eci: Float[Array, "3"],
    periods: int,
    names: tuple[str, ...],
    metrics: tuple[Metric, ...],
    key: Key[Array, ""],
    *,
    spread: float = 0.05,
) -> list[Sensitivity]:
    """One `Sensitivity` for each of the metrics, by two runs of all cases for each parameter.

    The loop of `settings` and `law` runs all `cases` for so many control `periods` with the Sun in the direction
    `sun_eci`, a unit vector. `names` are some of `PARAMETERS`, `metrics` functions of the final states, as
    `settling_time`, `impulse` and `final_error(...)`; `key` draws the changes of the parameters, whose logarithms have
    the 1-sigma `spread`: the mean that is differentiated is over these too. Cases in which a metric is not finite, on
    either side, count for nothing in it. Raises ValueError for a name that is none.
    """
    e = np.asarray(jax.random.normal(key, (len(cases.quaternion),)))
    means, slopes, errors = [], [], []
    for k in range(len(names)):
        shift = spread * e[:, None] * np.eye(len(names))[k]
        up, down = (
            np.asarray(_values(settings, law, cases, sun_eci, periods, names, metrics, sign * shift))
            for sign in (1.0, -1.0)
        )
        good = np.isfinite(up) & np.isfinite(down)
        # As a regression on e, which for many cases is the mean above.
        rise = np.where(good, up - down, 0.0) / (2.0 * spread)
        square = (good * e**2).sum(axis=1)
        slope = (rise * e).sum(axis=1) / square
        # Of a scatter that may depend on e (White 1980).
        left = np.where(good, rise - slope[:, None] * e, 0.0)
        errors.append(np.sqrt((left**2 * e**2).sum(axis=1)) / square)
        means.append(np.where(good, 0.5 * (up + down), 0.0).sum(axis=1) / good.sum(axis=1))
        slopes.append(slope)
    per_metric = zip(np.mean(means, axis=0), np.transpose(slopes), np.transpose(errors), strict=True)
    return [Sensitivity(float(mean), slope, error) for mean, slope, error in per_metric]


@eqx.filter_jit
def _values(settings, law, cases, sun_eci, periods, names, metrics, log_factor):
    law, cases = scaled(law, cases, names, log_factor)
    state = run_cases(settings, law, cases, sun_eci, periods)
    return jnp.stack([metric(state) for metric in metrics])


def settling_time(state: LoopState) -> Float[Array, " cases"]:
    """Until the Sun had been held for the hold time [s]; inf where it never was."""
    return state.controller.settled_at


def impulse(state: LoopState) -> Float[Array, " cases"]:
    """Spent by all thrusters [N s]."""
    return state.tally.impulse


def final_error(law: SunPointingLaw, cases: Cases, sun_eci: Float[Array, "3"]) -> Metric:
    """The metric of these cases that is the true angle between the Sun and where it shall stand, at the end [rad]."""
    target = law.target()
    mounting = jnp.broadcast_to(cases.vehicle.body_from_instrument, (len(cases.quaternion), 3, 3))

    def error(q, body_from_instrument):
        return angle_between(target, body_from_instrument.T @ quaternion.rotate_inverse(q, sun_eci))

    return lambda state: jax.vmap(error)(state.motion.quaternion, mounting)
