"""Numbers as text with as many digits as they deserve: for tables, pictures and reports."""

import math
import re


def value_text(value: float | None, digits: int = 4) -> str:
    """Returns `value` with `digits` significant digits, `n/a` where there is none."""
    if value is None or not math.isfinite(value):
        return "n/a"
    text = f"{value:#.{digits}g}"
    return text.rstrip(".") if "e" not in text else f"{value:.{digits - 1}e}"


def value_and_sigma(value: float | None, sigma: float | None, digits: int = 4) -> tuple[str, str]:
    """Returns a value and its 1-sigma as texts: sigma to two significant digits, value to the same decimal place.

    Without a usable sigma the value has `digits` significant digits and the sigma's text is empty.
    """
    if value is None or not math.isfinite(value) or sigma is None or not math.isfinite(sigma) or sigma <= 0.0:
        return value_text(value, digits), ""
    # Formatted first, so that 0.0996 counts as 0.10 and not as 0.0996 with one digit more.
    exponent = int(f"{sigma:.1e}".split("e")[1])
    decimals = 1 - exponent
    if abs(exponent) > 6:
        return f"{value:.{digits - 1}e}", f"{sigma:.1e}"
    if decimals <= 0:
        return f"{round(value, decimals):.0f}", f"{round(sigma, decimals):.0f}"
    # "z" writes no minus before a value that rounds to zero.
    return f"{value:z.{decimals}f}", f"{sigma:.{decimals}f}"


def unit_text(unit: str) -> str:
    """Returns a unit as printed: raised digits (`A m²`), nothing for a pure number."""
    return "" if unit == "1" else re.sub(r"(?<=m)2\b", "²", unit)


def count_text(number: int, singular: str, plural: str | None = None) -> str:
    """Returns a count with its noun in the right number: `1 row`, `3 rows`."""
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def spans_text(rows: list[int], limit: int = 12) -> str:
    """Returns row numbers as short runs (`4-6, 9`), cut after `limit` runs with the number of rows left out."""
    runs: list[list[int]] = []
    for row in sorted(set(rows)):
        if runs and row == runs[-1][1] + 1:
            runs[-1][1] = row
        else:
            runs.append([row, row])
    shown = [str(first) if first == last else f"{first}-{last}" for first, last in runs[:limit]]
    hidden = sum(last - first + 1 for first, last in runs[limit:])
    return ", ".join(shown) + (f" and {hidden} more" if hidden else "")
