"""Where sensors look, or any other number of theirs: a chosen sigma with its derivatives, and descents down it."""

from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import minimize

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.problem import linear_about, motion_of, whitened_sample
from fitting.parameters.names import STATE
from fitting.sensitivity.analysis import Sensitivity
from fitting.sensitivity.design.aim import ATTITUDE, aim_of, squared_sigma
from jaxsat.satellites.model import Model


def sigma_of_sensors(
    places: Sequence[Sensitivity], changed: Callable[[Model, Any], Model], name: str = ATTITUDE
) -> Callable[[Any], tuple[float, np.ndarray]]:
    """The chosen sigma of a design of sensors, and its derivatives by the design's numbers in reverse mode.

    `changed` puts a design (an array) into a model, as `lambda model, normals: eqx.tree_at(...)`; it must leave the
    motion alone. The sigma is the RMS over `places`, plans of one satellite with one choice of what is fitted; what is
    measured when, and which readings count, stays as it is in each of them. Where a cell begins to see a light that
    comes aslant its slope has a step: there sigmas of few readings jump a little, and derivatives do not tell of it.
    """
    terms = [_given(place, name) for place in places]

    def sigma(design):
        found = [_seen_slopes(jnp.asarray(design, float), term, changed) for term in terms]
        value = float(np.sqrt(np.mean([float(square) for square, _ in found])))
        return value, np.mean([np.asarray(slopes) for _, slopes in found], axis=0) / (2.0 * value)

    return sigma


def best_directions(
    sigma: Callable[[np.ndarray], tuple[float, np.ndarray]], starts: Sequence[np.ndarray]
) -> tuple[np.ndarray, float]:
    """[n 3] unit vectors of the least sigma that descents from some starts [n 3] lead to, and that sigma (L-BFGS-B).

    `sigma` takes unit vectors; they move freely on their spheres. The best of several descents need not be the best
    that there is: that takes many starts.
    """

    def cost(flat):
        vectors = flat.reshape(-1, 3)
        length = np.linalg.norm(vectors, axis=1, keepdims=True)
        unit = vectors / length
        value, slopes = sigma(unit)
        if not np.isfinite(value):
            return 1e3, np.zeros_like(flat)
        across = slopes - unit * np.sum(slopes * unit, axis=1, keepdims=True)
        return np.log(value), (across / length / value).ravel()

    found = min((minimize(cost, np.ravel(start), jac=True, method="L-BFGS-B") for start in starts), key=lambda r: r.fun)
    vectors = found.x.reshape(-1, 3)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True), float(np.exp(found.fun))


@eqx.filter_jit
def _moved(problem, tree, x, reference, blocks):
    linear = linear_about(tree, x[len(STATE) :])
    return linear, *motion_of(problem, linear, x[: len(STATE) + tree.moving], reference, blocks)


def _given(place: Sensitivity, name: str) -> tuple:
    """All of one motion that the sensors do not change."""
    vantage, choice, problem = place.vantage, place.choice, place.vantage.problem
    parameters = vantage.parameters
    x = np.concatenate([np.zeros(len(STATE)), parameters.shifts(choice.values)])
    x[3:6] += vantage.rate / RATE_UNIT
    blocks = problem.grid.blocks_to(int(np.flatnonzero(problem.valid)[-1]))
    linear, motion, slopes = _moved(problem, parameters.tree, x, vantage.quaternion, blocks)
    # Columns of the choice, spread over the unknowns with their padding.
    columns = np.zeros((len(x), choice.free.shape[1] + choice.consider.shape[1]))
    columns[np.concatenate([np.ones(len(STATE), bool), parameters.columns >= 0])] = np.hstack(
        [choice.free, choice.consider]
    )
    weight = vantage.weight * np.asarray(problem.valid)[:, None]
    seeing = x[len(STATE) + parameters.tree.moving :]
    return problem, linear, motion, slopes, seeing, columns, weight, aim_of(place, name).matrix, place.found.prior


@eqx.filter_jit
def _seen_slopes(design, term, changed):
    return jax.value_and_grad(_seen)(design, term, changed)


def _seen(design: Array, term: tuple, changed: Callable[[Model, Any], Model]) -> Float[Array, ""]:
    problem, linear, motion, slopes, seeing, columns, weight, aim, prior = term
    problem = eqx.tree_at(lambda p: p.model, problem, changed(problem.model, design))
    samples = motion, slopes, problem.sky, problem.measured, problem.known
    J = jax.vmap(lambda *sample: whitened_sample(problem, linear, jnp.asarray(seeing), *sample)[1])(
        *jax.tree.map(jnp.asarray, samples)
    )
    J = J @ columns
    return squared_sigma(jnp.einsum("scu,sc,scv->uv", J, jnp.asarray(weight), J), aim, prior)
