"""Units of tables and satellite files, by a small table of our own: what `mA`, `deg/s` or `12.5 nT` are in SI."""

import math
import re
from dataclasses import dataclass

_FIELD_UNITS = ("nT", "uT", "mT", "T", "mG", "G")
"""That magnetometers are read in."""
_PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6}
_PREFIXED: dict[str, tuple[float, dict[str, int]]] = {
    "T": (1.0, {"T": 1}),
    "G": (1e-4, {"T": 1}),
    "A": (1.0, {"A": 1}),
    "V": (1.0, {"V": 1}),
    "W": (1.0, {"W": 1}),
    "N": (1.0, {"N": 1}),
    "S": (1.0, {"S": 1}),
    "m": (1.0, {"m": 1}),
    "s": (1.0, {"s": 1}),
    "g": (1e-3, {"kg": 1}),
    "rad": (1.0, {"rad": 1}),
    "deg": (math.pi / 180.0, {"rad": 1}),
}
_PLAIN: dict[str, tuple[float, dict[str, int]]] = {
    "1": (1.0, {}),
    "%": (1e-2, {}),
    "count": (1.0, {}),
    "counts": (1.0, {}),
    "arcmin": (math.pi / 10800.0, {"rad": 1}),
    "arcsec": (math.pi / 648000.0, {"rad": 1}),
    "rpm": (math.pi / 30.0, {"rad": 1, "s": -1}),
    "min": (60.0, {"s": 1}),
    "h": (3600.0, {"s": 1}),
    "d": (86400.0, {"s": 1}),
}
_FACTOR = re.compile(r"([0-9]+\.?[0-9]*(?:[eE][+-]?[0-9]{1,3})?)[ *]+(?=[^0-9 ])")
_TERM = re.compile(r"([^0-9^]+|1)\^?([0-9])?")


@dataclass(frozen=True)
class Unit:
    """A unit as a user writes it."""

    text: str
    factor: float
    """What one of it is in SI."""
    quantity: str
    """The SI unit of what it measures, as `T` or `rad/s`; `1` for ratios and counts."""


def parsed_unit(text: str) -> Unit:
    """Returns the unit of a text; ValueError where it is none.

    Symbols with SI prefixes (nT, uT, G, mA, V, km, s, deg, rad, A, N, S), rpm, min, h, d, arcsec, arcmin, count, %, 1;
    products by a blank, powers as `m2`, one `/`; a number in front says what one count is, as in `12.5 nT`.
    """
    body, factor = text.strip(), 1.0
    number = _FACTOR.match(body)
    if number:
        factor, body = float(number[1]), body[number.end() :]
    above, slash, below = body.partition("/")
    powers: dict[str, int] = {}
    for part, sign in ((above, 1), (below, -1)) if slash else ((above, 1),):
        terms = part.replace("*", " ").split()
        if not terms:
            raise ValueError(_refusal(text))
        for term in terms:
            size, found, power = _term(term, text)
            factor *= size ** (sign * power)
            for base, exponent in found.items():
                powers[base] = powers.get(base, 0) + sign * power * exponent
    if not 0.0 < factor < math.inf:
        raise ValueError(_refusal(text))
    return Unit(text.strip(), factor, _quantity(powers))


def _term(term: str, text: str) -> tuple[float, dict[str, int], int]:
    match = _TERM.fullmatch(term)
    if match is None:
        raise ValueError(_refusal(text))
    symbol, power = match[1], int(match[2] or 1)
    if symbol in _PLAIN:
        return *_PLAIN[symbol], power
    if symbol in _PREFIXED:
        return *_PREFIXED[symbol], power
    if symbol[0] in _PREFIXES and symbol[1:] in _PREFIXED:
        size, found = _PREFIXED[symbol[1:]]
        return _PREFIXES[symbol[0]] * size, found, power
    raise ValueError(_refusal(text))


def _quantity(powers: dict[str, int]) -> str:
    above = [base + (str(power) if power > 1 else "") for base, power in powers.items() if power > 0]
    below = [base + (str(-power) if power < -1 else "") for base, power in powers.items() if power < 0]
    return (" ".join(above) or "1") + ("/" + " ".join(below) if below else "")


def _refusal(text: str) -> str:
    known = "nT, uT, G, mA, V, deg, deg/s, rpm, km, 1, or '12.5 nT' a count"
    return f"unknown unit {text[:24]!r}; expected one such as {known}"


def field_unit(ratio: float, written: str) -> str | None:
    """The unit in which a field that is `ratio` times too large in the unit `written` would be right; None if none."""
    factor = parsed_unit(written).factor
    return next((unit for unit in _FIELD_UNITS if 0.7 < ratio * parsed_unit(unit).factor / factor < 1.4), None)
