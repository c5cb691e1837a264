"""A satellite of any file is let go by its deployer and damps its rate with magnetorquers.

B-dot, by the difference of successive readings of the magnetometer or with a gyro (Stickler & Alfriend 1976; Avanzini &
Giulietti 2012), with the noise of the file's sensors. A case has succeeded if its rate ends below the limit.
"""

import functools
import math
from collections.abc import Mapping

import numpy as np

from jaxsat.sweep.flights.options import COMMON
from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import upright
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario

NAME = "detumble"
STATUSES = ("succeeded", "not detumbled", "diverged")
METRICS = {
    "detumbling_time_s": Metric(
        "s", "until the rate stays below the limit; none in a case that does not get there", endless=True
    ),
    "final_rate_deg_s": Metric("deg/s", "size of the angular velocity at the end"),
    "largest_rate_deg_s": Metric("deg/s", "of all beginnings of control periods"),
    "magnetic_impulse_A_m2_s": Metric("A m2 s", "sum of the torquers' dipoles over the time they are on"),
    "saturated_share": Metric("1", "control periods in which a torquer was at its largest dipole"),
}
CHUNK = 200
TOLERANCE_RAD = 1e-6
"""Of the attitude at the end, by the steps of the motion.

RK4 errs by the fifth power of the rate, which falls linearly while torquers are at their largest dipole and then
exponentially: as if it were the largest for a sixth of the one time and a fifth of the other's constant.
"""
WEAK_FIELD_T = 2e-5
"""Across the body, for how long torquers take at least."""


OPTIONS = (
    *COMMON,
    Option("orbits", "2", "simulated time"),
    Option("tipoff_deg_s", "10", "largest rate at the start: its size is uniform up to it, its direction over all"),
    Option("limit_deg_s", "0.5", "rate below which the satellite is detumbled"),
    Option("law", "difference", "B-dot by the difference of readings of the field, or gyro: by its rate"),
    Option("gain", "auto", "of the law, N m s; auto: that of Avanzini & Giulietti 2012"),
    Option("period_s", "2", "control period"),
    Option("duty", "0.8", "share of a period in which the torquers are on; then the field is read without them"),
    Option("sensors", "file", "with the errors of the satellite file, or perfect"),
    Option("dropouts", "0", "probability that a reading does not come"),
    Option("step_s", "auto", "of the motion's integration; auto: 1e-6 rad at the end for the largest rate"),
)
ASSUMPTIONS = (
    "All cases begin at the same place of the orbit; attitudes are uniform, rates uniform in size and direction.",
    "Numbers of the satellite file with a sigma are normal about their values; the law knows the values alone.",
    "Torquers reach their dipoles at once; while they are on the magnetometer is not read.",
    "Rods with hysteresis are magnetised by the Earth's field alone, not by torquers.",
    "Orbit and field are those of the models, IGRF and the file's elements, on board as well.",
)


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]):
    """The loop of the options, and the function of metrics."""
    import jax
    import jax.numpy as jnp

    from jaxsat.control.laws import damping_gain
    from jaxsat.control.loops import (
        AsRead,
        FieldDifference,
        Perfect,
        RateAcrossField,
        RateWatch,
        Schedule,
        step_within,
        timeline,
    )
    from jaxsat.math import safe_norm
    from jaxsat.satellites.actuators import torquers_of
    from jaxsat.sweep.flights.flight import flight_of
    from jaxsat.sweep.flights.loops import LoopCases, ended
    from jaxsat.sweep.flights.sensors import channels_of
    from jaxsat.sweep.flights.spread import spread_of
    from jaxsat.sweep.flights.starts import attitude_and_rate
    from jaxsat.sweep.flights.turns import satellite_turns
    from jaxsat.sweep.knobs.knob import Knob
    from jaxsat.sweep.knobs.turns import Turn, positive

    reader = Reader(dict(options))
    number = reader.number
    tipoff = math.radians(number("tipoff_deg_s", low=0.0, high=60.0))
    limit = math.radians(number("limit_deg_s", low=1e-3, high=60.0))
    orbits, period = number("orbits", low=0.01, high=200.0), number("period_s", low=0.05, high=60.0)
    duty, dropouts = number("duty", low=0.05, high=1.0), number("dropouts", low=0.0, high=1.0)
    law, sensors = reader.word("law", ("difference", "gyro")), reader.word("sensors", ("file", "perfect"))
    flight = flight_of(dict(options))
    duration = orbits * flight.orbit_s
    step = reader.number_or("step_s", "auto", low=1e-3, high=60.0)
    gain = reader.number_or("gain", "auto", low=0.0, high=1e3)
    satellite = flight.satellite
    if gain is None:
        least = float(np.linalg.eigvalsh(np.asarray(satellite.model.spacecraft.inertia)).min())
        gain = damping_gain(flight.orbit_rate, flight.inclination, least)
    perfect = sensors == "perfect"
    sights = () if perfect else ("field",) if law == "difference" else ("field", "rate")
    channels, names = channels_of(satellite, sights, period_s=period, dropout=dropouts)
    torquers = torquers_of(satellite)
    if step is None:
        most = float(np.linalg.eigvalsh(np.asarray(satellite.model.spacecraft.inertia)).max())
        damping = most * max(tipoff, limit) / (duty * float(np.min(torquers.max_dipole)) * WEAK_FIELD_T)
        lasting = damping / 6.0 + 1.5 * most / (5.0 * duty * max(gain, 1e-30))
        rods = satellite.model.spacecraft.hysteresis_rods is not None
        step = step_within(TOLERANCE_RAD, max(tipoff, limit), min(lasting, duration), rods=rods)
    schedule = Schedule(period, step, duty)
    around = functools.cache(
        lambda: timeline(
            flight.surroundings(duration + period), schedule, schedule.periods(duration), pressed=flight.pressed
        )
    )
    spread = spread_of(satellite, tuple(names.values()), flight.spread)
    of_law = Turn(Knob("gain", "N m s", "of the law", gain), (lambda f: f.controller.gain,))
    cases = LoopCases(
        flight=flight,
        spread=spread,
        channels=channels,
        names=names,
        torquers=torquers,
        wheels=None,
        estimator=Perfect() if perfect else AsRead(),
        controller=(FieldDifference if law == "difference" else RateAcrossField)(gain),
        schedule=schedule,
        watch=RateWatch(limit, period, duty),
        start=lambda key: attitude_and_rate(key, tipoff),
        timeline=around,
        duration_s=duration,
        noisy=not perfect,
        turns=(*positive([of_law]), *satellite_turns(flight, torquers, channels, names, spread)),
    )

    @jax.jit
    def metrics(state, last):
        rate = safe_norm(state.motion.angular_velocity)
        tally = state.tally
        sound = jnp.isfinite(rate) & jnp.all(jnp.isfinite(state.motion.quaternion), axis=1)
        found = {
            "detumbling_time_s": jnp.where(rate < limit, tally.above_until, jnp.nan),
            "final_rate_deg_s": jnp.degrees(rate),
            "largest_rate_deg_s": jnp.degrees(jnp.sqrt(tally.largest)),
            "magnetic_impulse_A_m2_s": tally.impulse,
            "saturated_share": tally.saturated / schedule.periods(duration),
        }
        return ended(rate < limit, sound, found)

    return cases, metrics


