"""A map of scenarios by named options: a sweep's engines run it as `fitting.sensitivity.scenarios.source:make`."""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fitting.sensitivity.scenarios.draws import Draws
from fitting.sensitivity.scenarios.many import map_of
from fitting.sensitivity.scenarios.maps import StartsMap
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.sweep import Factory, Option, Scenario, number_of
from jaxsat.synthetic.twins import TwinSettings
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
    """The options that make a map again, with the digest of the files, which are not to change under way."""
    files = {"satellite": satellite, "orbit": orbit, "commands": commands}
    given = {name: str(path) for name, path in files.items() if path is not None}
    given |= {name: str(plan[name]) for name in ("start_utc", "duration_s", "every_s") if name in plan}
    given |= {name: text for name, text in (("free", free), ("consider", consider), ("spread", spread)) if text}
    given |= {name: str(value) for name, value in asdict(draws).items() if name not in ("count", "seed")}
    return given | {"digest": _digest(given)}


def map_by(options: Mapping[str, str]) -> StartsMap:
    """The map of all options. Raises `InputError`."""
    if not options["satellite"]:
        raise InputError("expected a satellite file", field="satellite")
    satellite = read_satellite(Path(options["satellite"]))
    if options["digest"] and options["digest"] != _digest(options):
        raise InputError("is not what it was when the scenarios were begun: take another --out", file=satellite.path)
    plan = _plan(options)
    orbit = Path(options["orbit"]) if options["orbit"] else None
    columns = None
    if options["commands"]:
        flown = satellite if orbit is None else with_orbit(satellite, orbit)
        columns = read_columns(Path(options["commands"]), satellite, epoch_of(flown, plan))
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
    given = {name: options[name] for name in ("duration_s", "every_s")}
    if options["start_utc"]:
        given["start_utc"] = options["start_utc"]
    try:
        return TwinSettings.model_validate(given, strict=False)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InputError(first["msg"].removeprefix("Value error, "), field=str((*first["loc"], "plan")[0])) from None


def _digest(options: Mapping[str, str]) -> str:
    digest = hashlib.sha256()
    for name in ("satellite", "orbit", "commands"):
        if options.get(name):
            try:
                digest.update(Path(options[name]).read_bytes())
            except OSError as error:
                raise InputError(f"cannot be read: {error.strerror or error}", file=Path(options[name])) from None
    return digest.hexdigest()[:16]


make = Factory(
    _build,
    (
        Option("satellite", "", "satellite file"),
        Option("orbit", "", "file in place of the orbit of the satellite file"),
        Option("commands", "", "table of commands to coils and wheels"),
        Option("start_utc", "", "instant of the plan"),
        Option("duration_s", str(TwinSettings().duration_s), "length of the arc"),
        Option("every_s", str(TwinSettings().every_s), "time between readings"),
        Option("free", "", "what is fitted, as magnet,mag.bias"),
        Option("consider", "", "what is not fitted but uncertain"),
        Option("spread", "", "numbers of the satellite that are drawn, as inertia,magnet.x=0.001"),
        *(Option(name, str(getattr(_USUAL, name)), meaning) for name, meaning in _NUMBERS.items()),
        Option("instants", str(_USUAL.instants), "on which starts are, at most"),
        Option("digest", "", "of the files, where they must not have changed"),
    ),
)
