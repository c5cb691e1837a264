"""What results say of an orbit: elements with their sigmas."""

from typing import Any

from fitting.orbit.orbit_fit import ELEMENT_UNITS, OrbitFit

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
