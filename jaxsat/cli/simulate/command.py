"""`jaxsat simulate`: telemetry with its truth, of any satellite by its file, or of Munin (the program `Orfs`)."""

from pathlib import Path
from typing import Annotated

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import ConfigFile, whole_number
from jaxsat.cli.shared.talk import USUAL, Talking


def simulate(
    config: ConfigFile = None,
    /,
    *,
    satellite: Annotated[
        Path | None,
        Parameter(help="Satellite file, TOML, in place of a configuration: its own sensors, columns and units."),
    ] = None,
    orbit: Annotated[
        Path | None,
        Parameter(help="With --satellite: TLE, OMM or OEM file in place of the orbit that the satellite file names."),
    ] = None,
    start: Annotated[
        str | None,
        Parameter(help="UTC of t = 0, as 2020-11-21T20:58:01Z. [default: the epoch of the stamps or of the orbit]"),
    ] = None,
    duration: Annotated[float | None, Parameter(help="Length of the session [s]. [default: 600]")] = None,
    every: Annotated[
        float | None,
        Parameter(help="Time between readings [s], but of channels that have an interval_s. [default: 5]"),
    ] = None,
    rate: Annotated[
        tuple[float, float, float] | None,
        Parameter(help="X Y Z: angular velocity at t = 0, body axes [deg/s]. [default: drawn, 1 deg/s]", negative=()),
    ] = None,
    attitude: Annotated[
        tuple[float, float, float, float] | None,
        Parameter(help="W X Y Z: quaternion at t = 0, inertial from body. [default: drawn]", negative=()),
    ] = None,
    commands: Annotated[
        Path | None,
        Parameter(
            help="Table with what coils and wheels are commanded, and stray currents, by the columns of the satellite "
            "file; its times in a column t_s [s] or as the satellite file has them. [default: zero]"
        ),
    ] = None,
    nominal: Annotated[
        bool,
        Parameter(help="Take the numbers of the satellite file as true; else they are drawn.", negative=()),
    ] = False,
    tolerance: Annotated[
        float | None,
        Parameter(
            help="Largest error of the integrated attitude [rad]. [default: 1e-5, or 1e-4 where no step holds that]"
        ),
    ] = None,
    seed: Annotated[
        int | None,
        Parameter(
            help="Seed of all that is drawn. [default: that of the configuration, 0 with --satellite]",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=2**32),
        ),
    ] = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("simulate"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Simulate a session: attitude motion, what sensors read, telemetry with its noise, and the truth.

    With --satellite a twin experiment of any satellite: its numbers are drawn
    from the priors of its file, its sensors send columns with noise, steps and
    late stamps as the file says, and a fit has to find the numbers again.
    Writes NAME.csv, NAME.truth.json (SI), NAME.sat.toml with the orbit beside
    it, and pictures; NAME is that of the satellite file.

    Without it Munin: the configuration is that of a fit, with a section
    [simulate] of its own; without one the nominal Munin of 2001-01-18. Writes
    session.RAW_SUN and session.truth.json, angles.csv, currents.csv and
    limb.csv, currents.png and angles.png; where simulate.panel_corners_m
    describes panels of other outlines, also panels.csv.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat simulate --satellite sat.toml --orbit sat.tle --rate 1 0 -2
    --duration 900 --out twin && jaxsat fit twin/sat.csv
    --satellite twin/sat.sat.toml

    Example: jaxsat config > munin.toml && jaxsat simulate munin.toml --out sim
    && jaxsat fit sim/session.RAW_SUN --config munin.toml --limb sim/limb.csv
    """
    chosen = {
        "start_utc": start,
        "duration_s": duration,
        "every_s": every,
        "rate_deg_s": rate,
        "quaternion": attitude,
        "nominal": nominal or None,
        "tolerance_rad": tolerance,
    }
    given = {key: value for key, value in chosen.items() if value is not None}
    if satellite is not None:
        if config is not None:
            raise CycloptsError(msg="A configuration of Munin cannot stand beside --satellite.")
        from jaxsat.cli.simulate.twin import simulate_twin

        if seed is not None:
            given["seed"] = seed
        return simulate_twin(satellite, out, given, orbit=orbit, commands=commands, plots=plots, talk=talk)
    if given or orbit or commands:
        options = "--orbit, --start, --duration, --every, --rate, --attitude, --commands, --nominal and --tolerance"
        raise CycloptsError(msg=f"{options} belong to --satellite; Munin's are keys of the configuration.")
    from jaxsat.cli.settings.files import load_config

    settings = load_config(config, {} if seed is None else {"simulate.seed": seed})
    if config is None:
        talk.note("no configuration given: simulating the nominal Munin of 2001-01-18")

    from jaxsat.files.staging import staged_directory
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.cli.simulate.text import simulation_summary
    from jaxsat.synthetic.files import FILES, write_simulation
    from jaxsat.synthetic.session import SessionPlan, make_session

    plan = SessionPlan(settings.simulate, settings.numbers, settings.given, settings.cleaning, file=config)

    with talk.stages("simulate") as progress, staged_directory(out, FILES) as stage:
        progress("the motion and what sensors read")
        session = make_session(plan)
        progress("writing results")
        write_simulation(stage, session, plan, plots=plots)
    summary = simulation_summary(session, settings.simulate.satellite)
    talk.result(summary, f"\nresults in {out}", document=out / "session.truth.json")
    return 0
