"""Names, groups and units of everything that a fit may change."""

import math
from difflib import get_close_matches

from jaxsat.panel_names import PANEL_NAMES, TILT_AXES

STATE = ("attitude.x", "attitude.y", "attitude.z", "rate.x", "rate.y", "rate.z")
MAGNET = ("magnet.x", "magnet.y", "magnet.z")
POLAR = ("magnet.modulus", "magnet.azimuth", "magnet.elevation")
"""The same dipole by its modulus and two angles: azimuth from body x towards y, elevation above the xy plane."""
RODS = ("rods.y", "rods.z")
INERTIA = ("inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz")
GAINS = tuple(f"gains.{panel}" for panel in PANEL_NAMES)
ALBEDO = ("albedo.specular", "albedo.diffuse")
TILTS = tuple(f"tilts.{panel}.{axis}" for panel, axes in zip(PANEL_NAMES, TILT_AXES, strict=True) for axis in axes)
"""Turn of a panel off its place about each of the two body axes across its nominal normal."""

DYNAMIC = MAGNET + POLAR + RODS + INERTIA
"""Parameters that move the satellite."""
SENSOR = ("imax", *GAINS, *ALBEDO, *TILTS)
"""Parameters that only change what its panels report: they need no sensitivity through the integration."""
MODEL = MAGNET + RODS + INERTIA + SENSOR
"""Values that make up the model, in the order of its vector."""
NAMED = MODEL + POLAR
"""Every value that has a name: those of the model, and the dipole said in another way."""

GROUPS = {
    "state": STATE,
    "magnet": MAGNET,
    "rods": RODS,
    "imax": ("imax",),
    "gains": GAINS,
    "inertia": INERTIA,
    "albedo": ALBEDO,
    "tilts": TILTS,
}
PROGRAMS = ("als", "alsI0", "alsI23", "alsImax", "alsJ", "alsI0J")
"""The programs of Penkov et al. 2009, sec. 2.2."""
CLASSIC = {
    "als": (),
    "alsi0": ("magnet",),
    "alsi23": ("rods",),
    "alsimax": ("imax",),
    "alsj": ("inertia",),
    "alsi0j": ("magnet", "inertia"),
}
"""Their groups by lower-case name; the scans print I0 as IO or 10."""

UNITS = {
    **dict.fromkeys(("attitude.x", "attitude.y", "attitude.z", *POLAR[1:], *TILTS), "deg"),
    **dict.fromkeys(("rate.x", "rate.y", "rate.z"), "deg/s"),
    **dict.fromkeys((*MAGNET, POLAR[0], *RODS), "A m2"),
    **dict.fromkeys(INERTIA, "kg m2"),
    **dict.fromkeys(GAINS + ALBEDO, "1"),
    "imax": "mA",
}
QUOTED_FIELD = 3.0e-5
"""Field in which results quote the moments of rods [T]."""
TO_UNIT = {**dict.fromkeys((*STATE, *POLAR[1:], *TILTS), math.degrees(1.0)), "imax": 1e3}
"""Factors from SI to the unit of the name; 1 where absent."""


def parse_free(text: str | list[str] | tuple[str, ...]) -> tuple[str, ...]:
    """Names of the free model parameters (the state is always free and not listed): those of motion, then of sensors.

    `text` lists groups (`state,magnet,rods,imax,gains,inertia,albedo,tilts`), classic program names (`als`, `alsI0`,
    ...) and single parameters (`albedo.specular`, `magnet.azimuth`), in any mixture. Raises ValueError naming the
    first unknown item, and where the dipole is asked for both as a vector and by its angles.
    """
    items = text.split(",") if isinstance(text, str) else list(text)
    chosen: set[str] = set()
    for item in (part.strip() for part in items):
        classic = CLASSIC.get(item.lower().replace("sio", "si0").replace("s10", "si0"))
        if classic is not None:
            chosen.update(name for group in classic for name in GROUPS[group])
        elif item in GROUPS:
            chosen.update(GROUPS[item])
        elif item in NAMED or item in STATE:
            chosen.add(item)
        else:
            close = get_close_matches(item, (*GROUPS, *PROGRAMS, *STATE, *NAMED), n=1)
            hint = f" Did you mean {close[0]}?" if close else ""
            known = ", ".join([*GROUPS, *PROGRAMS])
            raise ValueError(
                f"unknown free parameter {item!r}; expected any of {known} or a single name as {MODEL[0]}.{hint}"
            )
    if chosen & set(MAGNET) and chosen & set(POLAR):
        raise ValueError(f"the dipole is free both as a vector and by {', '.join(POLAR)}: ask for one of them")
    return tuple(name for name in DYNAMIC + SENSOR if name in chosen)
