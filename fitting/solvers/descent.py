"""Gradient descent and L-BFGS (optax) with the interface of `least_squares.levenberg_marquardt`.

Both follow the exact gradient J^T W r of the robust cost. They are here to be compared with and to be chosen where a
Gauss-Newton matrix misleads; they are not the fast way: the forward-mode Jacobian that gives the gradient gives the
matrix as well, and a step of Levenberg-Marquardt costs what a step here costs.

optax sees each unknown in units of 1/sqrt(H_ii) at the start: rates and albedo factors differ by many orders in
curvature. The attitude stays a rotation about a `reference` that moves with it. optax only ever uses differences of
its unknowns, so it is given the sum of the steps made.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Bool, Float, Int

from fitting.measurements.abstract import AbstractProblem
from fitting.parameters.tree import FreeLeaves
from fitting.solvers.least_squares import (
    FINISHED_DECREMENT,
    TINY_DAMPING,
    Point,
    Settings,
    evaluate,
    free_unknowns,
    solve_bounded,
    unevaluated,
)

MEMORY = 20
"""Pairs of steps and gradient changes that L-BFGS keeps: no fewer than a usual fit has unknowns."""

SUFFICIENT, FLAT = 1e-4, 0.9
"""Constants of the weak Wolfe conditions (Nocedal & Wright 2006, sec. 3.1)."""

PEAK, BETA_1, BETA_2 = 10.0, 0.9, 0.99
"""Largest step of Adam in units of 1/sqrt(H_ii), and its means of gradient and square over 10 and 100 steps."""

Bounds = tuple[Float[Array, " unknowns"], Float[Array, " unknowns"]]


def lbfgs(
    problem: AbstractProblem,
    parameters: FreeLeaves,
    settings: Settings,
    bounds: Bounds,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    weight: Float[Array, "samples channels"],
) -> Point:
    """Minimum of one start by L-BFGS (Liu & Nocedal 1989); `settings.iterations` counts evaluations.

    The step length is bracketed until it meets the weak Wolfe conditions (Lewis & Overton 2013, alg. 4.6), one
    evaluation a pass, so the integration stands in the compiled program once. Bounds by projection of the step.
    """
    lower, upper = bounds
    quasi_newton = optax.scale_by_lbfgs(MEMORY)
    fresh: Any = quasi_newton.init(x)

    def unfinished(carry):
        return (carry.number <= settings.iterations) & (carry.point.decrement > FINISHED_DECREMENT)

    def iterate(carry: _LineSearch) -> _LineSearch:
        point, first = carry.point, carry.number == 0
        target = point.x + carry.length * carry.direction
        trial = _evaluate(problem, parameters, settings, bounds, point, target)
        step = jnp.clip(target, lower, upper) - point.x
        slope = point.gradient @ step
        low_enough = trial.cost <= point.cost + SUFFICIENT * slope
        # A longer step along a bound is the same step.
        stopped = jnp.any(jnp.clip(target, lower, upper) != target)
        flat_enough = (trial.gradient @ step >= FLAT * slope) | stopped
        accepted = first | (low_enough & flat_enough)

        low = jnp.where(low_enough, carry.length, carry.low)
        high = jnp.where(low_enough, carry.high, carry.length)
        length = jnp.where(jnp.isfinite(high), 0.5 * (low + high), 2.0 * low)
        bracketed = eqx.tree_at(lambda c: (c.low, c.high, c.length), carry, (low, high, length))

        scale = jnp.where(first, _scale(trial), carry.scale)
        gradient = scale * jnp.where(free_unknowns(trial, *bounds, settings), trial.gradient, 0.0)
        moved = carry.moved + step / scale
        # Without positive curvature along the step, as at a bound, the memory would not stay positive definite.
        curved = (gradient - carry.memory.updates) @ (step / scale) > 0.0
        memory = _choose(curved, carry.memory, fresh)
        proposed, memory = _update(quasi_newton, gradient, memory, moved)
        ascent = jnp.where(free_unknowns(trial, *bounds, settings), proposed, 0.0)
        # What is pressed against a bound is cut out of the direction, which may then lead uphill.
        downhill = ascent @ gradient > 0.0
        ascent = jnp.where(downhill, ascent, gradient / jnp.maximum(1.0, jnp.linalg.norm(gradient)))
        started = _LineSearch(
            number=carry.number,
            point=trial,
            scale=scale,
            direction=-scale * ascent,
            length=jnp.ones_like(length),
            low=jnp.zeros_like(low),
            high=jnp.full_like(high, jnp.inf),
            moved=moved,
            memory=_choose(downhill, memory, fresh),
        )
        chosen = _choose(accepted, started, bracketed)
        return eqx.tree_at(lambda c: c.number, chosen, carry.number + 1)

    one, zero = jnp.ones((), x.dtype), jnp.zeros_like(x)
    start = _LineSearch(
        number=jnp.zeros((), int),
        point=unevaluated(problem, x, reference, weight, TINY_DAMPING),
        scale=jnp.ones_like(x),
        direction=zero,
        length=one,
        low=0.0 * one,
        high=jnp.inf * one,
        moved=zero,
        memory=fresh,
    )
    return jax.lax.while_loop(unfinished, iterate, start).point


def adam(
    problem: AbstractProblem,
    parameters: FreeLeaves,
    settings: Settings,
    bounds: Bounds,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    weight: Float[Array, "samples channels"],
) -> Point:
    """Best point on the way of one start by Adam (Kingma & Ba 2015), steps falling from `PEAK` to 0 as a half cosine.

    `settings.iterations` is the length of that way, unless the minimum comes first. Bounds by projection.
    """
    lower, upper = bounds
    moments = optax.scale_by_adam(BETA_1, BETA_2)
    fresh: Any = moments.init(x)

    def unfinished(carry):
        number, here, best, *_ = carry
        going = (number == 0) | jnp.isfinite(here.cost)
        return (number <= settings.iterations) & going & (best.decrement > FINISHED_DECREMENT)

    def iterate(carry):
        number, here, best, scale, state = carry
        first = number == 0
        gradient = scale * jnp.where(free_unknowns(here, *bounds, settings), here.gradient, 0.0)
        update, new_state = _update(moments, gradient, state)
        state = _choose(first, fresh, new_state)
        share = number / jnp.maximum(settings.iterations, 1)
        length = PEAK * 0.5 * (1.0 + jnp.cos(jnp.pi * share))
        # A mean over past gradients may still push what is held now.
        update = jnp.where(free_unknowns(here, *bounds, settings) & ~first, update, 0.0)
        here = _evaluate(problem, parameters, settings, bounds, here, here.x - length * scale * update)
        scale = jnp.where(first, _scale(here), scale)
        return number + 1, here, _choose(first | (here.cost < best.cost), here, best), scale, state

    blank = unevaluated(problem, x, reference, weight, TINY_DAMPING)
    carry = (jnp.zeros((), int), blank, blank, jnp.ones_like(x), fresh)
    _, _, best, *_ = jax.lax.while_loop(unfinished, iterate, carry)
    return best


class _LineSearch(eqx.Module):
    """L-BFGS on its way along one direction."""

    number: Int[Array, ""]
    """Evaluations made."""
    point: Point
    """Where the line begins."""
    scale: Float[Array, " unknowns"]
    """Unit in which optax sees each unknown."""
    direction: Float[Array, " unknowns"]
    """Of the line, in the unknowns' own units; its gradient is negative."""
    length: Float[Array, ""]
    """Share of `direction` tried next."""
    low: Float[Array, ""]
    """Longest share known to lower the cost enough."""
    high: Float[Array, ""]
    """Shortest share known not to; infinite while there is none."""
    moved: Float[Array, " unknowns"]
    """Sum of the steps made, in units of `scale`."""
    memory: Any
    """State of `optax.scale_by_lbfgs`."""


