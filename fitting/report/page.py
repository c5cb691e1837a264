"""The report of a fit as one HTML page."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.parameters.names import UNITS
from fitting.report.page_data import page_data
from fitting.report.rows import (
    STRONG_CORRELATION,
    element_rows,
    medians,
    parameter_rows,
    profile_picture,
    profile_row,
    rejection_rows,
    setting_rows,
    strong_correlations,
)
from jaxsat.report import Facts, Live, Picture, Remarks, Table, Verdict, page
from jaxsat.significant import count_text, unit_text, value_text
from jaxsat.telemetry import Rejection

if TYPE_CHECKING:
    from fitting.outcome.currents_diagnostics import Diagnostics
    from fitting.outcome.result import FitResult
    from fitting.parameters.null_space import Direction
    from fitting.profile.profile import Profile

VERDICTS: dict[str, Verdict] = {"converged": "good", "ambiguous": "doubtful"}
LIVE = {
    "motion": (
        "Motion",
        "orbit.png",
        "The Earth with day and night, the orbit with its arc in shadow, body x and the field along it; the satellite "
        "at four instants",
    ),
    "currents": (
        "Panel currents",
        "currents.png",
        "Measured and modelled currents of the six panels with residuals, against time",
    ),
    "field-angle": (
        "Attitude to the magnetic field",
        "field_angle.png",
        "Angle of body x to the field with its band, against time",
    ),
}
"""Heading, picture and its description of what the script draws; the parameters' picture is not repeated, for their
table stands in the page."""


def fit_page(
    result: "FitResult",
    pictures: Mapping[str, bytes],
    *,
    diagnostics: "Diagnostics",
    profiles: Sequence["Profile"] = (),
    provenance: Mapping[str, Any],
    scene: Mapping[str, Any] | None = None,
) -> str:
    """Returns the HTML of one fit from what its files hold.

    `pictures` maps file names to PNG content, `provenance` and `scene` are the contents of their JSON files. Without a
    scene the motion is not shown.
    """
    rows = parameter_rows(result.parameters)
    parameters = [(name, value, f"± {s}" if s else "", *rest) for name, value, s, *rest in rows]
    strong = [(a, b, f"{value:+.3f}") for a, b, value in strong_correlations(result.correlations)]
    limb = provenance.get("limb")
    origin = [
        ("telemetry", provenance["telemetry"]),
        ("SHA-256 of the file", provenance["sha256"]),
        *((("limb angles", limb["file"]), ("SHA-256 of their file", limb["sha256"])) if limb else ()),
        ("seed", str(provenance["seed"])),
        ("versions", ", ".join(f"{name} {version}" for name, version in provenance["versions"].items())),
    ]
    label, orbit = provenance["label"], provenance["orbit"]
    live = {
        name: Live(name, heading, Picture(heading, pictures[file], alt) if file in pictures else None)
        for name, (heading, file, alt) in LIVE.items()
    }
    return page(
        f"Fit of {label}",
        subtitle=f"{provenance['telemetry']}, epoch {provenance['epoch_utc']} UTC",
        verdict=VERDICTS.get(result.status, "bad"),
        verdict_text=result.status.replace("_", " ").capitalize() + ".",
        message=result.message,
        data=page_data(result, scene, provenance["epoch_utc"]),
        sections=[
            Remarks("Warnings", provenance["warnings"]),
            live["motion"],
            Facts("Fit", fit_facts(result)),
            live["currents"],
            live["field-angle"],
            Table("Parameters", ("parameter", "value", "1σ", "unit", "note"), parameters, (1,)),
            Table(
                "What the data hardly see",
                ("direction", "information of data / prior", "held by", "largest components, one prior sigma along it"),
                [unseen_row(direction) for direction in result.unseen],
                (1,),
                note="From the information matrix, the state eliminated: combinations on which the priors say more "
                "than the data, and those of which the data say nothing.",
            ),
            Table(
                "Profiles",
                ("parameter", "value", "1σ", "68 %", "95 %", "unit", "note"),
                [profile_row(p) for p in profiles],
                (1,),
                note="Intervals in which the cost rises by less than 1/2 and 1.92, all other parameters at their best.",
            ),
            *(
                Picture(f"Profile of {p.name}", pictures[name], f"Rise of the cost against {p.name} with its intervals")
                for p in profiles
                if (name := profile_picture(p.name)) in pictures
            ),
            Table(
                "Residual diagnostics",
                ("panel", "residuals", "RMS / σ", "mean / σ", "z of the mean", "lag 1", "z of lag 1", "Ljung-Box p"),
                list(diagnostic_rows(diagnostics)),
                tuple(range(1, 8)),
                note=diagnostic_note(diagnostics),
            ),
            Table(f"Correlations beyond ±{STRONG_CORRELATION}", ("parameter", "with", "correlation"), strong, (2,)),
            Table(
                "Left out before the fit",
                ("reason", "count", "rows of the file", "first"),
                rejection_rows(Rejection(**rejection) for rejection in provenance["rejections"]),
                (1,),
                note=f"{provenance['rows']} rows gave {provenance['samples']} samples.",
            ),
            Table("Orbit", ("element", "value", "1σ", "unit"), _orbit_rows(orbit), (1,)),
            Facts("Provenance", origin),
            Table("Settings", ("key", "value"), list(setting_rows(provenance["settings"]))),
        ],
    )


def _orbit_rows(orbit: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str, str, str]]:
    values = {name: element["value"] for name, element in orbit.items()}
    sigmas = {name: math.nan if element["sigma"] is None else element["sigma"] for name, element in orbit.items()}
    return element_rows(values, sigmas)


def unseen_row(direction: "Direction") -> tuple[str, ...]:
    """Returns (name, information, what holds it, components) of a direction as text."""
    parts = [f"{name} {change:+.3g} {unit_text(UNITS[name])}" for name, change in direction.components.items()]
    seen = "none" if direction.blind else value_text(direction.information, 2)
    return (direction.name, seen, direction.held_by, ", ".join(parts))


def diagnostic_rows(diagnostics: "Diagnostics") -> Iterator[tuple[str, ...]]:
    """Yields (panel, residuals, RMS, mean, its z, lag 1, its z, p) as text."""
    for name, panel in diagnostics.panels.items():
        signed = (panel.mean, panel.mean_z, panel.lag1, panel.lag1_z)
        yield (
            name,
            str(panel.count),
            "" if panel.rms is None else f"{panel.rms:.2f}",
            *("" if number is None else f"{number:+.2f}" for number in signed),
            "" if panel.ljung_box_p is None else value_text(panel.ljung_box_p, 2),
        )


def diagnostic_note(diagnostics: "Diagnostics") -> str:
    """Returns chi2, tails and remarks in sentences."""
    ratio, p = diagnostics.chi2_per_dof, diagnostics.chi2_p
    parts = [] if ratio is None else [f"chi2 per degree of freedom {ratio:.3f} (p = {value_text(p, 2)})"]
    parts += [f"{t['found']} beyond {limit} σ, {t['expected']:.1f} expected" for limit, t in diagnostics.tails.items()]
    return "; ".join([*parts, *(diagnostics.remarks() or ["nothing that is not noise"])]) + "."


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


def _range(values: np.ndarray) -> str:
    finite = values[np.isfinite(values)]
    return f"{finite.min():.1f} to {finite.max():.1f}" if finite.size else "n/a"


def _alternative(other: dict) -> str:
    shown = {name: value_text(float(v), 4) if isinstance(v, int | float) else str(v) for name, v in other.items()}
    return ", ".join(f"{name} {text}" for name, text in shown.items())
