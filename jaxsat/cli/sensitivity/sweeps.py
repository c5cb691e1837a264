"""`jaxsat sensitivity SWEEP_DIR`: which drawn input drives which metric."""

from collections.abc import Sequence
from pathlib import Path

from jaxsat.cli.shared.talk import Talk


def indices_of(
    place: Path, out: Path, *, together: Sequence[str], apart: Sequence[str], plots: bool, talk: Talk
) -> None:
    """Writes and shows the indices of a sweep. Raises `InputError`.

    Each of `together` names inputs that count as one, with commas between.
    """
    from rich.console import Group
    from rich.text import Text

    from fitting.sensitivity.sweeps import write_sweep_indices
    from fitting.sensitivity.sweeps.report import HEAD
    from jaxsat.cli.shared.terminal import plain_table

    groups = [[name.strip() for name in each.split(",")] for each in together]
    names = [name.strip() for each in apart for name in each.split(",")]
    with talk.stages("sensitivity") as progress:
        how = {"together": groups, "apart": names, "plots": plots, "progress": progress}
        document, rows, said = write_sweep_indices(place, out, **how)
    table = plain_table(*HEAD, right=(2, 4))
    for row in rows:
        table.add_row(*row)
    header = Text.assemble((document["scenario"], "bold"), f": what drives each metric, of {document['cases']} cases.")
    text = Group(header, table, *(Text(f"- {line}") for line in said))
    talk.result(text, f"\nresults in {out}", document=out / "indices.json")
