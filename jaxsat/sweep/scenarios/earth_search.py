"""A spacecraft with four horizon sensors finds the Earth and tracks it.

How long that takes from any attitude, if it ends (Melnikov et al. 2022). A case has succeeded where it tracks the Earth
at the end of the simulated time, with body z near the nadir, and has for 30 control periods; its search time is when
tracking began for good. What decides the result is assumed: `ASSUMPTIONS`.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import Input, upright
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario, case_keys, number_of
from jaxsat.sweep.scenarios._study import Study, study_scenario

if TYPE_CHECKING:
    from jaxsat.control.earth_search.loop import LoopSettings

NAME = "earth-search"
Size = Literal["large", "small"]
Strategy = Literal["published", "fast", "guarded"]
STATUSES = ("succeeded", "never tracked", "lost again", "false capture", "diverged", "only just captured")
LIMIT_S = 1200.0
"""Melnikov et al. 2022: the search never takes longer."""
METRICS = {
    "search_time_s": Metric(
        "s", "until tracking began for good; none in a case that does not track at the end", endless=True, limit=LIMIT_S
    ),
    "first_capture_s": Metric("s", "until all four sensors signalled for the first time", endless=True, limit=LIMIT_S),
    "first_signal_s": Metric("s", "until any sensor signalled"),
    "captures": Metric("1", "how often tracking began"),
    "final_error_deg": Metric("deg", "angle between body z and the nadir at the end"),
    "final_rate_deg_s": Metric("deg/s", "angular rate at the end, of the orbit's own turn too"),
}
ASSUMPTIONS = (
    "presence inside the disk, which the paper leaves open: by the brightness met there (inside=)",
    "presence goes by the size of the first harmonic, whatever its phase",
    "while tracking, the drift of the vertical is learnt from outputs and gyros (tracking=)",
    "the sensors' angle fits 800 km (mounting_deg=), and the altitude is known on board",
    "accelerations and lags of 0.005 deg/s2, 20 s (large) and 0.2 deg/s2, 2 s (small) where not given",
    "mean brightness uniform in 25 to 60 W/(m2 sr), 15 % of it locally over 700 km, never below 25",
    "a spare stands 30 deg in azimuth beside its sensor; Sun and Moon stand still, the orbit is circular",
)
"""What decides the result and is not in the paper, or is left open there."""
OPTIONS = (
    Option("spacecraft", "large", "large: 0.25 and 0.1 deg/s; small: 2 and 0.8 deg/s"),
    Option(
        "strategy",
        "published",
        "published; fast: approach and corrections at the rate of the search; guarded: that, and turns that lead "
        "nowhere are given up",
    ),
    Option("tracking", "drift", "drift: the vertical's motion is learnt; published: 0.01 deg/s and nothing else"),
    Option(
        "inside", "brightness", "presence inside the disk: brightness: as the sensors have it; always, never, random"
    ),
    Option("altitude_km", "800", "of the circular orbit"),
    Option("altitude_spread_km", "0", "to both sides of it, uniform"),
    Option("brightness", "random", "random: field of 15 %, 700 km, about 25 to 60 W/(m^2 sr); even: 60 everywhere"),
    Option("moon", "yes", "yes or no: the Moon of a random date"),
    Option("sun", "blocked", "none; blocked: a struck sensor is replaced by its spare; unblocked"),
    Option("failure", "none", "of one sensor: replaced: known, its spare in use; silent or stuck: unknown"),
    Option("max_rate_deg_s", "0.05", "largest rate of each axis at the start"),
    Option("mounting_deg", "62.677811", "of the sensors from the axis; 0: the horizon's angle at altitude_km"),
    Option("start_axis_deg", "0", "of the search rotation in the plane of x and y, from x: 45 is the diagonal"),
    Option("search_rate_deg_s", "0", "0: that of the spacecraft"),
    Option("approach_rate_deg_s", "0", "0: that of the spacecraft and the strategy"),
    Option("time_s", "0", "simulated time; 0: 3600 of a large spacecraft, 900 of a small one"),
    Option("period_s", "0", "control period; 0: 4 of a large spacecraft, 0.5 of a small one"),
    Option("track_rate_deg_s", "0", "largest correction while tracking; 0: that of the strategy"),
    Option("track_gain", "0.02", "commanded rate over the angle while tracking, 1/s"),
    Option("acceleration_deg_s2", "0", "largest of each axis; 0: that of the spacecraft"),
    Option("lag_s", "0", "with which the rate follows the command; 0: that of the spacecraft"),
    Option("earth", "moving", "moving: its centre goes round once an orbit; still: it stays where it is"),
)
CHUNK = 1000
HELD_PERIODS = 30
"""For which the Earth must have been tracked at the end: the published search loses most captures sooner."""
CAPTURED_DEG = 20.0
"""Error at the end beyond which it is not the Earth's middle that is tracked."""


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]) -> Study:
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from jaxsat.constants import EARTH_RADIUS_MEAN
    from jaxsat.control.earth_search.cases import run_one
    from jaxsat.control.earth_search.draw import Dispersions, Failure, draw_cases
    from jaxsat.control.earth_search.law import search_law
    from jaxsat.control.earth_search.loop import LoopSettings
    from jaxsat.control.earth_search.sensing import Inside, SunChoice
    from jaxsat.control.earth_search.vehicle import nominal_vehicle
    from jaxsat.environment.albedo.infrared import random_brightness
    from jaxsat.sweep.knobs.turns import turned

    reader = Reader(dict(options))
    number, choice = reader.number, reader.choice
    size, strategy = choice("spacecraft", Size), choice("strategy", Strategy)
    period = number("period_s", low=0.0, high=30.0) or {"large": 4.0, "small": 0.5}[size]
    settings = LoopSettings(
        period_s=period,
        inside=choice("inside", Inside),
        sun=choice("sun", SunChoice),
        moon=choice("moon", Literal["yes", "no"]) == "yes",
    )
    altitude = number("altitude_km", low=150.0, high=5000.0)
    spread = number("altitude_spread_km", low=0.0, high=altitude - 150.0)
    mounting = math.radians(number("mounting_deg", low=0.0, high=85.0))
    mounting = mounting or math.asin(EARTH_RADIUS_MEAN / (EARTH_RADIUS_MEAN + 1e3 * altitude))
    even = choice("brightness", Literal["random", "even"]) == "even"
    dispersions = Dispersions(
        size=size,
        altitude_km=altitude,
        altitude_spread_km=spread,
        max_rate_deg_s=number("max_rate_deg_s", low=0.0, high=1.0),
        failure=choice("failure", Failure),
        even=even,
        mounting=mounting,
        acceleration_deg_s2=number("acceleration_deg_s2", low=0.0, high=100.0) or None,
        lag_s=number("lag_s", low=0.0, high=1e3) or None,
        still=choice("earth", Literal["moving", "still"]) == "still",
    )
    law = search_law(size, strategy)
    search = math.radians(number("search_rate_deg_s", low=0.0, high=5.0)) or float(law.search_rate)
    approach = math.radians(number("approach_rate_deg_s", low=0.0, high=5.0))
    approach = approach or (float(law.approach_rate) if strategy == "published" else search)
    axis = math.radians(number("start_axis_deg", low=-180.0, high=180.0))
    learns = choice("tracking", Literal["drift", "published"]) == "drift"
    changed = {
        "search_rate": search,
        "approach_rate": approach,
        "track_rate": math.radians(number("track_rate_deg_s", low=0.0, high=5.0))
        or (float(law.track_rate) if strategy == "published" else approach),
        "track_gain": number("track_gain", low=0.0, high=10.0),
        # A turn about x moves z along y.
        "search_direction": jnp.array([math.sin(axis), math.cos(axis)]),
        "drift_gain": float(law.drift_gain) if learns else 0.0,
    }
    law = dataclasses.replace(law, **changed)
    time = number("time_s", low=0.0, high=1e5) or {"large": 3600.0, "small": 900.0}[size]
    periods = math.ceil(time / settings.period_s)
    field = None if even else random_brightness(0)
    draw = jax.jit(functools.partial(draw_cases, dispersions))
    compiled = _compiled(settings, periods, even)
    run = functools.partial(compiled, law)
    one = jax.jit(lambda cases: run_one(settings, law, cases, field, periods)[1])
    vehicle = nominal_vehicle(
        size, mounting, acceleration_deg_s2=dispersions.acceleration_deg_s2, lag_s=dispersions.lag_s
    )
    turns = _turns(law, vehicle)

    @jax.jit
    def turn(cases, moved):
        own, built = turned((law, cases.vehicle), (law, vehicle), turns, moved)
        return own, eqx.tree_at(lambda c: c.vehicle, cases, built)

    def run_moved(cases, moved):
        # Another shape of the law, so another program of the same function.
        return compiled(*turn(cases, moved))

    return Study(settings, draw, run, run_moved, one, turns, periods * settings.period_s)


