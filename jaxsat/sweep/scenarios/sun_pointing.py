"""A spacecraft with a pyramid Sun sensor finds the Sun and holds it.

From any attitude and rate (Zhukov 2019, pp. 22-31). A case runs from the damping of its rate to the end of the
simulated time, 1500 s by default; it has succeeded once the Sun was held for 100 s, and is still held at the end.
"""

import functools
import math
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import Input, upright
from jaxsat.sweep.more_options import inertia_of, numbers_of
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario, case_keys, number_of
from jaxsat.sweep.scenarios._study import Study, study_scenario

NAME = "sun-pointing"
STATUSES = ("succeeded", "not settled", "let go of the Sun", "diverged")
METRICS = {
    "settling_time_s": Metric(
        "s", "until the Sun had been held for the hold time; none in a case that never did", endless=True
    ),
    "damping_time_s": Metric("s", "spent damping the initial rate"),
    "search_time_s": Metric("s", "spent in search rotations"),
    "slew_time_s": Metric("s", "spent turning to the Sun"),
    "final_error_deg": Metric("deg", "true angle between the Sun and where it shall stand, at the end"),
    "final_rate_deg_s": Metric("deg/s", "angular rate at the end"),
    "impulse_N_s": Metric("N s", "spent by all thrusters"),
    "propellant_g": Metric("g", "spent, at the assumed exhaust speed"),
    "firings": Metric("1", "pulses of all axes"),
    "worst_estimate_deg": Metric("deg", "largest error of the Sun's estimated direction while it was taken for known"),
}
ASSUMPTIONS = (
    "the paper gives the sensor and its mounting alone: all else of the vehicle and the law is assumed",
    "inertia of a vehicle of some tonne (moments_kg_m2=, products_kg_m2=); no torque but that of the thrusters",
    "thrusters that are on or off (torque_N_m=, lever_m=, min_pulse_s=, exhaust_m_s=)",
    "gains and rates of the law (attitude_gain=, rate_gain=, slew_rate_deg_s=, search_rate_deg_s=)",
    "the Sun stands still and is never hidden; a rate gyro is read with every control period",
)
"""What decides the result and is not in the paper."""
OPTIONS = (
    Option(
        "estimator",
        "tracking",
        "tracking: every candidate followed by the gyro; filter: by Kalman filters, for readings that are not exact; "
        "published: Zhukov's algorithm",
    ),
    Option("time_s", "1500", "simulated time"),
    Option("period_s", "1", "control period"),
    Option("sun_angle_deg", "0", "at which the Sun is held from the sensor's axis, 0 to 20"),
    Option("max_rate_deg_s", "3", "largest initial rate"),
    Option("inertia", "0", "1-sigma of the moments of inertia, relative"),
    Option("thrust", "0", "1-sigma of the thrusters' torques, relative"),
    Option("thruster_deg", "0", "1-sigma of the direction of the thrusters' torques"),
    Option("mounting_deg", "0", "1-sigma of the sensor's mounting about each axis"),
    Option("gyro_bias_deg_s", "0", "1-sigma of the gyro's bias about each axis"),
    Option("gyro_noise_deg_s", "0", "1-sigma of each of the gyro's readings"),
    Option("detector_failures", "0", "probability that a face has lost one of its two detectors"),
    Option("dead_faces", "0", "probability that a face has lost both of its detectors"),
    Option("detector_gain", "0", "1-sigma of each detector's gain, relative"),
    Option("reading_noise", "0", "1-sigma of each detector's readings, over the maximum current"),
    Option("reading_bits", "0", "of the converter of the sensor's readings; 0: none"),
    Option("moments_kg_m2", "620,840,1050", "of the vehicle as designed, about body x, y and z"),
    Option("products_kg_m2", "12,-8,15", "elements xy, xz and yz of its inertia"),
    Option("torque_N_m", "2.4,2.4,2.4", "of each axis' thrusters"),
    Option("lever_m", "1.2", "of the thrusters from the axis"),
    Option("min_pulse_s", "0.03", "shortest pulse"),
    Option("exhaust_m_s", "2158", "speed, for the propellant"),
    Option("attitude_gain", "0.05", "commanded rate over the angle still to turn, 1/s"),
    Option("rate_gain", "0.5", "commanded acceleration over the error of the rate, 1/s"),
    Option("slew_rate_deg_s", "0.5", "largest commanded rate"),
    Option("search_rate_deg_s", "0.5", "of the search rotation"),
    Option("hold_s", "100", "for which the Sun must be held"),
)
CHUNK = 1000
HELD_DEG = 3.0
"""Error at the end beyond which the Sun is no longer held, over the dead band and what is misaligned."""


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]) -> Study:
    import equinox as eqx
    import jax
    import jax.numpy as jnp

    from jaxsat.control.sun_pointing.cases import run_cases, run_one
    from jaxsat.control.sun_pointing.draw import Dispersions, draw_cases
    from jaxsat.control.sun_pointing.law import SunPointingLaw
    from jaxsat.control.sun_pointing.sensing import Estimator, LoopSettings
    from jaxsat.control.sun_pointing.vehicle import nominal_vehicle
    from jaxsat.math import angle_between, float_array
    from jaxsat.sweep.knobs.turns import turned

    reader = Reader(dict(options))
    number = reader.number
    period = number("period_s", low=0.05, high=10.0)
    bits = number("reading_bits", low=0.0, high=32.0)
    settings = LoopSettings(
        estimator=reader.choice("estimator", Estimator),
        period_s=period,
        reading_step=2.0**-bits if bits > 0.0 else 0.0,
        reading_noise=number("reading_noise", low=0.0, high=0.1),
        detector_gain=number("detector_gain", low=0.0, high=0.2),
        gyro_noise_rad_s=math.radians(number("gyro_noise_deg_s", low=0.0, high=1.0)),
    )
    dispersions = Dispersions(
        max_rate_deg_s=number("max_rate_deg_s", low=0.0, high=10.0),
        inertia=number("inertia", low=0.0, high=0.2),
        thrust=number("thrust", low=0.0, high=0.3),
        thruster_deg=number("thruster_deg", low=0.0, high=20.0),
        mounting_deg=number("mounting_deg", low=0.0, high=20.0),
        gyro_bias_deg_s=number("gyro_bias_deg_s", low=0.0, high=1.0),
        detector_failures=number("detector_failures", low=0.0, high=1.0),
        dead_faces=number("dead_faces", low=0.0, high=1.0),
        detector_gain=settings.detector_gain,
    )
    law = SunPointingLaw(
        sun_angle=jnp.asarray(math.radians(number("sun_angle_deg", low=0.0, high=20.0))),
        attitude_gain=float_array(number("attitude_gain", low=1e-6, high=10.0)),
        rate_gain=float_array(number("rate_gain", low=1e-6, high=10.0)),
        slew_rate=float_array(math.radians(number("slew_rate_deg_s", low=0.01, high=20.0))),
        search_rate=float_array(math.radians(number("search_rate_deg_s", low=0.01, high=20.0))),
        hold_time=float_array(number("hold_s", low=0.0, high=1e5)),
    )
    vehicle = nominal_vehicle(
        inertia_kg_m2=inertia_of(reader.options, "moments_kg_m2", "products_kg_m2"),
        torque_N_m=numbers_of(reader.options, "torque_N_m", 3, low=1e-6, high=1e4),
        lever_m=number("lever_m", low=1e-3, high=100.0),
        min_pulse_s=number("min_pulse_s", low=0.0, high=period),
    )
    exhaust = number("exhaust_m_s", low=10.0, high=1e5)
    periods = math.ceil(number("time_s", low=10.0, high=1e5) / period)
    sun_eci = jnp.array([1.0, 0.0, 0.0])
    draw = jax.jit(lambda keys: draw_cases(dispersions, keys, vehicle))
    run = jax.jit(
        lambda cases: _metrics(law, run_cases(settings, law, cases, sun_eci, periods), cases, sun_eci, exhaust)
    )

    @jax.jit
    def one(cases):
        samples = run_one(settings, law, cases, sun_eci, periods)[1]
        error = jax.vmap(lambda sun: angle_between(law.target(), sun))(samples.readings["all"].sun_instrument)
        return samples, error

    turns = _turns(law, vehicle)

    @jax.jit
    def run_moved(cases, moved):
        # Where the Sun shall stand is no knob, and the same for all.
        own, built = turned((law, cases.vehicle), (law, vehicle), turns, moved)
        cases = eqx.tree_at(lambda c: c.vehicle, cases, built)
        return _metrics(law, run_cases(settings, own, cases, sun_eci, periods), cases, sun_eci, exhaust)

    return Study(settings, draw, run, run_moved, one, turns, periods * period)


