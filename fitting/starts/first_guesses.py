"""First guesses for the growing arcs: attitudes that put the Sun where the first lit currents say it is."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PRNGKeyArray

from fitting.local.roll_search import search_roll
from fitting.measurements.problem import Problem
from fitting.parameters.names import GAINS, MODEL
from fitting.parameters.parametrization import GAINS_SLICE, Parametrization, build_model
from fitting.stored import Stored
from jaxsat.environment import LightTable
from jaxsat.math import quaternion, unit

CLEARLY = 1.5
"""How much more of the Sun than its opposite shows a dead panel must be left with to be the one that faces it."""


def silent_panels(measured: np.ndarray, noise: float, parameters: Parametrization) -> np.ndarray:
    """[6] panels of free gain that never show light while others do: taken for dead, which their priors may undo."""
    dark = ~np.any(measured > 3.0 * noise, axis=0)
    return dark & np.isin(GAINS, parameters.free) & ~np.all(dark)


def first_unknowns(parameters: Parametrization, silent: np.ndarray) -> np.ndarray:
    """[unknowns] all at their nominal values, but no gain where a panel is silent, and the others as bright as ever."""
    x = np.zeros(len(parameters.names))
    lower, _ = parameters.bounds()
    dead = [parameters.names.index(GAINS[panel]) for panel in np.flatnonzero(silent)]
    x[dead] = lower[dead]
    if len(dead) and parameters.gains_gauged:
        # The gauge would spread the common mean over the panels that are left.
        gains = np.asarray(parameters.nominal)[GAINS_SLICE]
        share = gains[~silent].sum() / gains.sum()
        imax = MODEL.index("imax")
        x[parameters.names.index("imax")] = (share - 1.0) * float(parameters.nominal[imax] / parameters.scale[imax])
    return x


def filled_in(measured: np.ndarray, noise: float, silent: np.ndarray, max_current: float) -> np.ndarray:
    """[samples 6] currents in which a silent panel has what the Sun leaves to it, where that is more than its opposite.

    The squares of the cosines to three axes add up to one; without this the first guess would put the Sun across it.
    Where two panels are silent the first of them gets what is left to both.
    """
    currents = measured.copy()
    for panel in np.flatnonzero(silent):
        opposite = currents[:, panel ^ 1]
        # What is on the opposite side beside a Sun on this one is light of the Earth.
        rest = max_current**2 - (currents**2).sum(axis=1) + opposite**2
        left = np.sqrt(np.maximum(rest, 0.0))
        currents[:, panel] = np.where(left > np.maximum(CLEARLY * opposite, 3.0 * noise), left, 0.0)
    return currents


def sun_direction_body(currents: Float[Array, "6"]) -> Float[Array, "3"]:
    """Rough direction of the Sun in body axes from six panels of a box, +X -X +Y -Y +Z -Z.

    Of each pair the stronger panel counts, with its sign: the Sun lights one side only, so the weaker one holds
    light of the Earth. Exact without albedo; 10 to 20 deg off with it.
    """
    plus, minus = currents[0::2], currents[1::2]
    return unit(jnp.where(plus >= minus, plus, -minus))


def random_starts(
    key: PRNGKeyArray, count: int, currents: Float[Array, "6"], sun_eci: Float[Array, "3"], max_rate: Float[Array, ""]
) -> tuple[Float[Array, "count 4"], Float[Array, "count 3"]]:
    """Attitudes with the Sun in its place and any roll about it, and rates uniform in a ball of `max_rate` [rad/s].

    Rolls and radii are stratified, so that few starts cover both evenly.
    """
    keys = jax.random.split(key, 4)
    strata = jnp.arange(count, dtype=currents.dtype)
    roll = 2.0 * jnp.pi * (strata + jax.random.uniform(keys[0], (count,), dtype=currents.dtype)) / count
    onto_sun = quaternion.shortest_turn(sun_direction_body(currents), sun_eci)
    rolls = quaternion.from_rotation_vector(roll[:, None] * sun_eci[None])
    attitude = jax.vmap(lambda q: quaternion.multiply(q, onto_sun))(rolls)
    layer = jax.random.permutation(keys[1], strata)
    radius = max_rate * jnp.cbrt((layer + jax.random.uniform(keys[2], (count,), dtype=currents.dtype)) / count)
    axis = unit(jax.random.normal(keys[3], (count, 3), dtype=currents.dtype))
    return attitude, radius[:, None] * axis


class Sightings(eqx.Module):
    """What the first guesses are made of: the first two lit samples, and the nominal satellite.

    Nothing else of the session, nor what is free: one program serves every fit.
    """

    nominal: Float[Array | np.ndarray, " model"]
    reference_field: Float[Array | np.ndarray, ""]
    currents: Float[Array | np.ndarray, "2 6"]
    """Of dead panels `filled_in` [A]."""
    light: LightTable
    b_field_eci: Float[Array | np.ndarray, "2 3"]
    times: Float[Array | np.ndarray, "2"]

    @staticmethod
    def of(
        problem: Problem, parameters: Parametrization, currents: np.ndarray, samples: Int[np.ndarray, "2"]
    ) -> "Sightings":
        """Those of a problem at its samples number `samples`."""
        nodes = np.asarray(problem.grid.sample_node)[samples]
        return Sightings(
            np.asarray(parameters.nominal)[: len(MODEL)],
            np.asarray(parameters.reference_field),
            currents[samples],
            jax.tree.map(lambda leaf: np.asarray(leaf)[samples], problem.light),
            np.asarray(problem.orbit.b_field_eci)[nodes],
            np.asarray(problem.grid.node_times)[nodes],
        )


def _first_guesses(
    seen: Sightings, key: PRNGKeyArray, count: int, max_rate: Float[Array, ""]
) -> tuple[Float[Array, "starts 4"], Float[Array, "starts 3"]]:
    """`count` random starts and, in front of them, those of the local method with x along the field.

    Each pair of the two samples' best field-aligned attitudes gives a start and its rate.
    """
    _, panels, _ = build_model(jnp.asarray(seen.nominal), jnp.asarray(seen.reference_field))
    attitude, rate = random_starts(key, count, seen.currents[0], seen.light.sun_eci[0], max_rate)
    found = jax.vmap(lambda currents, field, light: search_roll(currents, field, panels, light, jnp.asarray(1.0)))(
        jnp.asarray(seen.currents), jnp.asarray(seen.b_field_eci), seen.light
    )
    turn = jax.vmap(
        lambda a: jax.vmap(lambda b: quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(a), b)))(
            found.quaternion[1]
        )
    )(found.quaternion[0])
    local_rate = turn.reshape(-1, 3) / (seen.times[1] - seen.times[0])
    local_attitude = jnp.repeat(found.quaternion[0], found.quaternion.shape[1], axis=0)
    return jnp.concatenate([local_attitude, attitude]), jnp.concatenate([local_rate, rate])


first_guesses = Stored(_first_guesses)
