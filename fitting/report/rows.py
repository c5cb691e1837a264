"""What tables of results say, as text: parameters, correlations, profiles, rejections, orbital elements, settings."""

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.significant import spans_text, unit_text, value_and_sigma, value_text

if TYPE_CHECKING:
    from fitting.outcome.result import FittedParameter
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


def medians(values: np.ndarray) -> str:
    """Returns the median of each column of `values` [time columns] as text."""
    columns = np.atleast_2d(values.T)
    return ", ".join(
        value_text(float(np.median(c[np.isfinite(c)])), 2) if np.isfinite(c).any() else "n/a" for c in columns
    )


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


def setting_rows(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yields (key, value) as text with sections and tables within them in the key, as TOML names them."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from setting_rows(value, f"{prefix}{name}.")
        elif isinstance(value, list):
            yield prefix + name, ", ".join(map(str, value)) or "none"
        else:
            yield prefix + name, "not given" if value is None else str(value)
