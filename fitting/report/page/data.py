"""The numbers that the script of a page draws for any satellite."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fitting.outcome.result import Between, ChannelFit, FitResult
from fitting.report.fit.pictures import channel_text, lit_of, timeline_of
from fitting.report.fit.shown import readings_of
from jaxsat.files.json_files import plain
from jaxsat.panel_names import PANEL_COLOURS, PAPER_COLOURS, SAFE_COLOURS, SCHEME
from jaxsat.plotting.channels import column_colours
from jaxsat.significant import unit_text

SCHEMA = "jaxsat.page/1"
DRAWN = 20_000
"""Samples of a channel that a page draws; of more, every second, third, ..."""
DIGITS = 6


def page_data_of(
    result: FitResult, scene: Mapping[str, Any] | None, epoch_utc: str, size_m: Sequence[float] | None = None
) -> dict[str, Any]:
    """Returns the data block of a report; numbers that are not finite are null. `size_m` is that of the body."""
    n, timeline, between = len(result.t_s), timeline_of(result), result.between
    unknown = np.full(n, np.nan)
    angle, sigma = (
        unknown if array is None else array for array in (result.field_angle_deg, result.field_angle_sigma_deg)
    )
    document = {
        "schema": SCHEMA,
        "epoch_utc": epoch_utc,
        # Faces of the body, in the colours that panels have.
        "panels": [{"name": name.upper(), "colour": colour} for name, colour in SAFE_COLOURS.items()],
        # What stands in place of these where the reader wants the paper's, and whether the page begins so.
        "paper": {colour: PAPER_COLOURS[name] for name, colour in SAFE_COLOURS.items()},
        "scheme": SCHEME,
        "size": [1.0, 1.0, 1.0] if size_m is None else (np.asarray(size_m) / np.max(size_m)).round(4),
        "held_s": [list(span) for span in timeline.held_out],
        "samples": {
            "t_s": np.round(result.t_s, 3),
            "lit": lit_of(result).astype(int),
            "rate_deg_s": np.round(np.degrees(result.angular_velocity_rad_s), 5),
            "attitude_sigma_deg": np.round(result.attitude_sigma_deg, 4),
            "field_angle_deg": np.round(angle, 3),
            "field_angle_sigma_deg": np.round(sigma, 4),
        },
        "curve": None if between is None else _curve(between),
        "channels": [_channel(c, channel_text(result, name), between) for name, c in result.channels.items()],
    }
    # The scene is plain already.
    return {**plain(document)[0], "scene": scene}


def _curve(between: Between) -> dict[str, Any]:
    """The motion between the samples; the attitude there is the scene's."""
    return {
        "t_s": np.round(between.t_s, 3),
        "rate_deg_s": np.round(np.degrees(between.angular_velocity_rad_s), 5),
    }


def _channel(channel: ChannelFit, note: str, between: Between | None) -> dict[str, Any]:
    r = readings_of(channel, between)
    every = slice(None, None, -(-len(r.t_s) // DRAWN) or 1)
    named, turns = r.column_colours(), column_colours(len(r.differences))
    if r.paired:
        turns = named
    direct, light, curve = r.direct, r.light(), r.curve
    lines = [{} for _ in r.columns]
    if curve is not None:
        lines = [{"line": short(column)} for column in curve.modelled.T]
    if curve is not None and curve.direct is not None:
        lines = [{**line, "direct_line": short(column)} for line, column in zip(lines, curve.direct.T, strict=True)]
    return {
        "name": channel.name,
        "unit": unit_text(channel.unit),
        "note": note,
        "reach": r.reach(),
        "paired": r.paired,
        "scale": short(np.array(r.limits(0))) if r.shared else None,
        "t_s": np.round(r.t_s[every], 3),
        # 1 used, 3 left out.
        "use": np.where(channel.used[every], 1, 3),
        "readings": [
            {
                "name": name,
                "colour": _safe(named[k]),
                "measured": short(r.measured[every, k]),
                "modelled": short(r.modelled[every, k]),
                **({} if direct is None or "direct_line" in lines[k] else {"direct": short(direct[every, k])}),
                **lines[k],
            }
            for k, name in enumerate(r.columns)
        ],
        "residuals": [
            {
                "name": name,
                "colour": _safe(turns[k]),
                "residual": np.round(r.residual[every, k], 3),
                "promised": np.round(channel.promised[every, k], 3),
                # Numbers of the samples that were weighed down.
                **({"light": np.flatnonzero(light[every, k])} if light.any() else {}),
            }
            for k, name in enumerate(r.differences)
        ],
    }


def short(values: np.ndarray) -> np.ndarray:
    """Returns numbers with so many digits that the largest of them has `DIGITS`: pages are read by people."""
    known = np.abs(values[np.isfinite(values)])
    largest = float(known.max()) if known.size else 0.0
    return np.round(values, DIGITS - 1 - int(np.floor(np.log10(largest)))) if largest > 0.0 else values


def _safe(colour: str) -> str:
    """That for which the page's switch knows the paper's."""
    return next((SAFE_COLOURS[name] for name, own in PANEL_COLOURS.items() if own == colour), colour)
