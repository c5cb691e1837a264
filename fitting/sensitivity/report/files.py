"""Writes what a sensitivity leaves in its directory."""

from pathlib import Path

from fitting.sensitivity.analysis import Sensitivity
from fitting.sensitivity.report.document import document
from jaxsat.files.json_files import write_json


def write_sensitivity(stage: Path, found: Sensitivity, *, subject: str, plots: bool = True) -> None:
    """Writes sensitivity.json into an empty directory."""
    epoch = found.vantage.samples.epoch.iso(3)
    write_json(stage / "sensitivity.json", document(found, subject=subject, epoch_utc=epoch))
