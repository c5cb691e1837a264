"""A satellite with magnetic coils turns into its orbital attitude.

The transition of the emergency mode over some orbits (Somov 2018, section 5). A case has succeeded if its attitude
error stays below the limit for the last half orbit.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import Input
from jaxsat.sweep.more_options import date_of, inertia_of
from jaxsat.sweep.scenario import Factory, Metric, Option, Scenario, case_keys, choice_of, number_of

NAME = "emergency-mode"
STATUSES = ("succeeded", "not settled", "diverged")
METRICS = {
    "first_error_deg": Metric("deg", "at the start"),
    "settling_time_s": Metric(
        "s", "until the error stays below the limit; none in a case that did not settle", endless=True
    ),
    "largest_error_deg": Metric("deg", "of the whole run"),
    "last_error_deg": Metric("deg", "largest of the last half orbit"),
    "final_error_deg": Metric("deg", "at the end"),
    "magnetic_impulse_A_m2_s": Metric("A m2 s", "sum of the three dipoles' sizes over time"),
}
ASSUMPTIONS = (
    "14 October 2018 (start=), for which the node of 51 deg gives the paper's angles of the Sun; it begins at the node",
    "1-sigma of a measurement: 0.02 deg, 0.002 deg/s, 100 nT; filtered by the mean over 16 s",
    "gains that experiments/emergency_mode/gains.py found: the paper has none",
    "the torque's sign and the duty test are the paper's corrected ones",
    "panels of 60 kg and 3 x 5 m, 5 m from the centre of mass; the moments are those at -90 deg",
    "no solar pressure, air, residual dipole, nor pull of Sun and Moon on the body",
)
"""What decides the result and is not in the paper, or is left out."""
OPTIONS = (
    Option("orbits", "4", "simulated time"),
    Option("limit_deg", "1", "error that counts as settled"),
    Option("min_error_deg", "0", "smallest error at the start"),
    Option("max_error_deg", "30", "largest error at the start"),
    Option("max_rate_deg_s", "0.01", "largest rate at the start"),
    Option("rest", "inertial", "what that rate is against: inertial, or orbital as in a return from swinging"),
    Option("panels", "fixed", "fixed at -90 deg, slew to it from 0 in 15 minutes, or sun: after it, once an orbit"),
    Option("inertia", "0", "1-sigma of the moments of inertia, relative, unknown to the computer"),
    Option("field", "0", "1-sigma of the true field over the model's, of its size, relative, and direction, rad"),
    Option("magnetometer", "0", "1-sigma of the elements of the magnetometer's matrix"),
    Option("start", "2018-10-14", "date at whose beginning, UTC, the satellite is at its node"),
    Option("height_km", "720", "of the circular orbit"),
    Option("inclination_deg", "98.2695", "of the orbit"),
    Option("node_deg", "51", "right ascension of the orbit's node"),
    Option("moments_kg_m2", "11450,7150,9450", "body x, y (up) and z, with panels at -90 deg"),
    Option("max_dipole_A_m2", "300", "of each coil"),
    Option("attitude_gain", "6.8e-7", "far off, 1/s2"),
    Option("rate_gain", "3.55e-3", "far off, 1/s"),
    Option("fine_gain", "5.6e-7", "near, stiffness, 1/s2"),
    Option("fine_lead", "3.2e-3", "near, damping, 1/s"),
    Option("fine_pole", "0.6", "near, memory from period to period, 0 to 1"),
    Option("fine_below_deg", "3", "error below which the near law is in force"),
    Option("attitude_noise_deg", "0.02", "1-sigma of one measurement about each axis"),
    Option("rate_noise_deg_s", "0.002", "1-sigma of one measurement about each axis"),
    Option("field_noise_nT", "100", "1-sigma of one measurement along each axis"),
)
CHUNK = 250


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]):
    """`run`, `run_moved`, `history`, `draw` and turns of the scenario, and its simulated time [s]."""
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from jaxsat.constants import EARTH_EQUATORIAL_RADIUS, EARTH_MU
    from jaxsat.control.emergency_mode.cases import run_cases, run_one
    from jaxsat.control.emergency_mode.draw import Dispersions, draw_cases
    from jaxsat.control.emergency_mode.law import EmergencyLaw
    from jaxsat.control.emergency_mode.loop import ALWAYS_ON
    from jaxsat.control.emergency_mode.orbit import SunFollowing, fly, leg, orbital_period
    from jaxsat.control.emergency_mode.rotating_panels import PanelSlew
    from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S, nominal_vehicle
    from jaxsat.sweep.knobs.turns import turned

    number, choice = functools.partial(number_of, dict(options)), functools.partial(choice_of, dict(options))
    orbits, limit = number("orbits", low=0.5, high=100.0), number("limit_deg", low=0.01, high=90.0)
    low, high = (number(f"{end}_error_deg", low=0.0, high=180.0) for end in ("min", "max"))
    dispersions = Dispersions(
        min_error_deg=min(low, high),
        max_error_deg=high,
        max_rate_deg_s=number("max_rate_deg_s", low=0.0, high=1.0),
        orbital=choice("rest", ("inertial", "orbital")) == "orbital",
        inertia=number("inertia", low=0.0, high=0.2),
        field=number("field", low=0.0, high=0.2),
        magnetometer=number("magnetometer", low=0.0, high=0.2),
    )

    panels = choice("panels", ("fixed", "slew", "sun"))
    start, height = date_of(dict(options), "start"), number("height_km", low=200.0, high=2000.0)
    inclination, node = number("inclination_deg", low=0.0, high=180.0), number("node_deg", low=0.0, high=360.0)
    law = EmergencyLaw(
        attitude_gain=number("attitude_gain", low=0.0, high=1.0),
        rate_gain=number("rate_gain", low=0.0, high=1.0),
        fine_gain=number("fine_gain", low=0.0, high=1.0),
        fine_lead=number("fine_lead", low=0.0, high=1.0),
        fine_pole=number("fine_pole", low=0.0, high=0.999),
        fine_below=math.radians(number("fine_below_deg", low=0.0, high=90.0)),
        max_dipole=number("max_dipole_A_m2", low=0.0, high=1e5),
    )
    inertia = inertia_of(dict(options), "moments_kg_m2")
    sigmas = (
        math.radians(number("attitude_noise_deg", low=0.0, high=10.0)),
        math.radians(number("rate_noise_deg_s", low=0.0, high=10.0)),
        1e-9 * number("field_noise_nT", low=0.0, high=1e5),
    )
    # As long as a turn of the paper's orbit at least, whose legs stay what they were.
    kepler_s = 2.0 * math.pi * math.sqrt((EARTH_EQUATORIAL_RADIUS + 1e3 * height) ** 3 / EARTH_MU)
    turn_s = max(6000.0, 1.005 * kepler_s)

    @functools.cache
    def surroundings():
        """The leg, and control periods of half an orbit."""
        days = (orbits + 0.2) * turn_s / 86400.0
        flight = fly(days, start_utc=start, height_km=height, inclination_deg=inclination, node_deg=node)
        orbit = round(orbital_period(flight) / CONTROL_PERIOD_S)
        turning = {"fixed": None, "slew": PanelSlew(0.0), "sun": SunFollowing(flight)}[panels]
        return leg(flight, 0, round(orbits * orbit), panels=turning), orbit // 2

    def nominal():
        return nominal_vehicle(inertia_kg_m2=inertia, sigmas=sigmas)

    def moved_metrics(around, keys, half, moved):
        cases, designed = draw_cases(dispersions, around, keys, nominal()), nominal()
        own, vehicle = turned((law, cases.vehicle), (law, designed), turns, moved)
        return metrics_of(around, eqx.tree_at(lambda c: c.vehicle, cases, vehicle), half, own)

    def metrics(around, keys, half):
        return metrics_of(around, draw_cases(dispersions, around, keys, nominal()), half, law)

    def metrics_of(around, cases, half, law):
        state, samples = run_cases(ALWAYS_ON, law, cases, around)
        error = jnp.degrees(jnp.sqrt(jnp.sum(samples.error**2, axis=2)))
        sound = jnp.all(jnp.isfinite(error), axis=1)
        last = jnp.max(error[:, -half:], axis=1)
        settled = last < limit
        above = jnp.max(jnp.where(error >= limit, 1 + jnp.arange(error.shape[1])[None], 0), axis=1)
        found = {
            # Four tangents of a quarter of the angle.
            "first_error_deg": jnp.degrees(4.0 * jnp.arctan(0.25 * jnp.linalg.norm(cases.state.seen.error, axis=1))),
            "settling_time_s": jnp.where(settled, CONTROL_PERIOD_S * above.astype(float), jnp.nan),
            "largest_error_deg": jnp.max(error, axis=1),
            "last_error_deg": last,
            "final_error_deg": error[:, -1],
            "magnetic_impulse_A_m2_s": state.impulse,
        }
        found = {name: jnp.where(sound, value, jnp.nan) for name, value in found.items()}
        return {"status": jnp.where(sound, jnp.where(settled, 0, 1), 2), **found}

    def alone(around, keys):
        return run_one(ALWAYS_ON, law, draw_cases(dispersions, around, keys, nominal()), around)[1]

    turns = _turns(law, nominal())
    compiled = jax.jit(metrics, static_argnums=2), jax.jit(alone), jax.jit(moved_metrics, static_argnums=2)
    drawn = jax.jit(lambda first, keys: draw_cases(dispersions, first, keys, nominal()))

    def run(seed, numbers):
        around, half = surroundings()
        return jax.device_get(compiled[0](around, case_keys(seed, numbers), half))

    def run_moved(seed, numbers, moved):
        around, half = surroundings()
        return compiled[2](around, case_keys(seed, numbers), half, moved)

    def history(seed, case):
        around, _ = surroundings()
        return _history(jax.device_get(compiled[1](around, case_keys(seed, np.array([case])))))

    def draw(seed, numbers):
        # All that is drawn of the leg is its first node.
        first = jax.tree.map(lambda leaf: leaf[:1], surroundings()[0])
        return jax.device_get(drawn(first, case_keys(seed, numbers)))

    return run, run_moved, history, draw, turns, orbits * kepler_s


def _turns(law, vehicle) -> tuple[Any, ...]:
    """Knobs of a pair (law, vehicle)."""
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, largest_moment, positive

    degree = math.radians(1.0)
    of_law = (
        ("attitude_gain", "1/s2", "far off", 1.0),
        ("rate_gain", "1/s", "far off", 1.0),
        ("fine_gain", "1/s2", "near, stiffness", 1.0),
        ("fine_lead", "1/s", "near, damping", 1.0),
        ("fine_pole", "1", "near, memory from period to period", 1.0),
        ("fine_below", "deg", "error below which the near law is in force", degree),
        ("max_dipole", "A m2", "of each coil", 1.0),
    )
    noises = (
        ("attitude_noise", "deg", degree),
        ("rate_noise", "deg/s", degree),
        ("field_noise", "nT", 1e-9),
    )
    moment, sigmas = largest_moment(vehicle.inertia), np.asarray(vehicle.sigmas)
    found = [
        Turn(
            Knob(name, unit, meaning, float(getattr(law, name)) / size),
            (lambda pair, name=name: getattr(pair[0], name),),
        )
        for name, unit, meaning, size in of_law
    ]
    found += [
        Turn(
            Knob("inertia", "kg m2", "of satellite and computer, the largest moment", moment),
            (lambda pair: pair[1].inertia, lambda pair: pair[1].assumed_inertia),
            inverse=(lambda pair: pair[1].inverse_inertia,),
        ),
        Turn(
            Knob("known_inertia", "kg m2", "as the computer knows it, the largest moment", moment),
            (lambda pair: pair[1].assumed_inertia,),
        ),
    ]
    found += [
        Turn(
            Knob(name, unit, "1-sigma of one measurement about or along each axis", float(sigmas[k]) / size),
            (lambda pair: pair[1].sigmas,),
            entry=k,
        )
        for k, (name, unit, size) in enumerate(noises)
    ]
    return positive(found)


def _build(options: Mapping[str, str]) -> Scenario:
    # Whatever is wrong with the options is said before anything is computed.
    run, run_moved, history, draw, turns, time_s = _program(tuple(options.items()))
    return Scenario(
        NAME,
        STATUSES,
        METRICS,
        CHUNK,
        run,
        history=history,
        inputs=_inputs(options),
        draw=draw,
        knobs=tuple(turn.knob for turn in turns),
        run_moved=run_moved,
        horizon_s=time_s,
    )


def _inputs(options: Mapping[str, str]) -> tuple[Input, ...]:
    """What its cases are drawn from, of the `Cases` that they are: what has a spread."""
    orbital = options["rest"] == "orbital"

    def error(cases):
        found = cases.state.seen.error
        # Its length is four tangents of a quarter of the angle.
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.degrees(found * 4.0 * np.arctan(0.25 * length) / np.maximum(length, 1e-300))

    def rate(cases):
        return np.degrees(cases.state.seen.rate_error if orbital else cases.state.angular_velocity)

    def size(cases):
        return np.cbrt(np.linalg.det(cases.vehicle.field_error))

    def turn(cases):
        return Rotation.from_matrix(cases.vehicle.field_error / size(cases)[:, None, None]).as_rotvec(degrees=True)

    def moments(cases):
        return np.diagonal(cases.vehicle.inertia, axis1=1, axis2=2)

    axes, squares = tuple("xyz"), tuple(a + b for a in "xyz" for b in "xyz")
    against = "the orbital axes" if orbital else "inertial ones"
    given = (
        (
            "max_error_deg",
            Input("error", "deg", "at the start, rotation vector, body axes", error, axes),
        ),
        ("max_rate_deg_s", Input("rate", "deg/s", f"at the start, body axes, against {against}", rate, axes)),
        ("inertia", Input("inertia", "kg m2", "moments, body axes", moments, ("xx", "yy", "zz"))),
        ("field", Input("field_size", "1", "true field over the model's", size)),
        ("field", Input("field_turn", "deg", "rotation vector of the true field from the model's", turn, axes)),
        (
            "magnetometer",
            Input(
                "magnetometer",
                "1",
                "matrix of what it shows from the true field, body axes",
                lambda c: c.vehicle.magnetometer_error.reshape(-1, 9),
                squares,
            ),
        ),
    )
    return tuple(one for name, one in given if number_of(options, name) > 0.0)


def _history(samples) -> History:
    """Figures 4 to 6 of the paper for any case, from its `Sample` with the control periods in front."""
    from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S

    error, rate, dipole = np.degrees(samples.error), np.degrees(samples.rate_error), samples.dipole
    columns = {
        **{f"error_{c}_deg": error[:, k] for k, c in enumerate("xyz")},
        **{f"rate_error_{c}_deg_s": rate[:, k] for k, c in enumerate("xyz")},
        "tilt_deg": np.degrees(samples.tilt),
        **{f"dipole_{c}_A_m2": dipole[:, k] for k, c in enumerate("xyz")},
    }
    charts = {
        "angular errors, deg": dict(zip("xyz", error.T, strict=True)),
        "rates against the orbital axes, deg/s": dict(zip("xyz", rate.T, strict=True)),
        "angle of body y from the vertical, deg": {"": np.degrees(samples.tilt)},
        "dipoles, A m2": dict(zip("xyz", dipole.T, strict=True)),
    }
    # A sample is the end of its period.
    return History(CONTROL_PERIOD_S * np.arange(1, len(error) + 1), columns, charts)


make = Factory(_build, OPTIONS, ASSUMPTIONS)
