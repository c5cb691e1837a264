"""skCUBE: attitude from Sun sensors, gyro and magnetometer of unknown calibration; panel currents are the witness.

    python -m experiments.flight.skcube --data DIR --out flight-skcube [--search-axes]

DIR holds `skcube_adcs.csv` and `skcube_pwr.csv`, decoded frames of yangwao/skCube-data-collector (MIT licence). Three
passes of 28 June 2017 are fitted, each by itself; the dipole that nobody mentions is free. What the panels should have
given in that motion is set against the currents, which no fit has seen: in full Sun behind the shadow, where an empty
battery takes all, and later, where it does not. With --search-axes the first pass is also fitted under all 48 ways in
which the gyro's columns may read. Writes figures.json, skcube.png, and the report of each pass.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.flight.asked import Figure, told, write_figures
from experiments.flight.skcube_files import EMPTY_MV, PASSES, Pass, battery_mv, write_tables
from experiments.flight.skcube_orbit import behind
from experiments.flight.skcube_picture import draw_skcube

SATELLITE = Path(__file__).with_name("skcube.sat.toml")
MAX_RATE_DEG_S = 3.0
ASKED, BEFORE = 0.97, {"r": 0.96, "rms": 48.0}
"""Correlation of the first pass, and what a first look had."""


@dataclass(frozen=True)
class Agreement:
    """Currents of some frames beside those of the fitted motion, their common scale fitted."""

    count: int
    """Frames."""
    correlation: float
    rms_ma: float
    largest_ma: float
    """Current of a panel that faces the Sun."""

    @staticmethod
    def of(measured: np.ndarray, modelled: np.ndarray, nominal: float) -> "Agreement | None":
        """Of currents [frames panels, mA]; None without frames."""
        if not len(measured):
            return None
        scale = float((measured * modelled).sum() / (modelled**2).sum())
        rms = float(np.sqrt(np.mean((measured - scale * modelled) ** 2)))
        r = float(np.corrcoef(measured.ravel(), modelled.ravel())[0, 1])
        return Agreement(len(measured), r, rms, scale * nominal)


@dataclass(frozen=True)
class Threshold:
    """Cells that share a bus: each loses the same current before it gives any."""

    gain: float
    lost_ma: float

    @staticmethod
    def of(measured: np.ndarray, modelled: np.ndarray) -> "Threshold":
        """Least squares over both numbers."""
        found = []
        for lost in np.arange(0.0, 200.0, 2.0):
            # In units of the currents before the gain, which is then one number of a linear fit.
            left = np.maximum(modelled - lost, 0.0)
            gain = float((measured * left).sum() / (left**2).sum())
            found.append((float(np.sum((measured - gain * left) ** 2)), gain, lost))
        _, gain, lost = min(found)
        return Threshold(gain, gain * lost)

    def agreement(self, measured: np.ndarray, modelled: np.ndarray) -> Agreement:
        """Of the currents with those of this law, without any further scale."""
        given = np.maximum(self.gain * modelled - self.lost_ma, 0.0)
        rms = float(np.sqrt(np.mean((measured - given) ** 2)))
        return Agreement(
            len(measured), float(np.corrcoef(measured.ravel(), given.ravel())[0, 1]), rms, float(given.max())
        )


@dataclass(frozen=True)
class Flown:
    """A pass, its fit, and how its currents agree."""

    flown: Pass
    fit: Any
    full_sun: np.ndarray
    """[frames] bool: while the battery takes all."""
    early: Agreement | None
    empty: Agreement | None
    """Of those of them with an empty battery."""
    later: Agreement | None
    others: tuple[float, ...]
    """Correlation in full Sun by each other motion that the search ended at, best first."""

    def currents(self, part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """[frames panels] measured and modelled [mA]."""
        cells = self.fit.result.channels["cells"]
        return cells.measured[part], cells.modelled[part]


def main() -> None:
    """Fits, prints asked and measured, and writes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of skcube_adcs.csv and skcube_pwr.csv")
    parser.add_argument("--out", type=Path, default=Path("flight-skcube"))
    parser.add_argument("--search-axes", action="store_true", help="try all axes of the gyro, on the first pass")
    arguments = parser.parse_args()
    import jaxsat

    jaxsat.set_up_jax()
    from jaxsat.satellites import read_satellite

    satellite = read_satellite(SATELLITE)
    flown = [fly(satellite, arguments.data, arguments.out, each) for each in PASSES]
    evenings = [each.begin for each in PASSES if each.after_shadow]
    late = behind(arguments.data, satellite.orbit.tle, evenings)
    figures = [figure for each in flown for figure in _figures(each)]
    law = Threshold.of(*flown[0].currents(flown[0].full_sun))
    for each in flown:
        if each.full_sun.any():
            found = law.agreement(*each.currents(each.full_sun))
            what = "fitted" if each is flown[0] else "predicted"
            figures.append(
                Figure(f"{each.flown.name}, threshold of {law.lost_ma:.0f} mA {what}: r", found.correlation, "1")
            )
            figures.append(Figure("  RMS", found.rms_ma, "mA"))
    figures.append(Figure("behind VZLUSAT-1, by the horizon", late.best_s, "s"))
    print(told(figures))
    print(f"frames were above the horizon for {late.possible_s[0]:.0f} to {late.possible_s[1]:.0f} s behind")
    for each in flown:
        print(f"{each.flown.name}: {each.fit.verdict}; {each.fit.result.message}")
    write_figures(
        arguments.out / "figures.json",
        "jaxsat.flight/1",
        figures,
        passes={each.flown.name: _told(each) for each in flown},
        behind_s=late.possible_s,
        axes=_searched(satellite, arguments) if arguments.search_axes else None,
    )
    draw_skcube(arguments.out / "skcube.png", flown)


