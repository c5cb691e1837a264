"""Solvers by name, and the compiled program that runs one of them on a few starts at once."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.measurements.abstract import AbstractProblem
from fitting.parameters.tree import FreeLeaves
from fitting.solvers.least_squares import Point, Settings, levenberg_marquardt
from fitting.stored import Stored

EVALUATIONS = {"levenberg_marquardt": 1, "lbfgs": 20, "adam": 150}
"""The solvers, and how many evaluations each is given where Levenberg-Marquardt has one: more than it needs."""


def _one_by_one(solver: str) -> Callable[..., Point]:
    # optax takes half a second to import and is asked for by few.
    from fitting.solvers.descent import adam, lbfgs

    solve = {"lbfgs": lbfgs, "adam": adam}[solver]

    def all_of(problem, parameters, settings, bounds, x, reference, weight):
        def one(active, x, reference, weight):
            own = eqx.tree_at(lambda s: s.active, settings, active)
            return solve(problem, parameters, own, bounds, x, reference, weight)

        return jax.vmap(one)(jnp.asarray(settings.active), x, reference, weight)

    return all_of


def _solve_chunk(
    problem: AbstractProblem,
    parameters: FreeLeaves,
    solver: str,
    settings: Settings,
    bounds: tuple[Float[Array, " unknowns"], Float[Array, " unknowns"]],
    x: Float[Array, "starts unknowns"],
    reference: Float[Array, "starts 4"],
    weight: Float[Array, "starts samples channels"],
) -> Point:
    """Minima of a few starts by a solver of `EVALUATIONS`; every leaf of the result has the starts in front.

    `settings.active` has them too: what moves may differ from start to start.
    """
    solve = levenberg_marquardt if solver == "levenberg_marquardt" else _one_by_one(solver)
    return solve(problem, parameters, settings, bounds, x, reference, weight)


solve_chunk = Stored(_solve_chunk)
