"""Runs of the emergency mode: over some orbits, of as many satellites as one maps it over, or of one over years."""

from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.loop import (
    NOISES,
    Actuator,
    EmergencyState,
    Sample,
    Supervisor,
    one_period,
    supervised,
)
from jaxsat.control.emergency_mode.orbit import Flight, Leg, leg
from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle
from jaxsat.control.magnetic_actuator import actuator_dipole
from jaxsat.control.rotating_panels import PanelAngle

QUIET = 4
"""Control periods that one step takes while the actuator is off, 64 s: librations lose 0.3 % a year by it."""


def run_leg(
    law: EmergencyLaw,
    supervisor: Supervisor,
    vehicle: EmergencyVehicle,
    around: Leg,
    state: EmergencyState,
    key: Key[Array, ""] | None = None,
    *,
    actuator: Actuator = actuator_dipole,
) -> tuple[EmergencyState, Sample]:
    """One satellite over a leg: its state at the end, and samples with the control periods in front.

    With a `key` measurements are noisy. May be traced, mapped over cases, and differentiated.
    """
    nodes = _triples(around, 1)

    def advance(state, given):
        number, nodes = given
        return one_period(law, supervisor, vehicle, nodes, state, _noise(key, number), actuator=actuator)

    return jax.lax.scan(advance, state, (jnp.arange(len(nodes[0].orbit_rate)), nodes))


def run_years(
    law: EmergencyLaw,
    supervisor: Supervisor,
    vehicle: EmergencyVehicle,
    flight: Flight,
    state: EmergencyState,
    periods: int,
    *,
    first: int = 0,
    key: Key[Array, ""] | None = None,
    leg_periods: int = 5_400,
    panels: PanelAngle | None = None,
) -> Iterator[tuple[EmergencyState, Sample]]:
    """One satellite over many control periods from number `first`: state and samples, one in 64 s, of leg after leg.

    What is left of `periods` after whole legs is not flown; `leg_periods` is a multiple of `QUIET`. While the actuator
    is off a step takes 64 s. A sample's dipole is then that of the last 16 s. `panels` is as in `leg`.
    """
    for begin in range(first, first + periods - leg_periods + 1, leg_periods):
        around = leg(flight, begin, leg_periods, panels=panels)
        state, samples = _run_blocks(law, supervisor, vehicle, around, state, key, jnp.asarray(begin))
        yield state, jax.device_get(samples)


@eqx.filter_jit
def _run_blocks(
    law: EmergencyLaw,
    supervisor: Supervisor,
    vehicle: EmergencyVehicle,
    around: Leg,
    state: EmergencyState,
    key: Key[Array, ""] | None,
    first: Int[Array, ""],
) -> tuple[EmergencyState, Sample]:
    coarse = _triples(around, QUIET)
    fine = jax.tree.map(lambda leaf: leaf.reshape(-1, QUIET, *leaf.shape[1:]), _triples(around, 1))
    numbers = first + jnp.arange(len(around.orbit_rate) // 2).reshape(-1, QUIET)

    def block(state, given):
        numbers, coarse, fine = given

        def awake(state):
            def advance(state, given):
                number, nodes = given
                return one_period(law, supervisor, vehicle, nodes, state, _noise(key, number))

            state, samples = jax.lax.scan(advance, state, (numbers, fine))
            return state, jax.tree.map(lambda leaf: leaf[-1], samples)

        def asleep(state):
            noise = _noise(key, numbers[0])
            return one_period(law, supervisor, vehicle, coarse, state, noise, periods=QUIET)

        return jax.lax.cond(supervised(supervisor, state)[0], awake, asleep, state)

    return jax.lax.scan(block, state, (numbers, coarse, fine))


def _triples(around: Leg, periods: int) -> tuple[Leg, Leg, Leg]:
    """Begins, middles and ends of steps of so many control periods."""
    step = 2 * periods
    parts = (slice(0, -step, step), slice(periods, None, step), slice(step, None, step))
    begins, middles, ends = (jax.tree.map(lambda leaf, part=part: leaf[part], around) for part in parts)
    return begins, middles, ends


def _noise(key: Key[Array, ""] | None, number: Int[Array, ""]) -> Float[Array, "9"] | None:
    return None if key is None else jax.random.normal(jax.random.fold_in(key, number), (NOISES,))
