"""Earth, orbit and satellite in space, in parallel projection: what pictures of orbits and of turns are drawn of."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.patheffects import withStroke

from jaxsat.plotting.style import AXIS_COLOURS, FAINT, INK, MAIN, PANEL_COLOURS

DAY, NIGHT, LINES = np.array([0.83, 0.90, 0.95]), np.array([0.42, 0.48, 0.56]), "#9db2c4"
ORBIT, SHADOW_ARC, SUN, FIELD, NADIR, X_AXIS = (
    MAIN,
    "#3a3f4a",
    "#d98e00",
    "#c81fb0",
    "#4b5563",
    AXIS_COLOURS["x"],
)
EQUATOR, GREENWICH = "#0891b2", "#6d28d9"
PIXELS = 260
"""Of the Earth's picture from edge to edge."""
TWILIGHT = 0.05
RIM = [withStroke(linewidth=2.5, foreground="white")]
LABEL_HALVES = (1.5, 0.6)
"""Room of a word beside a cube, across and up, in halves of its edge."""
MERIDIANS = {"equator": EQUATOR, "Greenwich": GREENWICH, "Sun's meridian": SUN}
"""Lines on the Earth and their colours."""

Frame = np.ndarray
"""[3 3] rows: right, up and towards the eye, inertial components."""


def looking(position: np.ndarray, velocity: np.ndarray) -> Frame:
    """From above the orbit's plane, leaning to the middle of the arc and to the north."""
    normal = np.cross(position[0], velocity[0])
    eye = normal / np.linalg.norm(normal)
    middle = position[len(position) // 2]
    eye = eye + 0.55 * middle / np.linalg.norm(middle) + np.array([0.0, 0.0, 0.35])
    eye /= np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def draw_earth(axes: Axes, frame: Frame, sun: np.ndarray, greenwich: float) -> None:
    """The Earth of radius 1 with day and night, and Greenwich at a right ascension [rad]."""
    grid = np.linspace(-1.0, 1.0, PIXELS)
    x, y = np.meshgrid(grid, grid)
    depth = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    light = np.clip(np.stack([x, y, depth], axis=-1) @ (frame @ sun) / TWILIGHT + 0.5, 0.0, 1.0)[..., None]
    colour = light * DAY + (1.0 - light) * NIGHT
    inside = (x * x + y * y <= 1.0).astype(float)[..., None]
    axes.imshow(np.concatenate([colour, inside], axis=-1), extent=(-1, 1, -1, 1), origin="lower", zorder=1)
    axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, edgecolor=FAINT, linewidth=0.9, zorder=3))
    along, half = np.linspace(-np.pi, np.pi, 121), np.linspace(-np.pi / 2, np.pi / 2, 61)
    lines = [_sphere(along, np.full(121, b)) for b in np.radians(np.arange(-75, 76, 15))]
    lines += [_sphere(np.full(61, greenwich + a), half) for a in np.radians(np.arange(0, 360, 15))]
    _draw_visible(axes, frame, lines, LINES, 0.5)
    _draw_visible(axes, frame, [_sphere(along, 0.0 * along)], EQUATOR, 1.4)
    _draw_visible(axes, frame, [_sphere(np.full(61, greenwich), half)], GREENWICH, 1.4)
    _draw_visible(axes, frame, [_sphere(np.full(61, np.arctan2(sun[1], sun[0])), half)], SUN, 1.4)


def draw_ellipse(axes: Axes, frame: Frame, ellipse: np.ndarray, lit: np.ndarray) -> None:
    """An orbit [points 3] in Earth radii, where `lit` in another way than in the shadow."""
    points = ellipse @ frame.T
    pairs = np.stack([points[:-1, :2], points[1:, :2]], axis=1)
    hidden = (points[:-1, 2] < 0.0) & (np.hypot(points[:-1, 0], points[:-1, 1]) < 1.0)
    for dark, colour, width in ((False, ORBIT, 1.3), (True, SHADOW_ARC, 3.0)):
        wanted = lit[:-1] != dark
        for behind, alpha in ((False, 1.0), (True, 0.18)):
            segments = list(pairs[wanted & (hidden == behind)])
            axes.add_collection(LineCollection(segments, colors=colour, linewidths=width, alpha=alpha, zorder=4))


