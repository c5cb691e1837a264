"""What the panels of a box are called, for whoever must not wait for JAX to know it."""

PANEL_NAMES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Natural order of the panels of a box, and of the rows of `spacecraft.box_normals()`."""

TILT_AXES = tuple("xyz".replace(name[1], "") for name in PANEL_NAMES)
"""The two body axes across each panel, about which `spacecraft.tilted` turns it."""
