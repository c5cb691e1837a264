"""The satellite of the emergency mode: what Somov 2018 gives, and every number that it does not, in one place.

Given: mass 6500 kg, moments of inertia, a circular orbit of 720 km with its inclination and node, the actuator's 300
A m^2, periods of 1 and 16 s, and that the supervisor waits for 1.5 deg.

ASSUMED; `experiments/emergency_mode/assumptions.py` tables what each does to the results:

- the start, 14 October 2018, for which the node of 51 deg gives the paper's angles of the Sun; the satellite is then at
  its node. 13 June gives much the same angles.
- errors of navigation and magnetometer, as below, and their filter: the mean over a control period.
- the gains, which `gains.py` beside it found (`emergency_law`).
- the outer surface and the height of its middle over the centre of mass; of these solar pressure alone takes notice.
- the panels: their hinge along body z with the normal along y at zero (`rotating_panels`), their mass and size. The
  moments given are taken for those at -90 deg.
- the attitude from which the transition begins (`emergency_start`).
- when the supervisor switches off, and that it starts from the filtered error itself.

Left out: the pull of Sun and Moon on the body (1e-9 N m, where 1e-5 count), that of the Earth's oblateness (0.02 deg of
swing), air (4e-6 N m while the Sun is quiet), residual dipoles (4e-5 N m for each A m^2).
"""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.control.emergency_mode.rotating_panels import PARKED, dcm_body_from_panels
from jaxsat.spacecraft import Facets

MASS_KG = 6500.0
INERTIA_KG_M2 = np.diag([11450.0, 7150.0, 9450.0])
"""Panels at -90 deg, where they stay."""
HEIGHT_KM, INCLINATION_DEG, NODE_DEG = 720.0, 98.2695, 51.0
START_UTC = (2018, 10, 14)
MEASUREMENT_PERIOD_S, CONTROL_PERIOD_S = 1.0, 16.0
SAMPLES = 16
"""Measurements of a control period."""
ATTITUDE_SIGMA_DEG, RATE_SIGMA_DEG_S, FIELD_SIGMA_NT = 0.02, 0.002, 100.0
"""1-sigma of one measurement about each axis."""
SIGMAS = (math.radians(ATTITUDE_SIGMA_DEG), math.radians(RATE_SIGMA_DEG_S), 1e-9 * FIELD_SIGMA_NT)
TURN_ON_DEG, TURN_OFF_DEG = 1.5, 0.3
"""Filtered errors between which the supervisor works; the paper gives 1.5."""
CALM_S = 3000.0
"""For how long the error must stay below `TURN_OFF_DEG`: half an orbit, so that it is not just passing through."""
BODY_M = (3.0, 7.0, 3.0)
"""Edges of the bus along its axes, y up."""
PANEL_M, PANEL_ARM_M, PANEL_KG = (3.0, 5.0), 5.0, 60.0
"""Width and length (along body z, the hinge) of each of two panels, how far its middle is from the centre of mass."""
PRESSURE_CENTRE_M = 0.15
"""Height of the bus's middle over the centre of mass, which alone makes pressure turn a symmetrical satellite."""
BUS_MIRROR, BUS_DIFFUSE, PANEL_MIRROR, PANEL_DIFFUSE = 0.3, 0.3, 0.1, 0.1
"""Shares of sunlight reflected as by a mirror and scattered."""
PANEL_FACETS = 4
"""Both sides of two panels."""


class EmergencyVehicle(eqx.Module):
    """What is true of one satellite, and what its computer takes for true."""

    inertia: Float[Array, "3 3"]
    """[kg m^2]"""
    inverse_inertia: Float[Array, "3 3"]
    assumed_inertia: Float[Array, "3 3"]
    field_error: Float[Array, "3 3"]
    """True field over that of the table, as a matrix in inertial axes."""
    magnetometer_error: Float[Array, "3 3"]
    """What the magnetometer shows over the true field, as a matrix in body axes."""
    panel_inertia: Float[Array, "3 3"]
    """Of one panel in its own axes (normal y, hinge z), about the hinge's point at the centre of mass [kg m^2]."""
    sigmas: Float[Array, "3"]
    """1-sigma of one measurement about each axis: attitude [rad], rate [rad/s], field [T]."""
    facets: Facets | None = None
    """Outer surface with the panels at -90 deg; theirs are the last `PANEL_FACETS`."""


def nominal_vehicle(
    *,
    surface: bool = False,
    inertia_kg_m2: Float[np.ndarray, "3 3"] = INERTIA_KG_M2,
    sigmas: tuple[float, float, float] = SIGMAS,
) -> EmergencyVehicle:
    """The satellite as designed; with a `surface` sunlight presses on it.

    `sigmas` are those of one measurement: attitude [rad], rate [rad/s], field [T].
    """
    inertia = jnp.asarray(inertia_kg_m2)
    inverse = jnp.asarray(np.linalg.inv(inertia_kg_m2))
    panel = jnp.asarray(panel_inertia())
    facets = outer_surface() if surface else None
    return EmergencyVehicle(inertia, inverse, inertia, jnp.eye(3), jnp.eye(3), panel, jnp.asarray(sigmas), facets)


def panel_inertia() -> Float[np.ndarray, "3 3"]:
    """Of one panel as a uniform plate, in its own axes; the arm's part, which no angle changes, is left out."""
    width, length = PANEL_M
    return PANEL_KG / 12.0 * np.diag([length**2, width**2 + length**2, width**2])


def outer_surface(
    *, pressure_centre_m: float = PRESSURE_CENTRE_M, panel_share: float = 1.0, mirror: float = BUS_MIRROR
) -> Facets:
    """Six faces of the bus and both sides of two panels that look along body x, away from and to the Sun's side.

    `panel_share` scales the panels' area; `mirror` is the specular share of the bus's faces.
    """
    x, y, z = np.array(BODY_M) / 2.0
    axes = np.eye(3)
    normals = [*axes, *-axes, axes[0], -axes[0], axes[0], -axes[0]]
    areas = [4 * y * z, 4 * x * z, 4 * x * y] * 2 + [panel_share * PANEL_M[0] * PANEL_M[1]] * PANEL_FACETS
    up = pressure_centre_m * axes[1]
    centres = [up + half * normal for half, normal in zip((x, y, z) * 2, normals[:6], strict=True)]
    centres += [side * PANEL_ARM_M * axes[2] for side in (1.0, 1.0, -1.0, -1.0)]
    specular = np.array([mirror] * 6 + [PANEL_MIRROR] * PANEL_FACETS)
    diffuse = np.array([BUS_DIFFUSE] * 6 + [PANEL_DIFFUSE] * PANEL_FACETS)
    return Facets(np.array(areas), np.array(centres), np.array(normals), specular, diffuse)


def turned_panels(facets: Facets, angle: Float[Array, ""]) -> Facets:
    """The surface with its panels at an angle [rad] instead of -90 deg."""
    turn = dcm_body_from_panels(angle - PARKED)
    kept = len(facets.areas) - PANEL_FACETS

    def turned(vectors):
        return jnp.concatenate([vectors[:kept], vectors[kept:] @ turn.T])

    return eqx.tree_at(lambda f: (f.centers, f.normals), facets, (turned(facets.centers), turned(facets.normals)))
