"""A magnetometer in the International Space Station: calibrated along a motion that is known, and a break in it found.

    python -m experiments.flight.iss --out flight-iss [--data DIR]

The station holds its orbital frame, so SGP4 and IGRF say what a magnetometer in it should read but for its turn, bias,
scale and shear. They are fitted to 0.75-5.5 h, the rest is predicted; from the residuals the fit tells by itself when
the sensor was turned; turn and bias are then fitted anew behind that. Without DIR, the folder with
`astropi_mk2_IR.csv`, the excerpt beside this file is taken: every third row. Writes figures.json, iss.png, and the
report of each of the three fits.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from experiments.flight.asked import Figure, told, write_figures
from experiments.flight.iss_picture import draw_iss

HERE = Path(__file__).parent
FULL, EXCERPT = "astropi_mk2_IR.csv", HERE / "data" / "iss-magnetometer.csv"
HOUR = 3600.0
BEGIN, FITTED, PREDICTED = 0.75 * HOUR, 5.5 * HOUR, 8.3 * HOUR
"""The first 45 minutes settle."""
PROTOTYPE = {"fitted": (0.26, 0.27, 0.54), "predicted": (0.35, 0.40, 0.50), "after": (0.6, 0.4, 0.6)}
"""uT an axis, by a first look."""


def main() -> None:
    """Fits, prints asked and measured, and writes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of the full file")
    parser.add_argument("--out", type=Path, default=Path("flight-iss"))
    arguments = parser.parse_args()
    import jaxsat

    jaxsat.set_up_jax()
    import fitting
    from fitting.settings import FitSettings
    from jaxsat.satellites import read_satellite

    satellite = read_satellite(HERE / "iss.sat.toml")
    session = jaxsat.read_telemetry(EXCERPT if arguments.data is None else arguments.data / FULL, satellite)
    end = session.span_s[1]

    def fit(begin, until, stop, satellite=satellite, free=None):
        holdout = max(0.0, (stop - until) / (stop - begin))
        return fitting.fit(
            satellite, session, settings=FitSettings(arc_s=(begin, stop), holdout=holdout, free=free), causes=False
        )

    # What an engineer does who knows nothing of a break: all of it, most of it predicted.
    whole = fit(BEGIN, FITTED, end)
    breaks = whole.result.channels["mag"].breaks
    until = fit(BEGIN, FITTED, PREDICTED)
    channel = until.result.channels["mag"]
    figures = _figures(channel, until.result)
    more = {"verdict_whole": whole.result.verdict, "remarks_whole": whole.result.remarks}
    after = None
    if breaks:
        at = breaks[0].t_s
        later = replace(satellite, model=_calibrated(until))
        after = fit(at, end, end, satellite=later, free=("mag.turn", "mag.bias"))
        turned = _turn(until).inv() * _turn(after)
        figures += [
            Figure("break found at", at / HOUR, "h"),
            Figure("its turn, as told", breaks[0].turn_deg, "deg"),
            Figure("turn fitted anew behind it", float(np.degrees(turned.magnitude())), "deg"),
        ]
        left = _rms(after.result.channels["mag"], slice(None))
        figures += [
            Figure(f"Mag{axis} behind the break, turn and bias fitted anew", left[k], "uT RMS", None, before)
            for k, (axis, before) in enumerate(zip("XYZ", PROTOTYPE["after"], strict=True))
        ]
    print(told(figures))
    print(f"the whole: {whole.result.verdict}; {whole.result.message}")
    for remark in whole.result.remarks:
        print(f"- {remark}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_figures(arguments.out / "figures.json", "jaxsat.flight/1", figures, rows=session.paths[0].name, **more)
    draw_iss(arguments.out / "iss.png", whole.result, until.result, None if after is None else after.result)
    for name, each in (("whole", whole), ("until-break", until), ("behind-break", after)):
        if each is not None:
            each.write(arguments.out / name)


def _rms(channel, part) -> list[float]:
    """Of measured less modelled, by column [uT]."""
    return np.sqrt(np.nanmean((channel.residual[part] * channel.sigma) ** 2, axis=0)).tolist()


def _figures(channel, result) -> list[Figure]:
    found = []
    for what, part, asked in (("fitted", channel.fitted, None), ("predicted", ~channel.fitted, 0.55)):
        for axis, rms, before in zip("XYZ", _rms(channel, part), PROTOTYPE[what], strict=True):
            found.append(Figure(f"Mag{axis} {what}", rms, "uT RMS", asked, before))
    found.append(Figure("direction fitted", channel.angle_deg, "deg median", None, 0.7))
    found.append(Figure("direction predicted", channel.holdout.angle_deg, "deg median", 0.8, 0.8))
    found.append(Figure("held-out error over the promised one", channel.holdout.sigma_ratio, "times", 2.0))
    delay = next(p for p in result.parameters if p.name == "mag.delay")
    found.append(Figure("stamps late by", delay.value, f"s, sigma {delay.sigma:.2g}"))
    return found


def _turn(fit) -> Rotation:
    values = {p.name: p.value for p in fit.result.parameters}
    return Rotation.from_rotvec([values[f"mag.turn.{axis}"] for axis in "xyz"])


def _calibrated(fit):
    """The model with all numbers as they were fitted."""
    import jax.numpy as jnp

    from jaxsat.satellites.model import with_values

    found = {p.name: p.value for p in fit.result.parameters}
    leaves = [leaf for leaf in fit.satellite.leaves if leaf.name in found]
    values = np.array([found[leaf.name] / leaf.to_unit for leaf in leaves])
    return with_values(fit.satellite.model, [leaf.spot for leaf in leaves], jnp.asarray(values))


if __name__ == "__main__":
    main()
