"""The scenarios that `jaxsat sweep` knows: the files of `PACKAGES`, read without being imported."""

import ast
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

PACKAGES = ("jaxsat.sweep.scenarios", "fitting.scenarios")


@dataclass(frozen=True)
class Entry:
    """A scenario as help shows it, without importing it."""

    address: str
    """`module:name` of its `jaxsat.sweep.Factory`."""
    summary: str


def found_in(folder: Path, package: str) -> dict[str, Entry]:
    """The scenarios of a package's folder by their names: the file's, with dashes.

    Each file has a factory `make`; the first line of its docstring is the summary. A file whose name begins with an
    underscore is part of another.
    """
    files = sorted(path for path in folder.glob("*.py") if not path.stem.startswith("_"))
    return {
        path.stem.replace("_", "-"): Entry(f"{package}.{path.stem}:make", summary_of(path.read_text("utf-8")))
        for path in files
    }


def summary_of(source: str) -> str:
    """First line of a module's docstring as it stands after a colon."""
    line = (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0].rstrip(".")
    # Not of an acronym.
    return line if line[1:2].isupper() else line[:1].lower() + line[1:]


def folder_of(package: str) -> Path:
    """Where a package's files are, which is not imported."""
    return Path(__file__).parents[3].joinpath(*package.split("."))


SCENARIOS = {name: entry for package in PACKAGES for name, entry in found_in(folder_of(package), package).items()}


def address_of(name: str) -> str:
    """Address of a scenario's factory by its name, or `name` itself where it is an address or a file of Python's.

    Raises ValueError for neither.
    """
    if ":" in name or name.endswith(".py"):
        return name
    if name not in SCENARIOS:
        close = [f"{name}.py"] if Path(f"{name}.py").is_file() else get_close_matches(name, SCENARIOS, n=1)
        hint = (
            f"Did you mean {close[0]}?"
            if close
            else f"Known: {', '.join(SCENARIOS)}; or my_scenario.py, or module:factory."
        )
        raise ValueError(f'There is no scenario "{name}". {hint}')
    return SCENARIOS[name].address
