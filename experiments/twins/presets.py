"""The six kinds of sessions: how long, how fast a spin, how strong a dipole, and how each sensor fills its table.

What a kind's builder would write down, nominal values and their sigmas, stands in satellites/KIND.toml.
"""

from dataclasses import dataclass, field
from typing import Any

SPARSE = {"dropout": 0.02, "corrupt": 0.01}


@dataclass(frozen=True)
class Preset:
    """Settings of a kind of sessions that no satellite file names."""

    duration: float
    """[s]"""
    spin_deg_s: float
    dipole: float
    """Size of the magnet's moment, of which true ones lie within a factor of 1.4 [A m2]."""
    sensors: dict[str, dict[str, Any]]
    """For each sensor: cadence [s] (a list: by turns), offset [s], digits, shares of lost and of spoilt samples."""
    lit: tuple[float, float] = (1.0, 1.0)
    """Least and largest share of the session in sunlight."""
    fine_s: float = 1.0
    """Spacing of the truth between the samples [s]."""
    time_digits: int = 3
    start_early: bool = False
    """The motion starts ten seconds before the epoch, so that the rods are magnetised at it."""
    extra: dict[str, Any] = field(default_factory=dict)


PRESETS: dict[str, Preset] = {
    "1u-unitmag": Preset(
        300.0,
        11.0,
        0.34,
        {"mag": {"cadence": 2.0, "digits": 6, **SPARSE}, "sun": {"cadence": 2.0, "digits": 5, **SPARSE}},
        fine_s=0.5,
        time_digits=0,
    ),
    "1u-axes": Preset(
        300.0,
        11.0,
        0.34,
        {"mag": {"cadence": [1.0, 3.0], "digits": 6, **SPARSE}, "sun": {"cadence": [1.0, 3.0], "digits": 5, **SPARSE}},
        fine_s=0.5,
        time_digits=0,
    ),
    "1u-orbit": Preset(
        5700.0,
        3.0,
        0.0096,
        {
            "mag": {"cadence": 10.0, "digits": 4, "dropout": 0.01, "corrupt": 0.005},
            "gyro": {"cadence": 10.0, "digits": 4, "dropout": 0.01},
        },
        lit=(0.55, 0.75),
        start_early=True,
    ),
    "3u-panels": Preset(
        3000.0,
        1.0,
        0.026,
        {"cells": {"cadence": 20.0, "digits": 0, "dropout": 0.02, "corrupt": 0.005}},
        time_digits=1,
        extra={"limited_s": 500.0},
    ),
    "1u-coils": Preset(
        1500.0,
        2.5,
        0.0113,
        {
            "mag": {"cadence": 5.0, "digits": 4},
            "gyro": {"cadence": 5.0, "digits": 4},
            "sun": {"cadence": 5.0, "digits": 5},
        },
        extra={"commanded_s": 600.0, "held_s": 60.0, "current_A": 0.008},
    ),
    "3u-mix": Preset(
        1200.0,
        1.5,
        0.057,
        {
            "mag": {"cadence": 4.0, "digits": 1},
            "gyro": {"cadence": 1.0, "digits": 4},
            "sv": {"cadence": 3.0, "offset": 0.5, "digits": 6},
            "star": {"cadence": 10.0, "offset": 0.25, "digits": 7, "dropout": 0.3},
        },
    ),
}
