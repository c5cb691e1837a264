"""The nominal model of a fit in SI: where its parameters start and what their priors are about."""

from dataclasses import dataclass, field

import numpy as np

from fitting.parameters.names import TILTS
from jaxsat.satellites import SatelliteNumbers


@dataclass(frozen=True)
class Nominal:
    """Nominal model, SI: the values of what is not free, and the centre of the priors of what is."""

    magnet: np.ndarray
    """[3] body axes [A m^2]."""
    rods: np.ndarray
    """[2] moments of the y and z rods in the reference field [A m^2]."""
    reference_field: float
    """[T]"""
    inertia: np.ndarray
    """[6] xx yy zz xy xz yz [kg m^2]."""
    max_current: float
    """[A]"""
    gains: np.ndarray
    """[6] +x -x +y -y +z -z."""
    albedo: np.ndarray
    """[2] specular, diffuse."""
    tilts: np.ndarray = field(default_factory=lambda: np.zeros(len(TILTS)))
    """[12] turns of the panels +x -x +y -y +z -z off their places, as `TILTS` names them [rad]."""

    def vector(self) -> np.ndarray:
        """Values in the order of `MODEL`."""
        parts = [self.magnet, self.rods, self.inertia, [self.max_current], self.gains, self.albedo, self.tilts]
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])


def nominal_model(satellite: SatelliteNumbers) -> Nominal:
    """The satellite of a file or a configuration."""
    craft, inertia = satellite.spacecraft, satellite.spacecraft.inertia_kg_m2
    return Nominal(
        magnet=craft.magnet(),
        rods=np.array(craft.rods_A_m2),
        reference_field=craft.reference_field_T,
        inertia=np.array([inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz]),
        max_current=1e-3 * craft.imax_mA,
        gains=np.array(craft.gains),
        albedo=np.array([satellite.albedo.specular, satellite.albedo.diffuse]),
        tilts=np.radians(craft.panel_tilts_deg).ravel(),
    )
