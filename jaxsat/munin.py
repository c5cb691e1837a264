"""The torques that the identification of Munin rests on."""

from jaxsat.torques.abstract import AbstractTorque
from jaxsat.torques.gravity_gradient import GravityGradient
from jaxsat.torques.magnetic import LinearRodsTorque, PermanentMagnet

MUNIN_TORQUES: tuple[AbstractTorque, ...] = (GravityGradient(), PermanentMagnet(), LinearRodsTorque())
"""The model of Penkov et al. 2009: gravity gradient, permanent magnet, two linear rods."""