def _turns(law: Any, vehicle: Any) -> tuple[Any, ...]:
    """Knobs of a pair (law, vehicle)."""
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, positive

    degree = math.radians(1.0)
    numbers = (
        (0, "search_rate", "deg/s", "of the search rotation", degree),
        (0, "approach_rate", "deg/s", "of each axis toward a sensor that has signalled", degree),
        (0, "track_rate", "deg/s", "largest correction while tracking", degree),
        (0, "track_gain", "1/s", "commanded rate over the angle while tracking", 1.0),
        (0, "drift_gain", "1/s", "with which the drift of the vertical is learnt", 1.0),
        (1, "acceleration", "deg/s2", "largest of each axis", degree),
        (1, "lag", "s", "with which the rate follows the command", 1.0),
    )
    return positive(
        [
            Turn(
                Knob(name, unit, meaning, float(getattr((law, vehicle)[part], name)) / size),
                (lambda pair, part=part, name=name: getattr(pair[part], name),),
            )
            for part, name, unit, meaning, size in numbers
        ]
    )


@functools.lru_cache(maxsize=8)
def _compiled(settings: "LoopSettings", periods: int, even: bool):
    """The compiled `run(law, cases)`, which every law shares."""

    from jaxsat.control.earth_search.cases import run_cases
    from jaxsat.environment.albedo.infrared import random_brightness
    from jaxsat.math.one_function import WIDE, whole_or_usual

    field = None if even else random_brightness(0)

    def searched(law, cases):
        return run_cases(settings, law, cases, field, periods)

    def program(within, law, cases):
        return outcome(within(searched)(law, cases), HELD_PERIODS * settings.period_s)

    return whole_or_usual(program, WIDE)


