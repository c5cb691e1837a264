"""From the numbers of a satellite file to the satellite that the simulator moves."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.sensors import Albedo
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor, tilted


def assembled(satellite: SatelliteNumbers) -> tuple[Spacecraft, Albedo]:
    """The satellite, and the reflectivities of the Earth."""
    craft, inertia = satellite.spacecraft, satellite.spacecraft.inertia_kg_m2
    numbers = [inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz]
    made = Spacecraft(
        inertia=symmetric_tensor(jnp.asarray(np.array(numbers))),
        magnet=jnp.asarray(craft.magnet()),
        rods=MagneticRods(jnp.asarray(np.array(craft.rods_A_m2)), jnp.eye(3)[1:], jnp.asarray(craft.reference_field_T)),
        panels=SolarPanels(
            _normals(jnp.asarray(np.radians(craft.panel_tilts_deg))),
            jnp.asarray(1e-3 * craft.imax_mA),
            jnp.asarray(np.array(craft.gains)),
        ),
    )
    return made, Albedo(jnp.asarray(satellite.albedo.specular), jnp.asarray(satellite.albedo.diffuse))


@jax.jit
def _normals(tilts):
    return tilted(box_normals(), tilts)
