"""The automaton that finds the Earth by the presence signals of four horizon sensors (Melnikov et al. 2022).

Sensors +x, +y, -x, -y look to four sides of the body axis z, at one angle from it; that axis shall point to the nadir.
An axis of the search, x or y, is served by two opposite sensors: z moves toward +x by a turn about y.

1. SEARCH: rotation about a body axis until any sensor signals.
2. APPROACH: z moves toward that sensor, 3. until the opposite one signals, whatever the first one says; 4. a signal
   across starts the same on the other axis, at the same time. 5. With all four, TRACK: by the second harmonics. 6. A
   signal that is lost leads back to 1.

A signal inside the disk may come or not: nothing is concluded from its absence, and a direction once taken is kept.
What the paper leaves open is decided here: an axis that no sensor has told anything of while the other is done goes on
in the sense of the search; with both axes done but not all four signals, the signals that are there count anew, and
with none at all the search begins again; a search without a signal after `search_turn` goes on about the other axis.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.math import float_array

SEARCH, APPROACH, TRACK = 0, 1, 2
MODES = ("search", "approach", "track")
SENSORS = ("+x", "+y", "-x", "-y")


def _degrees(value: float):
    return eqx.field(converter=float_array, default=math.radians(value))


class EarthSearchLaw(eqx.Module):
    """Rates and directions of the search."""

    search_rate: Float[Array, ""] = _degrees(0.25)
    """[rad/s]"""
    approach_rate: Float[Array, ""] = _degrees(0.1)
    """Of each axis [rad/s]."""
    track_rate: Float[Array, ""] = _degrees(0.01)
    """Largest correction while tracking [rad/s]."""
    search_direction: Float[Array, "2"] = eqx.field(
        converter=float_array, default_factory=lambda: jnp.array([0.0, 1.0])
    )
    """Where z moves first, in x and y: (0, 1) is a rotation about x, (0.7, 0.7) one about the diagonal."""
    search_turn: Float[Array, ""] = _degrees(360.0)
    """After which the search goes on across [rad]."""
    track_gain: Float[Array, ""] = eqx.field(converter=float_array, default=0.02)
    """Commanded rate over the angle [1/s]."""
    drift_gain: Float[Array, ""] = eqx.field(converter=float_array, default=0.05)
    """Inverse time in which the drift of the vertical is learnt while tracking [1/s]; 0: it is not, as published."""
    approach_turn: Float[Array, ""] = eqx.field(converter=float_array, default=math.inf)
    """After which an approach is given up, for a search about the other axis [rad]; not in the paper."""
    returns: Bool[Array, ""] = eqx.field(converter=jnp.asarray, default=False)
    """Whether an axis that goes on blindly turns back as the last signal vanishes; not in the paper. Nor is the return
    from tracking to the approach, not to the search, while there are signals left."""


def search_law(size: str = "large", strategy: str = "published") -> EarthSearchLaw:
    """The law of a `large` or a `small` spacecraft.

    `published`: 0.25 and 0.1, or 2 and 0.8 deg/s, and 0.01 deg/s while tracking. `fast`: approach and corrections at
    the rate of the search. `guarded`: that; an approach ends after 120 deg, a blind turn comes back, and what is lost
    while tracking is approached again.
    """
    search, approach = (jnp.radians(x) for x in {"large": (0.25, 0.1), "small": (2.0, 0.8)}[size])
    if strategy == "published":
        return EarthSearchLaw(search, approach)
    if strategy == "fast":
        return EarthSearchLaw(search, search, search)
    return EarthSearchLaw(search, search, search, approach_turn=jnp.radians(120.0), returns=jnp.asarray(True))


class Signals(eqx.Module):
    """What the four sensors say, in the order +x, +y, -x, -y."""

    present: Bool[Array, "4"]
    offset: Float[Array, "4"]
    """Of the horizon from where it is with z to the nadir, by the second harmonic [rad]: positive outward."""


class SearchMemory(eqx.Module):
    """What the automaton remembers."""

    mode: Int[Array, ""]
    direction: Float[Array, "2"]
    """In which z moves along each axis: -1, 0, 1."""
    done: Bool[Array, "2"]
    """Whether both sensors of an axis have been met."""
    blind: Bool[Array, "2"]
    """Whether the direction is that of the search, for want of a signal."""
    search_direction: Float[Array, "2"]
    time_in_mode: Float[Array, ""]
    """[s]"""
    angle: Float[Array, "2"]
    """Of the nadir from z toward x and y, filtered [rad]."""
    drift: Float[Array, "2"]
    """Of the nadir in the axes of x and y [rad/s]."""


def first_memory(law: EarthSearchLaw) -> SearchMemory:
    """Before the first step."""
    none, no = jnp.zeros(2), jnp.zeros(2, bool)
    return SearchMemory(jnp.asarray(SEARCH), none, no, no, law.search_direction, jnp.asarray(0.0), none, none)


def decide(
    law: EarthSearchLaw,
    memory: SearchMemory,
    signals: Signals,
    sensor_axes: Float[Array, "4 2"],
    motion: Float[Array, "2"],
    period: float,
) -> tuple[SearchMemory, Float[Array, "2"]]:
    """The memory after a step of `period` [s], and the commanded motion of z toward +x and +y [rad/s].

    `sensor_axes` are the azimuths of the sensors in use, unit vectors in x and y; `motion` is that of z by the gyros.
    """
    plus, minus = signals.present[:2], signals.present[2:]
    both, seen = plus & minus, plus | minus
    any_seen, all_seen = seen[0] | seen[1], both[0] & both[1]
    searching, approaching, tracking = (memory.mode == number for number in range(3))

    # Both axes done without all four: what is there counts anew.
    stale = memory.done[0] & memory.done[1]
    fresh = approaching & ~stale
    done, direction = memory.done & fresh, jnp.where(fresh, memory.direction, 0.0)
    toward = jnp.where(both, 0.0, jnp.where(plus, 1.0, jnp.where(minus, -1.0, 0.0)))
    arrived = jnp.where(direction > 0.0, minus, jnp.where(direction < 0.0, plus, both))
    done = done | arrived
    told = (direction == 0.0) | memory.blind
    blind = memory.blind & fresh & ~seen
    direction = jnp.where(done, 0.0, jnp.where(told & seen, toward, direction))
    # Nothing known of this axis while the other one is done.
    begins = (direction == 0.0) & ~done & done[::-1]
    onward = jnp.where(memory.search_direction < 0.0, -1.0, 1.0)
    back = law.returns & blind & ~any_seen
    direction = jnp.where(begins, onward, jnp.where(back, -direction, direction))
    blind = (blind & ~back & ~done) | begins

    lost = ~any_seen & (stale | ~approaching)
    spent = approaching & ((memory.time_in_mode + period) * law.approach_rate > law.approach_turn)
    lost = lost | spent | (tracking & ~law.returns)
    mode = jnp.where(all_seen, TRACK, jnp.where(lost, SEARCH, APPROACH))
    time_in_mode = jnp.where(mode == memory.mode, memory.time_in_mode + period, 0.0)
    turned = (searching & (time_in_mode * law.search_rate > law.search_turn)) | spent
    x, y = memory.search_direction
    sweep = jnp.where(turned, jnp.stack([-y, x]), memory.search_direction)
    time_in_mode = jnp.where(turned, 0.0, time_in_mode)

    angle, drift = _followed(law, memory, signals, sensor_axes, motion, period, fresh=tracking & all_seen)
    correction = jnp.clip(law.track_gain * angle, -law.track_rate, law.track_rate)
    command = jnp.where(
        mode == SEARCH,
        law.search_rate * sweep,
        jnp.where(mode == APPROACH, law.approach_rate * direction, correction + drift),
    )
    stays = mode == APPROACH
    direction, done, blind = jnp.where(stays, direction, 0.0), done & stays, blind & stays
    return SearchMemory(mode, direction, done, blind, sweep, time_in_mode, angle, drift), command


def _followed(law, memory, signals, sensor_axes, motion, period, *, fresh):
    """Angle and drift of the nadir, by an observer that knows the own motion; begun anew where `fresh` is false."""
    # Four horizons: offset = - azimuth . angle, and the azimuths' squares sum to about 2.
    measured = -0.5 * (signals.offset @ sensor_axes)
    lag = 1.0 - jnp.exp(-law.drift_gain * period)
    predicted = memory.angle + (memory.drift - motion) * period
    off = measured - predicted
    # Both poles at exp(-gain T).
    angle = predicted + (1.0 - (1.0 - lag) ** 2) * off
    drift = memory.drift + lag**2 / period * off
    learns = law.drift_gain > 0.0
    angle = jnp.where(fresh & learns, angle, measured)
    return angle, jnp.where(fresh & learns, drift, 0.0)