def outcome(state: Any, hold_s: float) -> dict[str, Any]:
    """Status and metrics of cases, from their final `LoopState`; tracked is what has been for `hold_s`."""
    import jax
    import jax.numpy as jnp

    from jaxsat.control.earth_search.law import TRACK
    from jaxsat.math import angle_between, quaternion, safe_norm

    def error(q, up):
        return angle_between(quaternion.rotate_inverse(q, -up), jnp.array([0.0, 0.0, 1.0]))

    off = jnp.degrees(jax.vmap(error)(state.quaternion, state.up))
    tracking, ever = state.memory.mode == TRACK, jnp.isfinite(state.first_capture)
    sound = jnp.isfinite(off) & jnp.all(jnp.isfinite(state.angular_velocity), axis=1)
    long = state.time - state.last_capture >= hold_s
    captured = jnp.where(off < CAPTURED_DEG, jnp.where(long, 0, 5), 3)
    status = jnp.where(tracking, captured, jnp.where(ever, 2, 1))
    held = status == 0
    found = {
        "search_time_s": jnp.where(held, state.last_capture, jnp.nan),
        "first_capture_s": state.first_capture,
        "first_signal_s": state.first_signal,
        "captures": state.captures,
        "final_error_deg": off,
        "final_rate_deg_s": jnp.degrees(safe_norm(state.angular_velocity)),
    }
    found = {name: jnp.where(sound & jnp.isfinite(value), value, jnp.nan) for name, value in found.items()}
    return {"status": jnp.where(sound, status, 4), **found}


def _build(options: Mapping[str, str]) -> Scenario:
    about = {"name": NAME, "statuses": STATUSES, "metrics": METRICS, "chunk": CHUNK}
    return study_scenario(_program, options, _history, _inputs, **about)


