"""The `jaxsat` command: its sub-commands, exit statuses and the one line that a wrong input or usage gets.

Nothing heavy is imported here or by the modules of the commands: help and usage errors must come at once.
"""

import gc
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from cyclopts import App, CycloptsError

from jaxsat.cli.shared.interrupts import INTERRUPTED, heeded
from jaxsat.cli.shared.streams import Lasting
from jaxsat.errors import InputError

BAD_INPUT, USAGE = 1, 2


def _version() -> str:
    from importlib.metadata import version

    return f"jaxsat {version('jaxsat')}"


app = App(
    name="jaxsat",
    help="Satellite attitude, orbit and parameters from telemetry, by a differentiable simulator.\n\n"
    "Exit status: 0 done and converged, 1 bad input, 2 wrong usage,\n3 not converged or ambiguous, 130 interrupted, "
    "129 or 143 ended\nby SIGHUP or SIGTERM.\n\n"
    "Example: jaxsat fit session.RAW_SUN --out session-fit",
    help_format="plaintext",
    version=_version,
    # Its own handling would end the process before unfinished results are named and removed.
    suppress_keyboard_interrupt=False,
)
# A folder with a file `command.py` is a command of its name: nothing else has to know of it.
for file in sorted(Path(__file__).parent.glob("*/command.py")):
    name = file.parent.name
    app.command(getattr(import_module(f"jaxsat.cli.{name}.command"), name))


def run(arguments: Sequence[str]) -> int:
    """Runs one command line and returns its exit status; errors that a user can cause are one line on stderr."""
    try:
        "".join(arguments).encode("utf-8")
    except UnicodeEncodeError:
        # Bytes of a name that are none: results could not say where they come from.
        shown = next(a for a in arguments if not a.isprintable()).encode("utf-8", "backslashreplace").decode()
        return _fail(f"{shown}: its name is not UTF-8 text; rename it", BAD_INPUT)
    try:
        status = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        return _fail(f"{' '.join(str(error).split())} (see jaxsat --help)", USAGE)
    except InputError as error:
        return _fail(str(error), BAD_INPUT)
    except KeyboardInterrupt as stop:
        return _fail(str(stop) or "interrupted; nothing unfinished is left", INTERRUPTED)
    except OSError as error:
        # A full disk, a directory taken away: results were being written, input errors have their own type.
        return _fail(": ".join(str(part) for part in (error.filename, error.strerror or error) if part), BAD_INPUT)
    return status if isinstance(status, int) else 0


def _fail(message: str, status: int) -> int:
    print(f"jaxsat: error: {message}", file=sys.stderr)
    return status


def main() -> None:
    """Entry point of the console script."""
    # Python, JAX and their programs are millions of objects that stay: looking for garbage among them, at every 700
    # new ones, takes a quarter of the time that imports take.
    gc.set_threshold(100_000)
    # A stream that was closed before the start is None, and prints nothing.
    sys.stdout, sys.stderr = (cast(Any, stream and Lasting(stream)) for stream in (sys.stdout, sys.stderr))
    sys.exit(heeded(run, sys.argv[1:]))
