"""The torques that follow from what a satellite is made of."""

from jaxsat.environment import OrbitTable
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment
from jaxsat.torques.aerodynamic import AerodynamicTorque
from jaxsat.torques.gravity_gradient import GravityGradient
from jaxsat.torques.hysteresis import HysteresisRodsTorque
from jaxsat.torques.magnetic import LinearRodsTorque, PermanentMagnet
from jaxsat.torques.solar_pressure import SolarPressureTorque


def torques_of(
    spacecraft: Spacecraft, around: OrbitTable | BodyEnvironment | None = None
) -> tuple[AbstractTorque, ...]:
    """Gravity gradient, and a torque for each part that is there, in a fixed order; then the satellite's own `parts`.

    Hysteresis rods want their lag in the state and the field's rate in the table, and say so where they are absent. Air
    and sunlight push on `facets` only where `around`, the orbit's table or what is read of it, has columns of them:
    with no atmosphere and no Sun given, a satellite with facets moves as one without.
    """
    pushed = None if spacecraft.facets is None else around
    present = (
        (GravityGradient(), True),
        (PermanentMagnet(), spacecraft.magnet is not None),
        (LinearRodsTorque(), spacecraft.rods is not None),
        (HysteresisRodsTorque(), spacecraft.hysteresis_rods is not None),
        (AerodynamicTorque(), pushed is not None and pushed.air_density is not None),
        (SolarPressureTorque(), pushed is not None and pushed.solar_pressure is not None),
    )
    return (*(torque for torque, there in present if there), *map(_torque_of, spacecraft.parts))


def _torque_of(part: object) -> AbstractTorque:
    if not isinstance(part, AbstractTorque):
        raise ValueError(f"Spacecraft.parts: expected AbstractTorques, got {type(part).__name__}: derive it from that")
    return part