def _evaluate(
    problem: AbstractProblem,
    parameters: FreeLeaves,
    settings: Settings,
    bounds: Bounds,
    point: Point,
    x: Float[Array, " unknowns"],
) -> Point:
    """The point at `x` about another one's reference, projected on the bounds, with what Gauss-Newton would save.

    That is what a `Point` promises and the one measure of being done that does not depend on the solver.
    """
    trial = evaluate(problem, parameters, settings, jnp.clip(x, *bounds), point.reference, point.weight, point.damping)
    _, decrement = solve_bounded(trial, *bounds, settings)
    return eqx.tree_at(lambda p: p.decrement, trial, decrement)


def _update(
    transformation: optax.GradientTransformation, gradient: Array, state: Any, place: Array | None = None
) -> tuple[Array, Any]:
    """What optax makes of a gradient, and its next state."""
    # Its counters of 32 bits meet indices of 64, which this project's tests forbid.
    with jax.numpy_dtype_promotion("standard"):
        update, state = transformation.update(gradient, state, place)
    return jnp.asarray(update), state


def _scale(point: Point) -> Float[Array, " unknowns"]:
    curvature = jnp.diagonal(point.hessian)
    return jnp.where(curvature > 0.0, 1.0 / jnp.sqrt(jnp.maximum(curvature, 1e-300)), 1.0)


def _choose(condition: Bool[Array, ""], one: Any, other: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), one, other)
