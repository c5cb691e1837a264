"""One session: read, fitted, written whole or not at all, summed up on the terminal."""

import importlib
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from jaxsat.cli.shared.talk import Talk

if TYPE_CHECKING:
    from fitting.fitted import Fit
    from fitting.report.fit.drawing import Draw
    from fitting.starts.guess import Guess
    from jaxsat.cli.fit.inputs import Inputs

CONVERGED, BAD_INPUT, NOT_CONVERGED = 0, 1, 3
"""Exit statuses; an ambiguous fit has not converged to one answer and counts as such."""


@dataclass(frozen=True)
class Clock:
    """When the work on a file began (of perf_counter), and how long the imports before it took [s]."""

    began: float
    imported: float


@dataclass(frozen=True)
class Outcome:
    """What became of one session."""

    telemetry: str
    directory: Path
    status: str
    """That of the fit, or `failed`."""
    message: str
    numbers: dict[str, float | int | None]

    @property
    def exit_status(self) -> int:
        """That of the command, were this its only session."""
        return {"converged": CONVERGED, "failed": BAD_INPUT}.get(self.status, NOT_CONVERGED)


def fit_one(
    files: Sequence[Path],
    directory: Path,
    read: Callable[[Sequence[Path]], "Inputs"],
    *,
    clock: Clock,
    draw: "Draw | None",
    profiles: Sequence[str] = (),
    causes: bool = False,
    as_if: Sequence[str] = (),
    guess: "Guess | None" = None,
    talk: Talk,
    alone: bool = True,
) -> Callable[[], Outcome]:
    """Fits one session of one file or of several; what it returns writes its directory, whole or not at all.

    That says what was found too, if the session is `alone`; it is to be called, once, also where the outcome is of no
    interest. `draw` makes the pictures, if there are to be any; `profiles` names the parameters that get a profile;
    with `causes` the usual ones are tried where a fit is denied; `as_if` changes the data; a `guess` takes the place of
    the search. Raises `InputError`, as the writing may.
    """
    from fitting.report.fit.owned import owned_files
    from fitting.run import fit
    from jaxsat.files.staging import staged_directory

    start = time.perf_counter()
    inputs = read(files)
    session = inputs.session
    before = {"import": clock.imported, "prepare": time.perf_counter() - start}
    with ExitStack() as unfinished:
        # Staged before the work starts: a directory that cannot be written is known at once.
        stage = unfinished.enter_context(staged_directory(directory, owned_files(directory, session.channels)))
        # Importing matplotlib costs half a second; the solver leaves one core to Python.
        threading.Thread(target=importlib.import_module, args=("fitting.report.fit.files",), daemon=True).start()
        with talk.stages(session.name, patience_s=0.0) as progress:
            how = {"given": inputs.given, "profiles": profiles, "causes": causes, "as_if": as_if, "guess": guess}
            how["progress"] = progress
            found = fit(inputs.satellite, session, settings=inputs.settings, **how, sky_ahead=True)
            progress("writing results", 0, 0)
        found = found.after(before, total=time.perf_counter() - clock.began)
        rest = unfinished.pop_all()

    def write() -> Outcome:
        with rest:
            warnings = found.write_into(stage, draw=draw)
        if alone:
            from jaxsat.cli.fit.text import fit_text

            text = fit_text(found.result, session.name, session.rejections, whole=talk.verbose)
            talk.result(text, f"\nresults in {directory}", document=directory / "fit.json")
        return _outcome(found, directory, warnings)

    return write


def _outcome(found: "Fit", directory: Path, warnings: Sequence[str]) -> Outcome:
    result = found.result
    for warning in warnings:
        print(f"jaxsat: warning: {warning}", file=sys.stderr)
    numbers = {"chi2": result.chi2, "dof": result.dof, "residual_rms_mA": result.residual_rms_mA}
    return Outcome(found.session.telemetry, directory, result.status, result.message, numbers)
