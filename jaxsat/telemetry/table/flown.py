"""Where and since when a satellite flies without a table: its orbit from another file, and its first instant."""

import dataclasses
import math
from pathlib import Path

from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.satellites.sections.session import OrbitSettings
from jaxsat.telemetry.ccsds.oem import read_oem
from jaxsat.telemetry.table.orbit import MARGIN_S, beside, element_set_at
from jaxsat.time import Epoch

_OEM_MARKS = (b"CCSDS_OEM_VERS", b"<oem")
_HEAD_BYTES = 4096


def with_orbit(satellite: Satellite, path: Path) -> Satellite:
    """The satellite on the orbit of a file: element sets (TLE, OMM), or an ephemeris (OEM), told by what it holds."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    place = str(path.absolute())
    ephemeris = any(mark in head for mark in _OEM_MARKS)
    return dataclasses.replace(satellite, orbit=OrbitSettings(oem=place) if ephemeris else OrbitSettings(tle=place))


def first_instant(satellite: Satellite, start_utc: str | None = None) -> Epoch:
    """Instant of t = 0: the given one, that from which stamps count seconds, or the epoch of the orbit's elements.

    Of element sets the whole second after the first one's epoch, of an ephemeris after its beginning.
    """
    orbit, given = satellite.orbit, start_utc or satellite.time.epoch
    if given is not None:
        return Epoch.from_iso(given)
    if orbit.columns is not None:
        reason = "the positions are in the table that is to be made: give the orbit as elements or as an ephemeris"
        raise InputError(reason, file=satellite.path, field="orbit.columns")
    if orbit.elements is not None:
        return Epoch.from_iso(orbit.elements.epoch)
    if orbit.oem is not None:
        segment = read_oem(beside(satellite, orbit.oem))[0]
        found = segment.epoch.shifted(float(segment.t_s[0]) + MARGIN_S)
    else:
        elements = element_set_at(satellite, None)
        assert elements is not None
        found = elements.epoch
    whole = Epoch.from_iso(found.iso(0))
    return whole.shifted(math.ceil(round(found.seconds_since(whole), 6)))
