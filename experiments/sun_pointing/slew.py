"""The published test slew (Zhukov 2019, figures 20 to 22): from the edge of the field of view onto the axis.

The paper's first state is not given; here the Sun stands 88 deg from the axis at an azimuth of 35 deg, which gives the
largest errors that the paper reads off, and the vehicle is at rest. Each estimator steers one slew. Prints the largest
errors, writes JSON and a picture.

    .venv/bin/python experiments/sun_pointing/slew.py --out out/sun-slew
"""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxsat.control.sun_pointing.sensing import Estimator

VIEW_DEG, AZIMUTH_DEG = 88.0, 35.0
PERIODS = 400
PAPER = {"view_deg": 57.0, "azimuth_deg": 12.0}
"""Largest errors that the paper reads off its figures."""


def slew(estimator: "Estimator"):
    """History of one slew, a `Sample` with the periods in front."""
    import jax
    import jax.numpy as jnp

    from jaxsat.control.sun_pointing.cases import Cases, run_one
    from jaxsat.control.sun_pointing.law import SunPointingLaw
    from jaxsat.control.sun_pointing.sensing import LoopSettings
    from jaxsat.control.sun_pointing.vehicle import BODY_FROM_INSTRUMENT, nominal_vehicle
    from jaxsat.math import quaternion

    view, azimuth = np.radians(VIEW_DEG), np.radians(AZIMUTH_DEG)
    sun = np.array([np.cos(view), np.sin(view) * np.cos(azimuth), np.sin(view) * np.sin(azimuth)])
    sun_eci = jnp.array([1.0, 0.0, 0.0])
    q = quaternion.shortest_turn(jnp.asarray(BODY_FROM_INSTRUMENT @ sun), sun_eci)
    cases = Cases(q[None], jnp.zeros((1, 3)), nominal_vehicle(), jax.random.key(0)[None])
    settings = LoopSettings(estimator=estimator)
    return jax.device_get(jax.jit(lambda cases: run_one(settings, SunPointingLaw(), cases, sun_eci, PERIODS))(cases))[1]


def angles_deg(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle from the axis and azimuth from y toward z."""
    return np.degrees(np.arccos(np.clip(v[:, 0], -1.0, 1.0))), np.degrees(np.arctan2(v[:, 2], v[:, 1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sun-slew"), help="directory of the results")
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    arguments.out.mkdir(parents=True, exist_ok=True)
    found, panels = {}, {}
    t_s = np.arange(float(PERIODS))
    for estimator in ("published", "tracking", "filter"):
        samples = slew(estimator)
        sun = samples.readings["all"].sun_instrument
        (view, azimuth), (view_seen, azimuth_seen) = angles_deg(sun), angles_deg(samples.estimate.sun)
        # Near the axis an azimuth says nothing.
        clear = view > 5.0
        off = np.where(clear, (azimuth_seen - azimuth + 180.0) % 360.0 - 180.0, 0.0)
        found[estimator] = {
            "view_deg": float(np.abs(view_seen - view).max()),
            "azimuth_deg": float(np.abs(off).max()),
            "arrived_s": float(t_s[np.flatnonzero(view > 1.0)[-1] + 1]),
            "final_deg": float(view[-1]),
        }
        print(
            f"{estimator:10s} largest error of the angle {found[estimator]['view_deg']:6.2f} deg (paper 57), of the "
            f"azimuth {found[estimator]['azimuth_deg']:6.2f} deg (paper 12); within 1 deg after "
            f"{found[estimator]['arrived_s']:.0f} s, {found[estimator]['final_deg']:.2f} deg at the end"
        )
        panels[f"{estimator}: Sun from the axis, deg (figure 20)"] = {"true": view, "estimated": view_seen}
        shown = np.where(clear, 1.0, np.nan)
        panels[f"{estimator}: azimuth, deg (figure 21)"] = {
            "true": azimuth * shown,
            "estimated": azimuth_seen * shown,
        }
        if estimator == "published":
            from jaxsat.control.sun_pointing.vehicle import BODY_FROM_INSTRUMENT

            body = sun @ BODY_FROM_INSTRUMENT.T
            panels["published: Sun in body axes (figure 22)"] = dict(zip("xyz", body.T, strict=True))
    figure = draw_history(
        t_s,
        panels,
        title="The published test slew",
        subtitle=f"from {VIEW_DEG:g} deg, azimuth {AZIMUTH_DEG:g} deg, by each estimator",
    )
    (arguments.out / "slew.png").write_bytes(png_bytes(figure))
    (arguments.out / "slew.json").write_text(json.dumps({"paper": PAPER, "found": found}, indent=1))


if __name__ == "__main__":
    main()
