"""What `jaxsat sensitivity` is asked about: a satellite file with a plan, or the directory of a fit."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import CycloptsError
from pydantic import ValidationError

from jaxsat.cli.sensitivity.slopes import near_scenario
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from fitting.sensitivity.vantage import Vantage
    from jaxsat.satellites import Satellite
    from jaxsat.synthetic.twins import TwinSettings

RAW_SUN = ".raw_sun"


def check_place(place: Path) -> None:
    """Raises `InputError` where there is nothing, and for a directory that is neither a fit's nor a sweep's."""
    expected = "expected a satellite file, or the directory of a fit or of a sweep"
    if not place.exists():
        near = near_scenario(place)
        if near:
            raise InputError(f"no such file, directory or scenario; did you mean {near}?", file=place)
        raise InputError(f"no such file, directory or scenario; {expected}", file=place)
    if place.is_file() or (place / "fit.json").exists() or is_sweep(place):
        return
    if (place / "summary.json").exists():
        raise InputError("neither a fit nor a sweep; where it holds several runs name one of them", file=place)
    raise InputError(f"no fit.json; {expected}", file=place)


def is_sweep(place: Path) -> bool:
    """Whether a directory is that of a sweep. Raises `InputError` where its summary cannot be read."""
    from fitting.sensitivity.sweeps import holds_sweep

    return place.is_dir() and not (place / "fit.json").exists() and holds_sweep(place)


def check_names(craft: "Satellite", free: Sequence[str] | None, consider: Sequence[str]) -> None:
    """Raises CycloptsError where --free or --consider names what the satellite has not, before anything is computed."""
    from fitting.sensitivity.choice import considered_sigmas, named_free

    try:
        named_free(craft, free, considered_sigmas(craft, consider))
    except InputError as error:
        raise CycloptsError(msg=f"Invalid value for --{error.field}: {error.reason}") from None


def planned(
    place: Path,
    given: Mapping[str, object],
    free: Sequence[str] | None,
    consider: Sequence[str],
    *,
    orbit: Path | None,
    commands: Path | None,
) -> "Vantage":
    """The motion of a plan; `given` are `TwinSettings`. Raises `InputError`, and CycloptsError as `check_names`."""
    from fitting.sensitivity.plan import vantage_of_plan
    from jaxsat.cli.simulate.twin import settings_of_options
    from jaxsat.satellites import read_satellite

    craft, settings = read_satellite(place), settings_of_options(given)
    check_names(craft, free, consider)
    return vantage_of_plan(craft, settings, orbit=orbit, columns=_commanded(craft, settings, orbit, commands))


def _commanded(craft: "Satellite", settings: "TwinSettings", orbit: Path | None, commands: Path | None) -> Any:
    from jaxsat.synthetic.twins.source import epoch_of, read_columns, with_orbit

    if commands is None:
        return None
    return read_columns(commands, craft, epoch_of(craft if orbit is None else with_orbit(craft, orbit), settings))


def found_by(directory: Path, *, satellite: Path | None, config: Path | None) -> tuple["Vantage", tuple[str, ...]]:
    """The motion that a fit found, and the names of what it fitted. Raises `InputError`.

    Telemetry is read where the fit read it; of tables the satellite is that of the run's own copy of its file.
    """
    from fitting.report.schema.provenance_file import Provenance
    from fitting.report.schema.reading import PROVENANCE, read_stored
    from fitting.report.stored_run import read_run
    from fitting.sensitivity.of_fit import free_of_fit, vantage_of_result
    from fitting.settings import FitSettings

    result = read_run(directory).result
    provenance = read_stored(directory / "provenance.json", PROVENANCE, Provenance)
    try:
        settings = FitSettings.model_validate_json(json.dumps(provenance["settings"]))
    except ValidationError as error:
        reason = error.errors(include_url=False)[0]["msg"]
        raise InputError(
            f"settings of another version of jaxsat: {reason}", file=directory / "provenance.json"
        ) from None
    paths = [Path(path) for path in provenance["paths"]]
    for path in paths:
        if not path.is_file():
            raise InputError(
                "the telemetry of this fit is not where it was read; go to where it can be found", file=path
            )
    if paths[0].suffix.lower() == RAW_SUN:
        inputs = _of_raw_sun(paths, config)
    else:
        inputs = _of_tables(paths, directory, provenance, satellite, config)
    craft, session, given = inputs
    if list(session.sha256) != list(provenance["sha256"]):
        raise InputError("is not what it was when it was fitted: fit it again", file=paths[0])
    return vantage_of_result(result, craft, session, settings, given), free_of_fit(result, craft, settings)


def _of_raw_sun(paths: list[Path], config: Path | None) -> tuple[Any, Any, Any]:
    from jaxsat.cli.fit.inputs import OfRawSun
    from jaxsat.cli.settings.given import read_settings

    limb = paths[1] if len(paths) > 1 else None
    found = OfRawSun.by(read_settings(config), limb, None, None, config)(paths[:1])
    return found.satellite, found.session, found.given


def _of_tables(
    paths: list[Path], directory: Path, provenance: Mapping[str, Any], satellite: Path | None, config: Path | None
) -> tuple[Any, Any, Any]:
    from jaxsat.cli.settings.tables import load_table_config
    from jaxsat.satellites import read_satellite
    from jaxsat.satellites.satellite import satellite_of
    from jaxsat.telemetry import read_telemetry

    if satellite is not None:
        craft = read_satellite(satellite)
    else:
        tables, path = provenance["satellite_file"], provenance.get("satellite_path")
        kinds = [str(keys.get("kind", "")) for keys in dict(tables.get("sensors") or {}).values()]
        if not isinstance(path, str) or any(":" in kind for kind in kinds):
            # A directory that somebody sent is data, and no module is run because of it.
            why = (
                "has sensors of its own modules"
                if isinstance(path, str)
                else "does not say where its satellite file is"
            )
            raise InputError(f"this fit {why}: give --satellite SAT.toml", file=directory)
        craft = satellite_of(tables, Path(path))
    given = load_table_config(config, {}).given
    return craft, read_telemetry(paths, craft), given
