"""One satellite of the emergency mode over years: by longer steps while its actuator is off."""

from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from jaxsat.control.closed_loop import random_of
from jaxsat.control.emergency_mode.cases import NOISE, node_triples
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.loop import LoopState, Sample, Supervisor, one_period, supervised
from jaxsat.control.emergency_mode.orbit import Flight, Leg, leg
from jaxsat.control.emergency_mode.rotating_panels import PanelAngle
from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle

QUIET = 4
"""Control periods that one step takes while the actuator is off, 64 s: librations lose 0.3 % a year by it."""


def run_years(
    supervisor: Supervisor,
    law: EmergencyLaw,
    vehicle: EmergencyVehicle,
    flight: Flight,
    state: LoopState,
    periods: int,
    *,
    first: int = 0,
    key: Key[Array, ""] | None = None,
    leg_periods: int = 5_400,
    panels: PanelAngle | None = None,
) -> Iterator[tuple[LoopState, Sample]]:
    """One satellite over many control periods from number `first`: state and samples, one in 64 s, of leg after leg.

    What is left of `periods` after whole legs is not flown; `leg_periods` is a multiple of `QUIET`. While the actuator
    is off a step takes 64 s. A sample's dipole is then that of the last 16 s. `panels` is as in `leg`.
    """
    for begin in range(first, first + periods - leg_periods + 1, leg_periods):
        around = leg(flight, begin, leg_periods, panels=panels)
        state, samples = _run_blocks(supervisor, law, vehicle, around, state, key, jnp.asarray(begin))
        yield state, jax.device_get(samples)


@eqx.filter_jit
def _run_blocks(
    supervisor: Supervisor,
    law: EmergencyLaw,
    vehicle: EmergencyVehicle,
    around: Leg,
    state: LoopState,
    key: Key[Array, ""] | None,
    first: Int[Array, ""],
) -> tuple[LoopState, Sample]:
    coarse = node_triples(around, QUIET)
    fine = jax.tree.map(lambda leaf: leaf.reshape(-1, QUIET, *leaf.shape[1:]), node_triples(around, 1))
    numbers = first + jnp.arange(len(around.orbit_rate) // 2).reshape(-1, QUIET)

    def block(state, given):
        numbers, coarse, fine = given

        def awake(state):
            def advance(state, given):
                number, nodes = given
                return one_period(supervisor, law, vehicle, nodes, state, _noise(key, number))

            state, samples = jax.lax.scan(advance, state, (numbers, fine))
            return state, jax.tree.map(lambda leaf: leaf[-1], samples)

        def asleep(state):
            noise = _noise(key, numbers[0])
            return one_period(supervisor, law, vehicle, coarse, state, noise, periods=QUIET)

        return jax.lax.cond(supervised(supervisor, state)[0], awake, asleep, state)

    return jax.lax.scan(block, state, (numbers, coarse, fine))


def _noise(key: Key[Array, ""] | None, number: Int[Array, ""]) -> Float[Array, "9"] | None:
    return None if key is None else random_of(NOISE, key, number)
