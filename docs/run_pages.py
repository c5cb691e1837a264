"""Runs the commands and the Python of pages, and writes what they gave into the pages and into notebooks beside them.

    .venv/bin/python docs/run_pages.py docs/tutorials README.md
    .venv/bin/python docs/run_pages.py --check docs README.md

takes folders and single pages, `--check` writes nothing and ends with 1 where something else is printed than is shown,
`--prose` makes notebooks anew where nothing has to be run. Each page is run from top to bottom in an empty folder, by a
process of its own, as a reader would in a terminal where this environment comes first:

    ```sh          commands, run by bash
    ```python      one interpreter for all of a page
    ```text        right behind one of these: what it printed; a line of dots stands for lines that are not shown
    ![...](images/NAME.png)    a picture that the page's Python saved as NAME.png, where the page is a notebook too

A comment before a block, `<!-- KEY: VALUE -->`, says more of it:

    file: NAME             the block is a file, whatever its language
    before: COMMANDS       what a reader has or does elsewhere, run by bash; $DOCS is the folder of all pages
    with: PAGE             the files of another page's blocks are there, and what those have before
    status: NUMBER         with which the commands end, if it is not 0
    not shown              what it prints is not compared
    numbers vary           those of the output depend on how much was run, or on the machine
    in checks: OLD => NEW  `--check` runs less, and compares the output's words alone; several are parted by |
    not run: REASON        here, because of it

Outputs and pictures that are as before (`outputs.py`) are left to the byte. `tests/test_pages.py` checks all pages.
"""

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from notebooks import notebook
from outputs import alike, renewed, same_picture
from pages import Page, Prose, environment, parts_of


def check_page(path: Path) -> list[str]:
    """What a page shows and its blocks no longer give, from a run in the working folder."""
    text, page, wrong = path.read_text("utf-8"), Page(), []
    for part in parts_of(text):
        if isinstance(part, Prose):
            # Those of other pages are made by commands that take long, or by hand.
            drawn = part.pictures() if _notebook(path) in text else []
            wrong += [f"no block has drawn {name}" for name in drawn if not Path(name).exists()]
            continue
        printed = page.run(part.for_check())
        numbers = part.numbers and "in checks" not in part.words
        if "not shown" not in part.words and not alike(part.output, printed, numbers=numbers):
            wrong.append(f"{part.code}shown:\n{part.output}printed:\n{printed}")
    return wrong


def run_page(path: Path, *, run: bool = True) -> None:
    """Runs one page in the working folder, and writes it, its pictures and its notebook where they have changed.

    Without `run` the notebook is made of what the page shows.
    """
    text, page, written, cells = path.read_text("utf-8"), Page(), [], []
    for part in parts_of(text):
        if isinstance(part, Prose):
            pictures = {name: _picture(path, name) for name in part.pictures()}
            written.append(part.text)
            cells.append((part, pictures))
            continue
        printed = page.run(part) if run else part.output
        if "not shown" not in part.words:
            part = replace(part, output=renewed(part.output, printed, numbers=part.numbers))
        written.append(part.text())
        cells.append((part, {}))
    _write(path, "".join(written).encode("utf-8"))
    if _notebook(path) in text:
        _write(path.parent / _notebook(path), notebook(cells))


def _notebook(page: Path) -> str:
    """Where it is, seen from the page, which has a link to it if there is one."""
    return f"notebooks/{page.stem}.ipynb"


def _picture(page: Path, name: str) -> bytes:
    """The picture that was drawn, or the page's own where it looks the same or nothing drew it."""
    kept = page.parent / "images" / name
    if Path(name).exists() and not (kept.exists() and same_picture(Path(name), kept)):
        kept.parent.mkdir(exist_ok=True)
        shutil.copy(name, kept)
    return kept.read_bytes()


def _write(path: Path, content: bytes) -> None:
    if not path.exists() or path.read_bytes() != content:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
        print(path)


def main() -> int:
    """The command line: one page here, more of them in a process each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path, help="pages, or folders of pages")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 where a page shows something else")
    parser.add_argument("--prose", action="store_true", help="run nothing: only prose has changed, for the notebooks")
    asked = parser.parse_args()
    pages = [page for place in asked.places for page in (sorted(place.rglob("*.md")) if place.is_dir() else [place])]
    if len(pages) == 1:
        page = pages[0].resolve()
        sys.path.insert(0, "")  # What the page writes may be imported, as where a reader works.
        os.environ.update(environment())
        with tempfile.TemporaryDirectory(prefix="page-") as folder, contextlib.chdir(folder):
            if not asked.check:
                run_page(page, run=not asked.prose)
                return 0
            wrong = check_page(page)
        print("\n".join(wrong), end="")
        return int(bool(wrong))
    options = [f"--{name}" for name in ("check", "prose") if getattr(asked, name)]
    failed = [page for page in pages if subprocess.run([sys.executable, __file__, str(page), *options]).returncode]
    for page in failed:
        print(f"failed: {page}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
