"""`jaxsat init`: a commented satellite file, drafted from a table or as a template."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import CycloptsError, Parameter


def init(
    file: Annotated[Path | None, Parameter(help="Table of telemetry. [default: the template with all keys]")] = None,
    /,
    *,
    example: Annotated[
        Literal["3u", "1u-passive"] | None,
        Parameter(help="One of the made-up CubeSats that sweeps take without a file, in place of the template."),
    ] = None,
) -> int:
    """Print a commented satellite file, to be filled in.

    From a table its columns, their units and groups, and the form of its
    stamps are guessed by names and sizes; what nobody can guess says CHANGE.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat init pass.csv > sat.toml
    """
    from jaxsat.bundled import CUBESAT, PASSIVE
    from jaxsat.satellites.template import TEMPLATE

    if example is not None:
        if file is not None:
            raise CycloptsError(msg="--example is a file by itself: it goes with no table.")
        print({"3u": CUBESAT, "1u-passive": PASSIVE}[example].read_text(encoding="utf-8"), end="")
        return 0
    if file is None:
        print(TEMPLATE.read_text(encoding="utf-8"), end="")
        return 0
    from jaxsat.telemetry.draft import drafted

    print(drafted(file), end="")
    return 0
