"""`jaxsat local`: attitude of each sample by itself, without a model of the motion."""

import time
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import Arc, AxisBody, ConfigFile, Drop
from jaxsat.cli.shared.tables import refuse_tables
from jaxsat.cli.shared.talk import USUAL, Talking

Method = Literal["field-roll", "five-parameter", "sun-field"]
PROGRAM = {"field-roll": "OrbfiGraf", "five-parameter": "OptLoc", "sun-field": "OrSB"}


def local(
    files: Annotated[
        list[Path] | None,
        Parameter(
            help="RAW_SUN file, or with --satellite tables, CSV or Parquet, that are joined by time. [default: a "
            "bundled synthetic session]"
        ),
    ] = None,
    /,
    *,
    satellite: Annotated[
        Path | None,
        Parameter(
            help="Satellite file, TOML, of any satellite: attitudes by all directions that its sensors see at once, "
            "and by its star tracker; `jaxsat init TABLE` drafts one."
        ),
    ] = None,
    method: Annotated[
        Method,
        Parameter(
            help="field-roll (OrbfiGraf): magnet along the field or against it, best roll about it. five-parameter "
            "(OptLoc): three angles and two factors, where four panels show 2 mA. sun-field (OrSB): Sun from the "
            "currents, and the magnetometers."
        ),
    ] = "field-roll",
    albedo_max: Annotated[
        float | None,
        Parameter(
            help="Largest factor of the Earth's light over that of direct sunlight, albedomax. [default: 1 for "
            "field-roll, no limit for five-parameter]",
            validator=validators.Number(gte=0.0, lte=1e3),
        ),
    ] = None,
    earth: Annotated[
        Literal["mirror", "diffuse"], Parameter(help="How the Earth returns light: as published, or by Lambert's law.")
    ] = "mirror",
    x: Annotated[
        Literal["along", "against", "both"] | None,
        Parameter(
            help="Direction of the magnet's axis on the field's line, body x of Munin; for five-parameter that of its "
            "starts, for sun-field the sign of the component x that is not measured. [default: along for "
            "five-parameter, else both]",
        ),
    ] = None,
    axis_body: AxisBody = None,
    direct_sigma: Annotated[
        float | None,
        Parameter(
            help="Relative 1-sigma of spacecraft.imax_mA, for five-parameter: a fifth equation where four panels are "
            "lit. [default: not known, as published]",
            validator=validators.Number(gt=0.0, lte=10.0),
        ),
    ] = None,
    sun_sigma_deg: Annotated[
        float | None,
        Parameter(
            help="1-sigma of the Sun's direction from the currents, for sun-field: what the light of the Earth adds. "
            "[default: 10]",
            validator=validators.Number(gt=0.0, lte=90.0),
        ),
    ] = None,
    field_sigma_ut: Annotated[
        float | None,
        Parameter(
            name="--field-sigma-uT",
            help="1-sigma of a magnetometer axis, for sun-field. [default: 0.5]",
            validator=validators.Number(gt=0.0, lte=100.0),
        ),
    ] = None,
    config: ConfigFile = None,
    arc: Arc = None,
    drop: Drop = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("local"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Find the attitude of each sample by itself, without a model of the motion.

    Of Munin from six panel currents: attitude.csv (direction cosines of the
    body axes and other attitudes that explain a sample), currents.csv (direct
    and returned sunlight apart), local.json and pictures.

    With --satellite of any satellite whose sensors see two of field, Sun and
    nadir, or stars, in one table or in several that are joined by time: least
    squares of the directions that are seen at once. attitude.csv has also
    the 1-sigma, rates by finite turns and by how much the angle between two
    directions is off; unknown axes are ranked by that.

    What cannot be told has a status and a reason. The 1-sigma of field-roll
    has in it how far the magnet is off the field, by the residuals; what they
    deny, noise being fit.noise_mA, is called `does not fit`.

    Exit status: 0 done, 1 bad input or no sample in sunlight, 2 wrong usage,
    3 no sample has an attitude, or most of those that have do not fit, or are
    `inconsistent`: their directions are not as far apart as they must be.

    Example: jaxsat local a.RAW_SUN --albedo-max 0.3 --out a-local

    Example: jaxsat local --method five-parameter --direct-sigma 0.05

    Example: jaxsat local field.csv sun.csv stars.csv --satellite sat.toml --out pass-local
    """
    began = time.perf_counter()
    if satellite is not None:
        own = {"--albedo-max": albedo_max, "--x": x, "--direct-sigma": direct_sigma, "--sun-sigma-deg": sun_sigma_deg}
        own |= {"--axis-body": axis_body, "--field-sigma-uT": field_sigma_ut, "--config": config, "--drop": drop}
        refused = [option for option, value in own.items() if value is not None]
        if refused:
            raise CycloptsError(msg=f"{', '.join(refused)} cannot stand beside --satellite.")
        if not files:
            raise CycloptsError(msg="--satellite needs at least one table of telemetry.")
        from jaxsat.cli.local.directions import local_directions

        return local_directions(files, satellite, out, arc_s=arc, began=began, plots=plots, talk=talk)
    refuse_tables(files or ())
    if files and len(files) > 1:
        raise CycloptsError(msg="RAW_SUN files are taken one at a time; several tables are joined with --satellite.")
    file = files[0] if files else None
    if direct_sigma is not None and method != "five-parameter":
        raise CycloptsError(msg="--direct-sigma is for --method five-parameter.")
    if axis_body is not None and method == "sun-field":
        raise CycloptsError(msg="--axis-body is for the other methods than --method sun-field.")
    for option, value in {"--sun-sigma-deg": sun_sigma_deg, "--field-sigma-uT": field_sigma_ut}.items():
        if value is not None and method != "sun-field":
            raise CycloptsError(msg=f"{option} is for --method sun-field.")
    from jaxsat.cli.settings.given import read_settings

    settings = read_settings(config, arc=arc, drop=drop)
    if file is None:
        talk.note(f"no file given: taking the bundled synthetic session {BUNDLED.name}")

    from jaxsat.cli.shared.start import start_jax

    start_jax()
    from fitting.local.methods import FIELD_SIGMA_UT, SUN_SIGMA_DEG, local_samples, solve
    from fitting.session import prepare_session
    from jaxsat.cli.local.files import FILES, local_summary, write_local
    from jaxsat.files.staging import staged_directory
    from jaxsat.telemetry import read_session

    with talk.stages("local") as progress, staged_directory(out, FILES) as stage:
        progress("reading and orbit")
        session = read_session(file or BUNDLED, settings.numbers, cleaning=settings.cleaning)
        prepared = prepare_session(session, settings.given)
        chosen = {
            "noise_mA": settings.fit.noise_mA,
            "arc_s": settings.fit.arc_s,
            "earth": earth,
            "axis_body": axis_body,
        }
        samples = local_samples(prepared, settings.numbers, **chosen)
        limits: dict[str, Any] = {"albedo_max": albedo_max, "direct_sigma": direct_sigma, "x": x}
        if method == "sun-field":
            limits["sun_sigma_deg"] = SUN_SIGMA_DEG if sun_sigma_deg is None else sun_sigma_deg
            limits["field_sigma_uT"] = FIELD_SIGMA_UT if field_sigma_ut is None else field_sigma_ut
        progress("attitudes")
        solutions = solve(method, prepared, samples, **limits)
        options = {"method": method, "program": PROGRAM[method], "earth": earth, **limits}
        if method != "sun-field":
            options["axis_body"] = samples.axis_body
        progress("writing results")
        write_local(stage, prepared, samples, solutions, options=options, began=began, plots=plots)
    summary = local_summary(solutions, f"{prepared.label}, {method}")
    talk.result(summary, f"\nresults in {out}", document=out / "local.json")
    return 0 if solutions.fits else 3
