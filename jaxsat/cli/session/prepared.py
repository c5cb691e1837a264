"""From a file to what a fit starts from: cleaned session, elements of its orbit, how it is called in results."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from jaxsat.cli.settings.sections import Config
    from jaxsat.telemetry.raw_sun.cleaning import Session

BUNDLED = Path(__file__).parents[2] / "data" / "munin" / "b-specular50.RAW_SUN"
"""The session taken where no file is given. All sessions beside it are synthetic, and results say so."""


@dataclass(frozen=True)
class PreparedSession:
    """A session after cleaning, with the orbit fitted to its positions or given by the configuration."""

    session: "Session"
    orbit_fit: "OrbitFit"
    telemetry: str
    """The file as results name it: the path as given, or the bundled file's name with the word synthetic."""
    label: str
    """The same for titles, short."""

    @property
    def subtitle(self) -> str:
        """Line below the titles of pictures and reports."""
        return f"{self.label}, epoch {self.session.epoch.iso(3)} UTC"


def prepare_session(path: Path, config: "Config") -> PreparedSession:
    """Reads and cleans a RAW_SUN file and fits its orbit, or takes the given one; raises `InputError`."""
    from fitting.orbit.orbit_fit import fit_orbit, given_orbit
    from jaxsat.constants import EARTH_MU
    from jaxsat.telemetry.raw_sun.cleaning import clean
    from jaxsat.telemetry.raw_sun.reading import read_raw_sun

    session = clean(read_raw_sun(path), config.cleaning_settings())
    if config.time.zero_s:
        session = session.with_time_zero(config.time.zero_s)
    elements = config.orbit.elements(EARTH_MU)
    if elements is None:
        orbit_fit = fit_orbit(session.t_s, session.position_eci_m, session.velocity_eci_m_s, file=path)
    else:
        orbit_fit = given_orbit(elements, session.t_s, session.position_eci_m)
    bundled = path.resolve().parent == BUNDLED.resolve().parent
    telemetry = f"{path.name} (bundled, synthetic)" if bundled else str(path)
    label = f"{session.name} (bundled, synthetic)" if bundled else session.name
    return PreparedSession(session, orbit_fit, telemetry, label)
