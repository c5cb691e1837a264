"""`jaxsat almanac`: Sun, Moon and Greenwich at one instant or many (the program `God_ads`)."""

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, validators

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import whole_number
from jaxsat.cli.shared.talk import USUAL, Talking
from jaxsat.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from jaxsat.environment import Ephemeris
    from jaxsat.time import Epoch

SCHEMA = "jaxsat.almanac/1"
FILES = ("almanac.csv", "series.csv", "almanac.json")
MOST_ROWS = 100_000
_SHOWN = 24
_DATE = re.compile("[0-9]{4}-[0-9]{2}-[0-9]{2}|[0-9]{4}-[0-9]{3}")
COLUMNS = {
    "sun_right_ascension_deg": "Sun RA",
    "sun_declination_deg": "dec",
    "sun_distance_au": "au",
    "greenwich_angle_deg": "Greenw.",
    "moon_right_ascension_deg": "Moon RA",
    "moon_declination_deg": "dec",
    "moon_distance_km": "km",
}
"""Columns of almanac.csv and their headings in the terminal."""


def _positive(_: Any, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"Expected a positive number of seconds, got {value:g}.")


def almanac(
    date: Annotated[str, Parameter(help="UTC instant, 2001-01-18T04:54:15, or a date, which is its 0h.")],
    /,
    *,
    until: Annotated[str | None, Parameter(help="Last instant of a range, in the same form.")] = None,
    step: Annotated[float, Parameter(help="Seconds between instants of a range.", validator=_positive)] = 86400.0,
    series: Annotated[
        int | None,
        Parameter(
            help="Also the Fourier series of this year's almanac, as `God_ads` has them, coefficients and errors.",
            converter=whole_number,
            validator=validators.Number(gte=1960, lte=2199),
        ),
    ] = None,
    harmonics: Annotated[
        int,
        Parameter(help="Harmonics of the series.", converter=whole_number, validator=validators.Number(gte=1, lte=20)),
    ] = 6,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("almanac"),
    talk: Talking = USUAL,
) -> int:
    """Print where Sun, Moon and Greenwich are: apparent places of date, in degrees.

    Right ascension and declination in the true equator and equinox of date,
    and Greenwich apparent sidereal time with UT1 taken as UTC.
    Writes almanac.json and almanac.csv, and with --series series.csv, the
    coefficients of each harmonic, with their meaning in almanac.json.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat almanac 2001-01-18T04:54:15 --series 1994

    Example: jaxsat almanac 2001-01-01 --until 2001-02-01 --step 3600
    """
    from jaxsat.environment import ephemeris

    epoch = _instant(date, "DATE")
    t_s = _range(epoch, until, step)
    columns = ephemeris_columns(ephemeris(epoch, t_s))
    errors, coefficients = {}, None
    if series is not None:
        from jaxsat.cli.almanac.series import series_columns
        from jaxsat.numerics import set_up_jax

        set_up_jax()
        more, errors, coefficients = series_columns(epoch, t_s, series, harmonics, columns)
        columns |= more

    from jaxsat.files.csv_files import write_columns_csv
    from jaxsat.files.json_files import plain, write_json
    from jaxsat.files.staging import staged_directory

    found = {"utc": epoch.iso_texts(t_s), **columns}
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "epoch_utc": epoch.iso(3),
        "frame": "true equator and equinox of date",
    }
    if coefficients is not None:
        from jaxsat.cli.almanac.series import series_document

        own = {"year": series, "harmonics": harmonics, "largest_error_deg": errors}
        document["series"] = own | series_document(coefficients)
    document["instants"] = [dict(zip(found, row, strict=True)) for row in zip(*found.values(), strict=True)]
    with staged_directory(out, FILES) as stage:
        write_columns_csv(stage / "almanac.csv", t_s, epoch, columns)
        if coefficients is not None:
            from jaxsat.cli.almanac.series import write_series

            write_series(stage / "series.csv", coefficients)
        write_json(stage / "almanac.json", plain(document)[0])
    summary = _summary(found, errors, series, harmonics)
    talk.result(*summary, f"\nresults in {out}", document=out / "almanac.json")
    return 0


def _instant(text: str, field: str) -> "Epoch":
    from jaxsat.time import Epoch

    try:
        return Epoch.from_iso(f"{text}T00:00:00" if _DATE.fullmatch(text) else text)
    except ValueError as error:
        raise InputError(str(error), field=field) from None


def _range(epoch: "Epoch", until: str | None, step: float) -> "np.ndarray":
    if until is None:
        return epoch.clock_steps(step, 1)
    span = _instant(until, "--until").seconds_since(epoch)
    if span < 0.0:
        raise InputError(f"expected an instant after {epoch.iso(0)}, found {until}", field="--until")
    # Counting is generous, for leap seconds; a millisecond of grace keeps the last instant from rounding.
    rows = int(span / step) + 2
    if rows > MOST_ROWS:
        raise InputError(f"gives {rows - 1} instants, expected at most {MOST_ROWS}", field="--step")
    t_s = epoch.clock_steps(step, rows)
    return t_s[t_s <= span + 1e-3]


def ephemeris_columns(found: "Ephemeris") -> dict[str, "np.ndarray"]:
    """Returns an ephemeris in degrees, astronomical units and kilometres: `COLUMNS`."""
    import numpy as np

    from jaxsat.constants import AU

    values = (
        np.degrees(found.sun_right_ascension),
        np.degrees(found.sun_declination),
        found.sun_distance / AU,
        np.degrees(found.greenwich_angle),
        np.degrees(found.moon_right_ascension),
        np.degrees(found.moon_declination),
        found.moon_distance / 1e3,
    )
    return dict(zip(COLUMNS, values, strict=True))


def _summary(found: dict[str, Any], errors: dict[str, float], series: int | None, harmonics: int) -> list[Any]:
    from rich.table import Table

    headings = ("UTC", *COLUMNS.values())
    formats = ("{:.4f}", "{:.4f}", "{:.5f}", "{:.4f}", "{:.2f}", "{:.2f}", "{:.0f}")
    texts = found["utc"]
    # Two instants of one second are told apart in the files.
    rows = [
        (utc[:19], *(f.format(found[name][k]) for f, name in zip(formats, COLUMNS, strict=True)))
        for k, utc in enumerate(texts[:_SHOWN])
    ]
    table = Table.grid(padding=(0, 1))
    for number in range(len(headings)):
        table.add_column(justify="right" if number else "left", no_wrap=True)
    table.add_row(*headings, style="bold")
    for row in rows:
        table.add_row(*row)
    parts: list[Any] = [table]
    if len(texts) > _SHOWN:
        parts.append(f"and {len(texts) - _SHOWN} more in almanac.csv")
    if errors:
        from jaxsat.cli.almanac.series import SERIES

        values = [f"{found['series_' + name][0]:.4f}" for name in SERIES]
        largest = ", ".join(f"{name.replace('_', ' ')} {value:.4f}" for name, value in errors.items())
        parts.append(f"series of {series}, {harmonics} harmonics: {', '.join(values)} deg at the first instant")
        parts.append(f"largest error of the series, deg: {largest}")
    return parts
