"""The orbit of a satellite over a session, from what its file names: element sets, ephemeris, elements, positions."""

import math
from pathlib import Path

import erfa
import numpy as np
from scipy.interpolate import KroghInterpolator
from sgp4.alpha5 import from_alpha5
from sgp4.api import Satrec

from jaxsat.constants import EARTH_MU
from jaxsat.environment import AbstractOrbit, KeplerOrbit, SampledOrbit, sgp4_orbit
from jaxsat.environment.orbit.mean_elements import true_from_teme
from jaxsat.environment.orbit.sampled import LEAST_INTERVALS
from jaxsat.errors import InputError
from jaxsat.frames import dcms_eci_from_gcrf
from jaxsat.math.sizes import few_sizes
from jaxsat.satellites.satellite import Satellite
from jaxsat.satellites.sections.session import Elements
from jaxsat.telemetry.ccsds.oem import OrbitEphemeris, read_oem
from jaxsat.telemetry.elements.element_sets import ElementSet, nearest_element_set, read_element_sets
from jaxsat.telemetry.elements.tle_lines import check_tle_lines
from jaxsat.telemetry.table.axes import from_earth_fixed
from jaxsat.telemetry.table.positions import orbit_through
from jaxsat.telemetry.table.session import TableSession
from jaxsat.time import Epoch

MARGIN_S = 60.0
"""The orbit is known so long before the first stamp and after the last: a clock may be found to be off."""
_STEP_S = 60.0
_NODES = 4


def orbit_for(satellite: Satellite, session: TableSession, *, margin: float = MARGIN_S) -> AbstractOrbit:
    """Returns the orbit, true equator and equinox of date, over the session and a margin [s] on both sides.

    Of several element sets the one nearest to the middle of the session is taken. Raises `InputError` with the file
    where it is none, or does not reach over the session.
    """
    first, last = session.span_s
    start, stop = first - margin, last + margin
    columns = satellite.orbit.columns
    if columns is None:
        return orbit_over(satellite, session.epoch, start, stop)
    if session.positions is None:
        raise InputError("holds no positions", file=session.paths[0], field=columns.position[0])
    return orbit_through(*session.positions, start=start, stop=stop, file=session.paths[0])


def orbit_over(satellite: Satellite, epoch: Epoch, start: float, stop: float) -> AbstractOrbit:
    """The same between two times [s] after an epoch, of a satellite whose positions no table has to tell."""
    settings = satellite.orbit
    if settings.elements is not None:
        return _kepler(settings.elements, epoch)
    if settings.oem is not None:
        path = beside(satellite, settings.oem)
        return _from_ephemeris(read_oem(path), epoch, start, stop, path)
    elements = element_set_at(satellite, epoch.shifted(0.5 * (start + stop)))
    if elements is None:
        raise InputError("the positions are those of a table", file=satellite.path, field="orbit.columns")
    try:
        return sgp4_orbit(elements.satellite, epoch, start=start, stop=stop)
    except ValueError as error:
        raise InputError(str(error), file=satellite.path, row=elements.row, field="orbit") from None


def element_set_for(satellite: Satellite, session: TableSession) -> ElementSet | None:
    """The element set that the orbit is made of; None where it comes from something else."""
    return element_set_at(satellite, session.epoch.shifted(0.5 * sum(session.span_s)))


def element_set_at(satellite: Satellite, instant: Epoch | None) -> ElementSet | None:
    """The element set nearest to an instant, the first without one; None where the orbit has another source."""
    settings = satellite.orbit
    source = settings.tle if settings.tle is not None else settings.omm
    if source is None:
        return None
    if isinstance(source, tuple):
        try:
            check_tle_lines(source, file=satellite.path)
        except InputError as error:
            raise InputError(error.reason, file=satellite.path, field=f"orbit.tle: {error.field}") from None
        line = source[0]
        number = from_alpha5(line[2:7].replace(" ", "0"))
        return ElementSet(satellite.name, number, Satrec.twoline2rv(*source), None)
    found = read_element_sets(beside(satellite, source))
    return found[0] if instant is None else nearest_element_set(found, instant)


def beside(satellite: Satellite, name: str) -> Path:
    """A file that the satellite file names, looked for beside it."""
    return satellite.path.parent / name


