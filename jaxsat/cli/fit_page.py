"""The report of a fit as one HTML page."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jaxsat.cli.tables import (
    STRONG_CORRELATION,
    element_rows,
    fit_facts,
    parameter_rows,
    rejection_rows,
    strong_correlations,
)
from jaxsat.report import Facts, Picture, Remarks, Table, Verdict, page

if TYPE_CHECKING:
    from fitting.result import FitResult
    from jaxsat.cli.session import PreparedSession

VERDICTS: dict[str, Verdict] = {"converged": "good", "ambiguous": "doubtful"}
PICTURES = {
    "currents.png": ("Panel currents", "Measured and modelled currents of the six panels with residuals, against time"),
    "field_angle.png": ("Attitude to the magnetic field", "Angle of body x to the field with its band, against time"),
}
"""Headings and descriptions; the parameters' picture is not repeated, their table stands in the page."""


def fit_page(
    result: "FitResult",
    prepared: "PreparedSession",
    pictures: Mapping[str, bytes],
    *,
    warnings: Sequence[str],
    provenance: Mapping[str, Any],
) -> str:
    """Returns the HTML of one fit; `pictures` maps file names to PNG content, `provenance` is that of its JSON file."""
    rows = parameter_rows(result.parameters)
    parameters = [(name, value, f"± {s}" if s else "", *rest) for name, value, s, *rest in rows]
    strong = [(a, b, f"{value:+.3f}") for a, b, value in strong_correlations(result.correlations)]
    origin = [
        ("telemetry", prepared.telemetry),
        ("SHA-256 of the file", prepared.session.sha256),
        ("seed", str(provenance["seed"])),
        ("versions", ", ".join(f"{name} {version}" for name, version in provenance["versions"].items())),
    ]
    return page(
        f"Fit of {prepared.label}",
        subtitle=f"{prepared.telemetry}, epoch {prepared.session.epoch.iso(3)} UTC",
        verdict=VERDICTS.get(result.status, "bad"),
        verdict_text=result.status.replace("_", " ").capitalize() + ".",
        message=result.message,
        sections=[
            Remarks("Warnings", warnings),
            Facts("Fit", fit_facts(result)),
            *(Picture(heading, pictures[name], alt) for name, (heading, alt) in PICTURES.items() if name in pictures),
            Table("Parameters", ("parameter", "value", "1σ", "unit", "note"), parameters, (1,)),
            Table(f"Correlations beyond ±{STRONG_CORRELATION}", ("parameter", "with", "correlation"), strong, (2,)),
            Table(
                "Left out before the fit",
                ("reason", "count", "rows of the file", "first"),
                rejection_rows(prepared.session.rejections),
                (1,),
                note=f"{prepared.session.raw_t_s.size} rows gave {prepared.session.t_s.size} samples.",
            ),
            Table("Orbit", ("element", "value", "1σ", "unit"), element_rows(prepared.orbit_fit), (1,)),
            Facts("Provenance", origin),
            Table("Settings", ("key", "value"), list(setting_rows(provenance["settings"]))),
        ],
    )


def setting_rows(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yields (key, value) as text with sections and tables within them in the key, as TOML names them."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from setting_rows(value, f"{prefix}{name}.")
        elif isinstance(value, list):
            yield prefix + name, ", ".join(map(str, value)) or "none"
        else:
            yield prefix + name, "not given" if value is None else str(value)
