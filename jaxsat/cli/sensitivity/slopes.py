"""`jaxsat sensitivity SCENARIO`: what a change of a gain, a limit or a mass does to the means of its metrics."""

import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from cyclopts import CycloptsError

from jaxsat.cli.shared.talk import Talk
from jaxsat.cli.sweep.scenarios import SCENARIOS
from jaxsat.errors import InputError

CASES, SEED = 500, 0


def is_scenario(place: Path) -> bool:
    """Whether a word is the name of a scenario or the address of one, and not that of a file or directory."""
    word = str(place)
    if word in SCENARIOS:
        return not place.exists()
    return place.suffix == ".py" or ".py:" in word or (":" in word and not place.exists())


def near_scenario(place: Path) -> str:
    """The scenario that was meant by a word that is nothing, or an empty text."""
    close = get_close_matches(str(place), SCENARIOS, n=1)
    return close[0] if close else ""


@dataclass(frozen=True)
class Asked:
    """What the command line says; None where nothing."""

    knobs: Sequence[str] | None
    metrics: Sequence[str] | None
    cases: int | None
    seed: int | None
    width: float | None
    at_once: bool
    exact: bool


def slopes_of(place: Path, given: Mapping[str, str], asked: Asked, out: Path, *, plots: bool, talk: Talk) -> None:
    """Writes and shows the slopes of a scenario with the options `given`.

    Raises `InputError`, and CycloptsError for options, knobs and metrics that are none.
    """
    from jaxsat import numerics
    from jaxsat.cli.sweep.request import scenario_of
    from jaxsat.sweep import CodeError

    notice = numerics.set_up_jax()
    if notice:
        print(f"jaxsat: {notice}", file=sys.stderr)
    try:
        source, scenario = scenario_of(str(place), given)
        _studied(scenario, dict(source.options), asked, out, plots=plots, talk=talk)
    except CodeError as error:
        if talk.verbose and error.__cause__ is not None:
            traceback.print_exception(error.__cause__)
        raise


def _studied(scenario, options: Mapping[str, str], asked: Asked, out: Path, *, plots: bool, talk: Talk) -> None:
    from rich.console import Group
    from rich.text import Text

    from fitting.sensitivity.means import slopes_of_means
    from fitting.sensitivity.means.pairs import WIDTH
    from fitting.sensitivity.means.report import FILES, write_slopes
    from fitting.sensitivity.means.wording import head_of, sentences, table_rows
    from jaxsat.cli.shared.terminal import plain_table
    from jaxsat.files.staging import staged_directory

    if not scenario.knobs:
        reason = f"scenario {scenario.name} has no knobs, by which means could be differentiated"
        raise InputError(f"{reason}; docs/scenarios/own.md says how one gets them")
    how = {
        "cases": CASES if asked.cases is None else asked.cases,
        "seed": SEED if asked.seed is None else asked.seed,
        "width": WIDTH if asked.width is None else asked.width,
        "together": asked.at_once,
        "exact": asked.exact,
    }
    with staged_directory(out, FILES) as stage, talk.stages(scenario.name) as progress:
        try:
            found = slopes_of_means(scenario, asked.knobs, asked.metrics, progress=progress, **how)
        except InputError as error:
            # Names and numbers of the command line, not of a file.
            if error.field is not None and error.file is None:
                raise CycloptsError(msg=str(error)) from None
            raise
        progress("writing results")
        document = write_slopes(stage, found, options, plots=plots)
    head = head_of(document)
    table = plain_table(*head, right=range(1, len(head)))
    for row in table_rows(document, whole=talk.verbose):
        table.add_row(*row)
    header = Text.assemble((scenario.name, "bold"), f": what a change does on average, of {found.cases} cases.")
    text = Group(header, table, *(Text(f"- {line}") for line in sentences(document)))
    talk.result(text, f"\nresults in {out}", document=out / "slopes.json")
