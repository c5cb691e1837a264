"""A satellite under gravity gradient, let go at random: upright or tumbling.

A rigid satellite, by default of moments 12, 12.5 and 0.6 kg m^2 on a circular orbit of 700 km, begins tilted and
turning at random against the orbital attitude, its long axis up. Nothing damps it: it librates, or it tumbles.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import Input
from jaxsat.sweep.knobs.knob import Knob
from jaxsat.sweep.more_options import inertia_of
from jaxsat.sweep.scenario import Factory, Metric, Option, Scenario, case_keys, chunk_of, number_of

NAME = "gravity-gradient"
STATUSES = ("succeeded", "tumbling", "diverged")
METRICS = {
    "largest_tilt_deg": Metric("deg", "largest angle of the long axis from the vertical"),
    "final_rate_deg_s": Metric("deg/s", "rate against the orbital frame at the end"),
    "upset_time_s": Metric("s", "when the long axis first passed the horizontal; none in a case that stayed upright"),
}
ASSUMPTIONS = (
    "a rigid body on a circular orbit about a round Earth (moments_kg_m2=, altitude_km=)",
    "no torque but the gravity gradient: nothing damps it",
)
OPTIONS = (
    Option("tilt_deg", "15", "1-sigma of the initial rotation about each body axis"),
    Option("rate_deg_s", "0.04", "1-sigma of the initial rate about each body axis, against the orbital frame"),
    Option("orbits", "1", "how many orbits are run"),
    Option("moments_kg_m2", "12,12.5,0.6", "about body x (along the track), y (the orbit's normal) and z (up)"),
    Option("altitude_km", "700", "of the circular orbit, above 6378 km"),
)

CHUNK = 512
MOMENTS = (12.0, 12.5, 0.6)
"""About body x (along the track), y (along the orbit's normal) and z (up) in the orbital attitude [kg m^2]."""
EARTH, RADIUS = 6.378e6, 7.078e6
"""Of the Earth, and of the orbit of 700 km [m]."""
TOLERANCE = 1e-7
"""Error at the end of a steady turn at `FAST` times the 1-sigma rate [rad]; a body that hangs about the horizontal
makes thousands of times more of it, as it does of its initial state."""
FAST = 4.0
SAMPLES = 96
"""Looks at the tilt in an orbit; the libration in pitch takes more than half of one."""


@dataclass(frozen=True)
class Motion:
    """The motion of cases at the samples, in arrays of NumPy or JAX."""

    t_s: np.ndarray
    """[samples], 0 is the first."""
    quaternion: Any
    """Attitude [cases samples 4], scalar first, turns body axes into inertial ones."""
    rate: Any
    """Against the orbital frame, body axes [rad/s], [cases samples 3]."""
    tilt: Any
    """Of body z from the vertical [rad], [cases samples]."""


def _build(options: Mapping[str, str]) -> Scenario:
    tilt = math.radians(number_of(options, "tilt_deg", low=0.0, high=180.0))
    rate = math.radians(number_of(options, "rate_deg_s", low=0.0, high=1.0))
    orbits = number_of(options, "orbits", low=0.01, high=100.0)
    moments = tuple(np.diag(inertia_of(options, "moments_kg_m2")).tolist())
    radius = EARTH + 1e3 * number_of(options, "altitude_km", low=150.0, high=50_000.0)
    moved = functools.partial(motions, tilt=tilt, rate=rate, orbits=orbits, moments=moments, radius=radius)

    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        return outcome(moved(seed, cases))

    def history(seed: int, case: int) -> History:
        # In its own chunk, whose program is compiled and whose last digits are those of the sweep.
        found = moved(seed, chunk_of(case, CHUNK))
        return _history(found, case % CHUNK)

    axes = tuple("xyz")
    inputs = (
        Input("turn", "deg", "rotation vector from the orbital attitude, at the start", lambda d: d[0], axes),
        Input("rate", "deg/s", "at the start, body axes, against the orbital frame", lambda d: d[1], axes),
    )

    def draw(seed: int, cases: np.ndarray) -> np.ndarray:
        return np.degrees([[tilt], [rate]])[..., None] * np.asarray(_drawn()(case_keys(seed, cases)))

    knobs = tuple(Knob(f"moment_{c}", "kg m2", f"of inertia about body {c}", moments[k]) for k, c in enumerate("xyz"))
    sizes = (
        Knob("tilt", "deg", "1-sigma of the initial rotation about each body axis", math.degrees(tilt)),
        Knob("rate", "deg/s", "1-sigma of the initial rate about each body axis", math.degrees(rate)),
    )
    knobs += tuple(knob for knob in sizes if knob.value > 0.0)

    def run_moved(seed: int, cases: np.ndarray, turned: Any) -> Mapping[str, Any]:
        import jax

        t_s, move = _motion(rate, orbits, moments, radius)
        own = jax.jit(changed)(turned)
        return _outcome(t_s.tobytes())(*move(case_keys(seed, cases), *own))

    def changed(turned: Any) -> tuple[Any, Any, Any]:
        """Spreads of tilt and rate and moments of inertia, of each case."""
        import jax.numpy as jnp

        factor = {knob.name: jnp.exp(turned[:, k]) for k, knob in enumerate(knobs)}
        none = jnp.ones(len(turned))
        own = jnp.stack([moments[k] * factor[f"moment_{c}"] for k, c in enumerate("xyz")], axis=1)
        return tilt * factor.get("tilt", none), rate * factor.get("rate", none), own

    inputs = tuple(one for one, spread in zip(inputs, (tilt, rate), strict=True) if spread > 0.0)
    given = {"history": history, "inputs": inputs, "draw": draw, "knobs": knobs, "run_moved": run_moved}
    return Scenario(NAME, STATUSES, METRICS, CHUNK, run, **given)


@functools.cache
def _drawn():
    """Compiled: rotations and rates [2 cases 3] from keys, over their 1-sigma."""
    import jax

    return jax.jit(jax.vmap(_turn_and_spin, out_axes=1))


def _turn_and_spin(key):
    import jax

    return jax.random.normal(key, (2, 3))


@functools.lru_cache(maxsize=4)
def _outcome(times: bytes):
    """Compiled: `outcome` by JAX of a motion at times, from its quaternion, rate and tilt."""
    import jax
    import jax.numpy as jnp

    t_s = np.frombuffer(times)
    return jax.jit(lambda *found: outcome(Motion(t_s, *found), jnp))


def outcome(motion: Motion, xp: Any = np) -> dict[str, Any]:
    """Status and metrics of each case, by NumPy or by JAX (`xp`), through which derivatives go."""
    tilt = xp.degrees(motion.tilt)
    rate = xp.degrees(xp.linalg.norm(motion.rate[:, -1], axis=1))
    sound = xp.isfinite(tilt).all(axis=1) & xp.isfinite(rate)
    fallen = tilt > 90.0
    upset = fallen.any(axis=1) & sound
    return {
        "status": xp.where(sound, xp.where(upset, 1, 0), 2),
        "largest_tilt_deg": xp.where(sound, tilt.max(axis=1), np.nan),
        "final_rate_deg_s": xp.where(sound, rate, np.nan),
        "upset_time_s": xp.where(upset, xp.asarray(motion.t_s)[xp.argmax(fallen, axis=1)], np.nan),
    }


def _history(motion: Motion, case: int) -> History:
    rates, tilts = np.degrees(motion.rate[case]), np.degrees(motion.tilt[case])
    columns = {
        **{f"q_{c}": motion.quaternion[case, :, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
        "tilt_deg": tilts,
    }
    charts = {
        "long axis from the vertical, deg": {"": tilts},
        "rate against the orbit, deg/s": dict(zip("xyz", rates.T, strict=True)),
    }
    return History(motion.t_s, columns, charts)


make = Factory(_build, OPTIONS, ASSUMPTIONS)


def motions(
    seed: int,
    cases: np.ndarray,
    *,
    tilt: float,
    rate: float,
    orbits: float,
    moments: tuple[float, ...] = MOMENTS,
    radius: float = RADIUS,
) -> Motion:
    """Motion of numbered cases; `tilt` [rad] and `rate` [rad/s] are the 1-sigma of what they begin with.

    Of a body of the `moments` [kg m^2] on an orbit of the `radius` [m].
    """
    t_s, move = _motion(rate, orbits, moments, radius)
    found = move(case_keys(seed, cases), tilt, rate)
    return Motion(t_s, *(np.asarray(array) for array in found))


@functools.lru_cache(maxsize=4)
def _motion(rate: float, orbits: float, moments: tuple[float, ...], radius: float):
    """Times [samples] and the motion from (keys, tilt, rate) to (quaternion, rate, tilt).

    With moments of inertia [cases 3] of each case tilt and rate are those of each case too.
    """
    import jax
    import jax.numpy as jnp

    from jaxsat.constants import EARTH_MU
    from jaxsat.dynamics import AttitudeState
    from jaxsat.environment import KeplerOrbit, OrbitTable
    from jaxsat.integrators import RK4, StepGrid, step_for
    from jaxsat.math import cross, quaternion
    from jaxsat.simulate import simulate_on_grid
    from jaxsat.spacecraft import Spacecraft

    mean_motion = math.sqrt(EARTH_MU / radius**3)
    period = 2.0 * math.pi / mean_motion
    t_s = np.linspace(0.0, orbits * period, 1 + max(1, math.ceil(SAMPLES * orbits)))
    # The libration itself turns the body at up to twice the orbital rate.
    max_step = step_for(RK4, 2.0 * mean_motion + FAST * rate, orbits * period, TOLERANCE)
    grid = StepGrid.through(t_s, start=0.0, max_step=max_step)
    orbit = KeplerOrbit(radius, 0.0, math.radians(98.0), 0.0, 0.0, 0.0)
    # NumPy from here on: each operation of JAX outside a compiled function would be compiled by itself.
    position, velocity = (np.asarray(x) for x in jax.jit(jax.vmap(orbit))(grid.node_times))
    table = OrbitTable(jnp.asarray(position), jnp.asarray(np.zeros_like(position)))
    up = position[grid.sample_node] / radius
    normal = np.cross(position[0], velocity[0]) / np.linalg.norm(np.cross(position[0], velocity[0]))
    inertial_from_orbit = np.stack([np.cross(normal, up[0]), normal, up[0]], axis=1)
    craft = Spacecraft(jnp.asarray(np.diag(moments)))

    def carried(q):
        """Rate of the orbital frame in body axes."""
        return quaternion.rotate_inverse(q, jnp.asarray(mean_motion * normal))

    def begin(key, tilt, rate):
        turn, spin = _turn_and_spin(key)
        rest = quaternion.from_dcm(jnp.asarray(inertial_from_orbit))
        q = quaternion.multiply(rest, quaternion.from_rotation_vector(tilt * turn))
        return AttitudeState(q, rate * spin + carried(q))

    def one(state, craft=craft):
        return simulate_on_grid(craft, state, table, grid)

    # Three programs: compiled as one they take twice as long.
    @jax.jit
    def initial(keys, tilt, rate):
        own = 0 if jnp.ndim(tilt) else None
        return jax.vmap(begin, in_axes=(0, own, own))(keys, tilt, rate)

    @jax.jit
    def run(states, own=None):
        if own is None:
            motion = jax.vmap(one)(states)
        else:
            motion = jax.vmap(lambda state, each: one(state, Spacecraft(jnp.diag(each))))(states, own)
        return motion.quaternion, motion.angular_velocity

    @jax.jit
    def against_orbit(q, w):
        long_axis = quaternion.to_dcm(q)[..., :, 2]
        vertical = jnp.broadcast_to(jnp.asarray(up), long_axis.shape)
        sine = jnp.linalg.norm(cross(long_axis, vertical), axis=-1)
        tilt = jnp.arctan2(sine, jnp.sum(long_axis * vertical, axis=-1))
        return w - jax.vmap(jax.vmap(carried))(q), tilt

    def move(keys, tilt, rate, own=None):
        q, w = run(initial(keys, tilt, rate), own)
        return q, *against_orbit(q, w)

    return t_s, move
