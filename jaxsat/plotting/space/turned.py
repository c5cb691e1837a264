"""A turn of the satellite in space: Earth, orbit, Sun and field at its instant, and how it stands at some angles."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.space.drawing import (
    FIELD,
    MERIDIANS,
    NADIR,
    ORBIT,
    SHADOW_ARC,
    SUN,
    arrows,
    draw_cube,
    draw_earth,
    draw_ellipse,
    looking,
    name_lines,
    write,
)
from jaxsat.plotting.style import FAINT, INK, new_figure

SMALL, LARGE = 0.036, 0.085
"""Half an edge of the cubes, shares of the picture's height."""


def draw_turn_in_space(
    bodies: np.ndarray,
    angles_deg: Sequence[float],
    *,
    position: np.ndarray,
    velocity: np.ndarray,
    ellipse: np.ndarray,
    lit: np.ndarray,
    sun: np.ndarray,
    field: np.ndarray,
    greenwich: float,
    title: str,
    subtitle: str = "",
) -> Figure:
    """Returns the picture: the first of `bodies` [angles 3 3] large, the others small below it.

    `bodies` have the body axes as columns, inertial components as all vectors; `position` [3] and `ellipse` [points 3]
    are in Earth radii, `lit` [points] says where the orbit is, `greenwich` is a right ascension [rad].
    """
    figure = new_figure(11.0, 6.2, title, subtitle)
    frame = looking(position[None], velocity[None])
    high = 2.9 * float(np.linalg.norm(ellipse, axis=1).max())
    wide = high * 11.0 / 6.2
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    axes.set_xlim(-0.29 * wide, 0.71 * wide)
    axes.set_ylim(-0.46 * high, 0.54 * high)
    draw_earth(axes, frame, sun, greenwich)
    axes.set_aspect("equal")
    draw_ellipse(axes, frame, ellipse, lit)
    place = (frame @ position)[:2]
    ahead = {"Sun": (sun, SUN), "B": (field, FIELD), "nadir": (-position, NADIR)}
    for vector, colour in list(ahead.values())[:2]:
        arrows(axes, place[None], 0.4 * (frame @ (vector / np.linalg.norm(vector)))[None, :2], colour)
    axes.plot(*place, "o", color=INK, markersize=4.5, zorder=7)
    dark = bool(position @ sun < 0.0 and np.linalg.norm(position - (position @ sun) * sun) < 1.0)
    large, *small = angles_deg
    where = np.array([wide * 0.49, high * 0.16])
    draw_cube(axes, where, LARGE * high, frame, bodies[0], ahead, dark=dark)
    write(axes, where + [0.0, 0.3 * high], f"turned by {large:.4g} deg", fontweight="bold")
    for k, (angle, body) in enumerate(zip(small, bodies[1:], strict=True)):
        where = np.array([wide * (0.30 + 0.36 * k / max(len(small) - 1, 1)), -0.27 * high])
        near = {name: ahead[name] for name in ("Sun", "B")}
        draw_cube(axes, where, SMALL * high, frame, body, near, dark=dark)
        write(axes, where + [0.0, 0.16 * high], f"{angle:.4g} deg", color=FAINT)
    name_lines(figure, {"orbit": ORBIT, "in shadow": SHADOW_ARC, "field B": FIELD} | MERIDIANS)
    return figure
