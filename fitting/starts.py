"""First guesses for the growing arcs: attitudes that put the Sun where the first lit currents say it is."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PRNGKeyArray

from fitting.local.roll_search import search_roll
from fitting.parameters import Parametrization, build_model
from fitting.problem import Problem
from fitting.stored import Stored
from jaxsat.math import cross, quaternion, unit


def sun_direction_body(currents: Float[Array, "6"]) -> Float[Array, "3"]:
    """Rough direction of the Sun in body axes from six panels of a box, +X -X +Y -Y +Z -Z.

    Of each pair the stronger panel counts, with its sign: the Sun lights one side only, so the weaker one holds
    light of the Earth. Exact without albedo; 10 to 20 deg off with it.
    """
    plus, minus = currents[0::2], currents[1::2]
    return unit(jnp.where(plus >= minus, plus, -minus))


def shortest_turn(a: Float[Array, "3"], b: Float[Array, "3"]) -> Float[Array, "4"]:
    """Quaternion of the least rotation that carries unit vector `a` onto unit vector `b`."""
    opposite = a @ b < -1.0 + 1e-12
    # Half a turn about any axis across `a` where the two are opposite and the axis a x b vanishes.
    across = cross(a, jnp.eye(3, dtype=a.dtype)[jnp.argmin(jnp.abs(a))])
    q = jnp.concatenate([jnp.where(opposite, 0.0, 1.0 + a @ b)[None], jnp.where(opposite, across, cross(a, b))])
    return quaternion.normalize(q)


def random_starts(
    key: PRNGKeyArray, count: int, currents: Float[Array, "6"], sun_eci: Float[Array, "3"], max_rate: Float[Array, ""]
) -> tuple[Float[Array, "count 4"], Float[Array, "count 3"]]:
    """Attitudes with the Sun in its place and any roll about it, and rates uniform in a ball of `max_rate` [rad/s].

    Rolls and radii are stratified, so that few starts cover both evenly.
    """
    keys = jax.random.split(key, 4)
    strata = jnp.arange(count, dtype=currents.dtype)
    roll = 2.0 * jnp.pi * (strata + jax.random.uniform(keys[0], (count,), dtype=currents.dtype)) / count
    onto_sun = shortest_turn(sun_direction_body(currents), sun_eci)
    rolls = quaternion.from_rotation_vector(roll[:, None] * sun_eci[None])
    attitude = jax.vmap(lambda q: quaternion.multiply(q, onto_sun))(rolls)
    layer = jax.random.permutation(keys[1], strata)
    radius = max_rate * jnp.cbrt((layer + jax.random.uniform(keys[2], (count,), dtype=currents.dtype)) / count)
    axis = unit(jax.random.normal(keys[3], (count, 3), dtype=currents.dtype))
    return attitude, radius[:, None] * axis


def _first_guesses(
    problem: Problem,
    parameters: Parametrization,
    key: PRNGKeyArray,
    count: int,
    samples: Int[Array, "2"],
    max_rate: Float[Array, ""],
) -> tuple[Float[Array, "starts 4"], Float[Array, "starts 3"]]:
    """`count` random starts and, in front of them, those of the local method with x along the field.

    `samples` are the first two lit ones: each pair of their best field-aligned attitudes gives a start and its rate.
    """
    spacecraft, _ = build_model(jnp.asarray(parameters.nominal), jnp.asarray(parameters.reference_field))
    first = samples[0]
    measured = jnp.asarray(problem.measured)
    attitude, rate = random_starts(key, count, measured[first], problem.light.sun_eci[first], max_rate)

    def local(sample):
        light = jax.tree.map(lambda leaf: leaf[sample], problem.light)
        node = jnp.asarray(problem.grid.sample_node)[sample]
        field = problem.orbit.b_field_eci[node]
        return search_roll(measured[sample], field, spacecraft.panels, light, jnp.asarray(1.0))

    found = jax.vmap(local)(samples)
    times = jnp.asarray(problem.grid.node_times)[jnp.asarray(problem.grid.sample_node)[samples]]
    turn = jax.vmap(
        lambda a: jax.vmap(lambda b: quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(a), b)))(
            found.quaternion[1]
        )
    )(found.quaternion[0])
    local_rate = turn.reshape(-1, 3) / (times[1] - times[0])
    local_attitude = jnp.repeat(found.quaternion[0], found.quaternion.shape[1], axis=0)
    return jnp.concatenate([local_attitude, attitude]), jnp.concatenate([local_rate, rate])


first_guesses = Stored(_first_guesses, lambda: (0.0, 0.0))
