"""Measured against modelled currents of the six panels of a box, with the residuals below each."""

import numpy as np
from matplotlib.figure import Figure

from jaxsat.plotting.channels.readings import Curve, Readings, Words, draw_readings
from jaxsat.plotting.channels.timeline import Timeline
from jaxsat.plotting.current_marks import current_marks
from jaxsat.plotting.style import PANEL_COLOURS, PANEL_NAMES

FITTED = Words()
SIMULATED = Words("simulated, as telemetered", "simulated, without noise", "simulated with a limited current", "diff.")


def draw_currents(
    t_s: np.ndarray,
    measured_mA: np.ndarray,
    modelled_mA: np.ndarray,
    direct_mA: np.ndarray,
    *,
    weight: np.ndarray,
    lit: np.ndarray,
    limited: np.ndarray | None = None,
    curve: Curve | None = None,
    title: str = "Panel currents",
    subtitle: str = "",
    words: Words = FITTED,
) -> Figure:
    """Returns the picture of currents [time 6], panels +X -X +Y -Y +Z -Z; `lit` and `limited` are [time].

    All panels share one scale, and so do all residuals. A current is crossed out where its weight is zero or the whole
    sample was found `limited`, hollow where its weight is below half of the median one (so weighed down as doubtful).
    `words` say what that is: of a fit, or `SIMULATED`. `curve` is what is modelled between the samples.
    """
    lit = np.asarray(lit, bool)
    sample_out = np.zeros(len(t_s), bool) if limited is None else np.asarray(limited, bool)
    marks = current_marks(measured_mA, weight, lit, sample_out)
    residual = measured_mA - modelled_mA
    readings = Readings(
        t_s=t_s,
        columns=PANEL_NAMES,
        measured=measured_mA,
        modelled=modelled_mA,
        differences=PANEL_NAMES,
        # A panel that sees nothing has none.
        residual=np.where(marks.used | marks.left_out, residual, np.nan),
        promised=None,
        used=~marks.left_out,
        reduced=marks.reduced,
        direct=direct_mA,
        notes=[_note(residual[:, k], marks.used[:, k], marks.left_out[:, k], words) for k in range(len(PANEL_NAMES))],
        curve=curve,
        words=words,
        colours=[PANEL_COLOURS[name] for name in PANEL_NAMES],
        shared=True,
        residual_unit="mA",
    )
    timeline = Timeline.of(np.asarray(t_s), np.ones(len(t_s), bool), lit.astype(float))
    return draw_readings(readings, timeline, unit="mA", title=title, subtitle=subtitle)


def _note(residual: np.ndarray, used: np.ndarray, left_out: np.ndarray, words: Words) -> str:
    """The unweighted RMS of what was used, and how much that is."""
    if words is SIMULATED:
        parts = [f"noise and steps RMS {np.sqrt(np.mean(residual[used] ** 2)):.2f} mA"] if used.any() else []
        return ", ".join(parts + ([f"{left_out.sum()} limited"] if left_out.any() else []))
    parts = [f"residual RMS {np.sqrt(np.mean(residual[used] ** 2)):.2f} mA, {used.sum()} used"] if used.any() else []
    parts += [f"{left_out.sum()} left out"] if left_out.any() else []
    return ", ".join(parts) or "nothing used"
