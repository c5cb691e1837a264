"""`jaxsat fit`: attitude and parameters from what sensors measured, for one session or many."""

import time
from pathlib import Path
from typing import Annotated, Any

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import Arc, Drop, check_changes, whole_number
from jaxsat.cli.shared.tables import refuse_tables
from jaxsat.cli.shared.talk import USUAL, Talking
from jaxsat.files.as_if import FORMS


def _refuse(options: dict[str, object], beside: str) -> None:
    given = [name for name, value in options.items() if value]
    if given:
        raise CycloptsError(msg=f"{', '.join(given)} cannot stand beside {beside}.")


def _check_share(_: Any, value: float | None) -> None:
    if value is not None and not 0.0 <= value <= 0.9:
        meant = f"; {value:g} % are {value / 100.0:g}" if 1.0 < value <= 90.0 else ""
        raise ValueError(f"Expected a share from 0 to 0.9, as 0.3, got {value:g}{meant}.")


def fit(
    files: Annotated[
        list[Path] | None,
        Parameter(
            help="RAW_SUN files of Munin, or with --satellite tables (CSV, Parquet) that are joined by time. "
            "[default: a bundled synthetic session of Munin]"
        ),
    ] = None,
    /,
    *,
    satellite: Annotated[
        Path | None,
        Parameter(
            help="Satellite file, TOML: body, sensors and columns of the tables; `jaxsat init TABLE` drafts one, "
            "`jaxsat check` looks at the tables before."
        ),
    ] = None,
    holdout: Annotated[
        float | None,
        Parameter(
            help="Share of the time, at its end, that is not fitted but predicted, as 0.3.",
            validator=_check_share,
        ),
    ] = None,
    free: Annotated[
        str | None,
        Parameter(
            help="What is fitted. With --satellite names of numbers or of what they begin with, as "
            "magnet,mag.bias,sun.gain.+x [default: every number with a sigma]. Of Munin any of "
            "state,magnet,rods,imax,gains,inertia,albedo,tilts, a single one as albedo.specular or magnet.azimuth, or "
            "a classic name: als, alsI0, alsI23, alsImax, alsJ, alsI0J [default: that of the configuration]. The "
            "motion is always free.",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        Parameter(
            help="Configuration, TOML; `jaxsat config` prints all keys with units and defaults. With --satellite its "
            "sections [fit], as max_rate_deg_s, step_s, and [orbit], [time], [earth], [sun]."
        ),
    ] = None,
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
            help="NAME of a free number, as magnet.x, mag.bias.x, rate.x: the lowest cost at each of its values and "
            "the 68 and 95 % intervals read from it; repeatable.",
            negative=(),
        ),
    ] = None,
    guess: Annotated[
        Path | None,
        Parameter(
            help="Start from here, without a search: attitude.csv of an earlier fit or of `jaxsat local`, the "
            "directory of one (numbers of a fit's satellite are taken too), or TOML with quaternion, rate_deg_s, t_s "
            "or utc. For one session."
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
    causes: Annotated[
        bool,
        Parameter(help="Where the data deny the fit, try the usual causes by short refits (half a minute or more)."),
    ] = True,
    as_if: Annotated[
        list[str] | None,
        Parameter(
            name="--as",
            help="CHANGE: fit the data as if this were so, as the table of causes offers it; repeatable. One of "
            f"{'; '.join(FORMS.values())}.",
            negative=(),
            validator=check_changes,
        ),
    ] = None,
    talk: Talking = USUAL,
) -> int:
    """Fit attitude, and any of the satellite's parameters, to what its sensors measured.

    With --satellite any satellite and any mix of sensors: the tables are one
    session, and a verdict says in words whether the fit predicts what was
    held out. Without it the currents of Munin's six solar panels.

    Writes fit.json, attitude.csv, a CSV of the readings, pictures,
    report.html, scene.json and provenance.json; of several RAW_SUN files into
    a directory for each, and summary.json for all.

    Exit status: 0 converged, 1 bad input, 2 wrong usage,
    3 not converged or ambiguous.

    Example: jaxsat init pass.csv > sat.toml, edit it, then
    jaxsat fit pass.csv --satellite sat.toml --holdout 0.3 --out pass

    Example: jaxsat fit a.RAW_SUN --free magnet,imax,inertia,albedo --arc 0 2700 --out a-fit

    Example: jaxsat fit pass.csv --satellite sat.toml --profile magnet.x --profile mag.bias.x
    """
    began = time.perf_counter()
    if satellite is not None:
        _refuse({"--drop": drop, "--limb": limb}, "--satellite, whose file has [rows] and its own channels")
        if not files:
            raise CycloptsError(msg="--satellite needs at least one table of telemetry.")
    else:
        refuse_tables(files or ())
    if limb is not None and files and len(files) > 1:
        raise CycloptsError(msg=f"--limb holds the angles of one session, but {len(files)} files are given.")
    if guess is not None and satellite is None and files and len(files) > 1:
        raise CycloptsError(msg=f"--guess is of one session, but {len(files)} files are given.")
    # What is wrong with settings is told before the seconds that the imports of a fit take.
    options = {"free": free, "holdout": holdout, "arc_s": arc, "starts": starts, "seed": seed}
    if satellite is not None:
        from jaxsat.cli.settings.tables import load_table_config

        given = {key: value for key, value in options.items() if value is not None}
        table_config = load_table_config(config, given)
    else:
        from jaxsat.cli.settings.given import read_settings

        settings = read_settings(config, free=free, arc=arc, drop=drop, starts=starts, seed=seed)

    from jaxsat.cli.shared.start import start_jax

    start_jax()
    from jaxsat.cli.fit.inputs import OfRawSun, OfTables
    from jaxsat.cli.fit.one import Clock, fit_one

    if satellite is None:
        read = OfRawSun.by(settings, limb, free, holdout, config, profile or ())
    else:
        read = OfTables.by(satellite, table_config, free, config, profile or ())
    if not files:
        talk.note(f"no file given: fitting the bundled synthetic session {BUNDLED.name}")
        files = [BUNDLED]
    clock = Clock(began, time.perf_counter() - began)
    asked = {"clock": clock, "causes": causes, "profiles": tuple(profile or ()), "talk": talk}
    asked["as_if"] = tuple(as_if or ())
    # Tables are joined by time, RAW_SUN files are sessions by themselves.
    if satellite is not None or len(files) == 1:
        from fitting.report.fit.drawing import draw_all
        from fitting.starts.guess_files import read_guess

        begin = None if guess is None else read_guess(guess)
        return fit_one(files, out, read, **asked, draw=draw_all if plots else None, guess=begin)().exit_status

    from jaxsat.cli.fit.many import fit_many

    return fit_many(files, out, read, **asked, plots=plots)
