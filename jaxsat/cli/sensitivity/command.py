"""`jaxsat sensitivity`: what limits accuracy, before flight and after."""

import time
from pathlib import Path
from typing import Annotated

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import check_options, whole_number
from jaxsat.cli.shared.talk import USUAL, Talking

PARTS = 10
"""Parts of the arc by default."""


def sensitivity(
    place: Annotated[
        Path,
        Parameter(
            help="Satellite file, TOML, for a plan; the directory that a fit or a sweep has written; or a scenario of "
            "jaxsat sweep, of one's own too: my_scenario.py, or module:factory."
        ),
    ],
    /,
    *,
    free: Annotated[
        str | None,
        Parameter(
            help="What is fitted: names of numbers or of what they begin with, as magnet,mag.bias. [default: every "
            "number with a sigma; of a fit what it fitted]"
        ),
    ] = None,
    consider: Annotated[
        str | None,
        Parameter(
            help="What is not fitted but uncertain, as inertia,mag.delay=0.5: by the sigma of the satellite file, or "
            "by NAME=SIGMA in the unit of results."
        ),
    ] = None,
    parts: Annotated[
        int,
        Parameter(
            help="Parts of the arc that are told apart.",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=100),
        ),
    ] = PARTS,
    orbit: Annotated[
        Path | None,
        Parameter(help="Plan, scenario: TLE, OMM or OEM file in place of the orbit that the satellite file names."),
    ] = None,
    start: Annotated[
        str | None,
        Parameter(help="Plan: UTC of t = 0. [default: the epoch of the stamps or of the orbit]"),
    ] = None,
    duration: Annotated[float | None, Parameter(help="Plan: length of the arc [s]. [default: 600]")] = None,
    every: Annotated[
        float | None,
        Parameter(help="Plan: time between readings [s], but of channels that have an interval_s. [default: 5]"),
    ] = None,
    rate: Annotated[
        tuple[float, float, float] | None,
        Parameter(help="Plan: X Y Z, angular velocity at t = 0 [deg/s]. [default: drawn, 1 deg/s]", negative=()),
    ] = None,
    attitude: Annotated[
        tuple[float, float, float, float] | None,
        Parameter(help="Plan: W X Y Z, quaternion at t = 0, inertial from body. [default: drawn]", negative=()),
    ] = None,
    commands: Annotated[
        Path | None,
        Parameter(help="Plan: table of commands to coils and wheels, as for jaxsat simulate. [default: zero]"),
    ] = None,
    seed: Annotated[
        int | None,
        Parameter(
            help="Plan, scenario: seed of what is drawn. [default: 0]",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=2**32),
        ),
    ] = None,
    scenarios: Annotated[
        int | None,
        Parameter(
            help="Plan: the same of so many other starts, any attitude and direction of spin. [default: none]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=10_000_000),
        ),
    ] = None,
    spin: Annotated[
        tuple[float, float] | None,
        Parameter(help="LOW HIGH: rates of the scenarios [deg/s]. [default: 0.1 3]", negative=()),
    ] = None,
    days: Annotated[
        float | None, Parameter(help="Days after the instant of the plan on which scenarios begin. [default: 1]")
    ] = None,
    instants: Annotated[
        int | None,
        Parameter(
            help="Scenarios begin on so many instants, 64 of them on each by turns. [default: 64]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=100_000),
        ),
    ] = None,
    spread: Annotated[
        str | None,
        Parameter(
            help="Numbers of the satellite that differ between scenarios, as inertia,magnet.x=0.001: normal with the "
            "sigma of the satellite file, or NAME=SIGMA in the unit of results. [default: none]"
        ),
    ] = None,
    resume: Annotated[bool, Parameter(help="Finish the scenarios in DIR: run what is missing.", negative=())] = False,
    satellite: Annotated[
        Path | None,
        Parameter(
            help="Of a fit: its satellite file, where that has modules of its own or was moved. Of a scenario: that of "
            "jaxsat sweep."
        ),
    ] = None,
    config: Annotated[Path | None, Parameter(help="Of a fit: the configuration that it was made with.")] = None,
    together: Annotated[
        list[str] | None,
        Parameter(
            help="Of a sweep: inputs that count as one, as attitude,orbit. May be given several times.", negative=()
        ),
    ] = None,
    apart: Annotated[
        list[str] | None,
        Parameter(help="Of a sweep: vectors of which each column counts by itself, as gyro_bias.", negative=()),
    ] = None,
    by: Annotated[
        str | None,
        Parameter(
            help="Of a scenario: its knobs, as frequency,damping; jaxsat sweep SCENARIO --list tells them. "
            "[default: all]"
        ),
    ] = None,
    metrics: Annotated[
        str | None, Parameter(help="Of a scenario: some of its metrics, and success. [default: all]")
    ] = None,
    options: Annotated[
        list[str] | None,
        Parameter(
            name="--set",
            help="Of a scenario: NAME=VALUE, one of its options; repeatable.",
            negative=(),
            validator=check_options,
        ),
    ] = None,
    cases: Annotated[
        int | None,
        Parameter(
            help="Of a scenario: cases, each of which is run twice a knob. [default: 500]",
            converter=whole_number,
            validator=validators.Number(gte=8, lte=1_000_000),
        ),
    ] = None,
    width: Annotated[
        float | None,
        Parameter(help="Of a scenario: by what a knob is moved to both sides, 0.05 for 5 %. [default: 0.05]"),
    ] = None,
    at_once: Annotated[
        bool, Parameter(help="Of a scenario: move all knobs at once, not each alone.", negative=())
    ] = False,
    exact: Annotated[
        bool,
        Parameter(help="Of a scenario: the mean of the cases' own derivatives beside, as a check.", negative=()),
    ] = False,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("sensitivity"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Say what limits the accuracy of attitude and parameters, before flight and after.

    Of a satellite file and a plan, or of the directory of a fit: sigma of
    each number from noise and from what is only assumed (--consider), the
    worst known combinations in words, what each channel and each part of the
    arc tells, what a wrong assumption costs, and sigma over arc length and
    sampling interval. Says where the problem is not regular.

    Writes sensitivity.json, pictures and report.html; with --scenarios what
    many starts would give: a sweep in DIR/scenarios, cases.parquet with a row
    each, which --resume finishes whatever has stopped it.

    Of the directory of a sweep: which drawn input drives which metric, as
    Sobol indices with 95 % intervals. Writes indices.json and indices.png.

    Of a scenario: what a change of each knob, a gain, a limit, a mass or an
    error of a sensor, does to the mean of each metric, with its error. Writes
    slopes.json, slopes.png and report.html.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat sensitivity sat.toml --orbit sat.tle --duration 1800
    --every 10 --rate 1 0 -2 --consider inertia,mag.delay=0.5

    Example: jaxsat sensitivity sat.toml --scenarios 100000 --spin 0.1 5
    --days 365

    Example: jaxsat sensitivity pass-fit --consider inertia

    Example: jaxsat sensitivity pointing --apart gyro_bias

    Example: jaxsat sensitivity point --set target=sun --by frequency,damping
    """
    began = time.perf_counter()
    chosen = {
        "start_utc": start,
        "duration_s": duration,
        "every_s": every,
        "rate_deg_s": rate,
        "quaternion": attitude,
        "seed": seed,
    }
    given = {key: value for key, value in chosen.items() if value is not None}
    from jaxsat.cli.sensitivity.place import check_place, is_sweep
    from jaxsat.cli.sensitivity.slopes import Asked, is_scenario, slopes_of

    of_runs = (by, metrics, options, cases, width, at_once or None, exact or None)
    if is_scenario(place):
        of_others = (free, consider, config, commands, scenarios, spin, days, instants, spread, together, apart)
        if set(given) - {"seed"} or resume or any(value is not None for value in of_others) or parts != PARTS:
            takes = "--by, --metrics, --set, --cases, --seed, --width, --at-once, --exact, --satellite, --orbit"
            raise CycloptsError(msg=f"a scenario takes {takes}, --out and --no-plots alone.")
        chosen = dict(text.split("=", 1) for text in options or ())
        chosen |= {name: str(path) for name, path in (("satellite", satellite), ("orbit", orbit)) if path is not None}
        asked = Asked(_words(by), _words(metrics), cases, seed, width, at_once, exact)
        slopes_of(place, chosen, asked, out, plots=plots, talk=talk)
        return 0
    check_place(place)
    if any(value is not None for value in of_runs):
        msg = "--by, --metrics, --set, --cases, --width, --at-once and --exact are those of a scenario."
        raise CycloptsError(msg=msg)
    sweep = is_sweep(place)
    if (together or apart) and not sweep:
        raise CycloptsError(msg="--together and --apart are those of the directory of a sweep.")
    if sweep:
        of_others = (free, consider, satellite, config, orbit, commands, scenarios, spin, days, instants, spread)
        if given or resume or any(value is not None for value in of_others) or parts != PARTS:
            raise CycloptsError(msg="a sweep takes --together, --apart, --out and --no-plots alone.")
        from jaxsat.cli.sensitivity.sweeps import indices_of

        indices_of(place, out, together=together or (), apart=apart or (), plots=plots, talk=talk)
        return 0
    of_scenarios = {"spin": spin, "days": days, "instants": instants, "spread": spread, "resume": resume or None}
    if place.is_dir() and (
        given or orbit or commands or scenarios or any(v is not None for v in of_scenarios.values())
    ):
        of_plan = "--orbit, --start, --duration, --every, --rate, --attitude, --commands, --seed and --scenarios"
        raise CycloptsError(msg=f"{of_plan} are those of a plan; a fit has its own.")
    if scenarios is None and any(value is not None for value in of_scenarios.values()):
        raise CycloptsError(msg="--spin, --days, --instants, --spread and --resume are those of --scenarios.")
    if place.is_file() and (satellite or config):
        raise CycloptsError(msg="--satellite and --config belong to the directory of a fit.")

    from jaxsat.cli.shared.start import start_jax

    start_jax()
    from fitting.sensitivity.analysis import analysed, timed
    from fitting.sensitivity.report.files import FILES, write_sensitivity
    from jaxsat.cli.sensitivity.place import check_names, found_by, planned
    from jaxsat.cli.sensitivity.text import sensitivity_text
    from jaxsat.files.staging import staged_directory

    names = None if free is None else free.split(",")
    considered = () if consider is None else consider.split(",")
    drawn, draws = None, None
    if scenarios is not None:
        from jaxsat.cli.sensitivity.scenarios import Asked, run_scenarios

        draws = Asked(scenarios, spin, days, instants, seed).draws()
    with staged_directory(out, FILES) as stage:
        with talk.stages("sensitivity") as progress:
            progress("reading")
            if place.is_file():
                vantage = planned(place, given, names, considered, orbit=orbit, commands=commands)
            else:
                vantage, fitted = found_by(place, satellite=satellite, config=config)
                names = _without(fitted, considered) if names is None else names
                check_names(vantage.satellite, names, considered)
            found = analysed(vantage, names, considered, parts=parts, progress=progress)
            found = timed(found, time.perf_counter() - began)
        if draws is not None:
            files = {"orbit": orbit, "commands": commands}
            chosen = {"free": free, "consider": consider, "spread": spread}
            how = {"out": out, "resume": resume, "plots": plots, "talk": talk}
            drawn = run_scenarios(place, given, draws, chosen, files, **how)
        with talk.stages("sensitivity") as progress:
            progress("writing results")
            write_sensitivity(stage, found, subject=str(place), plots=plots, drawn=drawn)
    text = sensitivity_text(found, vantage.satellite.name, drawn, whole=talk.verbose)
    talk.result(text, f"\nresults in {out}", document=out / "sensitivity.json")
    return 0


def _words(text: str | None) -> list[str] | None:
    return None if text is None else [word.strip() for word in text.split(",")]


def _without(fitted: tuple[str, ...], considered: tuple[str, ...] | list[str]) -> list[str]:
    """What a fit fitted, but for what is considered now."""
    heads = [item.partition("=")[0].strip() for item in considered]
    return [name for name in fitted if not any(name == head or name.startswith(f"{head}.") for head in heads)]
