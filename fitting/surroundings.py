"""What a session happens in: its orbit, the field, the Earth's turn and the Sun, found or given."""

import numpy as np

from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit, fit_orbit, given_orbit
from jaxsat.constants import EARTH_MU
from jaxsat.environment import igrf_field
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.orbit import orbit_for
from jaxsat.time import greenwich_angle


def surroundings(
    satellite: Satellite, session: TableSession, given: Given | None = None
) -> tuple[Around, OrbitFit | None]:
    """Those of a session, and the fit of its orbit where it is an ellipse through positions, or given for one.

    Raises `InputError` where the orbit cannot be found.
    """
    given = given or Given()
    ellipse = _ellipse(satellite, session, given)
    craft, earth = satellite.model.spacecraft, given.earth
    around = Around(
        orbit_for(satellite, session) if ellipse is None else ellipse.orbit,
        igrf_field(session.epoch.decimal_year()),
        np.asarray(_greenwich_angle(session, given, ellipse)),
        np.asarray(earth.rotation_rate_rad_s),
        np.asarray(1e3 * earth.radius_km),
        field_rate=craft.hysteresis_rods is not None,
        pushed=craft.facets is not None,
        sharp=satellite.shadow == "cylinder",
        fixed_sun=None if given.sun.direction_eci is None else np.asarray(given.sun.direction_eci),
    )
    return around, ellipse


def _ellipse(satellite: Satellite, session: TableSession, given: Given) -> OrbitFit | None:
    elements, columns = given.orbit.elements(EARTH_MU), satellite.orbit.columns
    if session.positions is None:
        return None
    if elements is not None:
        return given_orbit(elements, *session.positions)
    if columns is None or columns.law != "kepler" or session.velocities is None:
        return None
    return fit_orbit(*session.positions, session.velocities, file=session.paths[0])


def _greenwich_angle(session: TableSession, given: Given, ellipse: OrbitFit | None) -> float:
    """At t = 0 [rad]."""
    # The passage that the user means, which need not be the first after t = 0.
    perigee_s = given.orbit.time_of_perigee_s
    if perigee_s is None:
        perigee_s = 0.0 if ellipse is None else ellipse.time_of_perigee_s
    angle = given.earth.greenwich_angle(perigee_s)
    return greenwich_angle(session.epoch) if angle is None else angle
