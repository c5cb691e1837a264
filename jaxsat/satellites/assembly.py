"""From the numbers of a satellite file to the satellite that the simulator moves."""

import jax
import numpy as np

from jaxsat.munin import munin_panels, munin_satellite
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.sensors import Albedo
from jaxsat.spacecraft import Spacecraft


def assembled(satellite: SatelliteNumbers) -> tuple[Spacecraft, Albedo]:
    """The satellite, and the reflectivities of the Earth."""
    craft, inertia = satellite.spacecraft, satellite.spacecraft.inertia_kg_m2
    return _assembled(
        {
            "inertia": np.array([inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz]),
            "magnet": craft.magnet(),
            "rods": np.array(craft.rods_A_m2),
            "reference_field": np.asarray(craft.reference_field_T),
        },
        (np.asarray(1e-3 * craft.imax_mA), np.array(craft.gains), np.radians(craft.panel_tilts_deg)),
        (np.asarray(satellite.albedo.specular), np.asarray(satellite.albedo.diffuse)),
    )


@jax.jit
def _assembled(numbers, panels, albedo):
    return munin_satellite(**numbers, panels=munin_panels(*panels)), Albedo(*albedo)
