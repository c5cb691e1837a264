"""From the numbers of a satellite file to the satellite that the simulator moves."""

import jax
import numpy as np

from jaxsat.munin import munin_panels, munin_satellite
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.sensors import Albedo
from jaxsat.spacecraft import SolarPanels, Spacecraft


def assembled(satellite: SatelliteNumbers) -> tuple[Spacecraft, Albedo]:
    """The satellite, and the reflectivities of the Earth."""
    craft, inertia = satellite.spacecraft, satellite.spacecraft.inertia_kg_m2
    made = jax.jit(munin_satellite)(
        np.array([inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz]),
        craft.magnet(),
        np.array(craft.rods_A_m2),
        reference_field=np.asarray(craft.reference_field_T),
        panels=assembled_panels(satellite),
    )
    albedo = satellite.albedo
    return made, Albedo(*jax.device_put((np.asarray(albedo.specular), np.asarray(albedo.diffuse))))


def assembled_panels(satellite: SatelliteNumbers) -> SolarPanels:
    """Its panels alone."""
    craft = satellite.spacecraft
    numbers = np.asarray(1e-3 * craft.imax_mA), np.array(craft.gains), np.radians(craft.panel_tilts_deg)
    return jax.jit(munin_panels)(*numbers)
