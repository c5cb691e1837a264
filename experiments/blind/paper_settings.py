"""Settings of figures 9 to 29 of Penkov et al. 2009, sections 4 and 5: what is true, what is assumed, what is free."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

ORBITAL_RATE = 9.47283e-4  # rad/s
MOMENT = 0.05283
"""Nominal principal moments [kg m2]."""
LIMITED = {"from_s": 2000.0, "to_s": 2500.0, "factors": (0.8, 0.65, 0.72)}
"""Limited charge current (fig. 20 and 29): factors of the panels on x, y, z; the paper's are not given."""


def tensor(moments: tuple[float, float, float], turn_deg: float = 0.0) -> np.ndarray:
    """Inertia with principal axes turned by `turn_deg` about each body axis in turn."""
    axes = Rotation.from_euler("xyz", [turn_deg] * 3, degrees=True).as_matrix()
    return axes @ np.diag(moments) @ axes.T


NOMINAL_TRUTH: dict[str, Any] = {
    "start": "2001-01-18T04:54:15",
    "elements": {
        "a": 7630026.457, "e": 0.072661, "i": 95.438873, "raan": 64.81879, "argp": 16.675906, "t_peri": 3230.533197,
    },
    "duration": 4500.0,
    "cadence": 64.0,
    "inertia": tensor((MOMENT, MOMENT, MOMENT)).tolist(),
    "magnet": [0.3, 0.0, 0.0],
    "rods": [0.03, 0.03],
    "imax": 240.0,
    "panel_ratio": [1.0] * 6,
    "albedo_specular": 0.5,
    "albedo_diffuse": 0.0,
    "w0": [11.0 * ORBITAL_RATE, 0.0, 0.0],
}  # fmt: skip
START_DEG = 12.0
"""Of body x from the field at t = 0: the regime near magnetic orientation that the paper simulates."""


@dataclass(frozen=True)
class Setting:
    """One figure: `truth` changes the true satellite, `nominal` the assumed one, keys as in a satellite file."""

    figures: str
    free: str
    until_s: float
    truth: dict[str, Any] = field(default_factory=dict)
    nominal: dict[str, Any] = field(default_factory=dict)
    limited: bool = False
    paper: dict[str, float] = field(default_factory=dict)
    """Published results, names as in fit.json with magnet, rods [A m2] and imax [mA]."""


LIGHT = {"inertia": tensor((0.0504, 0.0554, 0.0579)).tolist()}
HEAVY = {"inertia": tensor((0.048, 0.058, 0.063)).tolist()}
LIGHT_TURNED = {"inertia": tensor((0.0504, 0.0554, 0.0579), 10.0).tolist()}
HEAVY_TURNED = {"inertia": tensor((0.048, 0.058, 0.063), 10.0).tolist()}
NO_RODS, WEAK_RODS = {"spacecraft.rods_A_m2": [0.0, 0.0]}, {"spacecraft.rods_A_m2": [0.02, 0.02]}
WRONG_MAGNET = {"spacecraft.magnet_A_m2": [0.27, 0.01, -0.01]}

SETTINGS = (
    Setting("9", "als", 650.0, nominal=NO_RODS),
    Setting("10", "als", 2500.0, nominal=NO_RODS),
    Setting("11", "als", 650.0, nominal=WEAK_RODS),
    Setting("12", "als", 4500.0, nominal=WEAK_RODS),
    Setting("13, 14", "alsI23", 650.0, nominal=WEAK_RODS),
    Setting("15, 16", "alsI23", 2700.0, nominal=WEAK_RODS),
    Setting("17, 18", "alsI23", 4500.0, nominal=WEAK_RODS, paper={"rods.y": 0.0312, "rods.z": 0.0272}),
    Setting("19", "alsI0", 1950.0, nominal=WRONG_MAGNET),
    Setting("20", "alsI0", 4500.0, nominal=WRONG_MAGNET, limited=True),
    Setting("21", "als", 4500.0, nominal={"spacecraft.imax_mA": 210.0}),
    Setting("21", "als", 4500.0, nominal={"spacecraft.imax_mA": 270.0}),
    Setting("22", "alsImax", 4500.0, nominal={"spacecraft.imax_mA": 270.0}, paper={"imax": 255.7}),
    Setting("23", "als", 4500.0, truth=LIGHT),
    Setting("24", "als", 4500.0, truth=HEAVY),
    Setting("25", "als", 4500.0, truth=LIGHT_TURNED),
    Setting("26", "als", 4500.0, truth=HEAVY_TURNED),
    Setting("28", "alsJ", 650.0, truth=LIGHT_TURNED),
    Setting("27, 28", "alsJ", 4500.0, truth=LIGHT_TURNED),
    Setting("29", "alsI23", 4500.0, nominal=WEAK_RODS, limited=True, paper={"rods.y": 0.041, "rods.z": 0.016}),
)
