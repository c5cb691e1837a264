"""A channel as tables, pictures and the page show it."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from fitting.outcome.diagnostics import counted_of, differences_of
from fitting.outcome.result import Between, ChannelFit
from jaxsat.panel_names import PANEL_COLOURS
from jaxsat.plotting.channels.readings import Curve, Readings
from jaxsat.plotting.channels.timeline import column_colours
from jaxsat.significant import unit_text, value_text

ATTITUDE_KIND, PANELS_KIND = "StarTracker", "Panels"


def readings_of(channel: ChannelFit, between: Between | None = None) -> Readings:
    """The channel's arrays; quaternions without a change of sign from sample to sample, measured ones as modelled.

    `between` is what is modelled between the samples, if it is known.
    """
    measured, modelled, count = channel.measured, channel.modelled, channel.residual.shape[1]
    curve = None if between is None else _curve(channel.name, between)
    if channel.kind == ATTITUDE_KIND:
        modelled = _without_jumps(modelled)
        if curve is not None:
            curve = replace(curve, modelled=_without_jumps(curve.modelled))
            near = curve.modelled[np.clip(np.searchsorted(curve.t_s, channel.t_s - 1e-3), 0, len(curve.t_s) - 1)]
            modelled = np.where(np.einsum("ni,ni->n", modelled, near)[:, None] < 0.0, -modelled, modelled)
        measured = np.where(np.nansum(measured * modelled, axis=1, keepdims=True) < 0.0, -measured, measured)
    same, differences = count == len(channel.columns), differences_of(channel)
    panels = channel.kind == PANELS_KIND
    return Readings(
        t_s=channel.t_s,
        columns=tuple(channel.columns),
        measured=measured,
        modelled=modelled,
        differences=differences,
        residual=_telling(channel),
        promised=channel.promised,
        # A panel that sees nothing is no outlier.
        used=channel.used[:, None] | (measured == 0.0) if panels and same else channel.used,
        reduced=_reduced(channel),
        direct=channel.direct,
        notes=_notes(channel) if same else (),
        colours=panel_colours(channel.columns) if panels else (),
        shared=panels,
        curve=curve,
    )


def _curve(name: str, between: Between) -> Curve:
    """What is modelled of a channel."""
    return Curve(between.t_s, between.readings[name], between.direct.get(name))


def _without_jumps(quaternions: np.ndarray) -> np.ndarray:
    """The same turns [time 4] without a change of sign from one to the next."""
    turned = np.einsum("ni,ni->n", quaternions[1:], quaternions[:-1]) < 0.0
    return np.where(np.concatenate([[False], turned])[:, None].cumsum(axis=0) % 2, -quaternions, quaternions)


def _telling(channel: ChannelFit) -> np.ndarray:
    """Residuals, but for those that say nothing, as of a panel that sees nothing."""
    if channel.weight is None:
        return channel.residual
    silent = (channel.fitted & channel.used)[:, None] & ~(channel.weight > 0.0)
    if channel.kind == PANELS_KIND:
        silent |= ~channel.used[:, None] & (channel.measured == 0.0)
    return np.where(silent, np.nan, channel.residual)


def panel_colours(columns: Iterable[str]) -> list[str]:
    """A colour for each panel, that of its face where it is called after one."""
    names = list(columns)
    return [PANEL_COLOURS.get(name.lower(), own) for name, own in zip(names, column_colours(len(names)), strict=True)]


def _reduced(channel: ChannelFit) -> np.ndarray | None:
    """[time differences] bool: fitted with less than half of the usual weight; None where that of all is the same."""
    weight = channel.weight
    if weight is None or not (weight > 0.0).any():
        return None
    reduced = (weight > 0.0) & (weight < 0.5 * np.median(weight[weight > 0.0]))
    return reduced if reduced.any() else None


def _notes(channel: ChannelFit) -> list[str]:
    """Residuals of each column as text, of what was fitted, and how many of them there are."""
    notes = []
    for k in range(len(channel.columns)):
        counted, known = counted_of(channel)[:, k], np.isfinite(channel.measured[:, k])
        if channel.kind == PANELS_KIND:
            known &= channel.measured[:, k] != 0.0
        out = known & channel.fitted & ~channel.used
        parts = []
        if counted.any():
            rms = float(np.sqrt((channel.residual[counted, k] ** 2).mean()) * channel.sigma)
            parts.append(f"residual RMS {value_text(rms, 3)} {unit_text(channel.unit)}".strip())
            parts.append(f"{counted.sum()} used")
        parts += [f"{out.sum()} left out"] if out.any() else []
        notes.append(", ".join(parts) or "nothing fitted")
    return notes
