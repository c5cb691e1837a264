"""`jaxsat simulate --satellite`: telemetry of any satellite with its truth, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from jaxsat.cli.shared.talk import Talk

if TYPE_CHECKING:
    from jaxsat.synthetic.twins import TwinSettings

OPTIONS = {
    "start_utc": "--start",
    "duration_s": "--duration",
    "every_s": "--every",
    "rate_deg_s": "--rate",
    "quaternion": "--attitude",
    "tolerance_rad": "--tolerance",
}
"""Of the command line, for settings."""


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

    settings = settings_of_options(given)
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


def settings_of_options(given: Mapping[str, object]) -> "TwinSettings":
    """The settings of options that were given; raises `InputError` naming the option that cannot be."""
    from jaxsat.synthetic.twins import twin_settings

    return twin_settings(given, names=OPTIONS)
