"""Many cases of Sun pointing at once: the closed loop replayed on arrays over the cases, in one scan."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from jaxsat.control.sun_loop import LoopSettings, LoopState, Sample, first_state, one_period
from jaxsat.control.sun_pointing import SunPointingLaw
from jaxsat.control.sun_vehicle import SunPointingVehicle, nominal_vehicle
from jaxsat.math.scalars import elements, over_cases, regrouped

NOISES = 11
"""Random numbers of one control period: eight detectors, three rates."""


class Cases(eqx.Module):
    """What differs from case to case; leaves with the cases in front."""

    quaternion: Float[Array, "cases 4"]
    """inertial-from-body, at the start."""
    angular_velocity: Float[Array, "cases 3"]
    """At the start [rad/s]."""
    vehicle: SunPointingVehicle
    """Leaves with the cases in front, or without where they are common to all."""
    key: Key[Array, " cases"]
    """Of the noise."""


def run_cases(
    settings: LoopSettings, law: SunPointingLaw, cases: Cases, sun_eci: Float[Array, "3"], periods: int
) -> LoopState:
    """The state of every case after a number of control periods; leaves with the cases in front.

    The law's leaves may have the cases in front as well.
    """
    alone = jax.tree.map(lambda leaf: leaf[0], (cases.quaternion, cases.angular_velocity))
    shapes = jax.eval_shape(functools.partial(first_state, settings), *alone)
    craft, plan = jax.eval_shape(nominal_vehicle), jax.eval_shape(SunPointingLaw)
    noise = (jax.ShapeDtypeStruct((NOISES,), cases.quaternion.dtype),) if settings.noisy else ()

    def step(law, vehicle, state, *noise):
        return one_period(settings, law, vehicle, sun_eci, state, noise[0] if noise else None)[0]

    replayed = over_cases(step, plan, craft, shapes, *noise)
    fixed = [
        jax.tree.map(lambda leaf, like: elements(_last(leaf, like), element_rank=like.ndim), *pair)
        for pair in ((law, plan), (cases.vehicle, craft))
    ]
    start = jax.vmap(functools.partial(first_state, settings))(cases.quaternion, cases.angular_velocity)
    count = len(cases.quaternion)
    flat = jax.tree.map(lambda leaf, like: list(_last(leaf, like).reshape(-1, count)), start, shapes)
    flat = jax.tree.leaves(flat)

    def advance(carry, number):
        state = regrouped(tuple(carry), shapes)
        drawn = ()
        if settings.noisy:
            one = jax.vmap(lambda key: jax.random.normal(jax.random.fold_in(key, number), (NOISES,)))(cases.key)
            drawn = (elements(one.T, element_rank=1),)
        after = jax.tree.leaves(replayed(*fixed, state, *drawn, hold=functools.partial(_stored, number)))
        spread = [
            jnp.broadcast_to(jnp.asarray(x, old.dtype), old.shape)
            for x, old in zip([element for leaf in after for element in leaf.reshape(-1)], carry, strict=True)
        ]
        return spread, None

    final, _ = jax.lax.scan(advance, flat, jnp.arange(periods))
    state = regrouped(tuple(final), shapes)
    return jax.tree.map(
        lambda leaf, like: jnp.stack(list(leaf.reshape(-1)), axis=-1).reshape(count, *like.shape), state, shapes
    )


def _stored(number, arrays):
    """Arrays that are stored and not computed anew for each of their uses, as XLA would on a CPU.

    It takes barriers away, but not what might be otherwise: no period has a negative number.
    """
    return jax.lax.cond(number >= 0, lambda same: same, lambda same: jax.tree.map(jnp.zeros_like, same), arrays)


def _last(leaf, like):
    """The cases of a leaf behind its own axes."""
    return jnp.moveaxis(leaf, 0, -1) if leaf.ndim > like.ndim else leaf


def run_one(
    settings: LoopSettings, law: SunPointingLaw, case: Cases, sun_eci: Float[Array, "3"], periods: int
) -> tuple[LoopState, Sample]:
    """Final state and history [periods ...] of a single case, `Cases` of one."""
    vehicle = jax.tree.map(
        lambda leaf, like: leaf[0] if leaf.ndim > like.ndim else leaf, case.vehicle, jax.eval_shape(nominal_vehicle)
    )
    start = first_state(settings, case.quaternion[0], case.angular_velocity[0])

    def advance(state, number):
        noise = jax.random.normal(jax.random.fold_in(case.key[0], number), (NOISES,)) if settings.noisy else None
        return one_period(settings, law, vehicle, sun_eci, state, noise)

    return jax.lax.scan(advance, start, jnp.arange(periods))
