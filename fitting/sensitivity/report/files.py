"""Writes what a sensitivity leaves in its directory."""

from pathlib import Path

from fitting.sensitivity.analysis import Sensitivity
from fitting.sensitivity.report.document import document
from fitting.sensitivity.report.page import sensitivity_page
from fitting.sensitivity.scenarios.many import Scenarios
from jaxsat.files.json_files import plain, write_json

FILES = (
    *("sensitivity.json", "report.html", "limits.png", "arc.png", "sampling.png"),
    "scenarios.png",
)
"""All that may be there."""


def write_sensitivity(
    stage: Path, found: Sensitivity, *, subject: str, plots: bool = True, drawn: Scenarios | None = None
) -> None:
    """Writes sensitivity.json, report.html and, with `plots`, pictures into an empty directory.

    `drawn` are scenarios, where there are such.
    """
    epoch = found.vantage.samples.epoch.iso(3)
    pictures: dict[str, bytes] = {}
    subtitle = f"{subject}, epoch {epoch} UTC"
    if plots:
        # Matplotlib is wanted here for the first time.
        from fitting.sensitivity.report.pictures import draw_sensitivity

        pictures = draw_sensitivity(found, subtitle)
    content = document(found, subject=subject, epoch_utc=epoch)
    if drawn is not None:
        from fitting.sensitivity.report.drawn import draw_scenarios, scenarios_document

        content["scenarios"] = plain(scenarios_document(drawn))[0]
        if plots:
            from jaxsat.plotting.style import png_bytes

            pictures["scenarios.png"] = png_bytes(draw_scenarios(drawn, subtitle))
    for name, png in pictures.items():
        (stage / name).write_bytes(png)
    (stage / "report.html").write_text(sensitivity_page(found, pictures, subtitle), encoding="utf-8")
    write_json(stage / "sensitivity.json", content)
