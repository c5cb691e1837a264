"""How good one year of an almanac, turned into Fourier series, is for the Sun of that year and of its neighbours.

The programs `god94` and `God_ads` (Penkov et al. 2009, section 3.6, figures 5 and 6): right ascension and declination
of one year as series over the tropical year, extrapolated with constant lengths of year and sidereal day. Truth is the
apparent Sun and the Greenwich apparent sidereal time of ERFA. Prints a table, writes JSON and a picture.

    .venv/bin/python experiments/sun_almanac.py --out out/sun-almanac
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

YEAR = 1994
YEARS = list(range(1980, 2011))
HARMONICS = [(1, 1), (2, 2), (2, 3), (3, 3), (4, 4), (5, 5), (6, 6), (8, 8)]  # right ascension, declination
DRAWN = {(2, 3): "#8a4b20", (4, 4): "#3f9fd8", (6, 6): "#2340a8"}
PUBLISHED_LIMITS_DEG = (0.2, 0.06)
SAMPLE = (2001, 1, 18, 4, 54, 15)
# Right ascension, declination, Greenwich.
PUBLISHED_SAMPLE_DEG = {"approximate": (300.24, -20.482, 191.28), "exact": (300.265, -20.528, 191.27)}
DAY_S = 86400.0


@dataclass(frozen=True)
class Year:
    """What ERFA says at 0h UTC of each day of a year: Sun [rad], and Greenwich [rad] at its start."""

    year: int
    right_ascension: np.ndarray
    declination: np.ndarray
    greenwich: float

    @property
    def t(self) -> np.ndarray:
        """Time since the year's start [s]."""
        return DAY_S * np.arange(len(self.right_ascension))

    @property
    def t_same_date(self) -> np.ndarray:
        """The same month and day in a year without leap day [s]; 29 February counts as 1 March."""
        leap = len(self.right_ascension) - 365
        return self.t - DAY_S * (leap * (np.arange(365 + leap) > 59))


def exact_year(year: int) -> Year:
    from jaxsat.environment import apparent_sun
    from jaxsat.time import Epoch, greenwich_angle

    start, end = Epoch.from_utc(year, 1, 1), Epoch.from_utc(year + 1, 1, 1)
    days = round((end.utc1 - start.utc1) + (end.utc2 - start.utc2))
    sun, _ = apparent_sun(start, DAY_S * np.arange(days))
    return Year(year, np.arctan2(sun[:, 1], sun[:, 0]), np.arcsin(sun[:, 2]), greenwich_angle(start))


@jax.jit
def evaluate(series, t):
    return jax.vmap(series)(t)


def errors_deg(series, t: np.ndarray, exact: Year) -> np.ndarray:
    """Right ascension and declination of the series less the exact ones, [2, day]."""
    right_ascension, declination, _ = evaluate(series, t)
    away = np.stack([right_ascension - exact.right_ascension, declination - exact.declination])
    return np.degrees((away + np.pi) % (2.0 * np.pi) - np.pi)


def examine(series, years: list[Year]) -> dict:
    """Largest errors of each year, by elapsed days and by the calendar's date, and the sample."""
    from jaxsat.time import Epoch

    moved = [series.since(Epoch.from_utc(year.year, 1, 1)) for year in years]
    by_days = [errors_deg(s, year.t, year) for s, year in zip(moved, years, strict=True)]
    by_date = [errors_deg(series, year.t_same_date, year) for year in years]
    greenwich = [float(s.greenwich_angle_0) - year.greenwich for s, year in zip(moved, years, strict=True)]
    right_ascension, declination, angle = evaluate(series.since(Epoch.from_utc(*SAMPLE)), np.zeros(1))
    return {
        "largest_error_deg": [np.max(np.abs(e), axis=1).tolist() for e in by_days],
        "same_date_largest_error_deg": [np.max(np.abs(e), axis=1).tolist() for e in by_date],
        "greenwich_error_deg": np.degrees((np.array(greenwich) + np.pi) % (2.0 * np.pi) - np.pi).tolist(),
        "sample_deg": [
            float(np.degrees(right_ascension[0])) % 360.0,
            float(np.degrees(declination[0])),
            float(np.degrees(angle[0])) % 360.0,
        ],
        "daily_error_deg": by_days,
    }


