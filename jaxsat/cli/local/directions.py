"""`jaxsat local --satellite`: attitudes of any satellite by the directions that its sensors see at once."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jaxsat.cli.shared.talk import Talk
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.local.directions import DirectAttitudes

SHOWN_AXES = 4
CLOSE = 1.3
"""Axes whose mismatch is within this factor of the best are not told apart for sure."""


def local_directions(
    files: Sequence[Path],
    satellite: Path,
    out: Path,
    *,
    arc_s: tuple[float, float] | None,
    began: float,
    plots: bool,
    talk: Talk,
) -> int:
    """Solves the tables of one session, writes the files and returns the exit status. Raises `InputError`."""
    from jaxsat.cli.shared.start import start_jax

    start_jax()
    from jaxsat.cli.local.direction_files import write_directions
    from jaxsat.cli.local.files import FILES
    from jaxsat.files.staging import staged_directory
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry

    craft = read_satellite(satellite)
    if not any(sensor.sees not in (None, "rate") for sensor in craft.model.sensors.values()):
        raise InputError("has no sensor that sees a direction or stars by itself", file=satellite, field="sensors")
    with talk.stages("local") as progress, staged_directory(out, FILES) as stage:
        progress("reading")
        session = read_telemetry(files, craft)
        from fitting.local.directions import direct_attitudes
        from fitting.surroundings import surroundings

        progress("attitudes")
        found = direct_attitudes(craft, session, surroundings(craft, session)[0], arc_s=arc_s)
        progress("writing results")
        write_directions(stage, found, session, satellite, began=began, plots=plots)
    talk.result(directions_summary(found, session.name), f"\nresults in {out}", document=out / "local.json")
    return 0 if found.fits else 3


def directions_summary(found: "DirectAttitudes", name: str) -> "RenderableType":
    """How many samples came to what, medians over those that have an attitude, and axes by their mismatch."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from fitting.local.directions import status_counts
    from jaxsat.cli.shared.terminal import plain_table

    table = plain_table("samples", "status", "reason", right=(0,))
    for (status, reason), count in status_counts(found).items():
        table.add_row(str(count), status, reason)
    parts: list[RenderableType] = [Text(name, style="bold"), table]
    facts = Table.grid(padding=(0, 2))
    if found.solved.any():
        facts.add_row(Text("1σ of the attitude", style="dim"), f"{_middle(np.degrees(found.sigma)):.3g} deg, median")
    off = found.mismatch / found.mismatch_sigma
    if np.isfinite(off).any():
        size = f"{_middle(np.degrees(np.abs(found.mismatch))):.3g} deg, median, {_middle(np.abs(off)):.2g} sigma"
        facts.add_row(Text("angle between two directions is off by", style="dim"), size)
    speed = np.degrees(np.linalg.norm(found.rate, axis=1))
    if np.isfinite(speed).any():
        facts.add_row(Text("rate by finite turns", style="dim"), f"{_middle(speed):.3g} deg/s, median")
    parts.append(facts)
    if len(found.conventions) > 1:
        axes = plain_table("mismatch, sigma", "axes", right=(0,))
        for each in found.conventions[:SHOWN_AXES]:
            spelt = "; ".join(f"{sensor} {' '.join(texts)}" for sensor, texts in each.spelt().items())
            axes.add_row(f"{each.mismatch:.3f}", spelt)
        parts.append(axes)
        best, second = found.conventions[:2]
        if second.mismatch < CLOSE * best.mismatch:
            parts.append(Text("The first two are not told apart for sure; jaxsat fit tries them all.", style="yellow"))
    return Group(*parts)


def _middle(values: np.ndarray) -> float:
    return float(np.median(values[np.isfinite(values)]))
