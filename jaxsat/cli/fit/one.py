"""One file of a fit: prepared, fitted, written whole or not at all, summed up on the terminal."""

import importlib
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from jaxsat.cli.settings.sections import Config

CONVERGED, BAD_INPUT, NOT_CONVERGED = 0, 1, 3
"""Exit statuses; an ambiguous fit has not converged to one answer and counts as such."""


@dataclass(frozen=True)
class Clock:
    """When the work on a file began (of perf_counter), and how long the imports before it took [s]."""

    began: float
    imported: float


@dataclass(frozen=True)
class Outcome:
    """What became of one file."""

    telemetry: str
    directory: Path
    status: str
    """That of the fit, or `failed`."""
    message: str
    numbers: dict[str, float | int]

    @property
    def exit_status(self) -> int:
        """That of the command, were this its only file."""
        return {"converged": CONVERGED, "failed": BAD_INPUT}.get(self.status, NOT_CONVERGED)


def load_numerics(began: float) -> float:
    """Imports what a fit needs, sets JAX up and returns the seconds since `began`."""
    from jaxsat.cli.shared.start import start_jax

    start_jax()
    import fitting.run  # noqa: F401

    return time.perf_counter() - began


def fit_one(
    path: Path,
    directory: Path,
    settings: "Config",
    *,
    clock: Clock,
    plots: bool,
    profiles: tuple[str, ...] = (),
    limb: Path | None = None,
    quiet: bool = False,
) -> Outcome:
    """Fits one file, writes its directory whole or not at all, prints a summary; raises `InputError`.

    `profiles` names the parameters that get a profile; `limb` is a file of limb angles.
    """
    from fitting.report.files import FILES
    from fitting.run import fit_prepared
    from fitting.session import prepare_session
    from jaxsat.cli.fit.progress import StageProgress
    from jaxsat.cli.fit.text import fit_summary
    from jaxsat.cli.shared.terminal import show
    from jaxsat.files.staging import staged_directory
    from jaxsat.telemetry import read_telemetry

    start = time.perf_counter()
    # Staged before the work starts: a directory that cannot be written is known at once.
    with staged_directory(directory, FILES) as stage:
        session = read_telemetry(path, settings.satellite, cleaning=settings.cleaning)
        prepared = prepare_session(session, settings.given)
        before = {"import": clock.imported, "prepare": time.perf_counter() - start}
        if plots:
            # Importing matplotlib costs half a second; the solver leaves one core to Python.
            threading.Thread(target=importlib.import_module, args=("jaxsat.plotting",), daemon=True).start()
        asked = {"limb": limb, "profiles": profiles, "sky_ahead": True}
        with StageProgress(prepared.label) as progress:
            found = fit_prepared(prepared, settings.satellite, settings.fit, progress=progress, **asked)
            progress("writing results", 0, 0)
            result, warnings = found.after(before).write_into(stage, plots=plots, began=clock.began)
    if not quiet:
        told = () if found.witness is None else (f"\n{found.witness.text}",)
        show(fit_summary(result, prepared.label), *told, f"\nresults in {directory}")
    for warning in warnings:
        print(f"jaxsat: warning: {warning}", file=sys.stderr)
    numbers = {"chi2": result.chi2, "dof": result.dof, "residual_rms_mA": result.residual_rms_mA}
    return Outcome(prepared.telemetry, directory, result.status, result.message, numbers)
