"""What a session happens in: its orbit, the field, the Earth's turn and the Sun, found or given."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit, fit_orbit, given_orbit
from jaxsat.constants import EARTH_MU
from jaxsat.environment import igrf_field
from jaxsat.environment.orbit import AbstractOrbit
from jaxsat.errors import InputError
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.orbit import orbit_for
from jaxsat.time import Epoch, greenwich_angle


def surroundings(
    satellite: Satellite, session: TableSession, given: Given | None = None
) -> tuple[Around, OrbitFit | None]:
    """Those of a session, and the fit of its orbit where it is an ellipse through positions, or given for one.

    Raises `InputError` where the orbit cannot be found.
    """
    given = given or Given()
    ellipse = _ellipse(satellite, session, given)
    orbit = orbit_for(satellite, session) if ellipse is None else ellipse.orbit
    return around_of(satellite, orbit, session.epoch, given, ellipse, sun=given.sun.direction_eci), ellipse


def around_of(
    satellite: Satellite,
    orbit: AbstractOrbit,
    epoch: Epoch,
    given: Given | None = None,
    ellipse: OrbitFit | None = None,
    *,
    sun: Sequence[float] | np.ndarray | None = None,
) -> Around:
    """What surrounds a satellite on its orbit; `sun` is a fixed unit vector in place of the true one."""
    given = given or Given()
    craft, earth = satellite.model.spacecraft, given.earth
    return Around(
        orbit,
        igrf_field(epoch.decimal_year()),
        np.asarray(greenwich_of(given, epoch, ellipse)),
        np.asarray(earth.rotation_rate_rad_s),
        np.asarray(1e3 * earth.radius_km),
        field_rate=craft.hysteresis_rods is not None,
        pushed=craft.facets is not None,
        sharp=satellite.shadow == "cylinder",
        fixed_sun=None if sun is None else np.asarray(sun, float),
    )


def _ellipse(satellite: Satellite, session: TableSession, given: Given) -> OrbitFit | None:
    columns = satellite.orbit.columns
    asked = columns is not None and columns.law == "kepler" and session.velocities is not None
    if not asked and given.orbit.elements(EARTH_MU) is None:
        return None
    if session.positions is None:
        reason = "elements that are given take the place of positions, which the table has not: put them under [orbit]"
        raise InputError(reason, file=satellite.path, field="orbit")
    return ellipse_of(given, *session.positions, session.velocities, file=session.paths[0])


def ellipse_of(
    given: Given, t_s: np.ndarray, position_eci_m: np.ndarray, velocity_eci_m_s: np.ndarray | None, *, file: Path
) -> OrbitFit:
    """The ellipse that is given, or fitted to positions and velocities; raises `InputError` of the `file`."""
    elements = given.orbit.elements(EARTH_MU)
    if elements is not None:
        return given_orbit(elements, t_s, position_eci_m)
    assert velocity_eci_m_s is not None
    return fit_orbit(t_s, position_eci_m, velocity_eci_m_s, file=file)


def greenwich_of(given: Given, epoch: Epoch, ellipse: OrbitFit | None) -> float:
    """Right ascension of Greenwich at the epoch [rad], given there or at perigee, or found."""
    # The passage that the user means, which need not be the first after t = 0.
    perigee_s = given.orbit.time_of_perigee_s
    if perigee_s is None:
        perigee_s = None if ellipse is None else ellipse.time_of_perigee_s
    angle = given.earth.greenwich_angle(perigee_s)
    return greenwich_angle(epoch) if angle is None else angle
