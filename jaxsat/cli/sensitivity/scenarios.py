"""`jaxsat sensitivity --scenarios`: a sweep of starts in DIR/scenarios, finished by --resume as any sweep."""

import shlex
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import CycloptsError

from jaxsat.cli.shared.talk import Talk
from jaxsat.cli.sweep.request import PREPARE
from jaxsat.cli.sweep.run import SweepRun
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from fitting.sensitivity.scenarios.draws import Draws
    from fitting.sensitivity.scenarios.many import Scenarios

FOLDER = "scenarios"


@dataclass(frozen=True)
class Asked:
    """What the command line says of the scenarios; None where nothing."""

    count: int
    spin: tuple[float, float] | None
    days: float | None
    instants: int | None
    seed: int | None

    def draws(self) -> "Draws":
        """How they are drawn. Raises `InputError`."""
        from fitting.sensitivity.scenarios.draws import Draws

        low, high = self.spin or (Draws.slowest_deg_s, Draws.fastest_deg_s)
        days = Draws.days if self.days is None else self.days
        try:
            return Draws(self.count, low, high, days, self.seed or 0, self.instants or Draws.instants)
        except ValueError as error:
            raise InputError(str(error), field="--spin, --days, --instants") from None


def run_scenarios(
    place: Path,
    given: Mapping[str, object],
    draws: "Draws",
    chosen: Mapping[str, Any],
    files: Mapping[str, Any],
    *,
    out: Path,
    resume: bool,
    plots: bool,
    talk: Talk,
) -> "Scenarios":
    """Runs what is missing of so many starts of a plan, and reads what all gave.

    `given` are `TwinSettings`, `chosen` the options free, consider and spread, `files` orbit and commands. Raises
    `InputError`, and CycloptsError for numbers that are none.
    """
    from fitting.sensitivity.scenarios.many import Scenarios
    from fitting.sensitivity.scenarios.source import ADDRESS, map_by, options_of
    from jaxsat.sweep import Source, SweepPlan
    from jaxsat.versions import LAST_DIGITS, versions

    began = time.perf_counter()
    source = Source.of(ADDRESS, options_of(place, given, draws, **chosen, **files), prepare=PREPARE)
    try:
        scenario = source.scenario()
    except InputError as error:
        if error.field == "spread":
            raise CycloptsError(msg=f"Invalid value for --spread: {error.reason}") from None
        raise
    plan = SweepPlan(
        scenario.name, draws.seed, dict(source.options), scenario.chunk, draws.count, versions(LAST_DIGITS)
    )
    directory = out / FOLDER
    resuming = f"the same command and --resume, or jaxsat sweep {ADDRESS} --out {shlex.quote(str(directory))} --resume"
    replaying = ("jaxsat", "sweep", ADDRESS, "--out", str(directory), "--case")
    run = SweepRun(source, scenario, plan, directory, (1, 1), "local", None, None, resuming, replaying)
    done = run.complete(resume=resume, imported=0.0, began=began, plots=plots, talk=talk)
    if done is None:
        raise InputError("some chunks have gone while they were run; --resume runs them again", file=directory)
    content, _ = done
    timing, timed = content["timing_s"], max(content["cases_run"] - scenario.chunk, 0)
    seconds = timing["run"] - timing["first_chunk"]
    return Scenarios.read(
        map_by(dict(source.options)), draws, directory / "cases.parquet", seconds=seconds, timed=timed
    )
