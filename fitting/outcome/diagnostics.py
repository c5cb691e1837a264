"""Whether the residuals of a fit look like the noise that was stated: size, mean, memory and tails, column by column.

What the model leaves out (a light that it does not know, a satellite that turns a little differently) shows as a mean
or as neighbouring residuals that agree, long before chi2 shows it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtr

from fitting.outcome.result import ChannelFit, FitResult
from fitting.outcome.series import PanelResiduals

TAILS = (2.0, 3.0, 4.0)
"""Residuals beyond these are counted [sigma]."""
REMARKABLE_Z, REMARKABLE_P = 4.0, 1e-3
"""A mean, a size or a memory beyond them is remarked on: among the 18 of six panels, noise makes one in 100 fits or
so."""
TURNS = ("turn x", "turn y", "turn z")
"""What the residuals of a quaternion are of."""


@dataclass(frozen=True)
class ChannelDiagnostics:
    """How well residuals and stated noise of one sensor agree."""

    columns: dict[str, PanelResiduals]
    """By the names of the differences."""
    tails: dict[str, dict[str, float | int]]
    """For each limit of `TAILS`, as `3`: residuals `found` beyond it, and as many as are `expected` of normal ones."""


@dataclass(frozen=True)
class Diagnostics:
    """How well residuals and stated noise agree; the fit's own freedom makes all of it look a little better."""

    chi2_per_dof: float | None
    """None without a degree of freedom."""
    chi2_p: float | None
    """Probability that noise of the stated size gives this chi2 or more."""
    channels: dict[str, ChannelDiagnostics]
    """Of what was fitted."""

    def remarks(self) -> list[str]:
        """Sentences on what is not noise; none where all is well."""
        return [
            line
            for name, channel in self.channels.items()
            for column, residuals in channel.columns.items()
            for line in _remarks(f"{name} {column}", residuals)
        ]

    def as_dict(self) -> dict[str, Any]:
        """For JSON: plain numbers, None where there is none."""
        return asdict(self)


def diagnose(result: FitResult) -> Diagnostics:
    """Diagnostics of all residuals that were fitted."""
    channels = {name: of_channel(c) for name, c in result.channels.items() if c.residuals and not c.witness}
    known = result.dof > 0
    return Diagnostics(
        chi2_per_dof=result.chi2 / result.dof if known else None,
        chi2_p=float(chdtrc(result.dof, result.chi2)) if known else None,
        channels=channels,
    )


def of_channel(channel: ChannelFit) -> ChannelDiagnostics:
    """Diagnostics of one sensor."""
    size = np.abs(channel.residual[counted_of(channel)])
    tails: dict[str, dict[str, float | int]] = {
        f"{limit:g}": {
            "found": int((size > limit).sum()),
            "expected": round(2.0 * size.size * float(ndtr(-limit)), 2),
        }
        for limit in TAILS
    }
    return ChannelDiagnostics(dict(zip(differences_of(channel), channel.residuals, strict=True)), tails)


def counted_of(channel: ChannelFit) -> np.ndarray:
    """[time differences] bool: residuals that were fitted."""
    known = np.isfinite(channel.residual) & channel.fitted.astype(bool)[:, None]
    return known & (channel.used.astype(bool)[:, None] if channel.weight is None else channel.weight > 0.0)


def differences_of(channel: ChannelFit) -> tuple[str, ...]:
    """Names of what the residuals of a sensor are of: its columns, or small turns of an attitude."""
    count = channel.residual.shape[1]
    if count == len(channel.columns):
        return tuple(channel.columns)
    return TURNS if count == len(TURNS) else tuple(f"difference {k + 1}" for k in range(count))


def tail_text(tails: Mapping[str, Mapping[str, float | int]]) -> str:
    """Returns in words how many residuals are large."""
    return ", ".join(f"{t['found']} beyond {limit} σ ({t['expected']:.1f} expected)" for limit, t in tails.items())


def _remarks(name: str, panel: PanelResiduals) -> Iterator[str]:
    if panel.mean is not None and panel.mean_z is not None and abs(panel.mean_z) > REMARKABLE_Z:
        yield f"residuals of {name} have a mean of {panel.mean:+.2f} sigma ({panel.mean_z:+.1f} of its own)"
    if panel.rms is not None and panel.rms_z is not None and panel.rms_z > REMARKABLE_Z:
        yield f"residuals of {name} are {panel.rms:.2f} times the stated noise"
    if panel.ljung_box_p is not None and panel.ljung_box_p < REMARKABLE_P:
        lag1 = "" if panel.lag1 is None else f", lag 1: {panel.lag1:+.2f}"
        yield f"neighbouring residuals of {name} agree beyond chance (p = {panel.ljung_box_p:.1g}{lag1})"
