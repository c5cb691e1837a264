"""The one program of all scenarios: what a batch of starts would tell, each sample by itself and then summed."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.problem import Problem, linear_about, motion_of, whitened_sample
from fitting.parameters.free import FreeLeaves
from fitting.stored import Stored

BATCH = 32
"""Scenarios in one call of the program, few enough for a core's cache; memory does not grow beyond two calls."""


def _sums(
    problem: Problem,
    parameters: FreeLeaves,
    weight: Float[Array, "samples channels"],
    rate: Float[Array, "cases 3"],
    reference: Float[Array, "cases 4"],
    nominal: Float[Array, "*cases leaves"],
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[Float[Array, "cases unknowns unknowns"], Float[Array, "cases unknowns unknowns"]]:
    """Sums over samples of whitened derivatives, and of turns, of many starts without readings of their own.

    `nominal` values of the leaves are those of all cases, or of each.
    """
    count = parameters.tangent.shape[1]
    seeing = jnp.zeros(count - parameters.moving)
    sky = jax.tree.map(jnp.asarray, problem.sky)

    def one(rate, reference, nominal):
        linear = linear_about(eqx.tree_at(lambda tree: tree.nominal, parameters, nominal), jnp.zeros(count))
        moving = jnp.concatenate([jnp.zeros(3), rate / RATE_UNIT, jnp.zeros(parameters.moving)])
        motion, slopes = motion_of(problem, linear, moving, reference, blocks)

        def sample(motion, slopes, sky, known):
            model = linear.seen(problem.model, seeing)
            views = problem.views(model, sky, motion.quaternion, motion.angular_velocity, motion.acceleration)
            measured = {name: model.sensors[name](view) for name, view in views.items()}
            return whitened_sample(problem, linear, seeing, motion, slopes, sky, measured, known)[1]

        J = jax.vmap(sample)(motion, slopes, sky, jnp.asarray(problem.known))
        turn = jnp.where(jnp.asarray(problem.valid)[:, None, None], slopes[:, 0], 0.0)
        told = jnp.einsum("scu,sc,scv->uv", J, weight, J)
        turned = jnp.einsum("sku,skv->uv", turn, turn)
        return told, jnp.pad(turned, ((0, seeing.shape[0]), (0, seeing.shape[0])))

    return jax.vmap(one, (0, 0, None if nominal.ndim == 1 else 0))(rate, reference, nominal)


sums = Stored(_sums)