def _turns(law, vehicle):
    """Knobs of law, vehicle and sensor, of a pair (law, vehicle)."""
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, largest_moment, positive

    degree = math.radians(1.0)
    of_law = (
        ("attitude_gain", "1/s", "commanded rate over the angle still to turn", 1.0),
        ("rate_gain", "1/s", "commanded acceleration over the error of the rate", 1.0),
        ("slew_rate", "deg/s", "largest commanded rate", degree),
        ("search_rate", "deg/s", "of the search rotation", degree),
        ("rate_dead_band", "deg/s", "errors of the rate that are left alone while the Sun is held", degree),
        ("damped_rate", "deg/s", "below which the rate counts as damped", degree),
    )
    of_vehicle = (
        ("torque", "N m", "of each axis' thrusters, of which the largest", lambda v: v.thrusters.torque, 1.0),
        ("min_pulse", "s", "shortest pulse", lambda v: v.thrusters.min_pulse, 1.0),
        ("face_angle", "deg", "of the faces of the sensor's pyramid", lambda v: v.sensor.face_angle, degree),
        ("hood_angle", "deg", "from the sensor's axis, beyond which its hood shades it", _hood_angle, degree),
    )
    found = [
        Turn(
            Knob(name, unit, meaning, float(getattr(law, name)) / size),
            (lambda pair, name=name: getattr(pair[0], name),),
        )
        for name, unit, meaning, size in of_law
    ]
    found.append(
        Turn(
            Knob("inertia", "kg m2", "of vehicle and computer, the largest moment", largest_moment(vehicle.inertia)),
            (lambda pair: pair[1].inertia, lambda pair: pair[1].assumed_inertia),
            inverse=(lambda pair: pair[1].inverse_inertia,),
        )
    )
    found += [
        Turn(
            Knob(name, unit, meaning, float(np.max(np.asarray(where(vehicle)))) / size),
            (lambda pair, where=where: where(pair[1]),),
        )
        for name, unit, meaning, where, size in of_vehicle
    ]
    return positive(found)


