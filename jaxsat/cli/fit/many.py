"""Fits several files: a directory for each, one summary for all, and no failure stops the rest."""

import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from jaxsat.cli.fit.one import Clock, Outcome, fit_one
from jaxsat.cli.shared.talk import Talk
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from jaxsat.cli.fit.inputs import Inputs

SCHEMA = "jaxsat.fit-summary/1"
SUMMARY = "summary.json"
STATUSES = ("converged", "ambiguous", "not_converged", "failed")


def fit_many(
    files: list[Path],
    out: Path,
    read: Callable[[Sequence[Path]], "Inputs"],
    *,
    clock: Clock,
    plots: bool,
    profiles: Sequence[str] = (),
    causes: bool = False,
    as_if: Sequence[str] = (),
    talk: Talk,
) -> int:
    """Fits each file, a session by itself, into out/STEM, writes out/summary.json and returns the worst exit status.

    Worst is bad input (1), then not converged (3). Each directory is whole or absent, whenever the run is stopped.
    Raises `InputError` where not even the summary can be written.
    """
    from fitting.report.fit.drawing import DrawingProcess
    from jaxsat.cli.fit.text import files_summary
    from jaxsat.files.publishing import refuse_folders

    refuse_folders(out, [SUMMARY])
    writing: list[Future[Outcome]] = []
    drawing = DrawingProcess() if plots else nullcontext()
    # Each is drawn and written while the next file is fitted.
    with drawing as draw, ThreadPoolExecutor(1, thread_name_prefix="write") as writer:
        for number, (path, name) in enumerate(zip(files, directory_names(files), strict=True)):
            own, directory = clock if number == 0 else Clock(time.perf_counter(), 0.0), out / name
            how = {"clock": own, "draw": draw, "profiles": profiles, "causes": causes, "as_if": as_if, "talk": talk}
            failed = partial(_failed, path, directory)
            # A defect that one file brings to light must not cost the others their night's run.
            try:
                write = fit_one([path], directory, read, **how, alone=False)
            except Exception as error:
                write = partial(failed, error)
            # One at a time, so that finished fits do not heap up in memory.
            wait(writing)
            writing.append(writer.submit(_written, write, failed))
    outcomes = [each.result() for each in writing]
    _write_summary(out, outcomes, time.perf_counter() - clock.began)
    rows = files_summary([(o.telemetry, o.status, o.message) for o in outcomes])
    talk.result(rows, f"results in {out}", document=out / SUMMARY)
    found = {outcome.exit_status for outcome in outcomes}
    return next((status for status in (1, 3) if status in found), 0)


def directory_names(files: list[Path]) -> list[str]:
    """Returns a directory name for each file: its stem, with -2, -3 ... where an earlier one has it already."""
    names: list[str] = []
    for path in files:
        stem, number = path.stem or path.name, 1
        while (name := stem if number == 1 else f"{stem}-{number}") in names:
            number += 1
        names.append(name)
    return names


def _written(write: Callable[[], Outcome], failed: Callable[[Exception], Outcome]) -> Outcome:
    try:
        return write()
    except Exception as error:
        return failed(error)


def _failed(path: Path, directory: Path, error: Exception) -> Outcome:
    message = str(error)
    if not isinstance(error, InputError):
        message = f"{path}: unexpected {type(error).__name__}: {' '.join(message.split())}"
    print(f"jaxsat: error: {message}", file=sys.stderr)
    return Outcome(str(path), directory, "failed", message, {})


def _write_summary(out: Path, outcomes: list[Outcome], total_s: float) -> None:
    from jaxsat.files.json_files import json_text, plain
    from jaxsat.files.whole_file import write_whole

    counts = Counter(outcome.status for outcome in outcomes)
    document = {
        "schema": SCHEMA,
        "files": [
            {
                "telemetry": o.telemetry,
                "directory": o.directory.name if o.status != "failed" else None,
                "status": o.status,
                "message": o.message,
                **{name: o.numbers.get(name) for name in ("chi2", "dof", "residual_rms_mA")},
            }
            for o in outcomes
        ],
        "counts": {status: counts[status] for status in STATUSES},
        "timing_s": {"total": total_s},
    }
    text = json_text(plain(document)[0])
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_whole(out / SUMMARY, lambda stream: stream.write(text.encode()))
    except OSError as error:
        raise InputError(f"cannot write {SUMMARY} here: {error.strerror}", file=out) from None
