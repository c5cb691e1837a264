"""Options of a few numbers, of a body's inertia, and of a date, checked as single numbers are."""

import datetime
import math
import re
from collections.abc import Mapping

import numpy as np

from jaxsat.errors import InputError
from jaxsat.physical.inertia import check_inertia
from jaxsat.sweep.scenario import number_of

YEARS = (1900, 2029)
"""Which the magnetic field is known for."""


def numbers_of(
    options: Mapping[str, str], name: str, count: int, *, low: float = -math.inf, high: float = math.inf
) -> tuple[float, ...]:
    """Values of an option that is `count` numbers from `low` to `high`, apart by commas; `InputError` otherwise."""
    words = options[name].split(",")
    if len(words) != count:
        raise InputError(f"expected {count} numbers apart by commas, found {options[name]!r}", field=name)
    return tuple(number_of({name: word}, name, low=low, high=high) for word in words)


def inertia_of(options: Mapping[str, str], moments: str, products: str | None = None) -> np.ndarray:
    """Inertia tensor [3 3, kg m2] of an option of its moments xx,yy,zz and one of its elements xy,xz,yz.

    Raises `InputError` where no body has such a tensor.
    """
    tensor = np.diag(numbers_of(options, moments, 3, low=0.0, high=1e9))
    if products is not None:
        xy, xz, yz = numbers_of(options, products, 3, low=-1e9, high=1e9)
        tensor = tensor + np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
    try:
        check_inertia(tensor)
    except ValueError as error:
        raise InputError(str(error), field=moments) from None
    return tensor


def date_of(options: Mapping[str, str], name: str) -> tuple[int, int, int]:
    """Year, month and day of an option as 2018-10-14; `InputError` for anything else, or beyond the field's years."""
    text = options[name].strip()
    try:
        if not re.fullmatch(r"\d{4}-\d{2}-\d{2}", text):
            raise ValueError
        date = datetime.date.fromisoformat(text)
    except ValueError:
        raise InputError(f"expected a date as 2018-10-14, found {options[name]!r}", field=name) from None
    if not YEARS[0] <= date.year <= YEARS[1]:
        raise InputError(f"expected a year from {YEARS[0]} to {YEARS[1]}, found {options[name]!r}", field=name)
    return date.year, date.month, date.day