def _hood_angle(vehicle):
    return vehicle.sensor.hood_angle


def _metrics(law, state, cases, sun_eci, exhaust):
    import jax
    import jax.numpy as jnp

    from jaxsat.control.sun_pointing.law import DAMPING, SEARCH, SLEW
    from jaxsat.math import angle_between, quaternion, safe_norm

    mounting = jnp.broadcast_to(cases.vehicle.body_from_instrument, (len(cases.quaternion), 3, 3))

    def error(q, mounting):
        return angle_between(law.target(), mounting.T @ quaternion.rotate_inverse(q, sun_eci))

    motion, tally, settled_at = state.motion, state.tally, state.controller.settled_at
    off = jnp.degrees(jax.vmap(error)(motion.quaternion, mounting))
    settled = jnp.isfinite(settled_at)
    sound = jnp.isfinite(off) & jnp.all(jnp.isfinite(motion.angular_velocity), axis=1)
    status = jnp.where(settled, jnp.where(off < HELD_DEG, 0, 2), 1)
    found = {
        "settling_time_s": jnp.where(settled, settled_at, jnp.nan),
        "damping_time_s": tally.mode_time[:, DAMPING],
        "search_time_s": tally.mode_time[:, SEARCH],
        "slew_time_s": tally.mode_time[:, SLEW],
        "final_error_deg": off,
        "final_rate_deg_s": jnp.degrees(safe_norm(motion.angular_velocity)),
        "impulse_N_s": tally.impulse,
        "propellant_g": 1e3 * tally.impulse / exhaust,
        "firings": tally.pulses,
        "worst_estimate_deg": jnp.degrees(2.0 * jnp.arcsin(jnp.minimum(0.5 * jnp.sqrt(tally.worst_estimate), 1.0))),
    }
    found = {name: jnp.where(sound, value, jnp.nan) for name, value in found.items()}
    return {"status": jnp.where(sound, status, 3), **found}


def _build(options: Mapping[str, str]) -> Scenario:
    about = {"name": NAME, "statuses": STATUSES, "metrics": METRICS, "chunk": CHUNK}
    return study_scenario(_program, options, _history, _inputs, **about)


