"""Levenberg-Marquardt on derivatives of the motion, robust, bounded.

One compiled program serves every arc length, every subset of active unknowns, every mask of samples and every
robustness: all of these are traced.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.measurements.abstract import PAD_SAMPLES, AbstractProblem, Prediction
from fitting.measurements.floor import at_floor
from fitting.measurements.groups import Groups, columns_of
from fitting.parameters.names import STATE
from fitting.solvers.positive import solve_positive
from jaxsat.math import quaternion

FINISHED_DECREMENT = 1e-4
"""Cost below which a further step is not worth its time."""

TINY_DAMPING = 1e-10
"""Only keeps the factorisation of a singular matrix finite."""

ROWS = 8
"""Rows of a Jacobian that are summed together."""

FIRST_DAMPING, SHRINK, GROW = 1e-2, 0.2, 8.0
"""Relative damping of the first step, and its factors after a step that was accepted or refused."""
AS_PROMISED, FAST_SHRINK = 0.2, 0.01
"""Share of what a step promises by which its saving may differ, for the damping to shrink so much."""


class Settings(eqx.Module):
    """What changes from one stage of a fit to the next; all traced."""

    blocks: Int[Array | np.ndarray, ""]
    """Blocks of integration steps that cover the arc."""
    iterations: Int[Array | np.ndarray, ""]
    """Steps tried, accepted or not."""
    robust_scale: Float[Array | np.ndarray, ""]
    """Residual, in sigmas, beyond which a measurement counts linearly; very large for plain least squares."""
    active: Bool[Array | np.ndarray, "*starts unknowns"]
    """Unknowns that may move in this stage; of a chunk of starts those of each."""
    tail: Float[Array | np.ndarray, ""]
    """Degrees of freedom of Student's distribution of a sample; very large for the normal one."""
    ceiling: Float[Array | np.ndarray, ""]
    """Loss at which a sample is as likely to be an outlier as not, over its group's limit; very large where none is."""


class Point(eqx.Module):
    """A start on its way: where it is and the local quadratic model of its cost."""

    x: Float[Array, " unknowns"]
    """Unknowns; the attitude part is zero, for `reference` carries the attitude."""
    reference: Float[Array, "4"]
    """Attitude at the grid's start, inertial-from-body."""
    weight: Float[Array, "samples channels"]
    """Of each measurement: 1 where it is used as it is, 0 where it lies outside the arc or was left out."""
    cost: Float[Array, ""]
    """Half the robust sum of squares, priors included."""
    gradient: Float[Array, " unknowns"]
    hessian: Float[Array, "unknowns unknowns"]
    """Gauss-Newton matrix: the information matrix at a minimum without robust weights."""
    damping: Float[Array, ""]
    prediction: Prediction
    decrement: Float[Array, ""]
    """Cost that an undamped step promised to save: below ~1e-4 the minimum is reached on the scale of sigma."""


def robust_loss(
    square: Float[Array, "*starts samples channels"], scale: Float[Array | np.ndarray, "..."]
) -> Float[Array, "*starts samples channels"]:
    """Pseudo-Huber loss 2 c^2 (sqrt(1 + s/c^2) - 1) (Charbonnier et al. 1997) of squared residuals, s where small.

    Its slope is 1/sqrt(1 + s/c^2). Written without the difference that loses its digits at large `scale`.
    """
    return 2.0 * square / (1.0 + jnp.sqrt(1.0 + square / scale**2))


def sample_loss(
    square: Float[Array, " samples"], tail: Float[Array, ""], ceiling: Float[Array, ""]
) -> tuple[Float[Array, " samples"], Float[Array, " samples"]]:
    """Loss of samples with these sums of squares, and its derivative, which is the samples' weight.

    Student's distribution over a whole sample, v log(1 + S/v) (Lange, Little & Taylor 1989), then a mixture with
    outliers that may be anything: -2 log(exp(-S/2) + exp(-C/2)), so that the weight is the probability that the sample
    is none (Jepson & Black 1993). Both are S for small S.
    """
    heavy = tail * jnp.log1p(square / tail)
    above = 0.5 * (heavy - ceiling)
    loss = heavy - 2.0 * (jax.nn.softplus(above) - jax.nn.softplus(-0.5 * ceiling))
    return loss, jax.nn.sigmoid(-above) * tail / (tail + square)


