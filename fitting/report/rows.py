"""What tables of results say, as text: parameters, facts, correlations, rejections, orbital elements."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from jaxsat.significant import count_text, spans_text, unit_text, value_and_sigma, value_text

if TYPE_CHECKING:
    from fitting.outcome.result import FitResult, FittedParameter
    from jaxsat.telemetry import Rejection

STRONG_CORRELATION = 0.9
_DEG = float(np.degrees(1.0))


def parameter_rows(parameters: Iterable["FittedParameter"]) -> list[tuple[str, str, str, str, str]]:
    """Returns (name, value, sigma, unit, note) of each parameter as text, the fitted before the fixed."""
    rows = []
    for p in sorted(parameters, key=lambda p: not p.free):
        value, sigma = value_and_sigma(p.value, p.sigma if p.free else None)
        rows.append((p.name, value, sigma, unit_text(p.unit), p.note or ("" if p.free else "fixed")))
    return rows


def strong_correlations(
    correlations: dict[str, dict[str, float]], limit: float = STRONG_CORRELATION
) -> list[tuple[str, str, float]]:
    """Returns the pairs whose correlation is beyond +-`limit`, strongest first."""
    pairs = [(a, b, value) for a, row in correlations.items() for b, value in row.items() if a != b]
    return sorted((pair for pair in pairs if abs(pair[2]) > limit), key=lambda pair: -abs(pair[2]))


def limited_text(result: "FitResult") -> str:
    """Returns how many samples the fit left out, and when."""
    times = result.t_s[np.asarray(result.limited, bool)]
    if not times.size:
        return "none"
    return f"{count_text(times.size, 'sample')}, t = {times[0]:g} to {times[-1]:g} s"


def fit_facts(result: "FitResult") -> list[tuple[str, str]]:
    """Returns the fit's single numbers as (what, text)."""
    lit = np.asarray(result.lit, bool)
    facts = [
        ("chi2 / degrees of freedom", f"{result.chi2:.1f} / {result.dof}"),
        ("residual RMS", f"{value_text(result.residual_rms_mA, 3)} mA"),
        ("samples", f"{result.t_s.size}, {int(lit.sum())} lit, t = {result.t_s[0]:g} to {result.t_s[-1]:g} s"),
        ("left out as limited", limited_text(result)),
        ("attitude 1σ about x, y, z", f"{medians(result.attitude_sigma_deg)} deg (median)"),
        (
            "angle of x to the field",
            f"{_range(result.field_angle_deg)} deg, 1σ {medians(result.field_angle_sigma_deg)} deg",
        ),
        ("gauge", result.gauge or "none needed"),
        *([("held by the priors", _weak(result))] if any(not d.blind for d in result.unseen) else []),
    ]
    if result.limb_rms_deg is not None:
        text = f"{count_text(result.limb_samples, 'sample')}, residual RMS {value_text(result.limb_rms_deg, 3)} deg"
        facts.append(("limb angles", text))
    facts += [(f"other minimum {n}", _alternative(other)) for n, other in enumerate(result.alternatives, 1)]
    facts.append(("time", ", ".join(f"{name} {seconds:.1f} s" for name, seconds in result.timing_s.items())))
    return facts


def _weak(result: "FitResult") -> str:
    """How many combinations the priors hold though the data see them, and the weakest of them."""
    weak = sorted((d for d in result.unseen if not d.blind), key=lambda d: d.information)
    return f"{count_text(len(weak), 'combination')} of parameters, the weakest {weak[0].name}"


def medians(values: np.ndarray) -> str:
    """Returns the median of each column of `values` [time columns] as text."""
    columns = np.atleast_2d(values.T)
    return ", ".join(
        value_text(float(np.median(c[np.isfinite(c)])), 2) if np.isfinite(c).any() else "n/a" for c in columns
    )


def _range(values: np.ndarray) -> str:
    finite = values[np.isfinite(values)]
    return f"{finite.min():.1f} to {finite.max():.1f}" if finite.size else "n/a"


def _alternative(other: dict) -> str:
    shown = {name: value_text(float(v), 4) if isinstance(v, int | float) else str(v) for name, v in other.items()}
    return ", ".join(f"{name} {text}" for name, text in shown.items())


def rejection_rows(rejections: Iterable["Rejection"]) -> list[tuple[str, str, str, str]]:
    """Returns (reason, count, rows of the file, first example) for each reason, most frequent first."""
    by_reason: dict[str, list[Rejection]] = {}
    for rejection in rejections:
        by_reason.setdefault(rejection.reason, []).append(rejection)
    return [
        (reason, str(len(group)), spans_text([r.row for r in group]), group[0].detail)
        for reason, group in sorted(by_reason.items(), key=lambda item: -len(item[1]))
    ]


def element_rows(elements: Mapping[str, float], sigmas: Mapping[str, float]) -> list[tuple[str, str, str, str]]:
    """Returns (element, value, sigma, unit) as text, km and degrees, of elements in SI and radians."""
    rows = []
    for name, value in elements.items():
        scale, unit = (
            (1e-3, "km") if name == "semi_major_axis" else (1.0, "") if name == "eccentricity" else (_DEG, "deg")
        )
        text, sigma = value_and_sigma(value * scale, sigmas[name] * scale, 8)
        rows.append((name.replace("_", " "), text, f"± {sigma}" if sigma else "", unit))
    return rows
