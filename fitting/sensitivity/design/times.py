"""When to sample: the choice of N of many candidate times that makes a sigma least, and how far from the best it is.

What samples tell adds up, and tr(A C) is convex in the weights of the candidates. So its derivatives g at any weights x
tell how low any other weights y can be, tr(y) >= tr(x) + g (y - x): at an optimum no allowed y has g y < g x. That is
the equivalence theorem (Kiefer & Wolfowitz 1960; with bounds on the weights Wynn 1982), and it tells of every choice of
whole samples too how far it is from the best that there is.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize

from fitting.sensitivity.analysis import Sensitivity
from fitting.sensitivity.design.aim import ATTITUDE, Aim, aim_of, log_volume, squared_sigma


@dataclass(frozen=True)
class Candidates:
    """Times at which the satellite may be sampled, and what the readings of each would tell."""

    told: np.ndarray
    """[candidates, numbers, numbers] [J_f J_c]^T W [J_f J_c] of each."""
    prior: np.ndarray
    """[fitted] information of the priors."""
    aim: Aim | None
    """None: the volume of the confidence ellipsoid, by its logarithm (D-optimal)."""

    @classmethod
    def of(cls, found: Sensitivity, name: str | None = ATTITUDE) -> "Candidates":
        """All samples of a plan, with an aim by its name; raises `InputError` for names that are none."""
        known = found.found
        J = np.concatenate([known.jacobian, known.jacobian_considered], axis=-1)
        told = np.einsum("scu,sc,scv->suv", J, known.weight, J, optimize=True)
        return cls(told, known.prior, None if name is None else aim_of(found, name))

    @property
    def convex(self) -> bool:
        """Whether the best weights are known to be the best: not where considered numbers count."""
        return self.told.shape[-1] == len(self.prior)

    def criterion(self, weights: Float[Array | np.ndarray, " candidates"]) -> Float[Array, ""]:
        """sigma^2, or the logarithm of the volume, where each candidate is sampled `weights` times; in 64 bits."""
        return _criterion(weights, self.told, self.prior, None if self.aim is None else self.aim.matrix)

    def sigma(self, weights: Float[Array | np.ndarray, " candidates"]) -> float:
        """The chosen sigma in its unit; of a volume its root over the fitted numbers."""
        value = float(self.criterion(weights))
        return float(np.sqrt(value) if self.aim is not None else np.exp(0.5 * value / len(self.prior)))


@eqx.filter_jit
def _criterion(weights, told, prior, aim):
    told = jnp.einsum("k,kuv->uv", weights, told)
    return log_volume(told, prior) if aim is None else squared_sigma(told, aim, prior)


@eqx.filter_jit
def _slopes(weights, told, prior, aim):
    return jax.value_and_grad(_criterion)(weights, told, prior, aim)


@dataclass(frozen=True)
class Weights:
    """How often each candidate is best sampled, as a real number."""

    weights: np.ndarray
    """[candidates]."""
    sigma: float
    slopes: np.ndarray
    """[candidates] derivatives of the criterion by the weights."""
    gap: float | None
    """By how much of the criterion any other weights could be better, at most; None where that is not known."""
    bound: float | None
    """No design, of whole samples neither, has a sigma below this."""


def best_weights(candidates: Candidates, count: float, most: float = 1.0, *, tolerance: float = 1e-7) -> Weights:
    """Weights between 0 and `most` with the sum `count` that make the criterion least, by sequential programming.

    With `count` and `most` 1 they are the shares of a design in the sense of Kiefer & Wolfowitz. Raises ValueError
    where so many do not fit, where JAX works in single precision, and where no covariance is finite. `tolerance` is
    the relative change of sigma at which it ends; `Weights.gap` tells what that has left.
    """
    number = len(candidates.told)
    if not 0.0 < count <= most * number:
        raise ValueError(f"best_weights: {count:g} samples do not fit in {number} candidates, each {most:g} at most")
    if not jax.config.read("jax_enable_x64"):
        raise ValueError("best_weights: derivatives need 64-bit numbers: call jaxsat.set_up_jax() first")
    parts = candidates.told, candidates.prior, None if candidates.aim is None else candidates.aim.matrix

    def cost(weights):
        value, slopes = (np.asarray(each, float) for each in _slopes(weights, *parts))
        if not np.isfinite(value):
            return 1e3, np.zeros(number)
        # The logarithm has its least where sigma has, and one size whatever the unit.
        return (value, slopes) if candidates.aim is None else (0.5 * np.log(value), 0.5 * slopes / value)

    start = np.full(number, count / number)
    if not np.isfinite(_slopes(start, *parts)[0]):
        raise ValueError("best_weights: all candidates together do not tell what is fitted: fit less, or give sigmas")
    rule = {"type": "eq", "fun": lambda x: x.sum() - count, "jac": np.ones_like}
    options = {"maxiter": 500, "ftol": tolerance}
    found = minimize(cost, start, jac=True, method="SLSQP", bounds=[(0.0, most)] * number, constraints=[rule],
                     options=options)  # fmt: skip
    weights = np.clip(found.x, 0.0, most)
    weights *= count / weights.sum()
    value, slopes = (np.asarray(each, float) for each in _slopes(weights, *parts))
    gap = float(slopes @ weights - slopes @ _steepest(slopes, count, most)) if candidates.convex else None
    bound = None
    if gap is not None:
        low = float(value) - gap
        bound = float(np.sqrt(max(low, 0.0)) if candidates.aim else np.exp(0.5 * low / len(candidates.prior)))
    return Weights(weights, candidates.sigma(weights), slopes, gap, bound)


def _steepest(slopes: np.ndarray, count: float, most: float) -> np.ndarray:
    """Of all allowed weights those with the least sum of slopes: as much as may be where they are least."""
    found, order = np.zeros(len(slopes)), np.argsort(slopes)
    found[order] = np.clip(count - most * np.arange(len(slopes)), 0.0, most)
    return found


@eqx.filter_jit
def _swapped(summed, leaves, enters, prior, aim):
    def one(out, into):
        told = summed - out + into
        return log_volume(told, prior) if aim is None else squared_sigma(told, aim, prior)

    return jax.vmap(lambda out: jax.vmap(lambda into: one(out, into))(enters))(leaves)


def whole_samples(candidates: Candidates, weights: np.ndarray, count: int, rounds: int = 100) -> np.ndarray:
    """[count] candidates, in order, each once: those of the largest weights, then exchanged one for one.

    The exchange that lowers the criterion most is made until none does (Fedorov 1972, section 3.2). What is left to
    gain is at most the distance from `Weights.bound`.
    """
    chosen = np.sort(np.argsort(-np.asarray(weights), kind="stable")[:count])
    told, aim = candidates.told, None if candidates.aim is None else candidates.aim.matrix
    value = float(candidates.criterion(np.isin(np.arange(len(told)), chosen).astype(float)))
    for _ in range(rounds):
        others = np.setdiff1d(np.arange(len(told)), chosen)
        after = np.asarray(_swapped(told[chosen].sum(axis=0), told[chosen], told[others], candidates.prior, aim))
        after = np.where(np.isfinite(after), after, np.inf)
        if not after.size or not (after.min() < value - 1e-9 * abs(value) or np.isnan(value)):
            break
        out, into = np.unravel_index(np.argmin(after), after.shape)
        chosen[out], value = others[into], float(after.min())
        chosen = np.sort(chosen)
    return chosen
