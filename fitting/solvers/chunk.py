"""Solvers by name, and the compiled program that runs one of them on a few starts at once."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.measurements.abstract import AbstractProblem
from fitting.parameters.tree import FreeLeaves
from fitting.solvers.least_squares import Point, Settings, levenberg_marquardt
from fitting.stored import Stored

EVALUATIONS = {"levenberg_marquardt": 1, "lbfgs": 20, "adam": 150}
"""The solvers, and how many evaluations each is given where Levenberg-Marquardt has one: more than it needs."""


def _solver(name: str) -> Callable[..., Point]:
    if name == "levenberg_marquardt":
        return levenberg_marquardt
    # optax takes half a second to import and is asked for by few.
    from fitting.solvers.descent import adam, lbfgs

    return {"lbfgs": lbfgs, "adam": adam}[name]


def _solve_chunk(
    problem: AbstractProblem,
    parameters: FreeLeaves,
    solver: str,
    settings: Settings,
    bounds: tuple[Float[Array, " unknowns"], Float[Array, " unknowns"]],
    x: Float[Array, "starts unknowns"],
    reference: Float[Array, "starts 4"],
    weight: Float[Array, "starts samples channels"],
    count: Int[Array | np.ndarray, ""],
) -> Point:
    """Minima of the first `count` of a few starts by a solver of `EVALUATIONS`, zeros of the others.

    Every leaf of the result has the starts in front. `settings.active` has them too: what moves may differ from start
    to start. They are solved one after the other, for none then waits for one that takes more steps.
    """
    solve = _solver(solver)
    starts = (jnp.asarray(settings.active), x, reference, weight)

    def one(number):
        active, *start = (jax.lax.dynamic_index_in_dim(leaf, number, keepdims=False) for leaf in starts)
        own = eqx.tree_at(lambda s: s.active, settings, active)
        return solve(problem, parameters, own, bounds, *start)

    like = jax.eval_shape(one, jnp.zeros((), int))
    blank = jax.tree.map(lambda leaf: jnp.zeros((len(x), *leaf.shape), leaf.dtype), like)

    def store(number, points):
        return jax.tree.map(
            lambda all_of, own: jax.lax.dynamic_update_index_in_dim(all_of, own, number, 0), points, one(number)
        )

    return jax.lax.fori_loop(0, count, store, blank)


solve_chunk = Stored(_solve_chunk, quick=True, parts=True)
