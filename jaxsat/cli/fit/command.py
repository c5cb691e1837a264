"""`jaxsat fit`: attitude and parameters from panel currents, for one session or many."""

import sys
import time
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

from cyclopts import CycloptsError, Parameter, validators

from fitting.parameters.names import NAMED, STATE
from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import Arc, ConfigFile, Drop, Free, whole_number

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
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("fit"),
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
    from jaxsat.cli.settings.given import read_settings

    settings = read_settings(config, free=free, arc=arc, drop=drop, starts=starts, seed=seed)
    if not files:
        print(f"jaxsat: no file given: fitting the bundled synthetic session {BUNDLED.name}", file=sys.stderr)
        files = [BUNDLED]

    from jaxsat.cli.fit.one import Clock, fit_one, load_numerics

    clock = Clock(began, load_numerics(began))
    profiles = tuple(profile or ())
    if len(files) == 1:
        return fit_one(files[0], out, settings, clock=clock, plots=plots, profiles=profiles, limb=limb).exit_status

    from jaxsat.cli.fit.many import fit_many

    return fit_many(files, out, settings, clock=clock, plots=plots, profiles=profiles)
