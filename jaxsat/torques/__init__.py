"""Torques on a rigid satellite, in body axes: pure functions, and thin objects that are summed by the dynamics."""

from jaxsat.torques.abstract import AbstractTorque as AbstractTorque
from jaxsat.torques.abstract import BodyEnvironment as BodyEnvironment
from jaxsat.torques.aerodynamic import AerodynamicTorque as AerodynamicTorque
from jaxsat.torques.aerodynamic import aerodynamic_forces as aerodynamic_forces
from jaxsat.torques.aerodynamic import aerodynamic_torque as aerodynamic_torque
from jaxsat.torques.commanded import Coil as Coil
from jaxsat.torques.commanded import Wheel as Wheel
from jaxsat.torques.commanded import commanded_columns as commanded_columns
from jaxsat.torques.commanded import wheel_torque as wheel_torque
from jaxsat.torques.eddy_damping import EddyDamping as EddyDamping
from jaxsat.torques.eddy_damping import eddy_damping_torque as eddy_damping_torque
from jaxsat.torques.gravity_gradient import GravityGradient as GravityGradient
from jaxsat.torques.gravity_gradient import gravity_gradient_torque as gravity_gradient_torque
from jaxsat.torques.hysteresis import HysteresisRodsTorque as HysteresisRodsTorque
from jaxsat.torques.hysteresis import hysteresis_dipole as hysteresis_dipole
from jaxsat.torques.hysteresis import induction_from_lag as induction_from_lag
from jaxsat.torques.hysteresis import lag_from_induction as lag_from_induction
from jaxsat.torques.hysteresis import lag_rate as lag_rate
from jaxsat.torques.magnetic import LinearRodsTorque as LinearRodsTorque
from jaxsat.torques.magnetic import PermanentMagnet as PermanentMagnet
from jaxsat.torques.magnetic import magnetic_torque as magnetic_torque
from jaxsat.torques.of_parts import torques_of as torques_of
from jaxsat.torques.residual import ResidualTorque as ResidualTorque
from jaxsat.torques.solar_pressure import SolarPressureTorque as SolarPressureTorque
from jaxsat.torques.solar_pressure import solar_pressure_forces as solar_pressure_forces
from jaxsat.torques.solar_pressure import solar_pressure_torque as solar_pressure_torque