def _inputs(options: Mapping[str, str]) -> tuple[Input, ...]:
    """What its cases are drawn from, of the `Cases` that they are: what has a spread."""
    from jaxsat.constants import EARTH_RADIUS_MEAN

    def failed(cases):
        place = {"replaced": "on_spare", "silent": "silent", "stuck": "stuck"}[options["failure"]]
        return np.argmax(getattr(cases.vehicle, place), axis=1)

    def altitude(cases):
        return 1e-3 * EARTH_RADIUS_MEAN * (cases.scene.distance - 1.0)

    axes = tuple("xyz")
    plane = tuple(f"{place}_{axis}" for place in ("up", "along") for axis in axes)
    sky = tuple(f"{body}_{axis}" for body in ("sun", "moon") for axis in axes)
    inputs = (
        Input(
            "attitude",
            "1",
            "quaternion at the start, scalar first, from body to inertial axes",
            lambda c: upright(c.quaternion),
            tuple("wxyz"),
        ),
        Input(
            "orbit",
            "1",
            "directions from the Earth's centre and of the motion at the start, inertial axes",
            lambda c: np.concatenate([c.up, c.along], axis=1),
            plane,
        ),
        Input(
            "sky",
            "1",
            "directions of Sun and Moon on the date, inertial axes",
            lambda c: np.concatenate([c.scene.sun, c.scene.moon], axis=1),
            sky,
        ),
        Input("greenwich", "deg", "angle of the Earth at the start", lambda c: np.degrees(c.greenwich)),
    )
    given = (
        ("max_rate_deg_s", Input("rate", "deg/s", "body axes", lambda c: np.degrees(c.angular_velocity), axes)),
        ("altitude_spread_km", Input("altitude", "km", "of the circular orbit", altitude)),
    )
    found = [one for name, one in given if number_of(options, name) > 0.0]
    if options["brightness"] == "random":
        found.append(Input("brightness", "W/(m2 sr)", "mean of the Earth", lambda c: c.scene.brightness))
    if options["failure"] != "none":
        found.append(Input("failed_sensor", "1", "0 to 3 are +x, +y, -x, -y", failed))
    return (*inputs, *found)


def _history(program: tuple[tuple[str, str], ...], seed: int, case: int) -> History:
    """What the four sensors said and where the Earth was.

    Run alone, so that where a threshold is nearly met a signal may come a period sooner or later than in its chunk.
    """
    import jax

    from jaxsat.control.earth_search.law import SENSORS
    from jaxsat.sweep.scenarios._earth_search_page import search_page

    own = _program(program)
    settings, cases = own.settings, own.draw(case_keys(seed, np.array([case])))
    samples = jax.device_get(own.one(cases))
    nadir, present, first = samples.nadir_body, samples.present, samples.first
    rates, error = np.degrees(samples.angular_velocity), np.degrees(samples.error)
    toward = {f"toward {c}": np.degrees(np.arctan2(nadir[:, k], nadir[:, 2])) for k, c in enumerate("xy")}
    # Away from the body axis a jump by a whole turn is no motion.
    shown = {name: np.where(np.abs(np.diff(v, prepend=v[0])) > 180.0, np.nan, v) for name, v in toward.items()}
    columns = {
        **{f"nadir_{c}": nadir[:, k] for k, c in enumerate("xyz")},
        "error_deg": error,
        **{f"present{name}": present[:, k].astype(float) for k, name in enumerate(SENSORS)},
        **{f"first{name}_W_m2_sr": first[:, k] for k, name in enumerate(SENSORS)},
        "mode": samples.mode,
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
    }
    charts = {
        "Earth's centre from body z, deg": {"angle": error, **shown},
        "presence of the Earth, one line a sensor": {
            name: np.where(present[:, k], 1.0 + k, np.nan) for k, name in enumerate(SENSORS)
        },
        "first harmonic, W/(m² sr)": {name: first[:, k] for k, name in enumerate(SENSORS)},
        "angular rate, deg/s": dict(zip("xyz", rates.T, strict=True)),
        "mode: 0 search, 1 approach, 2 track": {"": samples.mode},
    }
    t_s, options = settings.period_s * np.arange(len(nadir)), dict(program)
    remark = f"{options['spacecraft']} spacecraft, {options['strategy']} strategy"
    page = search_page(options, cases.vehicle.sensor, float(cases.scene.disk[0]), samples, t_s)
    return History(t_s, columns, charts, remark, page)


make = Factory(_build, OPTIONS, ASSUMPTIONS)
