"""Currents of further panels of any outline in a simulated session: direct light, and the program `mirrKub`."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.errors import InputError
from jaxsat.math import quaternion
from jaxsat.sensors import PolygonPanels, mirror_currents, polygon_panels
from jaxsat.synthetic.settings import SimulationSettings
from jaxsat.synthetic.truth import Truth


def further_panels(settings: SimulationSettings, file: Path | None = None) -> PolygonPanels | None:
    """The panels of `simulate.panel_corners_m`; raises `InputError` naming `file` where one is not flat and convex."""
    corners = settings.panel_corners_m
    if corners is None:
        return None
    try:
        return polygon_panels([np.array(outline) for outline in corners], 1e-3 * settings.panel_density_mA_m2)
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.panel_corners_m") from None


def panel_columns(
    panels: PolygonPanels, truth: Truth, *, earth_radius: float, reflectivity: float
) -> dict[str, np.ndarray]:
    """Returns direct and mirrored currents of each panel at the samples, units in their names.

    `earth_radius` [m] and `reflectivity` are those of the mirror.
    """
    moments = (truth.quaternion, truth.position_eci, truth.sun_eci, truth.illumination)
    direct, mirrored = _currents(panels, moments, earth_radius, reflectivity)
    kinds = {"direct": direct, "mirrored": mirrored}
    return {
        f"{kind}_{k + 1}_mA": 1e3 * np.asarray(values[:, k])
        for k in range(direct.shape[1])
        for kind, values in kinds.items()
    }


@jax.jit
def _currents(panels, moments, radius, reflectivity):
    areas, normals = panels.areas_and_normals()

    def at(q, position, sun_eci, illumination):
        cosine = jnp.maximum(normals @ quaternion.rotate_inverse(q, sun_eci), 0.0)
        mirrored = mirror_currents(q, panels, position, sun_eci, radius, reflectivity)
        return illumination * panels.current_density * areas * cosine, mirrored

    return jax.vmap(at)(*moments)
