"""The pictures of a fit of any satellite."""

import numpy as np

from fitting.outcome.sensed_result import SensedResult
from fitting.report.rows import parameter_rows
from fitting.report.sensed.shown import file_stems, readings_of
from jaxsat.plotting import draw_parameters, png_bytes
from jaxsat.plotting.channels import Timeline, draw_motion, draw_readings, draw_worth
from jaxsat.significant import unit_text, value_text


def timeline_of(result: SensedResult) -> Timeline:
    """Ends, shadow and held-out part of a result."""
    return Timeline.of(result.t_s, result.fitted, result.illumination)


def draw_sensed(result: SensedResult, label: str) -> dict[str, bytes]:
    """Returns the pictures of a fit as PNG by file name."""
    subtitle, timeline = f"{label}: {result.verdict}", timeline_of(result)
    rates = np.degrees(result.angular_velocity_rad_s)
    figures = {"attitude.png": draw_motion(result.t_s, rates, result.attitude_sigma_deg, timeline, subtitle=subtitle)}
    stems = file_stems(result.channels)
    for name, channel in result.channels.items():
        figures[f"{stems[name]}.png"] = draw_readings(
            readings_of(channel),
            timeline,
            unit=unit_text(channel.unit),
            title=f"{name}: measured and modelled",
            subtitle=f"{subtitle}; {channel_text(result, name)}",
        )
    free = [p for p in result.parameters if p.free]
    if free:
        figures["parameters.png"] = draw_parameters(parameter_rows(free), subtitle=subtitle)
    if result.buys:
        figures["worth.png"] = draw_worth(result.buys, subtitle=subtitle)
    return {name: png_bytes(figure) for name, figure in figures.items()}


def channel_text(result: SensedResult, name: str) -> str:
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
