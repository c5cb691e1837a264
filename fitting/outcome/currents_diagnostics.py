"""Whether the residuals of a fit look like the noise that was stated: size, mean, memory and tails, panel by panel.

What the model leaves out (a light that it does not know, a satellite that turns a little differently) shows as a mean
or as neighbouring residuals that agree, long before chi2 shows it.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc, ndtr

from fitting.measurements.groups import Group
from fitting.outcome.result import FitResult
from fitting.outcome.sensed_result import WILD, Holdout
from fitting.outcome.sensed_verdict import Witness
from fitting.outcome.series import PanelResiduals, panel_residuals, slots
from jaxsat.errors import InputError
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.telemetry import Session

TAILS = (2.0, 3.0, 4.0)
"""Residuals beyond these are counted [sigma]."""
REMARKABLE_Z, REMARKABLE_P = 4.0, 1e-3
"""A mean, a size or a memory beyond them is remarked on: among the 18 of a fit, noise makes one in 100 fits or so."""
MAGNETOMETER_SIGMA_UT = 1.0
"""1-sigma of a magnetometer that nobody has calibrated in flight, as Munin's satellite file has it [uT]."""


@dataclass(frozen=True)
class Diagnostics:
    """How well residuals and stated noise agree; the fit's own freedom makes all of it look a little better."""

    chi2_per_dof: float | None
    """None without a degree of freedom."""
    chi2_p: float | None
    """Probability that noise of the stated size gives this chi2 or more."""
    panels: dict[str, PanelResiduals]
    """By name, `+x` ... `-z`."""
    tails: dict[str, dict[str, float | int]]
    """For each limit of `TAILS`, as `3`: residuals `found` beyond it, and as many as are `expected` of normal ones."""

    def remarks(self) -> list[str]:
        """Sentences on what is not noise; none where all is well."""
        return [line for name, panel in self.panels.items() for line in _remarks(name, panel)]

    def as_dict(self) -> dict[str, Any]:
        """For JSON: plain numbers, None where there is none."""
        return asdict(self)


def diagnose(result: FitResult, *, noise_mA: float) -> Diagnostics:
    """Diagnostics of all residuals that have a weight; `noise_mA` is the fit's 1-sigma of a current, rounding included.

    Raises `InputError` unless it is above zero.
    """
    if not noise_mA > 0.0:
        raise InputError(f"expected a noise above 0 mA, got {noise_mA:g}", field="noise_mA")
    used = result.weight > 0.0
    residual = (result.measured_mA - result.modelled_mA) / noise_mA
    slot = slots(result.t_s)
    panels = {name: panel_residuals(residual[used[:, k], k], slot[used[:, k]]) for k, name in enumerate(PANEL_NAMES)}
    size, count = np.abs(residual[used]), int(used.sum())
    tails = {
        f"{limit:g}": {"found": int((size > limit).sum()), "expected": round(2.0 * count * float(ndtr(-limit)), 2)}
        for limit in TAILS
    }
    known = result.dof > 0
    return Diagnostics(
        chi2_per_dof=result.chi2 / result.dof if known else None,
        chi2_p=float(chdtrc(result.dof, result.chi2)) if known else None,
        panels=panels,
        tails=tails,
    )


def _remarks(name: str, panel: PanelResiduals) -> Iterator[str]:
    if panel.mean is not None and panel.mean_z is not None and abs(panel.mean_z) > REMARKABLE_Z:
        yield f"residuals of {name} have a mean of {panel.mean:+.2f} sigma ({panel.mean_z:+.1f} of its own)"
    if panel.rms is not None and panel.rms_z is not None and panel.rms_z > REMARKABLE_Z:
        yield f"residuals of {name} are {panel.rms:.2f} times the stated noise"
    if panel.ljung_box_p is not None and panel.ljung_box_p < REMARKABLE_P:
        lag1 = "" if panel.lag1 is None else f", lag 1: {panel.lag1:+.2f}"
        yield f"neighbouring residuals of {name} agree beyond chance (p = {panel.ljung_box_p:.1g}{lag1})"


def magnetometer_witness(result: FitResult, session: Session) -> Witness | None:
    """What the magnetometer of a session, which is not fitted, says of the motion; None where it has no reading."""
    modelled, by_attitude = result.field_body_uT, result.field_body_sigma_uT
    if modelled is None or by_attitude is None:
        return None
    rows = np.searchsorted(session.t_s, result.t_s)
    residual = (session.b_field_uT[rows] - modelled[:, 1:]) / MAGNETOMETER_SIGMA_UT
    promised = np.hypot(1.0, by_attitude[:, 1:] / MAGNETOMETER_SIGMA_UT)
    known = np.isfinite(residual) & np.isfinite(promised)
    asked = known.any(axis=1)
    if not asked.any():
        return None
    residual, promised = np.where(known, residual, 0.0)[asked], np.where(known, promised, 0.0)[asked]
    wild = (residual**2).sum(axis=1) > WILD * Group("mag", 2).limit * promised.max(axis=1) ** 2
    mask = known[asked] & ~wild[:, None]
    held = None
    if mask.any():
        rms, promise = (
            MAGNETOMETER_SIGMA_UT * float(np.sqrt((part[mask] ** 2).mean())) for part in (residual, promised)
        )
        held = Holdout(int(mask.sum()), int(wild.sum()), rms, promise, None)
    return Witness("mag", "uT", int(asked.sum()), held)