def _searched(satellite, arguments) -> dict:
    """Axes of the gyro on the first pass."""
    free = replace(satellite, conventions={"gyro": "mirrored"})
    result = fly(free, arguments.data, arguments.out / "axes", PASSES[0]).fit.result
    others = [each for each in result.alternatives if each["axes"] != result.axes]
    print(f"axes of the gyro: {result.axes}; the next ones {others[0] if others else 'were given up on the way'}")
    return {"best": result.axes, "others": result.alternatives}


def fly(satellite, data: Path, out: Path, each: Pass) -> Flown:
    """Fits a pass by its Sun sensors and asks the currents."""
    import fitting
    import jaxsat
    from fitting.settings import FitSettings

    tables = write_tables(data, out / "tables" / each.name, each)
    session = jaxsat.read_telemetry(list(tables), satellite)
    fit = fitting.fit(satellite, session, settings=FitSettings(max_rate_deg_s=MAX_RATE_DEG_S), causes=False)
    fit.write(out / each.name)
    cells = fit.result.channels["cells"]
    full_sun = each.in_full_sun(cells.t_s)
    nominal = float(np.asarray(satellite.model.sensors["cells"].max_current)) * 1e3
    empty = full_sun & (battery_mv(tables[1]) < EMPTY_MV)
    early, hungry, later = (
        Agreement.of(cells.measured[part], cells.modelled[part], nominal) for part in (full_sun, empty, ~full_sun)
    )
    others = tuple(
        found.correlation
        for currents in _other_currents(fit)
        if (found := Agreement.of(cells.measured[full_sun], currents[full_sun], nominal)) is not None
    )
    return Flown(each, fit, full_sun, early, hungry, later, others)


def _other_currents(fit) -> list[np.ndarray]:
    """[frames panels] of the other motions at which the search ended [mA]."""
    import jax

    from fitting.outcome.looking import look_at

    best, cells = fit.found.minima[0], fit.result.channels["cells"]
    at = np.searchsorted(fit.result.t_s, cells.t_s)
    found = []
    for k in range(1, len(best.refined.score)):
        point = jax.tree.map(lambda leaf, k=k: np.asarray(leaf)[k], best.refined.points)
        found.append(look_at(best.problem, fit.found.parameters, point).readings["cells"][at] * 1e3)
    return found


def _figures(each: Flown) -> list[Figure]:
    found, name = [], each.flown.name
    first = each.flown is PASSES[0]
    for what, agreement in (("full Sun", each.early), ("battery empty", each.empty), ("later", each.later)):
        if agreement is None:
            continue
        wanted = first and what == "full Sun"
        found.append(
            Figure(
                f"{name}, {agreement.count} frames {what}: correlation",
                agreement.correlation,
                "1",
                asked=ASKED if wanted else None,
                before=BEFORE["r"] if wanted else None,
                at_least=True,
            )
        )
        found.append(Figure("  RMS", agreement.rms_ma, "mA", before=BEFORE["rms"] if wanted else None))
    return found


def _told(each: Flown) -> dict:
    result = each.fit.result
    return {
        "verdict": result.verdict,
        "message": result.message,
        "remarks": result.remarks,
        "rms": {name: channel.rms for name, channel in result.channels.items()},
        "parameters": {p.name: [p.value, p.sigma] for p in result.parameters if p.free},
        "attitude_sigma_deg": float(np.median(np.linalg.norm(result.attitude_sigma_deg, axis=1))),
        "rate_deg_s": np.degrees(np.linalg.norm(result.angular_velocity_rad_s, axis=1)).tolist(),
        "full_sun": None if each.early is None else vars(each.early),
        "battery_empty": None if each.empty is None else vars(each.empty),
        "later": None if each.later is None else vars(each.later),
        "correlation_of_other_motions": each.others,
    }


if __name__ == "__main__":
    main()
