"""The closed loop of Sun pointing: sensor, estimate, law, thrusters and rigid body, a control period at a time."""

import math
from dataclasses import dataclass
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.control.actuators import fire
from jaxsat.control.sun_pointing.law import Guidance, SunPointingLaw, decide, first_guidance, wanted_torque
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle
from jaxsat.dynamics import rigid_body_rates
from jaxsat.estimation.sun.candidates import sun_candidates
from jaxsat.estimation.sun.filter import SunFilter, blank_filter, corrected, predicted
from jaxsat.estimation.sun.published import published_direction
from jaxsat.estimation.sun.tracker import SunTrack, blank_track, carried, followed
from jaxsat.math import angle_between, quaternion
from jaxsat.math.runge_kutta import RK4, runge_kutta_step
from jaxsat.sensors.sun_sensor import combine_detectors, face_currents, quantize

Estimator = Literal["tracking", "filter", "published"]


@dataclass(frozen=True)
class LoopSettings:
    """What is fixed for all cases of a program."""

    estimator: Estimator = "tracking"
    """`published`: Zhukov's reconstruction of each sample by itself; `tracking`: all candidates, followed; `filter`:
    followed by Kalman filters, for readings that are not exact."""
    period_s: float = 1.0
    """Control period."""
    reading_step: float = 0.0
    """Of the sensor's converter, over the maximum current; 0 where readings are not quantised."""
    reading_noise: float = 0.0
    """1-sigma of one detector over the maximum current."""
    detector_gain: float = 0.0
    """1-sigma of the detectors' gains, relative, as the filter takes it."""
    gyro_noise_rad_s: float = 0.0
    """1-sigma of a rate."""
    gyro_error_rad_s: float = 2e-4
    """1-sigma of a rate as the filter takes it, bias included."""

    @property
    def noisy(self) -> bool:
        """Whether random numbers are drawn."""
        return self.reading_noise > 0.0 or self.gyro_noise_rad_s > 0.0

    @property
    def threshold(self) -> float:
        """Current over the maximum one that is told from none."""
        return 5.0 * self.reading_noise + 1.5 * self.reading_step

    @property
    def tolerance(self) -> float:
        """Mismatch of a current, over the maximum one, within which a candidate explains it."""
        return 4.0 * self.reading_noise + self.reading_step

    @property
    def reading_sigma(self) -> float:
        """1-sigma of a face's current over the maximum one, for the filter; exact readings count as good to 1e-4."""
        return max(math.hypot(self.reading_noise, self.reading_step / math.sqrt(12.0)), 1e-4)

    @property
    def gain(self) -> float:
        """Share of a reading in the direction that is followed."""
        return 0.3 if self.noisy else 1.0


class LoopState(eqx.Module):
    """Vehicle, estimate and tally of one case."""

    quaternion: Float[Array, "4"]
    """inertial-from-body, scalar first."""
    angular_velocity: Float[Array, "3"]
    """Body axes [rad/s]."""
    guidance: Guidance
    track: SunTrack | SunFilter
    time: Float[Array, ""]
    """[s]"""
    impulse: Float[Array, ""]
    """Spent so far [N s]."""
    pulses: Float[Array, ""]
    """Fired so far."""
    mode_time: Float[Array, "4"]
    """Spent in each mode before the Sun was first stabilised [s]."""
    worst_estimate: Float[Array, ""]
    """Largest distance between the unit vectors of estimate and Sun, squared, while the Sun was taken for known."""


class Sample(eqx.Module):
    """One control period as a person would plot it."""

    sun_instrument: Float[Array, "3"]
    """True direction of the Sun in the sensor's axes."""
    estimate: Float[Array, "3"]
    """What was believed of it; meaningless where it was not known."""
    known: Bool[Array, ""]
    lit: Int[Array, ""]
    """Faces with a current."""
    mode: Int[Array, ""]
    angular_velocity: Float[Array, "3"]
    """[rad/s]"""
    error: Float[Array, ""]
    """True angle between the Sun and where it shall stand [rad]."""
    impulse: Float[Array, ""]
    """[N s]"""


def first_state(settings: LoopSettings, q: Float[Array, "4"], w: Float[Array, "3"]) -> LoopState:
    """At rest in everything but the motion."""
    zero = jnp.asarray(0.0)
    track = blank_filter() if settings.estimator == "filter" else blank_track()
    return LoopState(q, w, first_guidance(), track, zero, zero, zero, jnp.zeros(4), zero)


