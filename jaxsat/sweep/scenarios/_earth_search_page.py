"""One Earth search as its page shows it: time to slide, the sky seen from the spacecraft, signals and thresholds."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxsat.sweep.history import Page

COLOURS = ("#14497a", "#d98e00", "#c81fb0", "#0f8a64")
"""Of the four sensors, as in the picture of the history; told apart with red-green blindness."""


def search_page(options: Mapping[str, str], sensor: Any, disk: float, samples: Any, t_s: np.ndarray) -> Page:
    """The page of one case, by its `HorizonSensor` and the angle from the nadir to the horizon [rad].

    `samples` is its `Sample` with the periods in front, at the times `t_s`.
    """
    from jaxsat.control.earth_search.law import TRACK

    mode = np.asarray(samples.mode)
    begins = np.flatnonzero((mode == TRACK) & (np.concatenate([[0], mode[:-1]]) != TRACK))
    off_deg, tracks = float(np.degrees(samples.error[-1])), bool(mode[-1] == TRACK)
    if tracks:
        message = f"For good from {t_s[begins[-1]]:.0f} s on; {off_deg:.2f} deg off at the end."
    else:
        message = f"Began to track {len(begins)} times; {off_deg:.1f} deg off at the end."
    return Page(
        script="search",
        heading="Sky about body z, seen from the spacecraft",
        good=tracks,
        verdict="Tracks the Earth." if tracks else "Does not track the Earth at the end.",
        message=message,
        alternative="angles, presence, first harmonics, rates and mode over time",
        data=_data(options, sensor, disk, samples, t_s),
    )


def _data(options: Mapping[str, str], sensor: Any, disk: float, samples: Any, t_s: np.ndarray) -> dict[str, Any]:
    """What the script draws from."""
    from jaxsat.control.earth_search.law import SENSORS

    rates = np.degrees(np.asarray(samples.angular_velocity)[:, :2])
    return {
        "sensors": [{"name": name, "colour": colour} for name, colour in zip(SENSORS, COLOURS, strict=True)],
        "disk_deg": math.degrees(disk),
        "cone_deg": float(np.degrees(sensor.cone_angle)),
        "amplitude_deg": float(np.degrees(sensor.amplitude)),
        "threshold": float(sensor.threshold),
        "search_rate_deg_s": float(max(np.abs(rates).max(), 1e-6)),
        "moon": options["moon"] == "yes",
        "sun": options["sun"] != "none",
        "shadow_s": [],
        "samples": {
            "t_s": t_s.tolist(),
            "nadir": _rounded(samples.nadir_body, 4),
            "sun": _rounded(samples.sun_body, 3),
            "moon": _rounded(samples.moon_body, 3),
            "azimuths": _rounded(samples.azimuths, 3),
            "present": np.asarray(samples.present).astype(int).tolist(),
            "first": _rounded(samples.first, 2),
            "mode": np.asarray(samples.mode).tolist(),
            "direction": np.sign(np.asarray(samples.direction)).astype(int).tolist(),
            "rate_deg_s": _rounded(rates, 4),
            "error_deg": _rounded(np.degrees(samples.error), 3),
        },
    }


def _rounded(values: Any, digits: int) -> list:
    return np.round(np.asarray(values, float), digits).tolist()
