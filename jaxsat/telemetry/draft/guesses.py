"""What groups of columns measure and in which unit, by their names and the sizes of their numbers."""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from jaxsat.files.units import parsed_unit
from jaxsat.telemetry.draft.columns import Group

Kind = Literal["magnetometer", "gyro", "sun_vector", "photodiodes", "panels", "star_tracker", "coils", "positions"]

_NAMES: tuple[tuple[Kind | None, str], ...] = (
    (None, r"acc|^a_?$|vel|^v_?$|temp|euler|rpy|volt"),
    ("coils", r"coil|mtq|torquer|mtr"),
    ("magnetometer", r"mag|^b_?$|^m\d?_?$|^b[_ (\[]|field|tam|hmc|_b_?$"),
    ("gyro", r"gyr|^g_?$|^g[_ (\[]|^w_?$|omega|rate|angvel"),
    ("sun_vector", r"sun|^s_?$|^sv|^ss"),
    ("positions", r"pos|^r_?$|^$|gps|ecef|eci"),
)
_UNIT_IN_NAME = {
    **{"nt": "nT", "ut": "uT", "µt": "uT", "mg": "mG", "gauss": "G", "t": "T"},
    **{"dps": "deg/s", "deg_s": "deg/s", "degs": "deg/s", "deg/s": "deg/s", "rads": "rad/s", "rad_s": "rad/s"},
    **{"rad/s": "rad/s", "rpm": "rpm", "ma": "mA", "a": "A", "ua": "uA", "km": "km", "m": "m", "v": "V", "mv": "mV"},
}
_QUANTITY = {"magnetometer": "T", "gyro": "rad/s", "panels": "A", "coils": "A", "positions": "m"}
_FIELD_T = (1.2e-5, 8e-5)


@dataclass(frozen=True)
class Guess:
    """What a group is."""

    group: Group
    kind: Kind
    unit: str
    sure: bool
    """Whether name or size says the unit; else it is the usual one."""
    unit_vector: bool = False
    sigma: float = 0.0
    """Noise of a number by differences of neighbours, in the unit."""
    largest: float = 1.0
    """Of its numbers, single wrong ones apart."""


def guessed(group: Group, values: np.ndarray) -> Guess | None:
    """Returns what a group of numbers [rows columns] is; None where nothing is like it."""
    whole = values[np.isfinite(values).all(axis=1)]
    size = float(np.median(np.linalg.norm(whole, axis=1))) if whole.size else np.nan
    named = _unit_in(group.stem)
    unit_long = bool(whole.size) and abs(size - 1.0) < 0.03
    kind = _kind(group, size, unit_long, named)
    if kind is None:
        return None
    noise = noise_of(values)
    if kind in ("sun_vector", "star_tracker") or (kind == "magnetometer" and unit_long):
        return Guess(group, kind, "1", True, unit_vector=kind == "magnetometer", sigma=noise)
    quantity = _QUANTITY.get(kind)
    if quantity is None:
        return Guess(group, kind, named or "1", named is not None, sigma=noise, largest=_largest(values))
    if named and parsed_unit(named).quantity == quantity:
        return Guess(group, kind, named, True, sigma=noise, largest=_largest(values))
    unit = _by_size(kind, size)
    return Guess(group, kind, unit or _USUAL[kind], unit is not None, sigma=noise, largest=_largest(values))


_USUAL = {"magnetometer": "nT", "gyro": "deg/s", "panels": "mA", "coils": "A", "positions": "km"}


def _kind(group: Group, size: float, unit_long: bool, named: str | None) -> Kind | None:
    stem = group.stem.lower()
    if group.shape == "quaternion":
        return "star_tracker" if unit_long else None
    if group.shape in ("faces", "numbered"):
        if group.shape == "faces" and (named in ("mA", "A", "uA") or re.search(r"^i|cur|panel|cell|sol|pv", stem)):
            return "panels"
        return "photodiodes" if re.search(r"^s_?$|sun|pd|diode|css|irr|lux|^i|light|photo", stem) else None
    kind = next((kind for kind, pattern in _NAMES if re.search(pattern, stem)), "unknown")
    if kind == "positions":
        return "positions" if 6.4e3 < size < 5e4 or 6.4e6 < size < 5e7 else None
    if kind == "unknown":
        return None
    return kind  # type: ignore[return-value]


def _by_size(kind: Kind, size: float) -> str | None:
    if kind == "magnetometer":
        sizes = {unit: size * parsed_unit(unit).factor for unit in ("nT", "uT", "mG", "G", "T")}
        fits = [unit for unit, tesla in sizes.items() if _FIELD_T[0] < tesla < _FIELD_T[1]]
        return fits[0] if len(fits) == 1 else None
    if kind == "positions":
        return "km" if size < 1e6 else "m"
    if kind == "panels":
        return "mA" if size > 10.0 else "A"
    return None


def _unit_in(stem: str) -> str | None:
    """The unit at the end of a name: field_nT, bx (nT), rate [deg/s]."""
    match = re.search(r"[_ (\[]+([A-Za-zµ/_]+)[)\]]?$", stem)
    if match is None:
        return None
    word = match[1].lower().strip("_")
    tail = word.rsplit("_", 1)[-1]
    return _UNIT_IN_NAME.get(word) or _UNIT_IN_NAME.get(tail)


def _largest(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.quantile(known, 0.99)) if known.size else 1.0


def noise_of(values: np.ndarray) -> float:
    """Robust 1-sigma of a number by third differences, which a smooth motion hardly has; their variance is 20 fold."""
    found = []
    for column in values.T:
        known = column[np.isfinite(column)]
        if known.size > 8:
            found.append(1.4826 * float(np.median(np.abs(np.diff(known, 3)))) / np.sqrt(20.0))
    return float(np.median(found)) if found else 0.0
