"""The orbit about the Earth with day, night and shadow, and how the satellite stands on it, from the scene of a fit."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from scipy.spatial.transform import Rotation

from jaxsat.plotting.style import FAINT, INK, PANEL_COLOURS, new_figure

DAY, NIGHT, LINES = np.array([0.83, 0.90, 0.95]), np.array([0.42, 0.48, 0.56]), "#9db2c4"
ORBIT, SHADOW_ARC, SUN, FIELD, X_AXIS = "#14497a", "#3a3f4a", "#d97706", "#c2255c", "#2e8b3d"
EQUATOR, GREENWICH = "#0f766e", "#6d28d9"
INSTANTS, ARROWS, PIXELS = 4, 19, 260
"""Cubes beside the orbit, arrows along it, and the Earth's picture from edge to edge."""
TWILIGHT = 0.05

Frame = np.ndarray
"""[3 3] rows: right, up and towards the eye, inertial components."""


def draw_orbit(scene: Mapping[str, Any], *, title: str = "Orbit and attitude", subtitle: str = "") -> Figure:
    """Returns the picture of a scene (as in scene.json): parallel projection onto a plane near that of the orbit."""
    figure = new_figure(11.0, 6.2, title, subtitle)
    track = {name: np.asarray(values, float) for name, values in scene["track"].items()}
    radius = scene["earth"]["radius_km"]
    position = track["position_km"] / radius
    sun = np.asarray(scene["sun_eci"], float)[len(scene["sun_eci"]) // 2]
    frame = _looking(position, track["velocity_km_s"])

    ellipse = np.asarray(scene["orbit"]["position_km"], float) / radius
    # One pair of axes in Earth radii for all: each further one costs as much as what is drawn on it.
    high = 2.9 * np.linalg.norm(ellipse, axis=1).max()
    wide = high * 11.0 / 6.2
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    axes.set_xlim(-0.29 * wide, 0.71 * wide)
    axes.set_ylim(-0.46 * high, 0.54 * high)
    _draw_earth(axes, frame, sun, _greenwich(scene, 0.5 * (scene["begin_s"] + scene["end_s"])))
    axes.set_aspect("equal")
    _draw_ellipse(axes, frame, ellipse, np.asarray(scene["orbit"]["lit"], bool))
    _draw_along(axes, frame, scene, position, track["field_uT"])
    towards = (frame @ sun)[:2]
    start = 0.275 * high * towards / np.hypot(*towards)
    _arrows(axes, start[None], 0.4 * towards[None], SUN)
    _write(axes, start + 0.52 * towards, "Sun", color=SUN, fontweight="bold")
    _name_lines(figure)
    for k, t in enumerate(np.linspace(scene["attitude"]["t_s"][0], scene["attitude"]["t_s"][-1], INSTANTS)):
        place = np.array([wide * (0.39 + 0.205 * (k % 2)), high * (0.19 - 0.45 * (k // 2))])
        _draw_cube(axes, place, 0.055 * high, frame, scene, position, track["field_uT"], sun, float(t))
        dark = any(begin <= t <= end for begin, end in scene["shadow_s"])
        name = f"{k + 1}: t = {t:.0f} s{', in shadow' if dark else ''}"
        _write(axes, place + [0.0, 0.21 * high], name)
    return figure


def _write(axes: Axes, place: np.ndarray, text: str, **style: Any) -> None:
    look = {"fontsize": 9, "color": INK, "ha": "center", "va": "center", **style}
    axes.text(float(place[0]), float(place[1]), text, **look)


def _looking(position: np.ndarray, velocity: np.ndarray) -> Frame:
    """From above the orbit's plane, leaning to the middle of the arc and to the north."""
    normal = np.cross(position[0], velocity[0])
    eye = normal / np.linalg.norm(normal)
    middle = position[len(position) // 2]
    eye = eye + 0.55 * middle / np.linalg.norm(middle) + np.array([0.0, 0.0, 0.35])
    eye /= np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def _greenwich(scene: Mapping[str, Any], t: float) -> float:
    return scene["earth"]["greenwich_angle_rad"] + scene["earth"]["rotation_rate_rad_s"] * t


def _row(scene: Mapping[str, Any], table: np.ndarray, t: float) -> np.ndarray:
    times = np.linspace(scene["begin_s"], scene["end_s"], len(table))
    return np.array([np.interp(t, times, column) for column in table.T])


def _body(scene: Mapping[str, Any], t: float) -> np.ndarray:
    """Columns are body axes, inertial components, of the node nearest to t."""
    k = int(np.argmin(np.abs(np.asarray(scene["attitude"]["t_s"]) - t)))
    w, x, y, z = scene["attitude"]["quaternion_inertial_from_body"][k]
    return Rotation.from_quat([x, y, z, w]).as_matrix()


def _draw_earth(axes: Axes, frame: Frame, sun: np.ndarray, greenwich: float) -> None:
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


def _sphere(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    across = np.cos(latitude)
    return np.stack([across * np.cos(longitude), across * np.sin(longitude), np.sin(latitude)], axis=-1)


def _draw_visible(axes: Axes, frame: Frame, lines: list[np.ndarray], colour: str, width: float) -> None:
    shown = []
    for points in (line @ frame.T for line in lines):
        points = np.where(points[:, 2:] > 0.0, points, np.nan)
        shown.append(points[:, :2])
    axes.add_collection(LineCollection(shown, colors=colour, linewidths=width, zorder=2))


def _draw_ellipse(axes: Axes, frame: Frame, ellipse: np.ndarray, lit: np.ndarray) -> None:
    points = ellipse @ frame.T
    pairs = np.stack([points[:-1, :2], points[1:, :2]], axis=1)
    hidden = (points[:-1, 2] < 0.0) & (np.hypot(points[:-1, 0], points[:-1, 1]) < 1.0)
    for dark, colour, width in ((False, ORBIT, 1.3), (True, SHADOW_ARC, 3.0)):
        wanted = lit[:-1] != dark
        for behind, alpha in ((False, 1.0), (True, 0.18)):
            segments = list(pairs[wanted & (hidden == behind)])
            axes.add_collection(LineCollection(segments, colors=colour, linewidths=width, alpha=alpha, zorder=4))


def _draw_along(axes: Axes, frame: Frame, scene: Mapping[str, Any], position: np.ndarray, field: np.ndarray) -> None:
    begin, end = scene["attitude"]["t_s"][0], scene["attitude"]["t_s"][-1]
    times = np.linspace(begin, end, ARROWS)
    places = np.stack([_row(scene, position, t) for t in times]) @ frame.T
    shown = (places[:, 2] > 0.0) | (np.hypot(places[:, 0], places[:, 1]) > 1.0)
    fields = np.stack([_row(scene, field, t) for t in times]) @ frame.T
    fields *= 0.26 / np.linalg.norm(fields, axis=1, keepdims=True)
    x_axes = 0.2 * np.stack([_body(scene, t)[:, 0] for t in times]) @ frame.T
    for arrows, colour in ((fields, FIELD), (x_axes, X_AXIS)):
        _arrows(axes, places[shown, :2], arrows[shown, :2], colour)
    for number, t in enumerate(np.linspace(begin, end, INSTANTS), 1):
        place = frame @ _row(scene, position, t)
        # On the orbit's inner side, where no arrow points to for long.
        inward = 1.0 - 0.12 / np.hypot(*place[:2])
        box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": INK, "linewidth": 0.7, "alpha": 0.9}
        _write(axes, inward * place, str(number), bbox=box, fontsize=8, zorder=7)


def _arrows(axes: Axes, origin: np.ndarray, along: np.ndarray, colour: str, **style: Any) -> None:
    """Arrows [n 2] in the units of the axes."""
    shape = {"width": 0.0014, "headwidth": 6, "headlength": 7, "headaxislength": 7, "zorder": 6, **style}
    axes.quiver(*origin.T, *along.T, color=colour, angles="xy", scale_units="xy", scale=1.0, **shape)


def _draw_cube(
    axes: Axes,
    place: np.ndarray,
    half: float,
    frame: Frame,
    scene: Mapping[str, Any],
    position: np.ndarray,
    field: np.ndarray,
    sun: np.ndarray,
    t: float,
) -> None:
    """The satellite at one instant, `half` half an edge, with Sun, field and nadir, in the projection of the orbit."""
    body = frame @ _body(scene, t)
    dark = any(begin <= t <= end for begin, end in scene["shadow_s"])
    ahead = {"Sun": (sun, SUN), "B": (_row(scene, field, t), FIELD), "nadir": (-_row(scene, position, t), FAINT)}
    for name, (vector, colour) in ahead.items():
        direction = frame @ (vector / np.linalg.norm(vector))
        along, alpha = direction[:2], 0.45 if name == "Sun" and dark else 1.0
        # What points away from the eye goes behind the cube.
        level = 7 if direction[2] > 0.0 else 2
        _arrows(axes, place[None], 2.7 * half * along[None], colour, zorder=level, alpha=alpha)
        outward = along / max(float(np.hypot(*along)), 1e-9)
        end = place + half * (2.7 * along + 0.45 * outward)
        _write(axes, end, name, color=colour, alpha=alpha, fontweight="bold")
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for k, (name, colour) in enumerate(PANEL_COLOURS.items()):
        axis, sign = k // 2, 1.0 - 2.0 * (k % 2)
        normal = sign * body[:, axis]
        if normal[2] <= 0.0:
            continue
        corners = place + half * (np.insert(square, axis, sign, axis=1) @ body.T)[:, :2]
        axes.add_patch(Polygon(corners, facecolor=colour, edgecolor=INK, linewidth=0.8, zorder=4))
        if normal[2] > 0.25:
            _write(axes, place + half * normal[:2], name, color="white", fontsize=7, zorder=5)


def _name_lines(figure: Figure) -> None:
    names = (("orbit", ORBIT), ("in shadow", SHADOW_ARC), ("body x", X_AXIS), ("field B", FIELD))
    names += (("equator", EQUATOR), ("Greenwich", GREENWICH), ("Sun's meridian", SUN))
    handles = [Polygon([(0, 0)], facecolor=colour, label=name) for name, colour in names]
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