def _inputs(options: Mapping[str, str]) -> tuple[Input, ...]:
    """What its cases are drawn from, of the `Cases` that they are: what has a spread."""

    def spreads(*names):
        return any(number_of(options, name) > 0.0 for name in names)

    axes, elements, across = tuple("xyz"), ("xx", "yy", "zz", "xy", "xz", "yz"), ("xy", "xz", "yx", "yz", "zx", "zy")
    faces = tuple(f"{face}{detector}" for face in range(1, 5) for detector in "ab")
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    k, j = [0, 0, 1, 1, 2, 2], [1, 2, 0, 2, 0, 1]

    def tilt(cases):
        axis = cases.vehicle.thrusters.axes_body
        # Column k is axis k.
        return np.degrees(axis[:, j, k] / axis[:, k, k])

    def turned(cases):
        vehicle = cases.vehicle
        turn = np.swapaxes(vehicle.assumed_body_from_instrument, -1, -2) @ vehicle.body_from_instrument
        return Rotation.from_matrix(turn).as_rotvec(degrees=True)

    vehicle = (
        Input("inertia", "kg m2", "body axes", lambda c: c.vehicle.inertia[:, rows, columns], elements),
        Input("torque", "N m", "of each axis' thrusters", lambda c: c.vehicle.thrusters.torque, axes),
        Input("thruster", "deg", "by which each axis' torque leans to each other axis", tilt, across),
        Input("mounting", "deg", "rotation vector of the sensor in its own axes", turned, axes),
        Input("gyro_bias", "deg/s", "body axes", lambda c: np.degrees(c.vehicle.gyro_bias), axes),
        Input(
            "detector_gain",
            "1",
            "of both detectors of each face, 0 where one is lost",
            lambda c: c.vehicle.detector_gain.reshape(-1, 8),
            faces,
        ),
    )
    drawn = (
        ("inertia",),
        ("thrust",),
        ("thruster_deg",),
        ("mounting_deg",),
        ("gyro_bias_deg_s",),
        ("detector_failures", "dead_faces", "detector_gain"),
    )
    attitude = Input(
        "attitude",
        "1",
        "quaternion at the start, scalar first, from body to inertial axes, in which x points to the Sun",
        lambda c: upright(c.quaternion),
        tuple("wxyz"),
    )
    rate = Input("rate", "deg/s", "at the start, body axes", lambda c: np.degrees(c.angular_velocity), axes)
    found = [one for one, names in zip(vehicle, drawn, strict=True) if spreads(*names)]
    return (attitude, *([rate] if spreads("max_rate_deg_s") else []), *found)


def _history(program: tuple[tuple[str, str], ...], seed: int, case: int) -> History:
    """Figures 20 to 22 of the paper for any case; an estimate is nan where the Sun was not known.

    Run alone, so that where a threshold is nearly met a pulse may come a period sooner or later than in its chunk.
    """
    import jax

    own = _program(program)
    settings = own.settings
    samples, error = jax.device_get(own.one(own.draw(case_keys(seed, np.array([case])))))
    sun, found = samples.readings["all"].sun_instrument, samples.estimate
    estimate = np.where(found.sun_known[:, None], found.sun, np.nan)
    rates, mode, spent = np.degrees(samples.motion.angular_velocity), samples.decision.mode, samples.pulses.impulse
    (true_angle, true_azimuth), (angle, azimuth) = _angles(sun), _angles(estimate)
    columns = {
        **{f"sun_{c}": sun[:, k] for k, c in enumerate("xyz")},
        **{f"estimate_{c}": estimate[:, k] for k, c in enumerate("xyz")},
        "view_angle_deg": true_angle,
        "estimated_view_angle_deg": angle,
        "faces_lit": samples.readings["all"].lit,
        "mode": mode,
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
        "error_deg": np.degrees(error),
        "impulse_N_s": np.cumsum(spent),
    }
    charts = {
        "Sun from the sensor's axis, deg": {"true": true_angle, "estimated": angle},
        "azimuth of the Sun about the axis, deg": {"true": true_azimuth, "estimated": azimuth},
        "Sun in instrument axes": dict(zip("xyz", sun.T, strict=True)),
        "angular rate, deg/s": dict(zip("xyz", rates.T, strict=True)),
        "mode: 0 damping, 1 search, 2 slew, 3 hold": {"": mode},
        "impulse spent, N s": {"": np.cumsum(spent)},
    }
    remark = f"{settings.estimator} estimator; seen every {settings.period_s:g} s"
    return History(settings.period_s * np.arange(len(sun)), columns, charts, remark)


def _angles(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From the sensor's axis, and azimuth about it [deg]."""
    azimuth = np.degrees(np.arctan2(v[:, 2], v[:, 1])) % 360.0
    # On the axis itself there is none.
    azimuth = np.where(np.hypot(v[:, 1], v[:, 2]) > 0.02, azimuth, np.nan)
    return np.degrees(np.arccos(np.clip(v[:, 0], -1.0, 1.0))), azimuth


make = Factory(_build, OPTIONS, ASSUMPTIONS)
