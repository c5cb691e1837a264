"""What all pictures share: panel colours, figure set-up without global state, shadow shading, PNG output."""

import io
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from jaxsat import panel_names

PANEL_NAMES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")

PANEL_COLOURS = {name.upper(): colour for name, colour in panel_names.PANEL_COLOURS.items()}

AXIS_COLOURS = {axis: panel_names.PANEL_COLOURS[f"+{axis}"] for axis in "xyz"}
"""Components of a vector, in the colours of the panels they point to."""

LineStyle = str | tuple[int, tuple[float, ...]]
AXIS_STYLES: dict[str, LineStyle] = {"x": "-", "y": (0, (6, 1.6)), "z": (0, (1.8, 1.3))}
"""The same told by dashes, for whoever does not tell the colours."""

MAIN = "#14497a"
"""Of what a picture is about."""
LINES = (MAIN, "#d98e00", "#c81fb0", "#0f8a64", "#3b9fe8", "#a5400b")
"""Of curves that are no axes, in this order."""
LINE_STYLES: tuple[LineStyle, ...] = ("-", (0, (5, 2)), (0, (1.6, 1.4)), (0, (7, 2, 1.5, 2)))
"""Of the same; there are fewer of them."""

INK, FAINT, SHADOW, LEFT_OUT = "#222222", "#8a8f98", "#e7e9ee", "#c0392b"
"""What was left out is a cross as well."""
QUIET = "#555b66"
"""Of words that explain."""
SUCCEEDED, FAILED = "#1a6fb5", "#d1490c"
"""Cases of a sweep, as on its page."""

DPI = 110


def new_figure(width_in: float, height_in: float, title: str, subtitle: str = "") -> Figure:
    """Returns a white figure with its own raster canvas, a bold title and a grey line below it, both at the left."""
    figure = Figure(figsize=(width_in, height_in), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    left, inch = 0.12 / width_in, 1.0 / height_in
    figure.text(left, 1.0 - 0.10 * inch, title, ha="left", va="top", fontsize=12, fontweight="bold", color=INK)
    if subtitle:
        figure.text(left, 1.0 - 0.36 * inch, subtitle, ha="left", va="top", fontsize=9, color=QUIET)
    return figure


def panels(figure: Figure, count: int, *, columns: int, **frame: float) -> list[Axes]:
    """So many axes in rows of `columns`, within a frame of Matplotlib's `gridspec_kw`; places left over stay empty."""
    grid = figure.subplots(rows_of(count, columns), columns, squeeze=False, gridspec_kw=frame)
    places = list(grid.flat)
    for axes in places[count:]:
        axes.set_axis_off()
    return places[:count]


def rows_of(count: int, columns: int) -> int:
    """Rows that hold so many panels, one at least."""
    return max(1, -(-count // columns))


def bar_panels(
    title: str, subtitle: str, count: int, *, bars: int, row_in: float, head_in: float, bottom_in: float, **sides: float
) -> tuple[Figure, list[Axes]]:
    """Returns a figure and `count` panels in two columns, each high enough for so many lines of `row_in`.

    `sides` are those of Matplotlib's `gridspec_kw` that depend on how long the lines' names are.
    """
    columns = min(2, max(1, count))
    height = 0.8 + rows_of(count, columns) * (head_in + row_in * bars)
    figure = new_figure(9.6, height, title, subtitle)
    frame = {"right": 0.985, "top": 1.0 - 0.95 / height, "bottom": bottom_in / height}
    return figure, panels(figure, count, columns=columns, hspace=head_in / (row_in * bars), **frame, **sides)


def dress(axes: Axes, *, y_label: str = "", x_label: str = "") -> None:
    """Gives axes the house's look: two spines, light grid, small labels."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.grid(True, color="#d5d8de", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=INK, length=3)
    if y_label:
        axes.set_ylabel(y_label, fontsize=9, color=INK)
    if x_label:
        axes.set_xlabel(x_label, fontsize=9, color=INK)


def head(axes: Axes, text: str, *, side: Literal["left", "right"] = "left", **style) -> None:
    """Writes a line above axes. Its height is given: matplotlib's search for a free one doubles the drawing time."""
    axes.set_title(text, loc=side, y=1.0, pad=3, **{"fontsize": 9.5, "color": INK, **style})


def shadow_spans(t_s: np.ndarray, lit: np.ndarray) -> list[tuple[float, float]]:
    """Returns the stretches of time [s] whose samples are in shadow; an edge lies half-way between two samples."""
    lit = np.asarray(lit, bool)
    if lit.size == 0:
        return []
    edges = np.concatenate(([t_s[0]], 0.5 * (t_s[1:] + t_s[:-1]), [t_s[-1]]))
    change = np.flatnonzero(np.diff(np.concatenate(([True], lit, [True])).astype(int)))
    return [(float(edges[first]), float(edges[last])) for first, last in zip(change[::2], change[1::2], strict=True)]


def shade_shadow(axes: Axes, t_s: np.ndarray, lit: np.ndarray, *, label: bool = False) -> None:
    """Shades the Earth's shadow behind everything else, with the word in it where `label` is set."""
    for begin, end in shadow_spans(t_s, lit):
        axes.axvspan(begin, end, color=SHADOW, linewidth=0, zorder=0)
        if label:
            axes.text(
                0.5 * (begin + end),
                0.96,
                "shadow",
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="top",
                fontsize=8,
                color=FAINT,
            )


def time_limits(t_s: np.ndarray) -> tuple[float, float]:
    """Returns the limits of a time axis: the samples' range and a small margin [s]."""
    begin, end = float(np.min(t_s)), float(np.max(t_s))
    margin = 0.015 * (end - begin) or 1.0
    return begin - margin, end + margin


def nice_ceiling(value: float) -> float:
    """Returns the smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten not below `value`; 1 for nothing."""
    if not np.isfinite(value) or value <= 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(step for step in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if step * power >= value * (1 - 1e-12)))


def png_bytes(figure: Figure) -> bytes:
    """Returns the figure as a PNG file's content; no date inside, so that equal pictures are equal bytes."""
    return png_of(rendered(figure))


def rendered(figure: Figure) -> np.ndarray:
    """Returns the figure's pixels [rows columns 4]."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def png_of(pixels: np.ndarray) -> bytes:
    """Returns pixels as a PNG file's content."""
    buffer = io.BytesIO()
    # None: no entry of the program's name and version.
    metadata: Any = {"Software": None}
    imsave(buffer, pixels, format="png", dpi=DPI, metadata=metadata, pil_kwargs={"compress_level": 4})
    return buffer.getvalue()