def picture(results: dict, years: list[Year], path: Path) -> None:
    from jaxsat.plotting.style import FAINT, LEFT_OUT, SHADOW, dress, head, new_figure, png_bytes

    figure = new_figure(
        11.0,
        8.4,
        f"The Sun by the almanac of {YEAR}: error of its Fourier series",
        "series less ERFA, at 0h UTC of each day; harmonics in right ascension + in declination",
    )
    grid = figure.add_gridspec(3, 2, left=0.075, right=0.97, top=0.885, bottom=0.065, hspace=0.42, wspace=0.2)
    names = ("right ascension", "declination")
    near = [k for k, year in enumerate(years) if abs(year.year - YEAR) <= 1]
    for row, (name, limit) in enumerate(zip(names, PUBLISHED_LIMITS_DEG, strict=True)):
        axes = figure.add_subplot(grid[row, :])
        axes.axvspan(YEAR, YEAR + 1, color=SHADOW, linewidth=0, zorder=0)
        for harmonics, colour in DRAWN.items():
            for k in near:
                error = results[harmonics]["daily_error_deg"][k][row]
                label = f"{harmonics[0]} + {harmonics[1]}" if k == near[0] else None
                axes.plot(years[k].year + np.arange(len(error)) / len(error), error, color=colour, lw=1.2, label=label)
        for side in (-limit, limit):
            label = "published limit" if side > 0 else None
            axes.axhline(side, color=LEFT_OUT, lw=1.0, ls=(0, (4, 3)), label=label)
        axes.set_xlim(YEAR - 1, YEAR + 2)
        axes.set_ylim(-1.35 * limit, 1.35 * limit)
        axes.set_xticks(np.arange(YEAR - 1, YEAR + 2.01, 0.5))
        dress(axes, y_label="error, deg", x_label="year")
        head(axes, name)
        axes.text(YEAR + 0.5, 1.2 * limit, "fitted", ha="center", va="center", fontsize=8.5, color=FAINT)
        if row == 0:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, fontsize=8.5, frameon=False)
    for column, (name, limit) in enumerate(zip(names, PUBLISHED_LIMITS_DEG, strict=True)):
        axes = figure.add_subplot(grid[2, column])
        numbers = [year.year for year in years]
        for harmonics, colour in DRAWN.items():
            largest = np.array(results[harmonics]["largest_error_deg"])[:, column]
            axes.semilogy(numbers, largest, color=colour, lw=1.2, marker=".", ms=4)
        same = np.array(results[6, 6]["same_date_largest_error_deg"])[:, column]
        axes.semilogy(numbers, same, color=FAINT, lw=1.0, marker=".", ms=4, label="6 + 6, by the date of the year")
        axes.axhline(limit, color=LEFT_OUT, lw=1.0, ls=(0, (4, 3)))
        dress(axes, y_label="largest error, deg", x_label="year extrapolated to")
        axes.set_ylim(4e-4, 2.0)
        head(axes, f"{name}, largest of each year")
        axes.legend(loc="lower right", fontsize=8, frameon=False)
    path.write_bytes(png_bytes(figure))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sun-almanac"), help="directory for results")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)

    from jaxsat.environment import fit_almanac

    years = [exact_year(year) for year in YEARS]
    results = {harmonics: examine(fit_almanac(YEAR, harmonics=harmonics), years) for harmonics in HARMONICS}

    print(f"largest error, deg: right ascension / declination; fitted to {YEAR}")
    columns = [YEAR, YEAR - 1, YEAR + 1, 2001, YEARS[0], YEARS[-1]]
    print("harmonics", *(f"{year:>15d}" for year in columns), "  at the published sample")
    for harmonics, result in results.items():
        cells = (result["largest_error_deg"][YEARS.index(year)] for year in columns)
        sample = "{:9.4f} {:9.4f} {:9.4f}".format(*result["sample_deg"])
        print(f"  {harmonics[0]} + {harmonics[1]}  ", *(f"{a:7.4f}/{d:7.4f}" for a, d in cells), " ", sample)
    for name, values in PUBLISHED_SAMPLE_DEG.items():
        print(f"published {name}:".rjust(108), "{:.3f} {:.3f} {:.3f}".format(*values))
    greenwich = np.abs(results[HARMONICS[0]]["greenwich_error_deg"])
    print(f"Greenwich: largest error of {YEARS[0]}-{YEARS[-1]} {greenwich.max():.4f} deg")

    arguments.out.mkdir(parents=True, exist_ok=True)
    report = {
        "fitted_year": YEAR,
        "years": YEARS,
        "published_limits_deg": PUBLISHED_LIMITS_DEG,
        "published_sample_deg": PUBLISHED_SAMPLE_DEG,
        "series": [
            {"harmonics": harmonics, **{key: value for key, value in result.items() if key != "daily_error_deg"}}
            for harmonics, result in results.items()
        ],
    }
    (arguments.out / "sun_almanac.json").write_text(json.dumps(report, indent=1))
    picture(results, years, arguments.out / "sun_almanac.png")


if __name__ == "__main__":
    main()
