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

    axes = figure.add_axes((0.01, 0.03, 0.55, 0.83))
    axes.set_aspect("equal")
    axes.axis("off")
    greenwich = _greenwich(scene, 0.5 * (scene["begin_s"] + scene["end_s"]))
    _draw_earth(axes, frame, sun, greenwich)
    ellipse = np.asarray(scene["orbit"]["position_km"], float) / radius
    _draw_ellipse(axes, frame, ellipse, np.asarray(scene["orbit"]["lit"], bool))
    _draw_along(axes, frame, scene, position, track["field_uT"])
    reach = 1.45 * np.linalg.norm(ellipse, axis=1).max()
    towards = (frame @ sun)[:2]
    _arrow(axes, 0.55 * reach * towards / np.hypot(*towards), 0.4 * towards, SUN, "Sun")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach * 0.83 * 6.2 / (0.55 * 11.0), reach * 0.83 * 6.2 / (0.55 * 11.0))
    _name_lines(figure)
    for k, t in enumerate(np.linspace(*np.asarray(scene["attitude"]["t_s"])[[0, -1]], INSTANTS)):
        place = (0.575 + 0.21 * (k % 2), 0.46 - 0.44 * (k // 2), 0.205, 0.38)
        _draw_cube(figure.add_axes(place), frame, scene, position, track["field_uT"], sun, float(t))
    return figure


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
    style = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "width": 0.003, "headwidth": 5, "headlength": 6}
    for arrows, colour in ((fields, FIELD), (x_axes, X_AXIS)):
        axes.quiver(*places[shown, :2].T, *arrows[shown, :2].T, color=colour, zorder=6, headaxislength=6, **style)
    for number, t in enumerate(np.linspace(begin, end, INSTANTS), 1):
        place = frame @ _row(scene, position, t)
        # On the orbit's inner side, where no arrow points to for long.
        inward = 1.0 - 0.12 / np.hypot(*place[:2])
        box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": INK, "linewidth": 0.7, "alpha": 0.9}
        style = {"fontsize": 8, "color": INK, "ha": "center", "va": "center", "zorder": 7}
        axes.text(*(inward * place[:2]), str(number), bbox=box, **style)


def _arrow(axes: Axes, origin: np.ndarray, along: np.ndarray, colour: str, label: str = "") -> None:
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 8}
    axes.annotate("", origin + along, origin, arrowprops=style, zorder=6)
    if label:
        axes.text(*(origin + 1.25 * along), label, color=colour, fontsize=9, fontweight="bold", ha="center", va="center")


def _draw_cube(
    axes: Axes,
    frame: Frame,
    scene: Mapping[str, Any],
    position: np.ndarray,
    field: np.ndarray,
    sun: np.ndarray,
    t: float,
) -> None:
    """The satellite at one instant with Sun, field and nadir, in the projection of the orbit."""
    axes.set_aspect("equal")
    axes.axis("off")
    body = frame @ _body(scene, t)
    dark = any(begin <= t <= end for begin, end in scene["shadow_s"])
    ahead = {"Sun": (sun, SUN), "B": (_row(scene, field, t), FIELD), "nadir": (-_row(scene, position, t), FAINT)}
    for name, (vector, colour) in ahead.items():
        direction = frame @ (vector / np.linalg.norm(vector))
        # What points away from the eye goes behind the cube.
        _arrow(axes, np.zeros(2), 1.6 * direction[:2], colour, name)
        axes.texts[-2].set_zorder(7 if direction[2] > 0.0 else 2)
        axes.texts[-2].set_alpha(0.4 if name == "Sun" and dark else 1.0)
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for k, (name, colour) in enumerate(PANEL_COLOURS.items()):
        axis, sign = k // 2, 1.0 - 2.0 * (k % 2)
        normal = sign * body[:, axis]
        if normal[2] <= 0.0:
            continue
        corners = np.insert(square, axis, sign, axis=1) * 0.55 @ body.T
        axes.add_patch(Polygon(corners[:, :2], facecolor=colour, edgecolor=INK, linewidth=0.8, zorder=4))
        if normal[2] > 0.25:
            axes.text(*(0.55 * normal[:2]), name, color="white", fontsize=8, ha="center", va="center", zorder=5)
    number = 1 + round((INSTANTS - 1) * (t - scene["attitude"]["t_s"][0]) / _span(scene))
    axes.set_title(f"{number}: t = {t:.0f} s{', in shadow' if dark else ''}", fontsize=9, color=INK, y=1.0)
    axes.set_xlim(-2.3, 2.3)
    axes.set_ylim(-2.2, 2.2)


def _span(scene: Mapping[str, Any]) -> float:
    return scene["attitude"]["t_s"][-1] - scene["attitude"]["t_s"][0] or 1.0


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