def _kepler(elements: Elements, epoch: Epoch) -> KeplerOrbit:
    semi_major_axis = 1e3 * elements.a_km
    elapsed = epoch.seconds_since(Epoch.from_iso(elements.epoch))
    mean_motion = math.sqrt(EARTH_MU / semi_major_axis**3)
    return KeplerOrbit(
        semi_major_axis=semi_major_axis,
        eccentricity=elements.e,
        inclination=math.radians(elements.i_deg),
        raan=math.radians(elements.raan_deg),
        argument_of_perigee=math.radians(elements.argp_deg),
        mean_anomaly=math.remainder(math.radians(elements.mean_anomaly_deg) + mean_motion * elapsed, 2.0 * math.pi),
    )


def _from_ephemeris(
    segments: list[OrbitEphemeris], epoch: Epoch, start: float, stop: float, path: Path
) -> SampledOrbit:
    for segment in segments:
        t = segment.epoch.seconds_since(epoch) + segment.t_s
        if t[0] <= start and t[-1] >= stop:
            break
    else:
        shown = " to ".join(epoch.shifted(each).iso(0) for each in (start, stop))
        reason = f"no segment reaches over the session with its margins, {shown} UTC"
        raise InputError(reason, file=path)
    if segment.center_name.upper() != "EARTH":
        raise InputError(
            f"expected an orbit about the Earth, found {segment.center_name}", file=path, field="CENTER_NAME"
        )
    if t.size < _NODES:
        raise InputError(f"expected at least {_NODES} states in a segment, found {t.size}", file=path)
    inside = np.flatnonzero((t > start) & (t < stop))
    low, high = inside[0] - _NODES if inside.size else 0, inside[-1] + _NODES + 1 if inside.size else t.size
    used = slice(max(int(low), 0), min(int(high), t.size))
    position, velocity = _to_date(segment, epoch, t[used], used, path)
    count = few_sizes(max(math.ceil((stop - start) / _STEP_S), _NODES), LEAST_INTERVALS)
    grid = np.linspace(start, stop, count + 1)
    return SampledOrbit(start, (stop - start) / count, *_resampled(grid, t[used], position, velocity))


def _to_date(
    segment: OrbitEphemeris, epoch: Epoch, t: np.ndarray, used: slice, path: Path
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities as true equator and equinox of date."""
    position, velocity = segment.position_m[used], segment.velocity_m_s[used]
    frame = segment.frame.upper()
    if frame in ("TOD", "TOD_EARTH") and segment.frame_epoch is None:
        return position, velocity
    if frame in ("GCRF", "ICRF", "EME2000", "J2000"):
        dcm = dcms_eci_from_gcrf(epoch, t)
        if frame in ("EME2000", "J2000"):
            bias, _, _ = erfa.bp06(2451545.0, 0.0)
            dcm = dcm @ bias.T
        return np.einsum("nij,nj->ni", dcm, position), np.einsum("nij,nj->ni", dcm, velocity)
    if frame == "TEME" and segment.frame_epoch is None:
        return true_from_teme(position, velocity, epoch, t)
    if frame.startswith("ITRF") or frame in ("ECEF", "WGS84"):
        return from_earth_fixed(epoch, t, position, velocity)
    reason = f"expected GCRF, ICRF, EME2000, TOD, TEME or ITRF without a REF_FRAME_EPOCH, found {segment.frame[:24]}"
    raise InputError(reason, file=path, field="REF_FRAME")


def _resampled(
    grid: np.ndarray, t: np.ndarray, position: np.ndarray, velocity: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """States at other times: at each the polynomial of degree seven through the four nearest and their velocities."""
    first = np.clip(np.searchsorted(t, grid) - _NODES // 2, 0, t.size - _NODES)
    states = np.empty((2, grid.size, 3))
    for low in np.unique(first):
        near, here = slice(low, low + _NODES), first == low
        nodes = np.repeat(t[near], 2)
        both = np.stack([position[near], velocity[near]], axis=1).reshape(-1, 3)
        curve = KroghInterpolator(nodes - nodes[0], both)
        states[:, here] = curve.derivatives(grid[here] - nodes[0], der=2)
    return states[0], states[1]
