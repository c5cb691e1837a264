"""Many cases of the emergency mode at once, or one satellite, over some orbits."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Int, Key

from jaxsat.control import closed_loop
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.loop import NOISES, Actuator, LoopState, Sample, Supervisor, one_period
from jaxsat.control.emergency_mode.orbit import Leg
from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle
from jaxsat.control.magnetic_actuator import actuator_dipole

NOISE = closed_loop.normals(NOISES)
"""Of one control period."""


class Cases(eqx.Module):
    """Random cases; leaves with the cases in front."""

    state: LoopState
    vehicle: EmergencyVehicle
    key: Key[Array, "*cases"]
    """Of the noise."""


def run_cases(supervisor: Supervisor, law: EmergencyLaw, cases: Cases, around: Leg) -> tuple[LoopState, Sample]:
    """States at the end of a leg, and samples [cases periods ...]; all meet the same surroundings.

    The law's leaves may have the cases in front as well.
    """

    def one(law, case):
        return run_leg(supervisor, law, case.vehicle, around, case.state, case.key)

    of_law = jax.tree.map(lambda leaf: 0 if jnp.ndim(leaf) else None, law)
    return jax.vmap(one, in_axes=(of_law, 0))(law, cases)


def run_one(
    supervisor: Supervisor, law: EmergencyLaw, cases: Cases, around: Leg, *, number: int | Int[Array, ""] = 0
) -> tuple[LoopState, Sample]:
    """Final state and history [periods ...] of one of the cases, by its number."""
    alone = jax.tree.map(lambda leaf: leaf[number][None], cases)
    return jax.tree.map(lambda leaf: leaf[0], run_cases(supervisor, law, alone, around))


def run_leg(
    supervisor: Supervisor,
    law: EmergencyLaw,
    vehicle: EmergencyVehicle,
    around: Leg,
    state: LoopState,
    key: Key[Array, ""] | None = None,
    *,
    actuator: Actuator = actuator_dipole,
) -> tuple[LoopState, Sample]:
    """One satellite over a leg: its state at the end, and samples with the control periods in front.

    With a `key` measurements are noisy. May be traced, mapped over cases, and differentiated.
    """
    nodes = node_triples(around, 1)

    def period(state, noise, nodes):
        return one_period(supervisor, law, vehicle, nodes, state, noise, actuator=actuator)

    periods = len(nodes[0].orbit_rate)
    return closed_loop.run_one(closed_loop.ClosedLoop(period, (), NOISE), (), state, key, periods, given=(nodes,))


def node_triples(around: Leg, periods: int) -> tuple[Leg, Leg, Leg]:
    """Begins, middles and ends of steps of so many control periods."""
    step = 2 * periods
    parts = (slice(0, -step, step), slice(periods, None, step), slice(step, None, step))
    begins, middles, ends = (jax.tree.map(lambda leaf, part=part: leaf[part], around) for part in parts)
    return begins, middles, ends
