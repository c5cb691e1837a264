"""Sun pointing as a closed loop of `jaxsat.control.loops`: its plant, estimator and controller, and what is noted.

Nothing turns the vehicle but its thrusters, and the Sun stands still: the plant's surroundings are `unchanging`.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.loops import AbstractController, AbstractWatch, Commands, Estimate, Instant, Now, Sample, Vehicle
from jaxsat.control.sun_pointing.law import Guidance, SunPointingLaw, decide, first_guidance, wanted_torque
from jaxsat.control.sun_pointing.sensing import LoopSettings, Sensors, SunEstimator
from jaxsat.control.sun_pointing.vehicle import SunPointingVehicle
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import required


class SunPointingController(AbstractController):
    """The law with what is known on board."""

    law: SunPointingLaw
    vehicle: SunPointingVehicle

    def start(self) -> Guidance:
        return first_guidance()

    def update(self, memory: Guidance, estimate: Estimate, now: Now) -> tuple[Guidance, Commands]:
        told = estimate.sun, estimate.sun_known, estimate.angular_velocity
        sun, known, rate = (required(x, "SunPointingController", "an Estimate", "SunEstimator") for x in told)
        mounting, t = self.vehicle.assumed_body_from_instrument, now.here.time
        guidance, command = decide(self.law, memory, sun, known, rate, mounting, t, now.period)
        wanted, band = wanted_torque(self.law, guidance, command, rate, self.vehicle.assumed_inertia)
        return guidance, Commands(jnp.zeros(3), jnp.zeros(3), wanted, band)


class Tally(eqx.Module):
    """What is noted of a case."""

    impulse: Float[Array, ""]
    """Spent so far [N s]."""
    pulses: Float[Array, ""]
    """Fired so far."""
    mode_time: Float[Array, "4"]
    """Spent in each mode before the Sun was first stabilised [s]."""
    worst_estimate: Float[Array, ""]
    """Largest distance between the unit vectors of estimate and Sun, squared, while the Sun was taken for known."""


class SunPointingWatch(AbstractWatch):
    """Notes a `Tally`."""

    period: float = eqx.field(static=True)
    """[s]"""

    def start(self) -> Tally:
        zero = jnp.zeros(())
        return Tally(zero, zero, jnp.zeros(4), zero)

    def update(self, tally: Tally, sample: Sample, here: Instant) -> Tally:
        told = sample.estimate.sun, sample.estimate.sun_known
        sun, known = (required(x, "SunPointingWatch", "an Estimate", "SunEstimator") for x in told)
        pulses = required(sample.pulses, "SunPointingWatch", "Sample.pulses", "a vehicle with thrusters")
        guidance = sample.decision
        off = jnp.sum((sun - sample.readings["all"].sun_instrument) ** 2)
        counts = (jnp.arange(4) == guidance.mode) & (guidance.settled_at == jnp.inf)
        worst = jnp.where(known, jnp.maximum(tally.worst_estimate, off), tally.worst_estimate)
        return Tally(
            impulse=tally.impulse + pulses.impulse,
            pulses=tally.pulses + pulses.count,
            mode_time=tally.mode_time + jnp.where(counts, self.period, 0.0),
            worst_estimate=worst,
        )


def parts(
    settings: LoopSettings, law: SunPointingLaw, vehicle: SunPointingVehicle
) -> tuple[Vehicle, dict[str, Sensors], SunEstimator, SunPointingController]:
    """What is `fixed` in the loop, of one case or with the cases in front."""
    craft = eqx.tree_at(lambda craft: craft.inertia, Spacecraft(np.eye(3)), vehicle.inertia)
    body = Vehicle(craft, vehicle.inverse_inertia, thrusters=vehicle.thrusters)
    own = {"all": Sensors(vehicle, settings)}
    return body, own, SunEstimator(vehicle, settings), SunPointingController(law, vehicle)
