"""A satellite of any file with a magnet and rods with hysteresis settles along the field.

Nothing is commanded: the rods turn the motion into heat (Flatley & Henretty 1995). A case has succeeded if the magnet
stays within the limit of the field over the last orbit.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from jaxsat.errors import InputError
from jaxsat.sweep.flights.inputs import start_inputs
from jaxsat.sweep.flights.options import COMMON
from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import upright
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario, case_keys

NAME = "settle"
STATUSES = ("succeeded", "not settled", "diverged")
METRICS = {
    "settling_time_s": Metric(
        "s", "until the magnet stays within the limit of the field; none in a case that does not settle", endless=True
    ),
    "mean_angle_deg": Metric("deg", "mean angle of the magnet from the field over the last orbit"),
    "largest_angle_deg": Metric("deg", "largest angle of the magnet from the field over the last orbit"),
    "final_rate_deg_s": Metric("deg/s", "size of the angular velocity at the end"),
    "rod_heat_uJ": Metric("uJ", "energy that the rods have taken from the motion"),
    "error_rad": Metric("rad", "largest angle to the same motion with steps 1.5 times as long"),
}
OPTIONS = (
    Option("satellite", "", "satellite file; without it a bundled CubeSat of one unit", file=True),
    *(option for option in COMMON if option.name != "satellite"),
    Option("hours", "12", "simulated time"),
    Option("rate_deg_s", "5", "largest rate at the start: its size is uniform up to it, its direction over all"),
    Option("limit_deg", "20", "angle of the magnet from the field that counts as settled"),
    Option("sample_s", "60", "between looks at the angle"),
    Option("tolerance_rad", "1e-2", "of each case's attitude, to which its steps are chosen"),
)
ASSUMPTIONS = (
    "All cases begin at the same place of the orbit; attitudes are uniform, rates uniform in size and direction.",
    "Numbers of the satellite file with a sigma are normal about their values, the rods' flux at the start among them.",
    "Rods are alike along their length and do not see each other; the law is that of Flatley & Henretty 1995.",
    "A motion that is chaotic is kept though no step holds the tolerance; error_rad says of which cases.",
)
CHUNK = 256
ONLY_FLOAT64 = "its steps are found by differences of motions that are smaller than roundings of float32"


@dataclass(frozen=True)
class Drawn:
    """Cases as they begin."""

    motion: Any
    """`jaxsat.control.loops.Motion` over the cases."""
    numbers: Any
    spacecraft: Any


@dataclass(frozen=True)
class _Program:
    """What the options say."""

    draw: Any
    """From keys to `Drawn`."""
    move: Any
    """From `Drawn` to the trajectory at `times`."""
    angles: Any
    """Of the magnet from the field [rad], from a spacecraft and quaternions."""
    times: np.ndarray
    """[s]"""
    last: np.ndarray
    """Which of them are in the last orbit."""
    limit: float
    """[rad]"""
    spread: Any
    name: str
    turns: Any
    """Of spacecraft."""
    nominal: Any
    """The spacecraft of the file, without parts that are commanded."""


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]) -> _Program:
    import dataclasses

    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from jaxsat.bundled import PASSIVE
    from jaxsat.control.loops import Motion
    from jaxsat.control.loops.vehicle import own_parts
    from jaxsat.dynamics import AttitudeState
    from jaxsat.math import angle_between, quaternion
    from jaxsat.simulate import simulate_many
    from jaxsat.sweep.flights.flight import flight_of
    from jaxsat.sweep.flights.spread import drawn_model, spread_of
    from jaxsat.sweep.flights.starts import attitude_and_rate, first_lag

    reader = Reader(dict(options))
    number = reader.number
    rate = math.radians(number("rate_deg_s", low=0.0, high=60.0))
    limit = math.radians(number("limit_deg", low=0.1, high=180.0))
    duration, every = 3600.0 * number("hours", low=0.01, high=2400.0), number("sample_s", low=1.0, high=3600.0)
    tolerance = number("tolerance_rad", low=1e-9, high=0.1)
    flight = flight_of(dict(options), bundled=PASSIVE)
    satellite = flight.satellite
    craft = satellite.model.spacecraft
    if craft.hysteresis_rods is None:
        reason = "has no [[rods]] with hysteresis (Hc, Br, Bs, volume), which settle it"
        raise InputError(reason, file=satellite.path)
    if not np.any(np.asarray(craft.magnet)):
        raise InputError("has no [magnet], which is to settle along the field", file=satellite.path)
    spread = spread_of(satellite, (), flight.spread)
    times = every * np.arange(math.ceil(duration / every) + 1)
    around = flight.surroundings(float(times[-1]))
    if not flight.pressed:
        around = dataclasses.replace(around, sun=None)
    nominal = dataclasses.replace(craft, parts=own_parts(craft.parts))
    field_0 = np.asarray(eqx.filter_jit(around)(jnp.zeros(1)).b_field_eci)[0]

    @jax.jit
    def begin(keys):
        def one(key):
            start, own = jax.random.split(key)
            return *attitude_and_rate(start, rate), own

        q, w, own = jax.vmap(one)(keys)
        model, numbers = drawn_model(spread, satellite.model, own)
        made = dataclasses.replace(model.spacecraft, parts=own_parts(model.spacecraft.parts))
        made = jax.tree.map(lambda leaf, like: jnp.broadcast_to(leaf, (len(keys), *jnp.shape(like))), made, nominal)
        return Motion(q, w, None, first_lag(made, nominal, q, field_0)), numbers, made

    def draw(keys):
        return Drawn(*begin(keys))

    def move(drawn):
        state = AttitudeState(drawn.motion.quaternion, drawn.motion.angular_velocity, drawn.motion.rod_lag)
        # Which motions are chaotic stands in the metric error_rad.
        return simulate_many(drawn.spacecraft, state, around, times, tolerance=tolerance, warn=False)

    @jax.jit
    def angles(magnets, quaternions):
        fields = around(jnp.asarray(times)).b_field_eci

        def one(magnet, qs):
            return jax.vmap(lambda q, b: angle_between(magnet, quaternion.rotate_inverse(q, b)))(qs, fields)

        return jax.vmap(one)(magnets, quaternions)

    last = times >= times[-1] - flight.orbit_s
    return _Program(draw, move, angles, times, last, limit, spread, satellite.name, _turns(nominal), nominal)


def _turns(craft) -> tuple[Any, ...]:
    """Knobs of a spacecraft. Rods begin with the induction that they have without them."""
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, largest_moment, positive

    rods = craft.hysteresis_rods
    of_rods = (
        ("rod_volume", "mm3", "of each rod, of which the largest", "volumes", 1e9),
        ("coercive_field", "A/m", "of each rod, as it appears outside it", "coercive_field", 1.0),
        ("remanence", "T", "of each rod, as it appears outside it", "remanence", 1.0),
        ("saturation", "T", "of each rod, as it appears outside it", "saturation", 1.0),
    )
    dipole = float(np.linalg.norm(np.asarray(craft.magnet)))
    found = [
        Turn(Knob("magnet", "A m2", "dipole of the magnet", dipole), (lambda craft: craft.magnet,)),
        Turn(Knob("inertia", "kg m2", "the largest moment", largest_moment(craft.inertia)), (lambda c: c.inertia,)),
    ]
    found += [
        Turn(
            Knob(name, unit, meaning, size * float(np.max(np.asarray(getattr(rods, own))))),
            (lambda craft, own=own: getattr(craft.hysteresis_rods, own),),
        )
        for name, unit, meaning, own, size in of_rods
    ]
    return positive(found)


def _build(options: Mapping[str, str]) -> Scenario:
    import jax

    options_of = tuple(options.items())
    # Whatever is wrong with options and files is said before anything is compiled.
    program = _program(options_of)

    def of_drawn(program: _Program, drawn: Drawn) -> dict[str, np.ndarray]:
        moved = program.move(drawn)
        return outcome(
            program,
            np.asarray(program.angles(drawn.spacecraft.magnet, moved.quaternion)),
            np.asarray(moved.angular_velocity),
            np.asarray(moved.rod_heat),
            np.asarray(moved.errors),
        )

    def run(seed: int, numbers: np.ndarray) -> dict[str, np.ndarray]:
        program = _program(options_of)
        return of_drawn(program, program.draw(case_keys(seed, numbers)))

    def run_moved(seed: int, numbers: np.ndarray, moved: Any) -> dict[str, np.ndarray]:
        from jaxsat.sweep.knobs.turns import turned

        program = _program(options_of)
        drawn = program.draw(case_keys(seed, numbers))
        # On the host, as the steps of each case are chosen there.
        craft = turned(drawn.spacecraft, program.nominal, program.turns, np.asarray(moved))
        return of_drawn(program, replace(drawn, spacecraft=craft))

    def draw(seed: int, numbers: np.ndarray):
        return jax.device_get(_drawn(program.draw(case_keys(seed, numbers))))

    inputs = (*start_inputs(Reader(options).number("rate_deg_s")), *program.spread.inputs())
    history = functools.partial(_history, options_of)
    return Scenario(
        NAME,
        STATUSES,
        METRICS,
        CHUNK,
        run,
        history=history,
        inputs=inputs,
        draw=draw,
        knobs=tuple(turn.knob for turn in program.turns),
        run_moved=run_moved,
        only_float64=ONLY_FLOAT64,
        horizon_s=float(program.times[-1]),
    )


def _drawn(drawn: Drawn) -> Drawn:
    """On the host, without what inputs do not read."""
    import jax

    return Drawn(jax.device_get(drawn.motion), np.asarray(drawn.numbers), None)


def outcome(
    program: Any, angle: np.ndarray, rate: np.ndarray, heat: np.ndarray, errors: np.ndarray
) -> dict[str, np.ndarray]:
    """Status and metrics of motions, whose leaves are over cases and samples: angle [rad], rate [rad/s], heat [J]."""
    sound = np.isfinite(angle).all(axis=1) & np.isfinite(rate).all(axis=(1, 2))
    above = angle >= program.limit
    late = angle[:, program.last]
    settled = sound & ~above[:, program.last].any(axis=1)
    # The sample after the last one beyond the limit.
    count = angle.shape[1]
    first = np.where(above.any(axis=1), count - np.argmax(above[:, ::-1], axis=1), 0)
    found = {
        "settling_time_s": np.where(settled, program.times[np.minimum(first, count - 1)], np.nan),
        "mean_angle_deg": np.degrees(late.mean(axis=1)),
        "largest_angle_deg": np.degrees(late.max(axis=1)),
        "final_rate_deg_s": np.degrees(np.linalg.norm(rate[:, -1], axis=1)),
        "rod_heat_uJ": 1e6 * heat[:, -1].sum(axis=1),
        "error_rad": errors,
    }
    found = {name: np.where(sound, values, np.nan) for name, values in found.items()}
    return {"status": np.where(sound, np.where(settled, 0, 1), 2), **found}


def _history(options: tuple[tuple[str, str], ...], seed: int, case: int) -> History:
    """A case over its time. Run alone, so that last digits may differ."""
    program = _program(options)
    drawn = program.draw(case_keys(seed, np.array([case])))
    moved = program.move(drawn)
    angle = np.degrees(np.asarray(program.angles(drawn.spacecraft.magnet, moved.quaternion))[0])
    rate, q = np.degrees(np.asarray(moved.angular_velocity)[0]), upright(np.asarray(moved.quaternion)[0])
    heat = 1e6 * np.asarray(moved.rod_heat)[0].sum(axis=1)
    columns = {
        **{f"quaternion_{c}": q[:, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_deg_s": rate[:, k] for k, c in enumerate("xyz")},
        "angle_deg": angle,
        "rod_heat_uJ": heat,
    }
    charts = {
        "magnet from the field, deg": {"": angle},
        "angular velocity, body axes, deg/s": dict(zip("xyz", rate.T, strict=True)),
        "energy taken by the rods, uJ": {"": heat},
    }
    error = float(np.asarray(moved.errors)[0])
    return History(program.times, columns, charts, f"{program.name}; error {error:.1e} rad")


make = Factory(_build, OPTIONS, ASSUMPTIONS)