def draw_cube(
    axes: Axes,
    place: np.ndarray,
    half: float,
    frame: Frame,
    body: np.ndarray,
    ahead: Mapping[str, tuple[np.ndarray, str]],
    *,
    dark: bool = False,
) -> None:
    """The satellite, `half` half an edge, and by their names arrows of vectors and their colours from it.

    `body` has the body axes as columns, inertial components as those of the vectors. In the `dark` the Sun is faint.
    """
    body = frame @ body
    ends: list[np.ndarray] = []
    for name, (vector, colour) in ahead.items():
        direction = frame @ (vector / np.linalg.norm(vector))
        along, alpha = direction[:2], 0.45 if name == "Sun" and dark else 1.0
        # What points away from the eye goes behind the cube.
        level = 7 if direction[2] > 0.0 else 2
        arrows(axes, place[None], 2.7 * half * along[None], colour, zorder=level, alpha=alpha)
        outward = along / max(float(np.hypot(*along)), 1e-9)
        end = aside(axes, place + half * (2.7 * along + 0.45 * outward), ends, half)
        ends.append(end)
        # Above the faces, with a rim: an arrow to the eye ends on them.
        write(axes, end, name, color=colour, alpha=alpha, fontweight="bold", zorder=8, path_effects=RIM)
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for k, (name, colour) in enumerate(PANEL_COLOURS.items()):
        axis, sign = k // 2, 1.0 - 2.0 * (k % 2)
        normal = sign * body[:, axis]
        if normal[2] <= 0.0:
            continue
        corners = place + half * (np.insert(square, axis, sign, axis=1) @ body.T)[:, :2]
        axes.add_patch(Polygon(corners, facecolor=colour, edgecolor=INK, linewidth=0.8, zorder=4))
        if normal[2] > 0.25:
            write(axes, place + half * normal[:2], name, color="white", fontsize=7, zorder=5)


def aside(axes: Axes, end: np.ndarray, taken: Sequence[np.ndarray], half: float) -> np.ndarray:
    """Returns a place for a word, moved up or down by as little as leaves those that are taken free, and in sight.

    `half` is that of an edge of the cubes, in the units of the axes.
    """
    wide, tall = LABEL_HALVES[0] * half, LABEL_HALVES[1] * half
    low, high = axes.get_ylim()
    tried = [end + [0.0, step * tall] for step in (0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0)]

    def free(at: np.ndarray) -> bool:
        seen = low + 0.5 * tall < at[1] < high - 0.5 * tall
        return bool(seen) and all(_apart(at - other, wide, tall) >= 1.0 for other in taken)

    return next(filter(free, tried), end)


def _apart(between: np.ndarray, wide: float, tall: float) -> float:
    """At least 1 where two words so far from each other do not touch."""
    return float(max(abs(between[0]) / wide, abs(between[1]) / tall))


def arrows(axes: Axes, origin: np.ndarray, along: np.ndarray, colour: str, **style: Any) -> None:
    """Arrows [n 2] in the units of the axes."""
    shape = {"width": 0.0014, "headwidth": 6, "headlength": 7, "headaxislength": 7, "zorder": 6, **style}
    axes.quiver(*origin.T, *along.T, color=colour, angles="xy", scale_units="xy", scale=1.0, **shape)


def write(axes: Axes, place: np.ndarray, text: str, **style: Any) -> None:
    """A word at a place [2]."""
    look = {"fontsize": 9, "color": INK, "ha": "center", "va": "center", **style}
    axes.text(float(place[0]), float(place[1]), text, **look)


def name_lines(figure: Figure, colours: Mapping[str, str]) -> None:
    """What lines of these colours are, above the picture."""
    handles = [Polygon([(0, 0)], facecolor=colour, label=name) for name, colour in colours.items()]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.002, 0.925),
        ncols=len(handles),
        fontsize=8.5,
        frameon=False,
        handlelength=1.0,
        handleheight=0.4,
        columnspacing=1.4,
    )


def _sphere(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    across = np.cos(latitude)
    return np.stack([across * np.cos(longitude), across * np.sin(longitude), np.sin(latitude)], axis=-1)


def _draw_visible(axes: Axes, frame: Frame, lines: list[np.ndarray], colour: str, width: float) -> None:
    shown = []
    for points in (line @ frame.T for line in lines):
        points = np.where(points[:, 2:] > 0.0, points, np.nan)
        shown.append(points[:, :2])
    axes.add_collection(LineCollection(shown, colors=colour, linewidths=width, zorder=2))
