"""The pictures of a fit of any satellite."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.outcome.result import FitResult
from fitting.report.fit.owned import file_stems
from fitting.report.fit.shown import readings_of
from fitting.report.rows import parameter_rows
from jaxsat.plotting import draw_field_angle, draw_orbit, draw_parameters
from jaxsat.plotting.channels import Timeline, draw_motion, draw_readings, draw_worth
from jaxsat.plotting.style import png_of, rendered
from jaxsat.significant import unit_text, value_text


def timeline_of(result: FitResult) -> Timeline:
    """Ends, shadow and held-out part of a result."""
    return Timeline.of(result.t_s, result.fitted, result.illumination)


def draw_fit(result: FitResult, label: str, scene: Mapping[str, Any] | None = None) -> dict[str, bytes]:
    """Returns the pictures of a fit as PNG by file name; that of the orbit is of its `scene`."""
    subtitle, timeline = f"{label}: {result.verdict}", timeline_of(result)
    rates = np.degrees(result.angular_velocity_rad_s)
    b = result.between
    between = (b.t_s, b.quaternion_inertial_from_body, np.degrees(b.angular_velocity_rad_s)) if b is not None else None
    q, sigma = result.quaternion_inertial_from_body, result.attitude_sigma_deg
    motion = draw_motion(result.t_s, q, rates, sigma, timeline, curves=between, subtitle=subtitle)
    figures = {"attitude.png": motion}
    stems = file_stems(result.channels)
    for name, channel in result.channels.items():
        figures[f"{stems[name]}.png"] = draw_readings(
            readings_of(channel, result.between),
            timeline,
            unit=unit_text(channel.unit),
            title=f"{name}: measured and modelled",
            subtitle=f"{subtitle}; {channel_text(result, name)}",
        )
    free = [p for p in result.parameters if p.free]
    if free:
        footer = [f"Gauge: {result.gauge}"] if result.gauge else []
        figures["parameters.png"] = draw_parameters(parameter_rows(free), subtitle=subtitle, footer=footer)
    if result.field_angle_deg is not None and result.field_angle_sigma_deg is not None:
        figures["field_angle.png"] = draw_field_angle(
            result.t_s,
            result.field_angle_deg,
            result.field_angle_sigma_deg,
            attitude_sigma_deg=result.attitude_sigma_deg,
            lit=lit_of(result),
            curve=_field_angle_between(result, scene),
            subtitle=subtitle,
        )
    if scene is not None:
        figures["orbit.png"] = draw_orbit(scene, subtitle=subtitle)
    if result.buys:
        figures["worth.png"] = draw_worth(result.buys, subtitle=subtitle)
    # What compresses them works beside the drawing of the next.
    with ThreadPoolExecutor(2, thread_name_prefix="png") as pool:
        encoded = {name: pool.submit(png_of, rendered(figure)) for name, figure in figures.items()}
    return {name: png.result() for name, png in encoded.items()}


def _field_angle_between(result: FitResult, scene: Mapping[str, Any] | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Times and angles [deg] of body x to the field between the samples; None where they are not known."""
    if result.between is None or scene is None:
        return None
    t, field = result.between.t_s, np.asarray(scene["track"]["field_uT"])
    along = np.linspace(scene["begin_s"], scene["end_s"], len(field))
    outside = np.column_stack([np.interp(t, along, column) for column in field.T])
    turned = Rotation.from_quat(result.between.quaternion_inertial_from_body, scalar_first=True)
    body = turned.inv().apply(outside)
    return t, np.degrees(np.arctan2(np.linalg.norm(body[:, 1:], axis=1), body[:, 0]))


def lit_of(result: FitResult) -> np.ndarray:
    """[time] bool: outside the Earth's shadow, as far as it is known."""
    return np.ones(len(result.t_s), bool) if result.illumination is None else result.illumination > 0.5


def channel_text(result: FitResult, name: str) -> str:
    """Returns a channel's residuals, and how well it was predicted, in a line."""
    channel = result.channels[name]
    unit = unit_text(channel.unit)
    parts = []
    if channel.rms is not None:
        parts.append(f"residual RMS {value_text(channel.rms, 3)} {unit}".strip())
    if channel.holdout is not None:
        held = channel.holdout
        parts.append(
            f"held out {value_text(held.rms, 3)} {unit}".strip() + f", {held.sigma_ratio:.2f} times the promised"
        )
    return ", ".join(parts) or "nothing fitted"
