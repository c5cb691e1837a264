"""What surrounds a loop's satellite, tabulated once: at the beginnings of control periods and at the steps' stages."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxsat.control.loops.schedule import Schedule
from jaxsat.environment import OrbitTable
from jaxsat.environment.shadow import ConeShadow
from jaxsat.environment.surroundings import Surroundings
from jaxsat.math import put

BATCH = 4096


class Instant(eqx.Module):
    """The surroundings at the beginning of a control period, which the computer on board knows too."""

    time: Float[Array, "*periods"]
    """[s]"""
    position_eci: Float[Array, "*periods 3"]
    """[m]"""
    velocity_eci: Float[Array, "*periods 3"]
    """[m/s]"""
    b_field_eci: Float[Array, "*periods 3"]
    """[T]"""
    sun_eci: Float[Array, "*periods 3"]
    """Unit vector."""
    illumination: Float[Array, "*periods"]
    """Visible share of the Sun."""
    mode: Int[Array, "*periods"]
    """Of the controller, by the schedule."""
    target_quaternion: Float[Array, "*periods 4"] | None = None
    """Attitude to point to, inertial-from-body."""
    target_rate_eci: Float[Array, "*periods 3"] | None = None
    """Its angular velocity, inertial components [rad/s]."""


class Stage(eqx.Module):
    """One step of the motion: its length, and the surroundings at its begin, middle and end."""

    length: Float[Array, "*steps"]
    """[s]"""
    on: Float[Array, "*steps"]
    """1 while the coils are on, 0 while they are off."""
    points: OrbitTable | None
    """Leaves [steps 3 ...]; None where no torque acts but that of actuators."""


class Timeline(eqx.Module):
    """All of it over a time of whole control periods."""

    instants: Instant
    """[periods ...]"""
    last: Instant
    """At the end of the last period."""
    stages: Stage
    """Leaves [periods steps ...]."""


def timeline(
    surroundings: Surroundings, schedule: Schedule, periods: int, *, start: float = 0.0, pressed: bool = False
) -> Timeline:
    """The surroundings over so many control periods from `start` [s]; the Sun of `surroundings` must be there.

    Sunlight presses on the satellite only where `pressed`. Raises ValueError where there is no Sun.
    """
    if surroundings.sun is None:
        raise ValueError("timeline: Surroundings.sun is None: give Sun(epoch.tt_centuries()), whom sensors look for")
    begins = start + schedule.period_s * np.arange(periods + 1)
    edges = schedule.edges
    middles = 0.5 * (edges[1:] + edges[:-1])
    inner = np.stack([edges[:-1], middles], axis=1).reshape(-1)
    nodes = np.append((begins[:-1, None] + inner).reshape(-1), begins[-1])
    moving = surroundings if pressed else dataclasses.replace(surroundings, sun=None, shadow=None)
    table = _tabulated(moving, put(nodes))
    steps = len(middles)
    first = 2 * np.arange(periods * steps).reshape(periods, steps)
    places = first[..., None] + np.arange(3)
    lengths = np.broadcast_to(np.diff(edges), (periods, steps))
    on = np.broadcast_to(schedule.on.astype(float), (periods, steps))
    stages = Stage(put(lengths.copy()), put(on.copy()), jax.tree.map(lambda leaf: put(np.asarray(leaf)[places]), table))
    every = _instants(surroundings, put(begins), put(schedule.mode_at(begins - start)))
    instants, last = (jax.tree.map(lambda leaf, part=part: leaf[part], every) for part in (slice(None, -1), -1))
    return Timeline(instants, last, stages)


def unchanging(
    schedule: Schedule, periods: int, sun_eci: Float[ArrayLike, "3"], points: OrbitTable | None = None
) -> Timeline:
    """Surroundings that stay as they are, with a Sun that nothing hides; `points` are those of torques and field."""
    edges, none = schedule.edges, np.zeros(3)
    steps = len(edges) - 1
    place, field = (none, none) if points is None else (points.position_eci, points.b_field_eci)
    times = schedule.period_s * np.arange(periods + 1)

    def many(value, *axes):
        return jnp.broadcast_to(value, (*axes, *jnp.shape(value)))

    around = (many(x, periods + 1) for x in (place, none, field, sun_eci, 1.0))
    every = Instant(jnp.asarray(times), *around, mode=jnp.asarray(schedule.mode_at(times)))
    instants, last = (jax.tree.map(lambda leaf, part=part: leaf[part], every) for part in (slice(None, -1), -1))
    points = jax.tree.map(lambda leaf: many(leaf, periods, steps, 3), points)
    return Timeline(instants, last, Stage(many(np.diff(edges), periods), many(schedule.on * 1.0, periods), points))


@eqx.filter_jit
def _tabulated(surroundings, times):
    return jax.lax.map(lambda t: jax.tree.map(lambda x: x[0], surroundings(t[None])), times, batch_size=BATCH)


@eqx.filter_jit
def _instants(surroundings, times, modes):
    def at(pair):
        t, mode = pair
        position, velocity = surroundings.orbit(t)
        to_sun, _ = surroundings.sun(t)
        distance = jnp.sqrt(jnp.sum(to_sun**2))
        sun = to_sun / distance
        field = surroundings(t[None]).b_field_eci[0]
        lit = (surroundings.shadow or ConeShadow())(position, sun)
        return Instant(t, position, velocity, field, sun, lit, mode)

    return jax.lax.map(at, (times, modes), batch_size=BATCH)
