"""A satellite of any file turns to Sun, Earth or stars and holds it, by wheels, torquers or thrusters.

Quaternion feedback (Wie, Weiss & Arapostathis 1989) with wheels, which torquers unload by the cross-product law, or
with torquers or thrusters alone. A case has succeeded if its error stays below the limit for the last quarter of the
time.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping

import numpy as np

from jaxsat.errors import InputError
from jaxsat.sweep.flights.options import COMMON
from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import upright
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario

NAME = "point"
STATUSES = ("succeeded", "not settled", "diverged")
METRICS = {
    "settling_time_s": Metric(
        "s", "until the error stays below the limit; none in a case that does not settle", endless=True
    ),
    "rms_error_deg": Metric("deg", "root of the mean square of the attitude's error in the last quarter"),
    "largest_error_deg": Metric("deg", "largest attitude error of the last quarter"),
    "final_rate_deg_s": Metric("deg/s", "rate against the target at the end"),
    "wheel_share": Metric("1", "largest speed of a wheel over its limit"),
    "magnetic_impulse_A_m2_s": Metric("A m2 s", "sum of the torquers' dipoles over the time they are on"),
    "thruster_impulse_N_s": Metric("N s", "spent by all thrusters"),
}
OPTIONS = (
    *COMMON,
    Option("orbits", "1", "simulated time"),
    Option("target", "nadir", "at what the axis points: sun, nadir, or inertial"),
    Option("axis", "+z", "of the body that points at the target"),
    Option("second", "+y", "of the body that stands as near the orbit's normal as the first allows"),
    Option("right_ascension_deg", "0", "where the axis points for the target inertial"),
    Option("declination_deg", "0", "where the axis points for the target inertial"),
    Option("actuators", "wheels", "wheels, which torquers unload; or torquers, or thrusters, alone"),
    Option("rate_deg_s", "0.3", "largest rate at the start: its size is uniform up to it, its direction over all"),
    Option("limit_deg", "auto", "error that counts as settled; auto: 2, with a filter 5, by torquers 15"),
    Option("frequency", "auto", "of small errors, rad/s; auto: wheels 0.1, thrusters 0.2, torquers the orbit's own"),
    Option("damping", "0.8", "damping ratio"),
    Option("slew_deg_s", "0.5", "largest rate of a slew"),
    Option("friction_known", "0.8", "share of the wheels' friction that their motors make good"),
    Option("dumping", "0.002", "gain of the wheels' unloading, 1/s"),
    Option("period_s", "1", "control period"),
    Option("duty", "0.8", "share of a period in which the torquers are on"),
    Option("sensors", "file", "with the errors of the satellite file, or perfect"),
    Option(
        "attitude",
        "auto",
        "that of the file's star_tracker; of a filter of gyro, Sun and field; or a stand_in: the true one with noise; "
        "auto: star_tracker where there is one, else filter",
    ),
    Option("attitude_sigma_deg", "0.2", "1-sigma about each axis of the stand_in"),
    Option("field_sigma_deg", "1", "1-sigma of the field's direction as the filter takes it, calibration included"),
    Option("dropouts", "0", "probability that a reading does not come"),
    Option("outliers", "0", "probability that a reading of field, Sun or attitude has twenty times the noise"),
    Option("gate", "off", "probability of a right reading to be taken by the filter, as 0.9999; off: all are taken"),
    Option("step_s", "auto", "of the motion's integration; auto: 1e-6 rad at the end, a control period at most"),
)
ASSUMPTIONS = (
    "All cases begin at the same place of the orbit; attitudes are uniform, rates uniform in size and direction.",
    "Numbers of the satellite file with a sigma are normal about their values; the law knows the values alone.",
    "Without a star_tracker the attitude is that of a filter, which begins when Sun and field are first seen at once.",
    "Rods with hysteresis are magnetised by the Earth's field alone, not by torquers.",
    "Wheels begin at rest and tell their speed without error; orbit, field and Sun are known on board.",
)
CHUNK = 200
TOLERANCE_RAD = 1e-6
"""Of the attitude at the end, by the steps of the motion."""


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]):
    """The loop of the options, and the function of metrics."""
    import jax
    import jax.numpy as jnp

    from jaxsat.control.laws import target_along
    from jaxsat.control.laws.targets import Goal
    from jaxsat.control.loops import (
        AsRead,
        Filtered,
        Perfect,
        Pointing,
        PointingWatch,
        Schedule,
        channel,
        step_within,
        timeline,
    )
    from jaxsat.control.loops.pointing import off_target
    from jaxsat.estimation.attitude_filter import AttitudeFilter
    from jaxsat.estimation.gyro_errors import GyroErrors
    from jaxsat.math import safe_norm
    from jaxsat.satellites.actuators import thrusters_of, torquers_of, wheels_of
    from jaxsat.sensors import StarTracker
    from jaxsat.sweep.flights.flight import flight_of
    from jaxsat.sweep.flights.loops import LoopCases, ended
    from jaxsat.sweep.flights.sensors import channels_of, has_star_tracker
    from jaxsat.sweep.flights.spread import spread_of
    from jaxsat.sweep.flights.starts import attitude_and_rate
    from jaxsat.sweep.flights.turns import satellite_turns

    reader = Reader(dict(options))
    number = reader.number
    goal = reader.choice("target", Goal)
    axis, second = (_direction(reader.options[name], name) for name in ("axis", "second"))
    if abs(axis @ second) > 0.999:
        raise InputError("expected another direction than that of the first axis", field="second")
    by = reader.word("actuators", ("wheels", "torquers", "thrusters"))
    most_rate = math.radians(number("rate_deg_s", low=0.0, high=30.0))
    slew = math.radians(number("slew_deg_s", low=1e-3, high=30.0))
    orbits, period = number("orbits", low=0.01, high=200.0), number("period_s", low=0.05, high=60.0)
    duty, errs = number("duty", low=0.05, high=1.0), {}
    for name, option in (("dropout", "dropouts"), ("outliers", "outliers")):
        errs[name] = number(option, low=0.0, high=1.0)
    gate = reader.number_or("gate", "off", low=0.5, high=1.0 - 1e-9)
    ascension, declination = (
        math.radians(number(f"{name}_deg", low=-360.0, high=360.0)) for name in ("right_ascension", "declination")
    )
    flight = flight_of(dict(options))
    satellite = flight.satellite
    duration = orbits * flight.orbit_s
    frequency = reader.number_or("frequency", "auto", low=1e-5, high=10.0)
    if frequency is None:
        frequency = {"wheels": 0.1, "torquers": flight.orbit_rate, "thrusters": 0.2}[by]
    step = reader.number_or("step_s", "auto", low=1e-3, high=60.0)
    if step is None:
        rods = satellite.model.spacecraft.hysteresis_rods is not None
        step = min(period, step_within(TOLERANCE_RAD, max(most_rate, slew), duration, rods=rods))
    perfect = reader.word("sensors", ("file", "perfect")) == "perfect"
    source = reader.word("attitude", ("auto", "star_tracker", "filter", "stand_in"))
    if source == "auto":
        source = "star_tracker" if has_star_tracker(satellite) else "filter"
    seen = {"star_tracker": ("attitude",), "filter": ("sun",), "stand_in": ()}[source]
    channels, names = channels_of(satellite, () if perfect else ("field", "rate", *seen), period_s=period, **errs)
    limit = reader.number_or("limit_deg", "auto", low=1e-3, high=180.0)
    if limit is None:
        limit = 15.0 if by == "torquers" else 5.0 if source == "filter" and not perfect else 2.0
    limit = math.radians(limit)
    estimator = Perfect() if perfect else AsRead()
    if not perfect and source == "stand_in":
        sigma = math.radians(number("attitude_sigma_deg", low=0.0, high=60.0))
        channels["attitude"] = channel(StarTracker(), sigma=sigma, **errs)
    elif not perfect and source == "filter":
        gyro = next(leaf for leaf in satellite.leaves if leaf.name.startswith(f"{names['rate']}.bias"))
        white = math.hypot(*(np.asarray(getattr(channels["rate"], key)) for key in ("sigma", "quantum")))
        estimator = Filtered(
            AttitudeFilter(GyroErrors(max(white, 1e-7) * math.sqrt(period), 1e-7), gate=gate),
            field_sigma=math.radians(number("field_sigma_deg", low=1e-3, high=60.0)),
            sun_sigma=max(float(channels["sun"].sigma), 1e-5),
            bias_sigma=gyro.sigma or gyro.loose,
        )
    torquers = torquers_of(satellite) if by != "thrusters" else None
    wheels = wheels_of(satellite) if by == "wheels" else None
    thrusters = thrusters_of(satellite) if by == "thrusters" else None
    schedule = Schedule(period, step, duty)
    periods = schedule.periods(duration)
    law = Pointing(
        inertia=satellite.model.spacecraft.inertia,
        frequency=frequency,
        damping=number("damping", low=0.01, high=10.0),
        slew_rate=slew,
        dumping=number("dumping", low=0.0, high=1.0),
        max_dipole=0.0 if torquers is None else np.min(torquers.max_dipole),
        friction_known=number("friction_known", low=0.0, high=2.0),
        wheels=wheels,
        by_thrusters=thrusters is not None,
    )

    @functools.cache
    def around():
        whole = timeline(flight.surroundings(duration + period), schedule, periods, pressed=flight.pressed)
        rows = jax.tree.map(lambda leaf, last: jnp.concatenate([leaf, last[None]]), whole.instants, whole.last)
        given = (np.asarray(x) for x in (rows.time, rows.position_eci, rows.velocity_eci, rows.sun_eci))
        across = math.cos(declination)
        direction = across * math.cos(ascension), across * math.sin(ascension), math.sin(declination)
        target = target_along(goal, *given, axis=axis, second=second, direction_eci=np.array(direction))
        rows = dataclasses.replace(rows, target_quaternion=target.quaternion, target_rate_eci=target.rate_eci)
        instants, last = (jax.tree.map(lambda leaf, part=part: leaf[part], rows) for part in (slice(None, -1), -1))
        return dataclasses.replace(whole, instants=instants, last=last)

    from_time = (periods - math.ceil(0.25 * periods)) * period
    spread = spread_of(satellite, tuple(names.values()), flight.spread)
    cases = LoopCases(
        flight=flight,
        spread=spread,
        channels=channels,
        names=names,
        torquers=torquers,
        wheels=wheels,
        estimator=estimator,
        controller=law,
        schedule=schedule,
        watch=PointingWatch(limit, from_time - 1e-6 * period, wheels, period, duty),
        start=lambda key: attitude_and_rate(key, most_rate),
        timeline=around,
        duration_s=duration,
        noisy=not perfect,
        thrusters=thrusters,
        turns=(
            *_turns(law, estimator),
            *satellite_turns(
                flight,
                torquers,
                channels,
                names,
                spread,
                inertia_of_law=(lambda f: f.controller.inertia,),
                dipole_of_law=(lambda f: f.controller.max_dipole,),
            ),
        ),
    )

    @jax.jit
    def metrics(state, last):
        motion, tally = state.motion, state.tally
        _, rates = jax.vmap(lambda q, w: off_target(q, w, last))(motion.quaternion, motion.angular_velocity)
        sound = jnp.all(jnp.isfinite(rates), axis=1) & jnp.all(jnp.isfinite(motion.quaternion), axis=1)
        settled = tally.worst < (2.0 * math.sin(0.5 * limit)) ** 2
        none = jnp.full_like(tally.fastest, jnp.nan)

        def angle(square):
            return jnp.degrees(2.0 * jnp.arcsin(jnp.minimum(0.5 * jnp.sqrt(square), 1.0)))

        found = {
            "settling_time_s": jnp.where(settled, tally.above_until, jnp.nan),
            "rms_error_deg": angle(tally.total / math.ceil(0.25 * periods)),
            "largest_error_deg": angle(tally.worst),
            "final_rate_deg_s": jnp.degrees(safe_norm(rates)),
            "wheel_share": none if wheels is None else tally.fastest,
            "magnetic_impulse_A_m2_s": none if torquers is None else tally.impulse,
            "thruster_impulse_N_s": none if thrusters is None else tally.thrust,
        }
        return ended(settled, sound, found)

    return cases, metrics


def _turns(law, estimator):
    """Knobs of the law, of wheels and of the filter."""
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, largest_moment, positive

    def both(name):
        return (lambda f: getattr(f.vehicle.wheels, name), lambda f: getattr(f.controller.wheels, name))

    degree = math.radians(1.0)
    moment, slew = largest_moment(law.inertia), float(law.slew_rate) / degree
    found = [
        Turn(Knob("frequency", "rad/s", "of small errors", float(law.frequency)), (lambda f: f.controller.frequency,)),
        Turn(Knob("damping", "1", "damping ratio", float(law.damping)), (lambda f: f.controller.damping,)),
        Turn(Knob("slew", "deg/s", "largest rate of a slew", slew), (lambda f: f.controller.slew_rate,)),
        Turn(
            Knob("known_inertia", "kg m2", "as the law knows it, the largest moment", moment),
            (lambda f: f.controller.inertia,),
        ),
    ]
    if law.wheels is not None:
        wheels, known = law.wheels, float(law.friction_known)
        dry, wet, most = (float(np.max(x)) for x in (wheels.coulomb, wheels.viscous, wheels.max_torque))
        found += [
            Turn(
                Knob("dumping", "1/s", "gain of the wheels' unloading", float(law.dumping)),
                (lambda f: f.controller.dumping,),
            ),
            Turn(
                Knob("friction_known", "1", "share of the wheels' friction that their motors make good", known, 1.0),
                (lambda f: f.controller.friction_known,),
            ),
            Turn(Knob("dry_friction", "N m", "of each wheel", dry), both("coulomb")),
            Turn(Knob("viscous_friction", "N m s", "of each wheel, over its speed", wet), both("viscous")),
            Turn(Knob("wheel_torque", "N m", "largest of each wheel's motor", most), both("max_torque")),
        ]
    if hasattr(estimator, "field_sigma"):
        taken = float(estimator.field_sigma) / degree
        found.append(
            Turn(
                Knob("filter_field_sigma", "deg", "1-sigma of the field's direction as the filter takes it", taken),
                (lambda f: f.estimator.field_sigma,),
            )
        )
    return positive(found)


def _direction(text: str, name: str) -> np.ndarray:
    from jaxsat.satellites.sections.fitted import to_direction

    try:
        return np.array(to_direction(text))
    except ValueError as error:
        raise InputError(f"{error}, found {text!r}", field=name) from None


def _build(options: Mapping[str, str]) -> Scenario:
    from jaxsat.sweep.flights.loops import loop_scenario

    about = {"name": NAME, "statuses": STATUSES, "metrics": METRICS, "chunk": CHUNK}
    return loop_scenario(_program, options, _history, **about, max_rate="rate_deg_s")


def _history(program: tuple[tuple[str, str], ...], seed: int, case: int) -> History:
    """A case over its time; its beginnings of control periods. Run alone, so that last digits may differ."""
    import jax

    from jaxsat.control.loops.pointing import off_target
    from jaxsat.math import quaternion

    cases, _ = _program(program)
    samples = jax.device_get(cases.history(cases.draw(seed, np.array([case])))[1])
    rows = cases.timeline().instants

    def seen(q, w, here):
        error, rate = off_target(q, w, here)
        return quaternion.to_rotation_vector(error), rate

    motion = samples.motion
    error, rate = map(np.degrees, jax.jit(jax.vmap(seen))(motion.quaternion, motion.angular_velocity, rows))
    q, dipoles, speed, pulses = upright(motion.quaternion), samples.dipoles, motion.wheel_speed, samples.pulses
    size = np.linalg.norm(error, axis=1)
    columns = {
        **{f"quaternion_{c}": q[:, k] for k, c in enumerate("wxyz")},
        **{f"error_{c}_deg": error[:, k] for k, c in enumerate("xyz")},
        "error_deg": size,
        **{f"rate_error_{c}_deg_s": rate[:, k] for k, c in enumerate("xyz")},
    }
    charts = {
        "attitude error about body axes, deg": dict(zip("xyz", error.T, strict=True)),
        "rate against the target, deg/s": dict(zip("xyz", rate.T, strict=True)),
    }
    if dipoles is not None:
        columns |= {f"dipole_{number}_A_m2": dipoles[:, number] for number in range(dipoles.shape[1])}
        charts["dipoles, A m2"] = {f"torquer {k}": dipoles[:, k] for k in range(dipoles.shape[1])}
    if speed is not None:
        rpm = speed * 30.0 / math.pi
        columns |= {f"wheel_{number}_rpm": rpm[:, number] for number in range(rpm.shape[1])}
        charts["speed of the wheels, rpm"] = {f"wheel {k}": rpm[:, k] for k in range(rpm.shape[1])}
    if pulses is not None:
        columns["thruster_impulse_N_s"] = np.cumsum(pulses.impulse)
        columns |= {f"thrust_{c}_N_m": pulses.torque_body[:, k] for k, c in enumerate("xyz")}
        charts["torque of the thrusters, mean of a period, N m"] = dict(zip("xyz", pulses.torque_body.T, strict=True))
    remark = f"{cases.flight.satellite.name} at {dict(program)['target']}; every {cases.schedule.period_s:g} s"
    return History(np.asarray(rows.time), columns, charts, remark)


make = Factory(_build, OPTIONS, ASSUMPTIONS)
