"""Samples of the posterior about a minimum by the no-U-turn sampler (Hoffman & Gelman 2014) of BlackJAX.

For small cases, to see whether the sigmas of the information matrix say all: a draw costs some five evaluations of the
whole arc. BlackJAX is an extra: `pip install blackjax`.
"""

import dataclasses
import importlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Key

from fitting.fitted import Fit
from fitting.measurements.abstract import PAD_SAMPLES, RATE_UNIT, AbstractProblem
from fitting.outcome.uncertainty import covariance
from fitting.parameters.free import FreeLeaves, FreeParameters
from fitting.parameters.names import STATE
from fitting.parameters.quoted import quoted_names, quoted_units
from fitting.solvers.least_squares import Settings, counted, priors
from fitting.solvers.refine import LIKELIHOODS, PLAIN, Refined
from fitting.starts.multi_start import NONE
from fitting.stored import Within, in_parts
from jaxsat.errors import InputError
from jaxsat.math.one_function import whole_or_usual

FIRST_STEP, ACCEPTANCE = 0.5, 0.8
"""Step of the whitened unknowns [sigma] that the warm-up begins with, and the acceptance that it aims at."""
PIECE = 20
"""Draws in one call of the compiled program."""
OPTIONS = {"xla_cpu_use_fusion_emitters": False}
"""As in `fitting.stored`: XLA's older code generator compiles faster."""
MAX_DOUBLINGS = 6
"""At most 63 evaluations a draw; a whitened posterior near a normal one takes three to seven."""


@dataclass(frozen=True)
class Posterior:
    """Draws of the state and the free parameters, with what says whether they may be trusted."""

    names: tuple[str, ...]
    """`attitude.x` ... are a small rotation about the body axes from the minimum's attitude."""
    units: tuple[str, ...]
    samples: np.ndarray
    """[chains draws names] in the units of the names; what stands at its bound at the minimum is held there."""
    effective_samples: np.ndarray
    """[names] independent draws that these are worth (Geyer 1992): 100 give a sigma to 7 %. nan for what is held."""
    split_r_hat: np.ndarray
    """[names] 1 where all halves of chains agree, beyond 1.05 the draws are no sample (Gelman et al. 2013, 11.4)."""
    divergences: int
    """Draws whose trajectory broke off, at a bound or where the step was too long."""
    acceptance: float
    """Mean acceptance, which the warm-up aims to bring to `ACCEPTANCE`."""

    def sigma(self) -> dict[str, float]:
        """Standard deviation of each parameter over all draws, in its unit."""
        deviation = self.samples.reshape(-1, len(self.names)).std(axis=0, ddof=1)
        return dict(zip(self.names, deviation.tolist(), strict=True))


class Target(eqx.Module):
    """The posterior over whitened unknowns u: x = minimum + factor u, so that it is near a unit normal one."""

    problem: AbstractProblem
    parameters: FreeLeaves
    settings: Settings
    x: Float[Array | np.ndarray, " unknowns"]
    """Of the minimum."""
    reference: Float[Array | np.ndarray, "4"]
    """Attitude of the minimum at the grid's start."""
    weight: Float[Array | np.ndarray, "samples channels"]
    factor: Float[Array | np.ndarray, "unknowns white"]
    """Cholesky factor of the covariance; rows of zeros for what is held."""
    bounds: tuple[Float[Array | np.ndarray, " unknowns"], Float[Array | np.ndarray, " unknowns"]]

    def unknowns(self, u: Float[Array, " white"]) -> Float[Array, " unknowns"]:
        """The fit's unknowns, the attitude's as a rotation vector from the minimum's."""
        return jnp.asarray(self.x) + jnp.asarray(self.factor) @ u

    def inside(self, u: Float[Array, " white"]) -> Bool[Array, ""]:
        """Whether all unknowns are within the bounds of the model."""
        x = self.unknowns(u)
        return jnp.all((x >= self.bounds[0]) & (x <= self.bounds[1]))

    def cost_and_gradient(self, u: Float[Array, " white"]) -> tuple[Float[Array, ""], Float[Array, " white"]]:
        """Cost, half of chi2 with the priors, and its gradient; the cost is infinite beyond a bound."""
        x, reference = self.unknowns(u), jnp.asarray(self.reference)

        def add(sums, new, begin):
            residual, jacobian = new
            leaves = (jnp.asarray(self.weight), jnp.asarray(self.problem.floor))
            weight, floor = (jax.lax.dynamic_slice_in_dim(leaf, begin, PAD_SAMPLES) for leaf in leaves)
            cost, slope, _ = counted(residual, weight, self.settings, floor, self.problem.groups)
            # A sum that is written out is not handed to a library.
            of_samples = jnp.sum(jnp.sum(slope[..., None] * jacobian, axis=0), axis=0)
            return sums[0] + cost, sums[1] + of_samples

        prior, pull, _ = priors(x)
        _, (cost, gradient) = self.problem.predict_blocks(
            self.parameters, x, reference, self.settings.blocks, visit=add, carry=(prior, pull)
        )
        inside = self.inside(u)
        return jnp.where(inside, cost, jnp.inf), jnp.where(inside, jnp.asarray(self.factor).T @ gradient, 0.0)

    def log_density(self, u: Float[Array, " white"]) -> Float[Array, ""]:
        """Minus the cost, which one pass in forward mode gives with its gradient J^T r."""

        @jax.custom_vjp
        def density(u):
            return -self.cost_and_gradient(u)[0]

        def forward(u):
            cost, gradient = self.cost_and_gradient(u)
            return -cost, gradient

        density.defvjp(forward, lambda gradient, cotangent: (-cotangent * gradient,))
        return density(u)

    def physical(self, u: Float[Array, " white"]) -> Float[Array, " numbers"]:
        """Values of the state and of all leaves in SI."""
        x = self.unknowns(u)
        return jnp.concatenate([x[:3], x[3:6] * RATE_UNIT, self.parameters.values(x[len(STATE) :])])


