"""A RAW_SUN session with its orbit, the Earth's rotation and the Sun, for what works on its samples one by one."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit
from fitting.surroundings import ellipse_of, greenwich_of
from jaxsat.bundled import told_names
from jaxsat.environment import igrf_field, sun_directions
from jaxsat.errors import InputError
from jaxsat.given import Given
from jaxsat.telemetry import Session, check_usable


@dataclass(frozen=True)
class PreparedSession:
    """A session with its orbit, fitted to its positions or given, and with what else is given in place of found."""

    session: Session
    orbit_fit: OrbitFit
    given: Given = Given()

    @property
    def telemetry(self) -> str:
        """The file as results name it: the path as given, or the bundled file's name with the word synthetic."""
        return told_names(self.session.path)[0]

    @property
    def label(self) -> str:
        """The same for titles, short."""
        return told_names(self.session.path)[1]

    @property
    def subtitle(self) -> str:
        """Line below the titles of pictures and reports."""
        return f"{self.label}, epoch {self.session.epoch.iso(3)} UTC"

    @property
    def greenwich_angle(self) -> float:
        """Of the Earth at t = 0 [rad]."""
        return greenwich_of(self.given, self.session.epoch, self.orbit_fit)

    def sun_eci(self, t_s: np.ndarray) -> np.ndarray:
        """[time 3] unit vectors to the Sun."""
        return sun_directions(self.session.epoch, t_s, fixed=self.given.sun.direction_eci)

    @property
    def around(self) -> Around:
        """What the session happens in; the Earth's shadow has a sharp edge."""
        earth, session = self.given.earth, self.session
        return Around(
            self.orbit_fit.orbit,
            igrf_field(session.epoch.decimal_year()),
            np.asarray(self.greenwich_angle),
            np.asarray(earth.rotation_rate_rad_s),
            np.asarray(1e3 * earth.radius_km),
            sharp=True,
        )

    def within(self, arc_s: tuple[float, float] | None = None) -> np.ndarray:
        """[time] bool: samples of an arc [t0, t1], of all by default; `InputError` where none has light."""
        session = self.session
        inside = np.ones(len(session.t_s), bool)
        if arc_s is not None:
            begin, end = arc_s
            inside = (session.t_s >= begin) & (session.t_s <= end)
            if not inside.any():
                raise InputError(
                    f"no sample between {begin:g} and {end:g} s; the session runs from {session.t_s[0]:g} to "
                    f"{session.t_s[-1]:g} s",
                    file=session.path,
                    field="arc",
                )
        check_usable(replace(session, t_s=session.t_s[inside], currents_mA=session.currents_mA[inside]))
        return inside


def prepare_session(session: Session, given: Given | None = None) -> PreparedSession:
    """Fits the orbit of a cleaned session, or takes the given one; raises `InputError`."""
    given = given or Given()
    if given.time.zero_s:
        session = session.with_time_zero(given.time.zero_s)
    states = (session.t_s, session.position_eci_m, session.velocity_eci_m_s)
    return PreparedSession(session, ellipse_of(given, *states, file=session.path), given)
