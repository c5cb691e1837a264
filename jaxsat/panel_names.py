"""What the panels of a box are called and how they are coloured, for whoever must not wait for JAX to know it."""

import os

from jaxsat.errors import InputError

PANEL_NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Natural order of the panels of a box, and of the rows of `spacecraft.box_normals()`."""

TILT_AXES = tuple("xyz".replace(name[1], "") for name in PANEL_NAMES)
"""The two body axes across each panel, about which `spacecraft.tilted` turns it."""

SAFE_COLOURS = {
    "+x": "#0f8a64",
    "-x": "#d99e10",
    "+y": "#a5400b",
    "-y": "#3b9fe8",
    "+z": "#0b3a94",
    "-z": "#c26fa6",
}
"""Green, yellow, brown, light blue, blue, violet as in `PAPER_COLOURS`, in shades that people with red-green blindness
tell apart: a test holds their distances as such people see them (Machado, Oliveira and Fernandes 2009)."""

PAPER_COLOURS = {
    "+x": "#2e8b3d",
    "-x": "#c79a00",
    "+y": "#8a4b20",
    "-y": "#3f9fd8",
    "+z": "#2340a8",
    "-z": "#8e44ad",
}
"""Those of Penkov et al. 2009, dark enough for lines on white; a choice of the reader's in a report."""

SCHEME = os.environ.get("JAXSAT_COLOURS") or "safe"
"""Which of the two pictures have, and a report begins with: `safe` or `paper`."""
if SCHEME not in ("safe", "paper"):
    raise InputError(f"{SCHEME!r} is neither 'safe' nor 'paper'", field="JAXSAT_COLOURS")
PANEL_COLOURS = PAPER_COLOURS if SCHEME == "paper" else SAFE_COLOURS
"""Of panels, and of axes by their positive side, in all pictures."""
