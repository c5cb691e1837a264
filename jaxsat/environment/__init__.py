"""Orbit, magnetic field, Sun, shadow and albedo: all that a satellite meets whatever its attitude."""

from jaxsat.environment.diffuse import DiffuseAlbedo as DiffuseAlbedo
from jaxsat.environment.diffuse import diffuse_albedo as diffuse_albedo
from jaxsat.environment.magnetic import InternalField as InternalField
from jaxsat.environment.magnetic import igrf_coefficients as igrf_coefficients
from jaxsat.environment.magnetic import igrf_field as igrf_field
from jaxsat.environment.magnetic import magnetic_field_eci as magnetic_field_eci
from jaxsat.environment.orbit import KeplerOrbit as KeplerOrbit
from jaxsat.environment.orbit import elements_from_state as elements_from_state
from jaxsat.environment.orbit import orbit_from_elements_km_deg as orbit_from_elements_km_deg
from jaxsat.environment.orbit import orbit_from_perigee_time_km_deg as orbit_from_perigee_time_km_deg
from jaxsat.environment.orbit import solve_kepler as solve_kepler
from jaxsat.environment.shadow import ConeShadow as ConeShadow
from jaxsat.environment.shadow import CylinderShadow as CylinderShadow
from jaxsat.environment.shadow import cone_illumination as cone_illumination
from jaxsat.environment.shadow import cylinder_illumination as cylinder_illumination
from jaxsat.environment.specular import SpecularAlbedo as SpecularAlbedo
from jaxsat.environment.specular import reflection_angle as reflection_angle
from jaxsat.environment.specular import specular_albedo as specular_albedo
from jaxsat.environment.sun import apparent_sun as apparent_sun
from jaxsat.environment.table import LightTable as LightTable
from jaxsat.environment.table import OrbitTable as OrbitTable
from jaxsat.environment.table import tabulate_light as tabulate_light
from jaxsat.environment.table import tabulate_orbit as tabulate_orbit
