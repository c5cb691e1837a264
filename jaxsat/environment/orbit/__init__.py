"""Orbits: Kepler's ellipse, states joined by polynomials, element sets through SGP4, numerical propagation."""

from jaxsat.environment.orbit.abstract import AbstractOrbit as AbstractOrbit
from jaxsat.environment.orbit.accelerations import MOON_MU as MOON_MU
from jaxsat.environment.orbit.accelerations import SUN_MU as SUN_MU
from jaxsat.environment.orbit.accelerations import AbstractAcceleration as AbstractAcceleration
from jaxsat.environment.orbit.accelerations import CentralGravity as CentralGravity
from jaxsat.environment.orbit.accelerations import Drag as Drag
from jaxsat.environment.orbit.accelerations import HarmonicGravity as HarmonicGravity
from jaxsat.environment.orbit.accelerations import SolarPressure as SolarPressure
from jaxsat.environment.orbit.accelerations import ThirdBody as ThirdBody
from jaxsat.environment.orbit.kepler import KeplerOrbit as KeplerOrbit
from jaxsat.environment.orbit.kepler import classical_elements as classical_elements
from jaxsat.environment.orbit.kepler import dcm_eci_from_perifocal as dcm_eci_from_perifocal
from jaxsat.environment.orbit.kepler import orbit_from_elements_km_deg as orbit_from_elements_km_deg
from jaxsat.environment.orbit.kepler import orbit_from_perigee_time_km_deg as orbit_from_perigee_time_km_deg
from jaxsat.environment.orbit.kepler import solve_kepler as solve_kepler
from jaxsat.environment.orbit.mean_elements import elements_epoch as elements_epoch
from jaxsat.environment.orbit.mean_elements import sgp4_orbit as sgp4_orbit
from jaxsat.environment.orbit.moving_axes import FrameMotion as FrameMotion
from jaxsat.environment.orbit.moving_axes import frame_motion as frame_motion
from jaxsat.environment.orbit.numerical import propagate_orbit as propagate_orbit
from jaxsat.environment.orbit.sampled import SampledOrbit as SampledOrbit
from jaxsat.environment.orbit.sampled import sample_orbit as sample_orbit
from jaxsat.environment.orbit.through_state import StateOrbit as StateOrbit
from jaxsat.environment.orbit.through_state import elements_from_state as elements_from_state