def one_period(
    settings: LoopSettings,
    law: SunPointingLaw,
    vehicle: SunPointingVehicle,
    sun_eci: Float[Array, "3"],
    state: LoopState,
    noise: Float[Array, "11"] | None,
) -> tuple[LoopState, Sample]:
    """One case one control period on: measure, estimate, decide, fire, move.

    `noise` are unit normal numbers: 8 of the detectors, 3 of the gyro.
    """
    period = settings.period_s
    sun_body = quaternion.rotate_inverse(state.quaternion, sun_eci)
    sun = vehicle.body_from_instrument.T @ sun_body

    faces = face_currents(vehicle.sensor, sun)
    readings = faces[:, None] * vehicle.detector_gain
    rate = state.angular_velocity + vehicle.gyro_bias
    if noise is not None:
        # A detector that has failed gives nothing, not even noise.
        alive = vehicle.detector_gain > 0.0
        scatter = settings.reading_noise * vehicle.sensor.max_current * noise[:8].reshape(4, 2)
        readings = jnp.maximum(readings + jnp.where(alive, scatter, 0.0), 0.0)
        rate = rate + settings.gyro_noise_rad_s * noise[8:]
    if settings.reading_step > 0.0:
        readings = quantize(readings, settings.reading_step * vehicle.sensor.max_current)
    currents = combine_detectors(readings)
    threshold = settings.threshold * vehicle.sensor.max_current

    mounting = vehicle.assumed_body_from_instrument
    track = state.track
    if settings.estimator == "published":
        reading = published_direction(vehicle.sensor, currents, threshold=threshold)
        estimate, known, lit = reading.direction, reading.lit > 0, reading.lit
    else:
        turn, full = mounting.T @ (rate * period), vehicle.sensor.max_current
        # Which faces have lost both detectors is known.
        alive = jnp.any(vehicle.detector_gain > 0.0, axis=1)
        filtering = isinstance(track, SunFilter)
        track = predicted(track, turn, settings.gyro_error_rad_s * period) if filtering else carried(track, turn)
        found = sun_candidates(
            vehicle.sensor,
            currents,
            track.best(),
            alive=alive,
            threshold=threshold,
            tolerance=settings.tolerance * full,
        )
        found, track = jax.lax.optimization_barrier((found, track))
        if filtering:
            sigma = jnp.sqrt((settings.reading_sigma * full) ** 2 + (settings.detector_gain * currents) ** 2)
            track = corrected(track, vehicle.sensor, currents, found, sigma=sigma, alive=alive, threshold=threshold)
        else:
            track = followed(track, found, gain=settings.gain)
        track = jax.lax.optimization_barrier(track)
        estimate, known, lit = track.best(), track.known(), found.lit

    estimate, known, rate = jax.lax.optimization_barrier((estimate, known, rate))
    guidance, command = decide(law, state.guidance, estimate, known, rate, mounting, state.time, period)
    wanted, band = wanted_torque(law, guidance, command, rate, vehicle.assumed_inertia)
    wanted, band = jax.lax.optimization_barrier((wanted, band))
    pulses = fire(vehicle.thrusters, wanted, band, period)
    pulses, guidance = jax.lax.optimization_barrier((pulses, guidance))
    q, w = _moved(vehicle, state.quaternion, state.angular_velocity, pulses.torque_body, period)

    off = jnp.sum((estimate - sun) ** 2)
    before = guidance.settled_at == jnp.inf
    numbers = jnp.arange(4)
    after = LoopState(
        quaternion=q,
        angular_velocity=w,
        guidance=guidance,
        track=track,
        time=state.time + period,
        impulse=state.impulse + pulses.impulse,
        pulses=state.pulses + pulses.count,
        mode_time=state.mode_time + jnp.where((numbers == guidance.mode) & before, period, 0.0),
        worst_estimate=jnp.where(known, jnp.maximum(state.worst_estimate, off), state.worst_estimate),
    )
    error = angle_between(law.target(), sun)
    return after, Sample(sun, estimate, known, lit, guidance.mode, state.angular_velocity, error, pulses.impulse)


def _moved(vehicle, q, w, torque_body, period):
    """The rigid body a period on under a torque that is constant in its axes: RK4, one step.

    Pulses count as their mean over the period, which moves the attitude by an eighth of their acceleration times the
    period squared at most.
    """

    def slope(state, _):
        q, w = jax.lax.optimization_barrier(state)
        rates = rigid_body_rates(q, w, torque_body, vehicle.inertia, vehicle.inverse_inertia)
        return jax.lax.optimization_barrier(rates)

    q, w = runge_kutta_step(RK4, slope, (q, w), period, (None,) * RK4.stages)
    return quaternion.normalize(q), w
