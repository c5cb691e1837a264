"""The satellite of the emergency mode: what Somov 2018 gives, and every number that it does not, in one place.

Given: mass 6500 kg, moments of inertia, a circular orbit of 720 km with its inclination and node, the actuator's 300
A m^2, periods of 1 and 16 s. ASSUMED: the start, 14 October 2018, for which the node of 51 deg gives the paper's angles
of the Sun; errors of navigation and magnetometer; the satellite's surface, of which only solar pressure takes notice.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

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
TURN_ON_DEG, TURN_OFF_DEG = 1.5, 0.3
"""Filtered errors between which the supervisor works; the paper gives 1.5."""
CALM_S = 3000.0
"""For how long the error must stay below `TURN_OFF_DEG`: half an orbit, so that it is not just passing through."""
BODY_M = (3.0, 7.0, 3.0)
"""Edges of the bus along its axes, y up."""
PANEL_M2, PANEL_ARM_M = 15.0, 5.0
"""Area of each of two panels, and how far its middle is from the centre of mass along body z."""
PRESSURE_CENTRE_M = 0.15
"""Height of the bus's middle over the centre of mass, which alone makes pressure turn a symmetrical satellite."""


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
    facets: Facets | None = None


def nominal_vehicle(*, surface: bool = False) -> EmergencyVehicle:
    """The satellite as designed; with a `surface` sunlight presses on it."""
    inertia = jnp.asarray(INERTIA_KG_M2)
    inverse = jnp.asarray(np.linalg.inv(INERTIA_KG_M2))
    return EmergencyVehicle(inertia, inverse, inertia, jnp.eye(3), jnp.eye(3), outer_surface() if surface else None)


def outer_surface() -> Facets:
    """Six faces of the bus and both sides of two panels that look along body x, away from and to the Sun's side."""
    x, y, z = np.array(BODY_M) / 2.0
    axes = np.eye(3)
    normals = [*axes, *-axes, axes[0], -axes[0], axes[0], -axes[0]]
    areas = [4 * y * z, 4 * x * z, 4 * x * y] * 2 + [PANEL_M2] * 4
    up = PRESSURE_CENTRE_M * axes[1]
    centres = [up + half * normal for half, normal in zip((x, y, z) * 2, normals[:6], strict=True)]
    centres += [side * PANEL_ARM_M * axes[2] for side in (1.0, 1.0, -1.0, -1.0)]
    specular, diffuse = np.array([0.3] * 6 + [0.1] * 4), np.array([0.3] * 6 + [0.1] * 4)
    return Facets(np.array(areas), np.array(centres), np.array(normals), specular, diffuse)
