"""A map of scenarios by named options: a sweep's engines run it as `fitting.sensitivity.scenarios.source:make`."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fitting.sensitivity.scenarios.draws import Draws
from fitting.sensitivity.scenarios.many import map_of
from fitting.sensitivity.scenarios.maps import StartsMap
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.sweep import Factory, Option, Scenario, number_of
from jaxsat.sweep.pinned import path_of
from jaxsat.synthetic.twins import TwinSettings, twin_settings
from jaxsat.synthetic.twins.source import epoch_of, read_columns, with_orbit

ADDRESS = "fitting.sensitivity.scenarios.source:make"
_USUAL = Draws()
_NUMBERS = {"slowest_deg_s": "lowest spin rate", "fastest_deg_s": "highest", "days": "of instants after the plan's"}


def options_of(
    satellite: Path,
    plan: Mapping[str, object],
    draws: Draws,
    *,
    free: str | None = None,
    consider: str | None = None,
    spread: str | None = None,
    orbit: Path | None = None,
    commands: Path | None = None,
) -> dict[str, str]:
    """The options that make a map again."""
    files = {"satellite": satellite, "orbit": orbit, "commands": commands}
    given = {name: str(path) for name, path in files.items() if path is not None}
    given |= {name: str(plan[name]) for name in ("start_utc", "duration_s", "every_s") if name in plan}
    given |= {name: text for name, text in (("free", free), ("consider", consider), ("spread", spread)) if text}
    return given | {name: str(value) for name, value in asdict(draws).items() if name not in ("count", "seed")}


def map_by(options: Mapping[str, str]) -> StartsMap:
    """The map of all options. Raises `InputError`."""
    if not options["satellite"]:
        raise InputError("expected a satellite file", field="satellite")
    satellite = read_satellite(path_of(options["satellite"]))
    plan = _plan(options)
    orbit = path_of(options["orbit"]) if options["orbit"] else None
    columns = None
    if options["commands"]:
        flown = satellite if orbit is None else with_orbit(satellite, orbit)
        columns = read_columns(path_of(options["commands"]), satellite, epoch_of(flown, plan))
    numbers: dict[str, Any] = {name: number_of(options, name) for name in _NUMBERS}
    instants = number_of(options, "instants")
    if instants != int(instants):
        raise InputError(f"expected a whole number, found {options['instants']!r}", field="instants")
    try:
        draws = Draws(**numbers, instants=int(instants))
    except ValueError as error:
        raise InputError(str(error), field="slowest_deg_s, fastest_deg_s, days, instants") from None
    return map_of(
        satellite,
        plan,
        draws,
        free=_names(options["free"]) or None,
        consider=_names(options["consider"]),
        spread=_names(options["spread"]),
        orbit=orbit,
        columns=columns,
    )


def _build(options: Mapping[str, str]) -> Scenario:
    return map_by(options).scenario


def _names(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]


def _plan(options: Mapping[str, str]) -> TwinSettings:
    given = {name: options[name] for name in ("start_utc", "duration_s", "every_s") if options[name]}
    return twin_settings(given, several="plan", strict=False)


make = Factory(
    _build,
    (
        Option("satellite", "", "satellite file", file=True),
        Option("orbit", "", "file in place of the orbit of the satellite file", file=True),
        Option("commands", "", "table of commands to coils and wheels", file=True),
        Option("start_utc", "", "instant of the plan"),
        Option("duration_s", str(TwinSettings().duration_s), "length of the arc"),
        Option("every_s", str(TwinSettings().every_s), "time between readings"),
        Option("free", "", "what is fitted, as magnet,mag.bias"),
        Option("consider", "", "what is not fitted but uncertain"),
        Option("spread", "", "numbers of the satellite that are drawn, as inertia,magnet.x=0.001"),
        *(Option(name, str(getattr(_USUAL, name)), meaning) for name, meaning in _NUMBERS.items()),
        Option("instants", str(_USUAL.instants), "on which starts are, at most"),
    ),
)
