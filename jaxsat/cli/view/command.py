"""`jaxsat view`: the report of a fit, built again from its files, and shown."""

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

from cyclopts import Parameter, validators

from jaxsat.cli.shared.options import whole_number

REPORT = "report.html"


def view(
    run: Annotated[Path, Parameter(help="Directory that `jaxsat fit` has written.")],
    /,
    *,
    open_page: Annotated[bool, Parameter(name="--open", help="Open the page in a browser, where there is one.")] = True,
    port: Annotated[
        int | None,
        Parameter(
            help="Serve the page on this port of this machine alone until interrupted, as for an SSH tunnel.",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=65535),
        ),
    ] = None,
    out: Annotated[Path | None, Parameter(help="Directory for report.html. [default: that of the run]")] = None,
) -> int:
    """Build the report of a fit again from its files, print where it is and open it.

    Takes fit.json, provenance.json, scene.json, the tables and the
    pictures of RUN; nothing is computed anew.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat view munin-fit

    Example: jaxsat view munin-fit --port 8000
    """
    from fitting.report.stored_run import read_run
    from jaxsat.files.staging import staged_directory

    target = out or run
    found = read_run(run, base=way_to(run, target))
    page = found.page
    with staged_directory(target, [REPORT]) as stage:
        (stage / REPORT).write_text(page, encoding="utf-8")
    if found.scene is None:
        print("jaxsat: no scene.json: the page is without its view of the motion", file=sys.stderr)
    print(target / REPORT)
    if port is not None:
        from jaxsat.cli.view.serving import serve

        serve(page.encode(), port, tables_of(run, found.provenance))
    elif open_page and has_screen():
        import webbrowser

        webbrowser.open((target / REPORT).resolve().as_uri())
    return 0


def way_to(run: Path, target: Path) -> str:
    """What links of a page in `target` begin with, so that they lead to files of the run; empty in the run itself."""
    way = os.path.relpath(run.resolve(), target.resolve())
    return "" if way == "." else f"{quote(Path(way).as_posix())}/"


def tables_of(run: Path, provenance: Mapping[str, Any]) -> dict[str, Path]:
    """The files that the page of a run links to, by their names."""
    return {name: run / name for name in (*provenance["columns"], "fit.json", "provenance.json")}


def has_screen() -> bool:
    """Whether a browser would have a screen: a text browser in the terminal is not what is meant."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
