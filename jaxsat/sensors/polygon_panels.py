"""Panels of any flat outline, anywhere on the satellite, and the light of a mirror Earth on them (`mirrKub`)."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.environment import mirrored_area
from jaxsat.math import cross, quaternion, safe_norm, unit
from jaxsat.spacecraft import SolarPanels

_FLAT = 1e-6
"""Largest distance of a corner from the panel's plane, over the panel's size."""


class PolygonPanels(eqx.Module):
    """Flat convex panels by their corners; made by `polygon_panels`, which checks them."""

    corners: Float[Array, "panels corners 3"]
    """From the satellite's centre, body axes [m], counter-clockwise seen from the side that works.

    A panel with fewer corners than another repeats its last one, which adds nothing to its area.
    """
    current_density: Float[Array, " panels"]
    """Current of direct sunlight at right angles [A/m^2]."""

    def areas_and_normals(self) -> tuple[Float[Array, " panels"], Float[Array, "panels 3"]]:
        """Areas [m^2] and outward unit normals, body axes."""
        sides = self.corners[:, 1:] - self.corners[:, :1]
        doubled = jnp.sum(cross(sides[:, :-1], sides[:, 1:]), axis=1)
        return 0.5 * safe_norm(doubled), unit(doubled)

    def flat(self) -> SolarPanels:
        """The same panels as models of parallel light have them: their size is in the gains, their place is lost."""
        areas, normals = self.areas_and_normals()
        full = self.current_density * areas
        return SolarPanels(normals, jnp.max(full), full / jnp.max(full))


def polygon_panels(corners: Sequence[np.ndarray], current_density: float | Sequence[float]) -> PolygonPanels:
    """Panels from the corners [k 3] of each [m] and their current per area in direct sunlight [A/m^2].

    Raises ValueError where a panel has fewer than three corners, is not flat to 1e-6 of its size, or is not convex.
    """
    outlines = [np.asarray(outline, float) for outline in corners]
    for number, outline in enumerate(outlines):
        _check(number, outline)
    most = max(len(outline) for outline in outlines)
    padded = [np.concatenate([o, np.repeat(o[-1:], most - len(o), axis=0)]) for o in outlines]
    density = jnp.broadcast_to(jnp.asarray(current_density, float), (len(outlines),))
    return PolygonPanels(jnp.asarray(np.stack(padded)), density)


def _check(number: int, outline: np.ndarray) -> None:
    where = f"polygon_panels: panel {number}"
    if outline.ndim != 2 or outline.shape[1] != 3 or len(outline) < 3:
        raise ValueError(f"{where}: expected three or more corners of three coordinates, got shape {outline.shape}")
    if not np.all(np.isfinite(outline)):
        raise ValueError(f"{where}: expected finite corners")
    sides = np.roll(outline, -1, axis=0) - outline
    turns = np.cross(sides, np.roll(sides, -1, axis=0))
    normal = np.sum(np.cross(outline - outline[0], np.roll(outline, -1, axis=0) - outline[0]), axis=0)
    size, twice_area = float(np.max(np.linalg.norm(outline - outline[0], axis=1))), float(np.linalg.norm(normal))
    if not twice_area > 1e-12 * size**2:
        raise ValueError(f"{where}: its corners lie on a line")
    normal /= twice_area
    off = float(np.max(np.abs((outline - outline[0]) @ normal)))
    if off > _FLAT * size:
        raise ValueError(f"{where}: not flat: a corner is {off:.3g} m out of its plane")
    if np.any(turns @ normal < -1e-9 * size**2):
        raise ValueError(f"{where}: not convex: its outline turns back at corner {int(np.argmin(turns @ normal)) + 1}")
    # Once round: a star turns always the same way, but more than once.
    angles = np.arctan2(turns @ normal, np.sum(sides * np.roll(sides, -1, axis=0), axis=1))
    if abs(float(np.sum(angles)) - 2.0 * np.pi) > 1e-6:
        raise ValueError(f"{where}: its outline crosses itself")


def mirror_currents(
    q_inertial_from_body: Float[Array, "4"],
    panels: PolygonPanels,
    position_eci: Float[Array, "3"],
    sun_eci: Float[Array, "3"],
    radius: float | Float[Array, ""],
    reflectivity: float | Float[Array, ""] = 1.0,
) -> Float[Array, " panels"]:
    """Currents from sunlight that an Earth of `radius` [m] and `reflectivity` mirrors onto the panels [A].

    Corner by corner, so each panel's outline, tilt and place count (Penkov et al. 2009, sec. 3.5); see
    `mirrored_area`. Exactly zero on panels that the light meets from behind and beyond the mirror's terminator. One
    panel's shadow on another is not modelled.
    """
    corners_eci = quaternion.rotate(q_inertial_from_body, panels.corners)
    areas = jax.vmap(lambda corners: mirrored_area(position_eci, corners, sun_eci, radius))(corners_eci)
    return reflectivity * panels.current_density * areas