def counted(
    r: Float[Array, "samples channels"],
    weight: Float[Array, "samples channels"],
    settings: Settings,
    floor: Float[Array, "samples channels"],
    groups: Groups,
) -> tuple[Float[Array, ""], Float[Array, "samples channels"], Float[Array, "samples channels"]]:
    """Cost of some samples, its slope by each residual, and the weight of the residual's own Jacobian in the matrix.

    `floor` is that of `Problem`. The loss of a sample is that of each group: what is wrong with its currents, as a
    limited charge current, is nothing to its limb angles.
    """
    scale = jnp.asarray(settings.robust_scale)
    square, slope, curvature = at_floor(r, floor)
    loss = robust_loss(square, scale) * weight
    weight = weight / jnp.sqrt(1.0 + square / scale**2)
    cost, weights = jnp.zeros((), r.dtype), []
    for group, columns in zip(groups, columns_of(groups), strict=True):
        ceiling = jnp.asarray(settings.ceiling) * group.limit
        tail = jnp.asarray(float(group.width) if group.loss == "student" else settings.tail)
        of_samples, of_sample = sample_loss(jnp.sum(loss[:, columns], axis=1), tail, ceiling)
        cost, weights = cost + 0.5 * jnp.sum(of_samples), [*weights, weight[:, columns] * of_sample[:, None]]
    weight = jnp.concatenate(weights, axis=1)
    return cost, weight * slope, weight * curvature


def normal_equations(
    r: Float[Array, "samples channels"],
    J: Float[Array, "samples channels unknowns"],
    weight: Float[Array, "samples channels"],
    settings: Settings,
    floor: Float[Array, "samples channels"],
    groups: Groups,
) -> tuple[Float[Array, ""], Float[Array, " unknowns"], Float[Array, "unknowns unknowns"]]:
    """Cost, gradient and Gauss-Newton matrix of some samples, as `counted` does."""
    cost, slope, curvature = counted(r, weight, settings, floor, groups)
    return cost, *_sums(J.reshape(-1, J.shape[-1]), curvature.reshape(-1), slope.reshape(-1))


def _sums(
    J: Float[Array, "rows unknowns"], curvature: Float[Array, " rows"], slope: Float[Array, " rows"]
) -> tuple[Float[Array, " unknowns"], Float[Array, "unknowns unknowns"]]:
    """J^T slope and J^T diag(curvature) J, row by row into one matrix that stays in the first cache.

    A product of matrices takes element after element of the result, each a sum that waits for its own last term.
    """
    short = -J.shape[0] % ROWS
    rows = [jnp.pad(leaf, ((0, short), *((0, 0),) * (leaf.ndim - 1))) for leaf in (J, curvature, slope)]

    def add(sums, rows):
        J, curvature, slope = rows
        gradient, hessian = sums
        for k in range(ROWS):
            gradient = gradient + slope[k] * J[k]
            hessian = hessian + (curvature[k] * J[k])[:, None] * J[k][None, :]
        return (gradient, hessian), None

    unknowns = J.shape[1]
    blank = jnp.zeros(unknowns, J.dtype), jnp.zeros((unknowns, unknowns), J.dtype)
    return jax.lax.scan(add, blank, tuple(leaf.reshape(-1, ROWS, *leaf.shape[1:]) for leaf in rows))[0]


def prior_information(unknowns: int) -> Float[np.ndarray, " unknowns"]:
    """Of each unknown: none for the state, one for a number in sigmas of its prior."""
    return (np.arange(unknowns) >= len(STATE)).astype(float)


def priors(
    x: Float[Array, " unknowns"],
) -> tuple[Float[Array, ""], Float[Array, " unknowns"], Float[Array, "unknowns unknowns"]]:
    """Cost, gradient and matrix of the priors: a unit sigma for each parameter of the model in its own scale."""
    prior = prior_information(x.shape[0])
    pull = x * prior
    return 0.5 * pull @ pull, pull, jnp.diag(prior)


def free_unknowns(
    point: Point, lower: Float[Array, " unknowns"], upper: Float[Array, " unknowns"], settings: Settings
) -> Bool[Array, " unknowns"]:
    """Unknowns that may move and that no bound stops."""
    pressed = ((point.x <= lower) & (point.gradient > 0)) | ((point.x >= upper) & (point.gradient < 0))
    return jnp.asarray(settings.active) & ~pressed


def solve_bounded(
    point: Point, lower: Float[Array, " unknowns"], upper: Float[Array, " unknowns"], settings: Settings
) -> tuple[Float[Array, " unknowns"], Float[Array, ""]]:
    """Damped step, and the cost that an undamped one promises to save; unknowns pressed against a bound stay there.

    A damped step promises little where only directions of little information are left: that is no reason to stop.
    """
    free = free_unknowns(point, lower, upper, settings)
    gradient = jnp.where(free, point.gradient, 0.0)
    hessian = jnp.where(free[:, None] & free[None, :], point.hessian, 0.0)
    diagonal = jnp.where(free, jnp.diagonal(hessian), 1.0)
    hessian = hessian + jnp.diag(jnp.where(free, 0.0, 1.0))
    # Equilibrate before factoring: rates and albedo factors differ by many orders in curvature.
    root = jnp.sqrt(jnp.maximum(diagonal, 1e-300))
    scaled = hessian / (root[:, None] * root[None, :])
    identity = jnp.eye(scaled.shape[0], dtype=scaled.dtype)
    dampings = jnp.stack([point.damping, jnp.minimum(point.damping, TINY_DAMPING)])
    steps = jax.vmap(lambda damping: -solve_positive(scaled + damping * identity, gradient / root) / root)(dampings)
    promise = -0.5 * gradient @ steps[1]
    # A matrix that rounding makes indefinite promises nothing that could be believed.
    return jnp.clip(point.x + steps[0], lower, upper) - point.x, jnp.where(jnp.isnan(promise), jnp.inf, promise)


