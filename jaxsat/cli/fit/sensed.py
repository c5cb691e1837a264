"""`jaxsat fit --satellite`: the tables of one session, fitted, written whole or not at all, summed up."""

import dataclasses
import gc
import importlib
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from jaxsat.cli.fit.one import CONVERGED, NOT_CONVERGED


def fit_sensed(
    files: list[Path], satellite: Path, out: Path, given: Mapping[str, object], began: float, *, plots: bool
) -> int:
    """Fits the session and returns the exit status; `given` are `SensedSettings`. Raises `InputError`."""
    from jaxsat.cli.shared.start import start_jax
    from jaxsat.satellites import read_sensed

    start_jax()
    # A wrong satellite file is told before the seconds that the imports of a fit take.
    craft = read_sensed(satellite)
    from fitting.report.sensed.owned import owned_files
    from fitting.sensed_run import fit_table
    from fitting.sensed_settings import SensedSettings
    from jaxsat.cli.fit.progress import StageProgress
    from jaxsat.cli.fit.sensed_text import sensed_summary
    from jaxsat.cli.shared.terminal import show
    from jaxsat.files.staging import staged_directory
    from jaxsat.telemetry import read_telemetry

    imported = time.perf_counter() - began
    session = read_telemetry(files, craft)
    with staged_directory(out, owned_files(out, session.channels)) as stage:
        # Importing matplotlib costs half a second; the solver leaves one core to Python.
        threading.Thread(target=importlib.import_module, args=("fitting.report.sensed.files",), daemon=True).start()
        with StageProgress(session.name) as progress:
            settings = SensedSettings.model_validate(dict(given))
            found = fit_table(craft, session, settings, progress=progress, sky_ahead=True)
            progress("writing results", 0, 0)
            timing = {"import": imported, **found.result.timing_s, "total": time.perf_counter() - began}
            found = dataclasses.replace(found, result=dataclasses.replace(found.result, timing_s=timing))
            # What is there stays to the end: no search for garbage among JAX's many objects while pictures are drawn.
            gc.freeze()
            warnings = found.write_into(stage, plots=plots)
    show(sensed_summary(found.result, found.label, session.rejections), f"\nresults in {out}")
    for warning in warnings:
        print(f"jaxsat: warning: {warning}", file=sys.stderr)
    return CONVERGED if found.status == "converged" else NOT_CONVERGED
