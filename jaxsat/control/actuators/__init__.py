"""Magnetorquers, reaction wheels and thrusters, as any loop may have them."""

from jaxsat.control.actuators.thrusters import Pulses as Pulses
from jaxsat.control.actuators.thrusters import Thrusters as Thrusters
from jaxsat.control.actuators.thrusters import fire as fire
from jaxsat.control.actuators.torquers import Magnetorquers as Magnetorquers
from jaxsat.control.actuators.torquers import torquer_dipoles as torquer_dipoles
from jaxsat.control.actuators.wheels import ReactionWheels as ReactionWheels
from jaxsat.control.actuators.wheels import friction as friction
from jaxsat.control.actuators.wheels import motor_torques as motor_torques
from jaxsat.control.actuators.wheels import stored_momentum as stored_momentum
