"""Tables and text on the terminal, in the one look of all commands."""

from collections.abc import Sequence

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table


def plain_table(*columns: str, right: Sequence[int] = (), title: str = "") -> Table:
    """Returns an empty table in the one look of all commands; `right` are the columns of numbers."""
    table = Table(box=box.SIMPLE_HEAD, title=title or None, title_justify="left", title_style="bold", pad_edge=False)
    for number, name in enumerate(columns):
        table.add_column(name, justify="right" if number in right else "left", overflow="fold")
    return table


def show(*parts: RenderableType) -> None:
    """Prints to stdout, at most 100 columns wide, with colours on a terminal only."""
    console = Console(highlight=False)
    console = Console(highlight=False, width=min(console.width, 100))
    for part in parts:
        console.print(part)