def blank_prediction(problem: AbstractProblem) -> Prediction:
    """Zeros in the shape of a prediction."""
    samples = problem.valid.shape[0]
    return Prediction(
        jnp.zeros((samples, problem.channels)),
        jnp.zeros((samples, 4)),
        jnp.zeros((samples, 3)),
        None,
    )


def unevaluated(
    problem: AbstractProblem,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    weight: Float[Array, "samples channels"],
    damping: float,
) -> Point:
    """A start as an infinitely bad point with a zero gradient, for the first pass of a solver's loop to evaluate.

    The integration then stands in the compiled program once, not twice.
    """
    infinite = jnp.asarray(jnp.inf, x.dtype)
    return Point(
        x=x,
        reference=reference,
        weight=weight,
        cost=infinite,
        gradient=jnp.zeros_like(x),
        hessian=jnp.eye(x.shape[0], dtype=x.dtype),
        damping=jnp.asarray(damping, x.dtype),
        prediction=blank_prediction(problem),
        decrement=infinite,
    )


def evaluate(
    problem: AbstractProblem,
    parameters: Any,
    settings: Settings,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    weight: Float[Array, "samples channels"],
    damping: Float[Array, ""],
) -> Point:
    """The point reached at `x`, with the attitude part of `x` moved into the reference."""
    turn = quaternion.from_rotation_vector(x[:3])
    reference = quaternion.normalize(quaternion.multiply(reference, turn))
    x = jnp.concatenate([jnp.zeros_like(x[:3]), x[3:]])

    def add(total, new, begin):
        residual, jacobian = new
        own = [jax.lax.dynamic_slice_in_dim(leaf, begin, PAD_SAMPLES) for leaf in (weight, jnp.asarray(problem.floor))]
        new = normal_equations(residual, jacobian, own[0], settings, own[1], problem.groups)
        return jax.tree.map(jnp.add, total, new)

    prediction, (cost, gradient, hessian) = problem.predict_blocks(
        parameters, x, reference, settings.blocks, visit=add, carry=priors(x)
    )
    # Large, and not wanted before the minimum is looked at.
    prediction = dataclasses.replace(prediction, rotation_jacobian=None)
    return Point(x, reference, weight, cost, gradient, hessian, damping, prediction, jnp.full_like(cost, jnp.inf))


def levenberg_marquardt(
    problem: AbstractProblem,
    parameters: Any,
    settings: Settings,
    bounds: tuple[Float[Array, " unknowns"], Float[Array, " unknowns"]],
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    weight: Float[Array, "samples channels"],
) -> Point:
    """Minimum of one start (Marquardt 1963; damping on the scaled diagonal, one evaluation a step)."""
    lower, upper = bounds

    def unfinished(carry):
        number, point = carry
        return (number <= settings.iterations) & (point.decrement > FINISHED_DECREMENT)

    def iterate(carry):
        number, point = carry
        step, decrement = solve_bounded(point, lower, upper, settings)
        # Clipped once more: the sum of a point and its step may miss the bound by a rounding.
        x = jnp.clip(point.x + step, lower, upper)
        trial = evaluate(problem, parameters, settings, x, point.reference, point.weight, point.damping * SHRINK)
        better = trial.cost < point.cost
        # Where the quadratic model holds, damping has nothing left to guard against, and only slows what little is
        # known: combinations that priors alone tell have a billionth of the others' curvature.
        promised = -step @ (point.gradient + 0.5 * point.hessian @ step)
        holds = jnp.abs(point.cost - trial.cost - promised) < AS_PROMISED * promised
        trial = eqx.tree_at(lambda p: p.damping, trial, point.damping * jnp.where(holds, FAST_SHRINK, SHRINK))
        worse = eqx.tree_at(lambda p: p.damping, point, jnp.minimum(point.damping * GROW, 1e8))
        new = jax.tree.map(lambda a, b: jnp.where(better, a, b), trial, worse)
        # The decrement is that of the point just left, so a start ends one evaluation after it has settled.
        return number + 1, eqx.tree_at(lambda p: p.decrement, new, jnp.where(number == 0, jnp.inf, decrement))

    blank = unevaluated(problem, x, reference, weight, FIRST_DAMPING / SHRINK)
    return jax.lax.while_loop(unfinished, iterate, (jnp.zeros((), int), blank))[1]