def _build(options: Mapping[str, str]) -> Scenario:
    from jaxsat.sweep.flights.loops import loop_scenario

    about = {"name": NAME, "statuses": STATUSES, "metrics": METRICS, "chunk": CHUNK}
    return loop_scenario(_program, options, _history, **about, max_rate="tipoff_deg_s")


def _history(program: tuple[tuple[str, str], ...], seed: int, case: int) -> History:
    """A case over its time; its beginnings of control periods. Run alone, so that last digits may differ."""
    import jax

    cases, _ = _program(program)
    drawn = cases.draw(seed, np.array([case]))
    samples = jax.device_get(cases.history(drawn)[1])
    t_s = np.asarray(cases.timeline().instants.time)
    rate, dipoles = np.degrees(samples.motion.angular_velocity), samples.dipoles
    size = np.linalg.norm(rate, axis=1)
    field = 1e6 * np.asarray(samples.estimate.b_field_body)
    q = upright(samples.motion.quaternion)
    torquers = [f"torquer {number}" for number in range(dipoles.shape[1])]
    columns = {
        **{f"quaternion_{c}": q[:, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_deg_s": rate[:, k] for k, c in enumerate("xyz")},
        "rate_deg_s": size,
        **{f"field_read_{c}_uT": field[:, k] for k, c in enumerate("xyz")},
        **{f"dipole_{number}_A_m2": dipoles[:, number] for number in range(dipoles.shape[1])},
    }
    charts = {
        "angular velocity, body axes, deg/s": dict(zip("xyz", rate.T, strict=True)),
        "its size, deg/s": {"": size},
        "field as the law is told, body axes, uT": dict(zip("xyz", field.T, strict=True)),
        "dipoles, A m2": dict(zip(torquers, dipoles.T, strict=True)),
    }
    schedule = cases.schedule
    remark = f"{cases.flight.satellite.name}; every {schedule.period_s:g} s, torquers on for {schedule.duty:.0%} of it"
    return History(t_s, columns, charts, remark)


make = Factory(_build, OPTIONS, ASSUMPTIONS)
