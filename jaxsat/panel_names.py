"""What the panels of a box are called and how they are coloured, for whoever must not wait for JAX to know it."""

PANEL_NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Natural order of the panels of a box, and of the rows of `spacecraft.box_normals()`."""

TILT_AXES = tuple("xyz".replace(name[1], "") for name in PANEL_NAMES)
"""The two body axes across each panel, about which `spacecraft.tilted` turns it."""

PANEL_COLOURS = {
    "+x": "#2e8b3d",
    "-x": "#c79a00",
    "+y": "#8a4b20",
    "-y": "#3f9fd8",
    "+z": "#2340a8",
    "-z": "#8e44ad",
}
"""Those of Penkov et al. 2009 (green, yellow, brown, light blue, blue, violet), dark enough for lines on white."""
