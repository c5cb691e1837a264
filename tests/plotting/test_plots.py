"""Pictures are drawn, not blank, and survive data with gaps."""

import io
import struct

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from jaxsat.plotting import (
    draw_coordinates,
    draw_currents,
    draw_field_angle,
    draw_magnetometers,
    draw_orbit,
    draw_orbit_residuals,
    draw_panel_currents,
    draw_parameters,
    png_bytes,
)
from jaxsat.plotting.currents import SIMULATED
from jaxsat.plotting.style import nice_ceiling, shadow_spans

T = 64.0 * np.arange(30)
LIT = (T < 900) | (T > 1400)
WAVE = np.maximum(np.sin(T[:, None] / 120.0 + np.arange(6)), 0.0) * LIT[:, None] * 200.0
NOISE = np.random.default_rng(0).normal(size=(T.size, 6))
WEIGHT = np.where(WAVE > 0, 1.0, 0.0)
WEIGHT[3:5] *= 0.1
WEIGHT[6] = 0.0


def currents(**changes):
    arguments = {"weight": WEIGHT, "lit": LIT, "limited": T == 640.0, "subtitle": "synthetic", **changes}
    return draw_currents(T, WAVE + NOISE * (WAVE > 0), WAVE, 0.8 * WAVE, **arguments)


def field_angle(sigma):
    return draw_field_angle(T, 10 + np.sin(T / 99), sigma, attitude_sigma_deg=np.tile(sigma[:, None], 3), lit=LIT)


def scene(shadow: bool) -> dict:
    """A circular polar orbit with the Sun on the x axis."""
    u = np.linspace(0.0, np.pi, 33)
    ellipse = np.linspace(0.0, 2.0 * np.pi, 61)

    def circle(angle, radius):
        return (radius * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)).tolist()

    lit = 1 - (np.cos(ellipse) < -0.5) * shadow
    return {
        "begin_s": 0.0,
        "end_s": 3000.0,
        "earth": {"radius_km": 6371.2, "greenwich_angle_rad": 1.0, "rotation_rate_rad_s": 7.3e-5},
        "sun_eci": [[1.0, 0.0, 0.0]] * 3,
        "shadow_s": [[2000.0, 3000.0]] if shadow else [],
        "orbit": {"period_s": 6000.0, "position_km": circle(ellipse, 7200.0), "lit": lit.tolist()},
        "track": {
            "position_km": circle(u, 7200.0),
            "velocity_km_s": circle(u + np.pi / 2, 7.4),
            "field_uT": circle(3 * u, 30.0),
        },
        "field_lines_km": None,
        "attitude": {"t_s": T.tolist(), "quaternion_inertial_from_body": [[0.6, 0.8, 0.0, 0.0]] * T.size},
    }


FIGURES = {
    "orbit": lambda: draw_orbit(scene(shadow=True), subtitle="synthetic"),
    "orbit, never dark": lambda: draw_orbit(scene(shadow=False)),
    "currents": currents,
    "currents, nothing used": lambda: currents(weight=0.0 * WEIGHT, limited=None),
    "field angle": lambda: field_angle(np.full(T.size, 0.3)),
    "field angle, sigma unknown": lambda: field_angle(np.full(T.size, np.nan)),
    "parameters": lambda: draw_parameters(
        [("magnet.x", "0.3050", "0.0012", "A m²", ""), ("imax", "240.0", "", "mA", "fixed")], footer=["Gauge: none"]
    ),
    "coordinates": lambda: draw_coordinates(T, NOISE[:, :3], T, NOISE[:, :3]),
    "magnetometers": lambda: draw_magnetometers(T, NOISE[:, :2], T, np.where(NOISE[:, :2] > 1, np.nan, NOISE[:, :2])),
    "magnetometers, no reading": lambda: draw_magnetometers(
        T, np.full((T.size, 2), 999.9), T, np.full((T.size, 2), np.nan)
    ),
    "panel currents": lambda: draw_panel_currents(T - 86400.0 * (T == 64), 9 * WAVE, T, WAVE, raw_used=T > 70, lit=LIT),
    "orbit residuals": lambda: draw_orbit_residuals(T, NOISE[:, :3], 0.1 * NOISE[:, :3]),
}


@pytest.mark.parametrize("name", FIGURES)
def test_picture_is_a_png_with_something_on_it(name):
    png = png_bytes(FIGURES[name]())
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", png[16:24])
    assert 800 <= width <= 1400 and 100 <= height <= 1400
    pixels = imread(io.BytesIO(png))[..., :3]
    assert pixels.std() > 0.03
    # Ink in every quarter but for short tables: nothing has slipped off the page.
    if height > 400:
        half_x, half_y = width // 2, height // 2
        for part in (
            pixels[:half_y, :half_x],
            pixels[:half_y, half_x:],
            pixels[half_y:, :half_x],
            pixels[half_y:, half_x:],
        ):
            assert part.std() > 0.02


def test_words_beside_a_cube_keep_apart():
    """Nadir and field along one line, and the Sun along the eye's: no name lies on another, or out of sight."""
    held = scene(shadow=False)
    held["track"]["field_uT"] = (-30.0 * np.asarray(held["track"]["position_km"]) / 7200.0).tolist()
    figure = draw_orbit(held)
    renderer = FigureCanvasAgg(figure).get_renderer()
    names = [text for text in figure.axes[0].texts if text.get_text() in ("Sun", "B", "nadir")]
    boxes = [text.get_window_extent(renderer) for text in names]
    # Four cubes of three, and the Sun of the orbit.
    assert len(boxes) == 13
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    assert all(0.0 < box.y0 and box.y1 < figure.bbox.height for box in boxes)


def test_simulated_currents_are_called_so():
    texts = [text.get_text() for text in currents(words=SIMULATED).legends[0].get_texts()]
    assert texts[0].startswith("simulated") and not any("fit" in text or "measured" in text for text in texts)


def test_equal_data_give_equal_bytes():
    assert png_bytes(FIGURES["orbit residuals"]()) == png_bytes(FIGURES["orbit residuals"]())


def test_shadow_spans_end_half_way_between_samples():
    t = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    assert shadow_spans(t, np.array([True, False, False, True, True])) == [(5.0, 25.0)]
    assert shadow_spans(t, np.array([False, True, True, True, False])) == [(0.0, 5.0), (35.0, 40.0)]
    assert shadow_spans(t, np.ones(5, bool)) == []


@pytest.mark.parametrize(
    ("value", "expected"), [(0.0, 1.0), (np.nan, 1.0), (1.0, 1.0), (271.0, 300.0), (0.0061, 0.008)]
)
def test_nice_ceiling(value, expected):
    assert nice_ceiling(value) == pytest.approx(expected)