def sample_posterior(found: Fit, *, draws: int = 500, warmup: int = 300, chains: int = 4, seed: int = 0) -> Posterior:
    """Draws about the best minimum of a fit, under its stated noise, its priors and the samples that it kept.

    Samples that it left out stay out, so the draws tell nothing of that choice. The prior of the attitude is even in
    the rotation vector.

    Raises `InputError` where BlackJAX is not installed, or where the data and priors leave a direction open.
    """
    best, parameters = found.found.minima[0], found.found.parameters
    tail = LIKELIHOODS[found.settings.likelihood][-1].tail
    target = build_target(best.problem, parameters, best.refined, tail=tail)
    return draw_from(target, parameters, draws=draws, warmup=warmup, chains=chains, seed=seed)


def draw_from(
    target: Target, parameters: FreeParameters, *, draws: int, warmup: int, chains: int, seed: int
) -> Posterior:
    """Draws of a target whose leaves are those of `parameters`; raises `InputError` where BlackJAX is not installed."""
    sampler = load_blackjax()
    if chains < 2 or draws < 4 or warmup < 1:
        raise InputError(f"expected 2 chains, 4 draws, 1 of warm-up or more, got {chains}, {draws}, {warmup}")
    key_starts, key_chains = jax.random.split(jax.random.key(seed))
    starts = np.asarray(jax.random.normal(key_starts, (chains, target.factor.shape[1])))
    # Halved until within the bounds: the minimum itself is.
    for _ in range(60):
        x = target.x + starts @ target.factor.T
        outside = np.any((x < target.bounds[0]) | (x > target.bounds[1]), axis=1)
        starts = np.where(outside[:, None], 0.5 * starts, starts)
    physical, diverged, acceptance = _drawn(
        sampler, target, jax.random.split(key_chains, chains), starts, warmup, draws
    )
    numbers, all_names = _free_numbers(parameters), quoted_names(parameters)
    unit = np.concatenate([np.full(len(STATE), np.degrees(1.0)), [leaf.to_unit for leaf in parameters.leaves]])
    samples = np.asarray(physical)[..., numbers] * unit[numbers]
    halves = samples[:, : draws - draws % 2].reshape(2 * chains, draws // 2, len(numbers))
    moving = samples.std(axis=(0, 1)) > 0.0
    effective, r_hat = np.full(len(numbers), np.nan), np.full(len(numbers), np.nan)
    effective[moving] = jax.jit(sampler.diagnostics.effective_sample_size)(samples[..., moving])
    r_hat[moving] = jax.jit(sampler.diagnostics.potential_scale_reduction)(halves[..., moving])
    return Posterior(
        names=tuple(all_names[k] for k in numbers),
        units=tuple(quoted_units(parameters)[k] for k in numbers),
        samples=samples,
        effective_samples=effective,
        split_r_hat=r_hat,
        divergences=int(np.sum(diverged)),
        acceptance=float(np.mean(acceptance)),
    )


def _free_numbers(parameters: FreeParameters) -> np.ndarray:
    """Which of the state and the leaves are free, in the order of the unknowns."""
    state = np.arange(len(STATE) if parameters.free_motion else 0)
    return np.concatenate([state, len(STATE) + parameters.columns[parameters.columns >= 0]])


def build_target(
    problem: AbstractProblem, parameters: FreeParameters, refined: Refined, *, tail: float = NONE
) -> Target:
    """The density about the best minimum; raises `InputError` where a direction is open.

    `tail` is that of the likelihood (`fitting.solvers.refine.LIKELIHOODS`, last round).
    """
    best = jax.tree.map(lambda leaf: np.asarray(leaf)[0], refined.points)
    # Padding, which spares a fit its compilation, would be carried through every draw.
    there = np.concatenate([np.full(len(STATE), True), parameters.columns >= 0])
    names = [name for name, own in zip(parameters.names, there, strict=True) if own]
    lower, upper = (bound[there] for bound in parameters.bounds())
    x = best.x[there]
    moving = parameters.everything[there] & (x > lower + 1e-9) & (x < upper - 1e-9)
    cov = covariance(best.hessian[np.ix_(there, there)], moving)
    if not np.all(np.isfinite(np.diagonal(cov))):
        blind = ", ".join(name for name, v in zip(names, np.diagonal(cov), strict=True) if not v < np.inf)
        raise InputError(f"the data say nothing of {blind}: there is no posterior to draw from")
    factor = np.zeros((len(cov), int(moving.sum())))
    factor[moving] = np.linalg.cholesky(cov[np.ix_(moving, moving)])
    # What was held out takes no part in the cost.
    last = int(np.flatnonzero(np.asarray(best.weight).any(axis=1))[-1])
    settings = Settings(
        blocks=problem.grid.blocks_to(last),
        iterations=np.asarray(0),
        robust_scale=np.asarray(PLAIN),
        active=moving,
        tail=np.asarray(tail),
        ceiling=np.asarray(NONE),
    )
    weight = np.asarray(best.weight)
    return Target(problem, _without_padding(parameters), settings, x, best.reference, weight, factor, (lower, upper))


def _without_padding(parameters: FreeParameters) -> FreeLeaves:
    """The same map from as many unknowns as there are."""
    tree, there = parameters.tree, parameters.columns >= 0
    tangent = np.asarray(tree.tangent)[:, there]
    return dataclasses.replace(tree, tangent=tangent, moving=int(there[: tree.moving].sum()))


def _drawn(
    sampler,
    target: Target,
    keys: Key[Array, " chains"],
    starts: Float[np.ndarray, "chains white"],
    warmup: int,
    draws: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Physical draws, divergences and acceptances, all [chains draws ...].

    Each chain runs by itself, a few draws a call: side by side all would wait for the longest trajectory of a draw.
    """

    def chain(key, start):
        carry, found = _begun(sampler, target, start), []
        every = jax.random.split(key, -(-(warmup + draws) // PIECE) * PIECE)
        for first in range(0, warmup + draws, PIECE):
            warming = np.arange(first, first + PIECE) < warmup
            carry, new = _gone_on(sampler, target, carry, every[first : first + PIECE], warming)
            found.append(jax.device_get(new))
        return jax.tree.map(lambda *parts: np.concatenate(parts)[warmup : warmup + draws], *found)

    # The first one alone, for which XLA compiles.
    one = chain(keys[0], jnp.asarray(starts[0]))
    with ThreadPoolExecutor(2) as pool:
        others = list(pool.map(chain, keys[1:], jnp.asarray(starts[1:])))
    return jax.tree.map(lambda *chains: np.stack(chains), one, *others)


def _adaptation():
    """Dual averaging of the step: how it begins, learns and ends."""
    module = importlib.import_module("blackjax.adaptation.step_size")
    return module.dual_averaging_adaptation(ACCEPTANCE)


def _go_on(within: Within, sampler, target: Target, carry, keys: Key[Array, " draws"], warming: Bool[Array, " draws"]):
    """A chain after so many draws more, and what was drawn.

    The unknowns are white already, so the warm-up has only the step to find (dual averaging). Warm-up and draws share
    one loop, for the integration stands in the compiled program at every use of a kernel.
    """
    kernel, (_, learn, learnt) = sampler.nuts.build_kernel(), _adaptation()
    metric = jnp.ones(target.factor.shape[1])

    def draw(carry, key_and_warming):
        (state, steps), (key, warming) = carry, key_and_warming
        size = jnp.where(warming, jnp.exp(steps.log_step_size), learnt(steps))
        state, info = kernel(key, state, target.log_density, size, metric, MAX_DOUBLINGS)
        learned = learn(steps, info.acceptance_rate)
        steps = jax.tree.map(lambda new, old: jnp.where(warming, new, old), learned, steps)
        return (state, steps), (target.physical(state.position), info.is_divergent, info.acceptance_rate)

    with in_parts(within):
        return jax.lax.scan(draw, carry, (keys, warming))


def _begin(within: Within, sampler, target: Target, start: Float[Array, " white"]):
    """Where a chain begins."""
    with in_parts(within):
        return sampler.nuts.init(start, target.log_density), _adaptation()[0](FIRST_STEP)


_gone_on, _begun = whole_or_usual(_go_on, OPTIONS), whole_or_usual(_begin, OPTIONS)


def load_blackjax() -> Any:
    """The sampler's library; raises `InputError` where it is not installed."""
    try:
        return importlib.import_module("blackjax")
    except ImportError:
        raise InputError(
            "drawing from the posterior needs BlackJAX, which is not installed: pip install blackjax"
        ) from None
