"""The orbit about the Earth with day, night and shadow, and how the satellite stands on it, from the scene of a fit."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from jaxsat.plotting.space.drawing import (
    FIELD,
    MERIDIANS,
    NADIR,
    ORBIT,
    RIM,
    SHADOW_ARC,
    SUN,
    X_AXIS,
    Frame,
    arrows,
    aside,
    draw_cube,
    draw_earth,
    draw_ellipse,
    looking,
    name_lines,
    write,
)
from jaxsat.plotting.style import INK, new_figure

INSTANTS, ARROWS = 4, 19
"""Cubes beside the orbit, and arrows along it."""


def draw_orbit(scene: Mapping[str, Any], *, title: str = "Orbit and attitude", subtitle: str = "") -> Figure:
    """Returns the picture of a scene (as in scene.json): parallel projection onto a plane near that of the orbit."""
    figure = new_figure(11.0, 6.2, title, subtitle)
    track = {name: np.asarray(values, float) for name, values in scene["track"].items()}
    radius = scene["earth"]["radius_km"]
    position = track["position_km"] / radius
    sun = np.asarray(scene["sun_eci"], float)[len(scene["sun_eci"]) // 2]
    frame = looking(position, track["velocity_km_s"])

    ellipse = np.asarray(scene["orbit"]["position_km"], float) / radius
    # One pair of axes in Earth radii for all: each further one costs as much as what is drawn on it.
    high = 2.9 * np.linalg.norm(ellipse, axis=1).max()
    wide = high * 11.0 / 6.2
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    axes.set_xlim(-0.29 * wide, 0.71 * wide)
    axes.set_ylim(-0.46 * high, 0.54 * high)
    draw_earth(axes, frame, sun, _greenwich(scene, 0.5 * (scene["begin_s"] + scene["end_s"])))
    axes.set_aspect("equal")
    draw_ellipse(axes, frame, ellipse, np.asarray(scene["orbit"]["lit"], bool))
    _draw_along(axes, frame, scene, position, track["field_uT"])
    towards = (frame @ sun)[:2]
    start = 0.275 * high * towards / np.hypot(*towards)
    arrows(axes, start[None], 0.4 * towards[None], SUN)
    numbers = _number_places(frame, scene, position)
    name = aside(axes, start + 0.52 * towards, numbers, 0.055 * high)
    write(axes, name, "Sun", color=SUN, fontweight="bold", path_effects=RIM, zorder=8)
    colours = {"orbit": ORBIT, "in shadow": SHADOW_ARC, "body x": X_AXIS, "field B": FIELD}
    name_lines(figure, colours | MERIDIANS)
    for k, t in enumerate(np.linspace(scene["attitude"]["t_s"][0], scene["attitude"]["t_s"][-1], INSTANTS)):
        place = np.array([wide * (0.39 + 0.205 * (k % 2)), high * (0.19 - 0.45 * (k // 2))])
        dark = any(begin <= t <= end for begin, end in scene["shadow_s"])
        ahead = {"Sun": (sun, SUN), "B": (_row(scene, track["field_uT"], float(t)), FIELD)}
        ahead["nadir"] = (-_row(scene, position, float(t)), NADIR)
        draw_cube(axes, place, 0.055 * high, frame, _body(scene, float(t)), ahead, dark=dark)
        name = f"{k + 1}: t = {t:.0f} s{', in shadow' if dark else ''}"
        write(axes, place + [0.0, 0.21 * high], name)
    return figure


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


def _draw_along(axes: Axes, frame: Frame, scene: Mapping[str, Any], position: np.ndarray, field: np.ndarray) -> None:
    begin, end = scene["attitude"]["t_s"][0], scene["attitude"]["t_s"][-1]
    times = np.linspace(begin, end, ARROWS)
    places = np.stack([_row(scene, position, t) for t in times]) @ frame.T
    shown = (places[:, 2] > 0.0) | (np.hypot(places[:, 0], places[:, 1]) > 1.0)
    fields = np.stack([_row(scene, field, t) for t in times]) @ frame.T
    fields *= 0.26 / np.linalg.norm(fields, axis=1, keepdims=True)
    x_axes = 0.2 * np.stack([_body(scene, t)[:, 0] for t in times]) @ frame.T
    for vectors, colour in ((fields, FIELD), (x_axes, X_AXIS)):
        arrows(axes, places[shown, :2], vectors[shown, :2], colour)
    for number, place in enumerate(_number_places(frame, scene, position), 1):
        box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": INK, "linewidth": 0.7, "alpha": 0.9}
        write(axes, place, str(number), bbox=box, fontsize=8, zorder=7)


def _number_places(frame: Frame, scene: Mapping[str, Any], position: np.ndarray) -> list[np.ndarray]:
    """Of the instants that are drawn, on the orbit's inner side, where no arrow points to for long."""
    begin, end = scene["attitude"]["t_s"][0], scene["attitude"]["t_s"][-1]
    places = (frame @ _row(scene, position, float(t)) for t in np.linspace(begin, end, INSTANTS))
    return [(1.0 - 0.12 / np.hypot(*place[:2])) * place[:2] for place in places]
