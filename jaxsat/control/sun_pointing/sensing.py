"""What a Sun-pointing vehicle reads of its pyramid sensor and its gyro, and what is made of it on board."""

import math
from dataclasses import dataclass
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxsat.control.loops import AbstractChannel, AbstractEstimator, Estimate, Instant, Motion, Now
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle
from jaxsat.estimation.sun.candidates import sun_candidates
from jaxsat.estimation.sun.filter import SunFilter, blank_filter, corrected, predicted
from jaxsat.estimation.sun.published import published_direction
from jaxsat.estimation.sun.tracker import SunTrack, blank_track, carried, followed
from jaxsat.math import quaternion
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


class SensorReading(eqx.Module):
    """What the sensors say at the beginning of a control period."""

    currents: Float[Array, "4"]
    """Of the faces of the Sun sensor [A]."""
    lit: Int[Array, ""]
    """Faces with a current."""
    alive: Bool[Array, "4"]
    """Faces that have not lost both detectors, which is known."""
    rate: Float[Array, "3"]
    """Of the gyro [rad/s]."""
    sun_instrument: Float[Array, "3"]
    """True direction of the Sun in the sensor's axes, for who judges the estimate."""


class Sensors(AbstractChannel):
    """The pyramid sensor of eight detectors, and the gyro."""

    vehicle: SunPointingVehicle
    settings: LoopSettings = eqx.field(static=True)

    @property
    def numbers(self) -> tuple[int, int]:
        return 11, 0

    def start(self) -> None:
        return None

    def read(self, memory: None, motion: Motion, here: Instant, normal, uniform) -> tuple[None, SensorReading]:
        vehicle, full = self.vehicle, self.vehicle.sensor.max_current
        sun = vehicle.body_from_instrument.T @ quaternion.rotate_inverse(motion.quaternion, here.sun_eci)
        readings = face_currents(vehicle.sensor, sun)[:, None] * vehicle.detector_gain
        rate, alive = motion.angular_velocity + vehicle.gyro_bias, vehicle.detector_gain > 0.0
        if normal is not None:
            # A detector that has failed gives nothing, not even noise.
            scatter = self.settings.reading_noise * full * normal[:8].reshape(4, 2)
            readings = jnp.maximum(readings + jnp.where(alive, scatter, 0.0), 0.0)
            rate = rate + self.settings.gyro_noise_rad_s * normal[8:]
        if self.settings.reading_step > 0.0:
            readings = quantize(readings, self.settings.reading_step * full)
        currents = combine_detectors(readings)
        lit = jnp.sum(currents > self.settings.threshold * full)
        return None, SensorReading(currents, lit, jnp.any(alive, axis=1), rate, sun)


class SunEstimator(AbstractEstimator):
    """The Sun's direction in the sensor's axes, by one of three ways."""

    vehicle: SunPointingVehicle
    settings: LoopSettings = eqx.field(static=True)

    def start(self) -> SunTrack | SunFilter:
        return blank_filter() if self.settings.estimator == "filter" else blank_track()

    def update(self, memory: SunTrack | SunFilter, readings, now: Now) -> tuple[SunTrack | SunFilter, Estimate]:
        settings, sensor, track, full = self.settings, self.vehicle.sensor, memory, self.vehicle.sensor.max_current
        read = readings["all"]
        currents, alive, rate = read.currents, read.alive, read.rate
        threshold = settings.threshold * full
        if settings.estimator == "published":
            sun, known = published_direction(sensor, currents, threshold=threshold).direction, read.lit > 0
        else:
            turn = self.vehicle.assumed_body_from_instrument.T @ (rate * now.period)
            filtering = isinstance(track, SunFilter)
            track = (
                predicted(track, turn, settings.gyro_error_rad_s * now.period) if filtering else carried(track, turn)
            )
            tolerance = settings.tolerance * full
            found = sun_candidates(
                sensor, currents, track.best(), alive=alive, threshold=threshold, tolerance=tolerance
            )
            found, track = jax.lax.optimization_barrier((found, track))
            if filtering:
                sigma = jnp.sqrt((settings.reading_sigma * full) ** 2 + (settings.detector_gain * currents) ** 2)
                track = corrected(track, sensor, currents, found, sigma=sigma, alive=alive, threshold=threshold)
            else:
                track = followed(track, found, gain=settings.gain)
            track = jax.lax.optimization_barrier(track)
            sun, known = track.best(), track.known()
        sun, known, rate = jax.lax.optimization_barrier((sun, known, rate))
        return track, Estimate(angular_velocity=rate, sun=sun, sun_known=known)
