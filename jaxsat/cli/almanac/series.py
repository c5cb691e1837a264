"""The Fourier series of a year's almanac as `jaxsat almanac` shows and writes them (the program `god94`)."""

from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxsat.environment import AlmanacSeries, fit_almanac
from jaxsat.environment.almanac import SIDEREAL_DAY_S, TROPICAL_YEAR_DAYS
from jaxsat.time import Epoch

SERIES = ("sun_right_ascension_deg", "sun_declination_deg", "greenwich_angle_deg")
"""Columns."""


def series_columns(
    epoch: Epoch, t_s: np.ndarray, year: int, harmonics: int, exact: dict[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, float], AlmanacSeries]:
    """Returns Sun and Greenwich by the series of a year's almanac [deg], their largest errors [deg], and the series."""
    series = fit_almanac(year, harmonics=harmonics)
    here = series.since(epoch)
    ascension, declination, greenwich = (np.degrees(x) for x in jax.jit(lambda t: jax.vmap(here)(t))(t_s))
    columns = dict(zip(SERIES, (ascension % 360.0, declination, greenwich % 360.0), strict=True))
    apart = {name: (values - exact[name] + 180.0) % 360.0 - 180.0 for name, values in columns.items()}
    return (
        {f"series_{name}": values for name, values in columns.items()},
        {name.removesuffix("_deg"): float(np.abs(values).max()) for name, values in apart.items()},
        series,
    )


def series_document(series: AlmanacSeries) -> dict[str, Any]:
    """Returns what the series is made of, in degrees, and how to sum it."""
    return {
        "origin_utc": f"{series.year}-01-01T00:00:00.000",
        "meaning": "p = 360 deg t / year, t counts days from the origin; right ascension p + c0 + sum over k of "
        "c[2k-1] cos kp + c[2k] sin kp, declination without the p ahead; Greenwich its angle at the origin + 360 deg "
        "t / sidereal day",
        "year_days": TROPICAL_YEAR_DAYS,
        "sidereal_day_s": SIDEREAL_DAY_S,
        "sun_right_ascension_deg": np.degrees(series.right_ascension),
        "sun_declination_deg": np.degrees(series.declination),
        "greenwich_angle_deg": np.degrees(series.greenwich_angle_0),
    }


def write_series(path: Path, series: AlmanacSeries) -> None:
    """One row a harmonic, degrees; the mean is that of number 0, and has no sine."""
    columns = []
    for each in (series.right_ascension, series.declination):
        # A sine of nothing ahead, so that cosines and sines stand in pairs.
        columns.append(np.degrees(np.insert(np.asarray(each), 1, 0.0)).reshape(-1, 2))
    table = np.column_stack([np.arange(len(columns[0])), *columns])
    names = ["harmonic", *(f"{name}_{wave}_deg" for name in ("ascension", "declination") for wave in ("cos", "sin"))]
    np.savetxt(path, table, fmt=["%d"] + 4 * ["%.12g"], delimiter=",", header=",".join(names), comments="")
