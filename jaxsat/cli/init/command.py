"""`jaxsat init`: a commented satellite file, drafted from a table or as a template."""

from pathlib import Path
from typing import Annotated

from cyclopts import CycloptsError, Parameter


def init(
    file: Annotated[Path | None, Parameter(help="Table of telemetry. [default: the template with all keys]")] = None,
    /,
    *,
    cubesat: Annotated[
        bool, Parameter(help="The made-up CubeSat of three units that sweeps take without a file.", negative=())
    ] = False,
) -> int:
    """Print a commented satellite file, to be filled in.

    From a table its columns, their units and groups, and the form of its
    stamps are guessed by names and sizes; what nobody can guess says CHANGE.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat init pass.csv > sat.toml
    """
    from jaxsat.bundled import CUBESAT
    from jaxsat.satellites.template import TEMPLATE

    if cubesat:
        if file is not None:
            raise CycloptsError(msg="--cubesat is a file by itself: it goes with no table.")
        print(CUBESAT.read_text(encoding="utf-8"), end="")
        return 0
    if file is None:
        print(TEMPLATE.read_text(encoding="utf-8"), end="")
        return 0
    from jaxsat.telemetry.draft import drafted

    print(drafted(file), end="")
    return 0
