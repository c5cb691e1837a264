"""Pictures of channels are drawn for one reading and for many, with gaps, and where nothing was used."""

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from scipy.spatial.transform import Rotation

from jaxsat.plotting import png_bytes
from jaxsat.plotting.channels import Readings, Timeline, column_colours, draw_motion, draw_readings, draw_worth
from jaxsat.plotting.channels.timeline import HELD_OUT
from jaxsat.plotting.style import AXIS_COLOURS

T = 5.0 * np.arange(40)
FITTED = T < 120.0
TIMELINE = Timeline.of(T, FITTED, np.where((T > 30.0) & (T < 60.0), 0.0, 1.0))


def readings(count: int, differences: int | None = None) -> Readings:
    rng = np.random.default_rng(count)
    names = tuple(f"c{k}" for k in range(count))
    residual = rng.normal(size=(len(T), differences or count))
    modelled = np.sin(T[:, None] / 20.0 + np.arange(count))
    return Readings(
        t_s=T,
        columns=names,
        measured=modelled + 0.01 * rng.normal(size=modelled.shape),
        modelled=modelled,
        differences=names if differences is None else tuple("xyz"[:differences]),
        residual=residual,
        promised=np.ones_like(residual),
        used=T != 50.0,
    )


def drawn(figure) -> np.ndarray:
    pixels = imread(io.BytesIO(png_bytes(figure)))[..., :3]
    assert pixels.std() > 0.02
    return pixels


def share(pixels: np.ndarray, colour: str) -> float:
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    # Shades are laid over white at four fifths.
    return float((np.abs(pixels - (0.8 * wanted + 0.2)).max(axis=2) < 0.01).mean())


@pytest.mark.slow
@pytest.mark.parametrize(("count", "differences"), [(1, None), (3, None), (8, None), (4, 3)])
def test_every_reading_has_a_chart(count, differences):
    figure = draw_readings(readings(count, differences), TIMELINE, unit="nT", title="mag")
    assert len(figure.axes) == count + (differences or count)
    # Charts with their titles do not run into each other.
    boxes = [axes.get_position() for axes in figure.axes]
    for number, box in enumerate(boxes):
        assert box.x0 > 0.0 and box.y0 > 0.0 and box.x1 < 1.0 and box.y1 < 1.0
        assert not any(box.overlaps(other) for other in boxes[number + 1 :])
    # A third of the time is held out.
    assert share(drawn(figure), HELD_OUT) > 0.08


@pytest.mark.parametrize("lost", ["measured", "residual"])
def test_gaps_and_nothing_used(lost):
    own = readings(1)
    gone = np.full_like(getattr(own, lost), np.nan)
    drawn(draw_readings(replace(own, **{lost: gone, "used": np.zeros(len(T), bool)}), TIMELINE, unit="", title="mag"))


def test_wild_readings_do_not_flatten_the_others():
    own = readings(1)
    own.measured[10] = 1e6
    own.residual[10] = 1e8
    figure = draw_readings(own, TIMELINE, unit="nT", title="mag")
    assert figure.axes[0].get_ylim()[1] < 2.0 and figure.axes[1].get_ylim()[1] < 10.0
    residual = np.zeros((len(T), 1))
    residual[:3, 0] = np.nan, 7.0, 1e9
    assert replace(own, residual=residual, used=T != 10.0).reach() == 8.0


def test_panels_share_a_scale_and_show_direct_light_and_doubt():
    own = readings(4)
    light = np.zeros(own.residual.shape, bool)
    light[20, 1] = True
    modelled = 100.0 * np.abs(own.modelled) * [1.0, 0.5, 0.1, 0.0]
    own = replace(own, measured=modelled, modelled=modelled, direct=0.8 * modelled, shared=True, reduced=light)
    figure = draw_readings(own, TIMELINE, unit="mA", title="cells")
    charts = figure.axes[::2]
    assert {axes.get_ylim() for axes in charts} == {own.limits(0)} == {(-4.5, 150.0)}
    # The model's curve, the direct light's, and hollow one of the second panel.
    np.testing.assert_array_equal(charts[1].get_lines()[0].get_ydata(), 0.8 * modelled[:, 1])
    hollow = [[np.size(line.get_xdata()) for line in axes.get_lines() if line.get_marker() == "o"] for axes in charts]
    assert hollow == [[0], [1], [0], [0]]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"direct sunlight alone", "weighed down", "left out of the fit"} <= set(texts)
    drawn(figure)


def test_timeline_ends_half_way_between_samples():
    assert TIMELINE.held_out == [(117.5, 195.0)] and TIMELINE.shadow == [(32.5, 57.5)]
    assert Timeline.of(T, FITTED | True, None) == Timeline(0.0, 195.0, [], [])


def test_motion_with_and_without_sigma():
    rates = np.stack([np.sin(T / 9.0), np.cos(T / 9.0), 0.0 * T], axis=1)
    turn = Rotation.from_rotvec(np.outer(T, [0.0, 0.05, 0.0])).as_quat(scalar_first=True)
    flipped = turn * np.where(np.arange(len(T)) % 2, -1.0, 1.0)[:, None]
    figure = draw_motion(T, flipped, rates, np.full((len(T), 3), 0.3), TIMELINE)
    # Both signs are one attitude: the line is the smooth one, here cos and sin of half the turn.
    lines = figure.axes[0].get_lines()
    np.testing.assert_allclose(np.asarray(lines[0].get_ydata(), float), np.cos(0.025 * T), atol=1e-12)
    np.testing.assert_allclose(np.asarray(lines[2].get_ydata(), float), np.sin(0.025 * T), atol=1e-12)
    drawn(figure)
    drawn(draw_motion(T, turn, rates, np.full((len(T), 3), np.inf), TIMELINE))


def test_worth_of_nothing_and_of_much():
    drawn(draw_worth({"magnet": 54321.0, "mag.bias": 77.7, "mag.turn": -0.001}))
    drawn(draw_worth({}))


def test_colours_are_those_of_the_axes_for_three():
    assert len(set(column_colours(8))) == 8 and len(column_colours(13)) == 13
    assert column_colours(3) == list(AXIS_COLOURS.values())
