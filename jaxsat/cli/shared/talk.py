"""How much a command says, and in which form: `--quiet`, `--verbose` and `--json`, alike in all that have results."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from jaxsat.cli.shared.progress import Stages

if TYPE_CHECKING:
    from rich.console import RenderableType

PATIENCE_S = 2.0
"""What takes no longer needs no progress."""


@dataclass(frozen=True)
class Talk:
    """Results go to stdout; whatever else is said to stderr, so that stdout may be a document."""

    quiet: Annotated[
        bool, Parameter(name=("--quiet", "-q"), help="Say nothing but warnings and errors.", negative=())
    ] = False
    verbose: Annotated[
        bool,
        Parameter(
            name=("--verbose", "-v"),
            help="Say more: tables in full length, a line for each stage of the work, versions.",
            negative=(),
        ),
    ] = False
    json: Annotated[
        bool,
        Parameter(help="Print the JSON file of the results in place of tables, and nothing else.", negative=()),
    ] = False

    def note(self, text: str) -> None:
        """Says on stderr what is no result and no warning."""
        if not self.quiet:
            print(f"jaxsat: {text}", file=sys.stderr)

    def stages(self, label: str, *, patience_s: float = PATIENCE_S) -> Stages:
        """Progress of work in stages; what is done within `patience_s` is not spoken of."""
        return Stages(label, quiet=self.quiet, lines=self.verbose, patience_s=0.0 if self.verbose else patience_s)

    def result(self, *parts: "RenderableType", document: Path | str) -> None:
        """Says on stdout what was found: `parts`, or the `document`, text of JSON or the file that holds it."""
        if self.verbose:
            self.note(_versions())
        if self.json:
            text = document if isinstance(document, str) else document.read_text("utf-8")
            print(text, end="" if text.endswith("\n") else "\n")
        elif not self.quiet:
            from jaxsat.cli.shared.terminal import show

            show(*parts)


def _versions() -> str:
    from jaxsat.versions import versions

    return ", ".join(f"{name} {version}" for name, version in versions().items())


Talking = Annotated[Talk, Parameter(name="*")]
"""Of a command that has results."""
USUAL = Talk()
