"""The key `orbit` of fit.json: whose orbit it is, its elements, and the states at the samples of the attitude."""

from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.cli.orbit import orbit_document
from jaxsat.telemetry.elements.tle_lines import international_designator

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from jaxsat.telemetry.raw_sun.cleaning import Session

FRAME = "true equator and equinox of date"


def orbit_states(session: "Session", orbit_fit: "OrbitFit", t_s: np.ndarray) -> dict[str, Any]:
    """Returns satellite, frame, elements and states at `t_s` [s after the epoch]; SI units and radians."""
    from fitting.orbit.orbit_fit import states

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
