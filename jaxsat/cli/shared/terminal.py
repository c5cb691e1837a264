"""What the terminal shows of a preparation and of a fit; 80 columns are enough."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from jaxsat.significant import count_text, spans_text, unit_text, value_and_sigma, value_text

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from fitting.outcome.result import FitResult, FittedParameter
    from jaxsat.telemetry.raw_sun.cleaning import Rejection, Session

STRONG_CORRELATION = 0.9
STATUS_STYLE = {
    "converged": "bold green",
    "not_converged": "bold red",
    "ambiguous": "bold yellow",
    "failed": "bold red",
}


def plain_table(*columns: str, right: Sequence[int] = (), title: str = "") -> Table:
    """Returns an empty table in the one look of all commands; `right` are the columns of numbers."""
    table = Table(box=box.SIMPLE_HEAD, title=title or None, title_justify="left", title_style="bold", pad_edge=False)
    for number, name in enumerate(columns):
        table.add_column(name, justify="right" if number in right else "left", overflow="fold")
    return table


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
        ("attitude 1σ about x, y, z", f"{_medians(result.attitude_sigma_deg)} deg (median)"),
        (
            "angle of x to the field",
            f"{_range(result.field_angle_deg)} deg, 1σ {_medians(result.field_angle_sigma_deg)} deg",
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


def _medians(values: np.ndarray) -> str:
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


def fit_summary(result: "FitResult", name: str) -> RenderableType:
    """Returns status, parameters, facts and strong correlations of one fit."""
    status = Text.assemble(
        (name, "bold"),
        ": ",
        (result.status.replace("_", " "), STATUS_STYLE.get(result.status, "bold")),
        ". ",
        result.message,
    )
    rows = parameter_rows(result.parameters)
    parameters = plain_table("parameter", "value", "1σ", "unit", "note", right=(1,))
    for row in rows:
        if row[4] != "fixed":
            parameters.add_row(row[0], row[1], f"± {row[2]}" if row[2] else "", row[3], row[4])
    fixed = ", ".join(f"{row[0]} {row[1]} {row[3]}".strip() for row in rows if row[4] == "fixed")
    facts = Table.grid(padding=(0, 2))
    for what, text in fit_facts(result):
        facts.add_row(Text(what, style="dim"), text)
    parts: list[RenderableType] = [status, parameters]
    if fixed:
        parts.append(Padding(Text(f"fixed: {fixed}", style="dim"), (0, 0, 1, 0)))
    parts.append(facts)
    strong = strong_correlations(result.correlations)
    if strong:
        table = plain_table("strongly correlated", "with", "correlation", right=(2,))
        for a, b, value in strong[:8]:
            table.add_row(a, b, f"{value:+.3f}")
        parts.append(table)
        if len(strong) > 8:
            parts.append(
                Text(f"and {count_text(len(strong) - 8, 'pair')} more beyond ±{STRONG_CORRELATION} in fit.json")
            )
    return Group(*parts)


def rejection_rows(rejections: Iterable["Rejection"]) -> list[tuple[str, str, str, str]]:
    """Returns (reason, count, rows of the file, first example) for each reason, most frequent first."""
    by_reason: dict[str, list[Rejection]] = {}
    for rejection in rejections:
        by_reason.setdefault(rejection.reason, []).append(rejection)
    return [
        (reason, str(len(group)), spans_text([r.row for r in group]), group[0].detail)
        for reason, group in sorted(by_reason.items(), key=lambda item: -len(item[1]))
    ]


def preparation_summary(session: "Session", orbit_fit: "OrbitFit", name: str) -> RenderableType:
    """Returns what was read, what was left out and why, and the elements found."""
    used = count_text(session.raw_t_s.size, "row")
    header = Text.assemble(
        (name, "bold"),
        f": {used} give {count_text(session.t_s.size, 'sample')}, t = {session.t_s[0]:g} to {session.t_s[-1]:g} s, "
        f"epoch {session.epoch.iso(3)} UTC",
    )
    parts: list[RenderableType] = [header]
    rows = rejection_rows(session.rejections)
    if rows:
        table = plain_table("left out because", "count", "rows of the file", "first", right=(1,))
        for row in rows:
            table.add_row(*row)
        parts.append(table)
    else:
        parts.append(Text("nothing was left out"))
    elements = plain_table("orbital element", "value", "1σ", "unit", right=(1,))
    for row in element_rows(orbit_fit.elements, orbit_fit.sigma):
        elements.add_row(*row)
    before, after = orbit_fit.rms_before_m, orbit_fit.rms_after_m
    residuals = f"position residuals of a coordinate: RMS {before:.4g} m, after least squares {after:.4g} m"
    return Group(*parts, elements, Text(residuals))


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


_DEG = float(np.degrees(1.0))


def files_summary(rows: Iterable[tuple[str, str, str]]) -> RenderableType:
    """Returns one line a file for a run over several: (file, status, message)."""
    table = plain_table("file", "status", "message")
    for file, status, message in rows:
        table.add_row(file, Text(status.replace("_", " "), style=STATUS_STYLE.get(status, "")), message)
    return table


def show(*parts: RenderableType) -> None:
    """Prints to stdout, at most 100 columns wide, with colours on a terminal only."""
    console = Console(highlight=False)
    console = Console(highlight=False, width=min(console.width, 100))
    for part in parts:
        console.print(part)
