"""`jaxsat fit`: attitude and parameters from panel currents, for one session or many."""

import dataclasses
import importlib
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import CycloptsError, Parameter, validators

from fitting.parameters.names import NAMED, STATE
from jaxsat.cli.session.prepared import BUNDLED
from jaxsat.cli.shared.options import Arc, ConfigFile, Drop, Free, whole_number
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from jaxsat.cli.settings.sections import Config

CONVERGED, BAD_INPUT, NOT_CONVERGED = 0, 1, 3
"""Exit statuses; an ambiguous fit has not converged to one answer and counts as such."""


PROFILED = STATE + NAMED
"""The words of `--profile`."""


def _check_profiles(_: Any, value: Sequence[str] | None) -> None:
    for name in value or ():
        if name not in PROFILED:
            close = get_close_matches(name, PROFILED, n=1)
            hint = f" Did you mean {close[0]}?" if close else ""
            raise ValueError(f'"{name}" is no single parameter such as imax or {PROFILED[0]}.{hint}')


def fit(
    files: Annotated[list[Path] | None, Parameter(help="RAW_SUN files. [default: a bundled synthetic one]")] = None,
    /,
    *,
    free: Free = None,
    config: ConfigFile = None,
    arc: Arc = None,
    drop: Drop = None,
    starts: Annotated[
        int | None,
        Parameter(
            help="Number of random starts of the search. [default: that of the configuration]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=65536),
        ),
    ] = None,
    seed: Annotated[
        int | None,
        Parameter(
            help="Seed of the starts. [default: that of the configuration]",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=2**32),
        ),
    ] = None,
    profile: Annotated[
        list[str] | None,
        Parameter(
            help="NAME of a free parameter, as imax, rods.y, rate.x: the lowest cost at each of its values and the "
            "68 and 95 % intervals read from it; repeatable.",
            negative=(),
            validator=_check_profiles,
        ),
    ] = None,
    limb: Annotated[
        Path | None,
        Parameter(
            help="CSV of limb angles, fitted with the currents of the one session: utc,distance_deg,turn_deg, the "
            "angle of body x from the Earth's limb (positive outside) and atan2(z, y) of the nadir in body axes; an "
            "empty cell is not measured. Keys of the configuration: fit.limb_sigma_deg, fit.limb_weight.",
        ),
    ] = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = Path("jaxsat-fit"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
) -> int:
    """Fit attitude, and any of the satellite's parameters, to the currents of six solar panels.

    Writes fit.json, attitude.csv, currents.csv, pictures, report.html,
    scene.json and provenance.json; with several files into a directory for
    each, and summary.json for all.

    Exit status: 0 converged, 1 bad input, 2 wrong usage,
    3 not converged or ambiguous.

    Example: jaxsat fit a.RAW_SUN --free alsI0,albedo --arc 0 2700 --out a-fit

    Example: jaxsat fit --profile imax --profile albedo.specular
    """
    began = time.perf_counter()
    if limb is not None and files and len(files) > 1:
        raise CycloptsError(msg=f"--limb holds the angles of one session, but {len(files)} files are given.")
    settings = read_settings(config, free=free, arc=arc, drop=drop, starts=starts, seed=seed)
    if not files:
        print(f"jaxsat: no file given: fitting the bundled synthetic session {BUNDLED.name}", file=sys.stderr)
        files = [BUNDLED]

    clock = Clock(began, load_numerics(began))
    profiles = tuple(profile or ())
    if len(files) == 1:
        return fit_one(files[0], out, settings, clock=clock, plots=plots, profiles=profiles, limb=limb).exit_status

    from jaxsat.cli.fit.many import fit_many

    return fit_many(files, out, settings, clock=clock, plots=plots, profiles=profiles)


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
    from jaxsat.cli.shared.numerics import set_up_jax

    notice = set_up_jax()
    if notice:
        print(f"jaxsat: {notice}", file=sys.stderr)
    import fitting.estimate  # noqa: F401

    return time.perf_counter() - began


def read_settings(
    config: Path | None,
    *,
    free: str | None = None,
    arc: tuple[float, float] | None = None,
    drop: list[tuple[float, float]] | None = None,
    starts: int | None = None,
    seed: int | None = None,
) -> "Config":
    """Returns the configuration with the command line's options in place of its keys; `drop` adds to the file's."""
    from jaxsat.cli.settings.files import load_config

    options = {"fit.free": free, "fit.arc_s": arc, "fit.starts": starts, "fit.seed": seed}
    given: dict[str, object] = {key: value for key, value in options.items() if value is not None}
    settings = load_config(config, given)
    if drop:
        settings = load_config(config, {**given, "cleaning.drop_s": [*settings.cleaning.drop_s, *drop]})
    return settings


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
    from fitting.estimate import fit
    from fitting.measurements.observations import LIMB_FIELD
    from jaxsat.cli.fit.files import FILES, write_fit
    from jaxsat.cli.fit.limb import LimbInput
    from jaxsat.cli.fit.profiles import Profiler
    from jaxsat.cli.fit.progress import StageProgress
    from jaxsat.cli.fit.scene import look_around
    from jaxsat.cli.session.inputs import fit_settings, nominal, observations
    from jaxsat.cli.session.prepared import prepare_session
    from jaxsat.cli.shared.staging import staged_directory
    from jaxsat.cli.shared.terminal import fit_summary, show

    start = time.perf_counter()
    # Staged before the work starts: a directory that cannot be written is known at once.
    with staged_directory(directory, FILES) as stage:
        prepared = prepare_session(path, settings)
        sighted = LimbInput.read(limb, prepared.session, settings)
        before = {"import": clock.imported, "prepare": time.perf_counter() - start}
        if plots:
            # Importing matplotlib costs half a second; the solver leaves one core to Python.
            threading.Thread(target=importlib.import_module, args=("jaxsat.plotting",), daemon=True).start()
        with StageProgress(prepared.label) as progress:
            samples = observations(prepared.session, prepared.orbit_fit, settings, sighted.angles)
            sky = look_around(prepared, samples, settings)
            try:
                profiler = Profiler(profiles, settings, progress)
                result = fit(samples, nominal(settings), fit_settings(settings), progress=progress, at_minimum=profiler)
            except InputError as error:
                source = limb if error.field == LIMB_FIELD else path
                raise InputError(error.reason, file=source, row=error.row, field=error.field) from None
            progress("writing results", 0, 0)
            timing = {**before, **result.timing_s}
            timing["prepare"] = before["prepare"] + result.timing_s.get("prepare", 0.0)
            result = dataclasses.replace(result, timing_s=timing)
            found = {
                "sky": sky.result(),
                "profiles": profiler.profiles,
                "limb": sighted.matched,
                "remarks": [*sighted.remarks, *profiler.reasons],
            }
            result, warnings = write_fit(stage, result, prepared, settings, began=clock.began, plots=plots, **found)
    if not quiet:
        show(fit_summary(result, prepared.label), f"\nresults in {directory}")
    for warning in warnings:
        print(f"jaxsat: warning: {warning}", file=sys.stderr)
    numbers = {"chi2": result.chi2, "dof": result.dof, "residual_rms_mA": result.residual_rms_mA}
    return Outcome(prepared.telemetry, directory, result.status, result.message, numbers)
