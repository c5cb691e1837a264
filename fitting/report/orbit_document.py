"""What results say of an orbit: elements with their sigmas, and the states at the samples of an attitude."""

from typing import Any

import numpy as np

from fitting.orbit.orbit_fit import ELEMENT_UNITS, OrbitFit, states
from jaxsat.telemetry import Session
from jaxsat.telemetry.elements.tle_lines import international_designator

FRAME = "true equator and equinox of date"


def orbit_document(fit: OrbitFit) -> dict[str, Any]:
    """Returns elements with their sigmas, and what follows from them; SI units and radians."""
    return {
        "elements": elements_document(fit),
        "time_of_perigee_s": fit.time_of_perigee_s,
        "argument_of_latitude_rad": fit.argument_of_latitude,
        "position_residual_rms_m": {"before": fit.rms_before_m, "after": fit.rms_after_m},
    }


def elements_document(fit: OrbitFit) -> dict[str, dict[str, Any]]:
    """Returns the elements with their sigmas and units, as results have them: SI and radians."""
    return {
        name: {"value": fit.elements[name], "sigma": fit.sigma[name], "unit": unit}
        for name, unit in ELEMENT_UNITS.items()
    }


def orbit_states(session: Session, orbit_fit: OrbitFit, t_s: np.ndarray) -> dict[str, Any]:
    """Returns satellite, frame, elements and states at `t_s` [s after the epoch]; SI units and radians."""
    position, velocity = states(orbit_fit.orbit, t_s)
    return {
        "object_name": session.raw.satellite,
        "object_id": international_designator(session.raw.tle[0]),
        "frame": FRAME,
        "message": orbit_fit.message,
        **orbit_document(orbit_fit),
        "position_eci_m": np.round(position, 3),
        "velocity_eci_m_s": np.round(velocity, 6),
    }
