"""`jaxsat fit --satellite`: the tables of one session, fitted, written whole or not at all, summed up."""

import dataclasses
import importlib
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from jaxsat.cli.fit.one import CONVERGED, NOT_CONVERGED
from jaxsat.errors import InputError


def fit_sensed(
    files: list[Path], satellite: Path, out: Path, given: Mapping[str, object], began: float, *, plots: bool
) -> int:
    """Fits the session and returns the exit status; `given` are `SensedSettings`. Raises `InputError`."""
    # What is wrong with the files comes before JAX is there, at once.
    from jaxsat.numerics import set_up_jax
    from jaxsat.satellites import read_satellite
    from jaxsat.satellites.satellite import Satellite

    notice = set_up_jax()
    if notice:
        print(f"jaxsat: {notice}", file=sys.stderr)
    craft = read_satellite(satellite)
    if not isinstance(craft, Satellite):
        raise InputError(
            "expected sections [body], [sensors] and [channels]; `jaxsat init` prints a template", file=satellite
        )
    from fitting.sensed_run import fit_table
    from fitting.sensed_settings import SensedSettings
    from jaxsat.cli.fit.progress import StageProgress
    from jaxsat.cli.fit.sensed_text import sensed_summary
    from jaxsat.cli.shared.terminal import show
    from jaxsat.files.staging import staged_directory
    from jaxsat.telemetry import read_telemetry

    imported = time.perf_counter() - began
    session = read_telemetry(files, craft)
    from fitting.report.sensed.files import owned_files

    with staged_directory(out, owned_files(out, session.channels)) as stage:
        if plots:
            # Importing matplotlib costs half a second; the solver leaves one core to Python.
            threading.Thread(target=importlib.import_module, args=("jaxsat.plotting",), daemon=True).start()
        with StageProgress(session.name) as progress:
            found = fit_table(craft, session, SensedSettings.model_validate(dict(given)), progress=progress)
            progress("writing results", 0, 0)
            timing = {"import": imported, **found.result.timing_s, "total": time.perf_counter() - began}
            found = dataclasses.replace(found, result=dataclasses.replace(found.result, timing_s=timing))
            warnings = found.write_into(stage, plots=plots)
    show(sensed_summary(found.result, session.name, session.rejections), f"\nresults in {out}")
    for warning in warnings:
        print(f"jaxsat: warning: {warning}", file=sys.stderr)
    return CONVERGED if found.status == "converged" else NOT_CONVERGED
