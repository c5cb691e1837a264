"""`jaxsat check`: what is odd about a session's table before any fit."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import CycloptsError, Parameter

from jaxsat.cli.shared.talk import USUAL, Talking

if TYPE_CHECKING:
    from jaxsat.telemetry.checks import SessionCheck

FILES = ("check.json",)


def check(
    files: Annotated[list[Path], Parameter(help="Table of telemetry, CSV or Parquet; several are joined by time.")],
    /,
    *,
    satellite: Annotated[
        Path | None, Parameter(help="Satellite file, TOML; `jaxsat init TABLE` drafts one. (required)")
    ] = None,
    out: Annotated[Path | None, Parameter(help="Directory for check.json. [default: nothing is written]")] = None,
    talk: Talking = USUAL,
) -> int:
    """Say what is odd about telemetry before any fit.

    The size of the field against IGRF, and the bias and scale of a
    magnetometer that follow from it, light against the computed shadow, angles
    between what two sensors see, or from where stars put it, rates and turns,
    gaps, spacing and rounding of stamps, columns that nobody uses, age of the
    element set, rows left out and why.

    Exit status: 0 done, odd or not, 1 bad input, 2 wrong usage.

    Example: jaxsat check pass.csv --satellite sat.toml --out pass-check
    """
    if satellite is None:
        raise CycloptsError(msg=f"--satellite is missing; `jaxsat init {files[0]} > sat.toml` drafts one.")
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.files.json_files import json_text, plain, write_json
    from jaxsat.files.staging import staged_directory
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry
    from jaxsat.telemetry.checks import check_session

    found = read_satellite(satellite)
    with talk.stages("check") as progress:
        progress("reading")
        session = read_telemetry(files, found)
        progress("looking")
        checked = check_session(found, session)
    document = plain(checked.document())[0]
    if out is not None:
        with staged_directory(out, FILES) as stage:
            write_json(stage / "check.json", document)
    talk.result(*summary(checked), *([f"\nresults in {out}"] if out else []), document=json_text(document))
    return 0


def summary(checked: "SessionCheck") -> list[Any]:
    """What the terminal shows: a line a finding, what is odd marked, and the count of it."""
    from rich.text import Text

    from jaxsat.significant import count_text

    session = checked.session
    head = f"{', '.join(path.name for path in session.paths)}: {count_text(len(session.channels), 'channel')}, "
    lines = [Text(head + f"epoch {session.epoch.iso(3)} UTC\n", style="bold")]
    for finding in checked.findings:
        mark, style = ("ODD ", "bold yellow") if finding.odd else ("    ", "")
        lines.append(Text.assemble((mark, style), (f"{finding.about}: ", "bold"), finding.text))
    odd = len(checked.odd)
    lines.append(Text(f"\n{count_text(odd, 'thing')} to look at" if odd else "\nnothing odd", style="bold"))
    return lines
