"""`jaxsat simulate --satellite`: telemetry of any satellite with its truth, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from jaxsat.cli.shared.talk import Talk
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from jaxsat.synthetic.twins import TwinSettings


def simulate_twin(
    satellite: Path,
    out: Path,
    given: Mapping[str, object],
    *,
    orbit: Path | None,
    commands: Path | None,
    plots: bool,
    talk: Talk,
) -> int:
    """Makes and writes a session and returns the exit status; `given` are `TwinSettings`. Raises `InputError`."""
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.satellites import read_satellite

    craft = read_satellite(satellite)
    from jaxsat.cli.simulate.text import twin_summary
    from jaxsat.files.staging import staged_directory
    from jaxsat.synthetic.twins import make_twin, write_twin
    from jaxsat.synthetic.twins.files import name_of, owned_files
    from jaxsat.synthetic.twins.source import epoch_of, read_columns, with_orbit

    settings = twin_settings(given)
    columns = None
    if commands is not None:
        flown = craft if orbit is None else with_orbit(craft, orbit)
        columns = read_columns(commands, craft, epoch_of(flown, settings))
    with talk.stages("simulate") as progress:
        progress("the motion and what sensors read")
        twin = make_twin(craft, settings, orbit=orbit, columns=columns)
        progress("writing results")
        with staged_directory(out, owned_files(twin)) as stage:
            write_twin(stage, twin, plots=plots, target=out)
    table, copy, truth = (out / f"{name_of(satellite)}.{ending}" for ending in ("csv", "sat.toml", "truth.json"))
    following = f"\nresults in {out}\nnext: jaxsat fit {table} --satellite {copy}"
    talk.result(twin_summary(twin), following, document=truth)
    return 0


def twin_settings(given: Mapping[str, object]) -> "TwinSettings":
    """The settings of options that were given; raises `InputError` naming the option that cannot be."""
    from jaxsat.synthetic.twins import TwinSettings

    try:
        return TwinSettings.model_validate(dict(given))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InputError(first["msg"].removeprefix("Value error, "), field=_option(first["loc"])) from None


def _option(location: tuple[int | str, ...]) -> str | None:
    """Name of the option of a setting."""
    names = {"start_utc": "--start", "duration_s": "--duration", "every_s": "--every", "rate_deg_s": "--rate"}
    names |= {"quaternion": "--attitude", "tolerance_rad": "--tolerance"}
    return names.get(str(location[0]), str(location[0])) if location else None
