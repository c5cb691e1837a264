"""Runs the commands and the Python of pages, and writes what they gave into the pages and into notebooks beside them.

    .venv/bin/python docs/run_pages.py docs/tutorials

takes folders and single pages (`--prose` where nothing has to be run again). Each page is run from top to bottom in
an empty folder, by a process of its own:

    ```sh          commands, run by bash, with this environment's `jaxsat` and `python`
    ```python      one interpreter for all of a page
    ```text        right behind one of these: what it printed, which is written here
    ![...](images/NAME.png)    a picture that the page's Python saved as NAME.png

A comment before a block, `<!-- KEY: VALUE -->`, says more of it:

    file: NAME             the block is a file, whatever its language
    take: PATH PATH        files beside the page that the block needs: the reader has downloaded them
    shown: FIRST+LAST      of a long output only so many first and last lines are shown
    in tests: OLD => NEW   the test runs less: its output's words are compared, not its numbers
    numbers vary           those of the output depend on how much was run, or on the machine

Outputs and pictures that are as before (`outputs.alike`) are left to the byte. `tests/test_tutorials.py` runs the same.
"""

import argparse
import base64
import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from outputs import alike, same_picture, shortened

ROOT = Path(__file__).parent.parent
WIDTH = 84
"""Of the terminal, in characters."""
MOST_BYTES = 500_000
"""Of a notebook."""
RUN = ("sh", "python")
FENCE = re.compile(
    r"((?:^<!-- [^\n]+ -->\n)*)^```(\w+)\n(.*?)^```\n(?:\n^```text\n(.*?)^```\n)?", re.DOTALL | re.MULTILINE
)
PICTURE = re.compile(r"^!\[[^\]]*\]\(images/([\w-]+\.png)\)\n", re.MULTILINE)


@dataclass(frozen=True)
class Prose:
    """What stands between blocks."""

    text: str

    def pictures(self) -> list[str]:
        """Names of those that are shown."""
        return PICTURE.findall(self.text)


@dataclass(frozen=True)
class Block:
    """A fenced block with what is said of it and what it printed."""

    comments: str
    language: str
    code: str
    output: str = ""

    @property
    def words(self) -> dict[str, str]:
        """What the comments say, by key."""
        found = re.findall(r"^<!-- ([a-z ]+?)(?:: (.*?))? -->$", self.comments, flags=re.MULTILINE)
        return {key: value for key, value in found}

    @property
    def runs(self) -> bool:
        """Whether it is run, and not a file or an example to look at."""
        return self.language in RUN and "file" not in self.words

    def for_tests(self) -> "Block":
        """With the smaller sizes of the tests."""
        if "in tests" not in self.words:
            return self
        old, new = self.words["in tests"].split(" => ")
        if self.code.count(old) != 1:
            raise ValueError(f"in tests: {old!r} does not stand once in\n{self.code}")
        return replace(self, code=self.code.replace(old, new))

    def told(self, printed: str) -> str:
        """The output as the page shows it."""
        return shortened(printed, self.words.get("shown"))

    def text(self) -> str:
        """As it stands in the page."""
        shown = f"\n```text\n{self.output}```\n" if self.output else ""
        return f"{self.comments}```{self.language}\n{self.code}```\n{shown}"


def parts_of(text: str) -> Iterator[Prose | Block]:
    """A page as prose and blocks, in their order. An output belongs to blocks that run alone."""
    end = 0
    for match in FENCE.finditer(text):
        comments, language, code, output = match.groups()
        block, last = Block(comments, language, code, output or ""), match.end()
        if output and not block.runs:
            block, last = replace(block, output=""), match.end(3) + len("```\n")
        yield Prose(text[end : match.start()])
        yield block
        end = last
    yield Prose(text[end:])


@dataclass
class Page:
    """A page while it is run, in the working folder."""

    beside: Path
    """The folder of its source."""
    shell: Callable[[str], str]
    """Runs commands and returns what they printed."""
    names: dict = field(default_factory=lambda: {"__name__": "__main__"})
    """The variables of its Python."""

    def run(self, block: Block) -> str:
        """Does what a reader does with a block; returns what it prints."""
        for name in block.words.get("take", "").split():
            shutil.copy(self.beside / name, Path(name).name)
        if "file" in block.words:
            Path(block.words["file"]).write_text(block.code, "utf-8")
        if not block.runs:
            return ""
        if block.language == "sh":
            return self.shell(block.code)
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            exec(compile(block.code, f"<{self.beside.name}>", "exec"), self.names)
        return told.getvalue()


def bash(commands: str) -> str:
    """Runs commands as a reader would; those that fail end it, with what they said."""
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands], capture_output=True, text=True, env=environment()
    )
    if done.returncode:
        raise RuntimeError(f"{commands}\nended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def environment() -> dict[str, str]:
    """A terminal of one width without colours, in which this environment comes first."""
    paths = [str(Path(sys.executable).parent), os.environ.get("PATH", "")]
    own = {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    return {**os.environ, **own, "PATH": os.pathsep.join(paths)}


def run_page(path: Path, *, run: bool = True) -> None:
    """Runs one page in the working folder, and writes it, its pictures and its notebook where they have changed.

    Without `run` the notebook is made of what the page shows.
    """
    page, written, cells = Page(path.parent, bash), [], []
    for part in parts_of(path.read_text("utf-8")):
        if isinstance(part, Prose):
            pictures = {name: _picture(path, name) for name in part.pictures()}
            written.append(part.text)
            cells.append((part, pictures))
            continue
        printed = part.told(page.run(part)) if run else part.output
        same_form = re.sub(r"\d", "0", part.output) == re.sub(r"\d", "0", printed)
        if not (same_form and alike(part.output, printed, numbers="numbers vary" not in part.words)):
            part = replace(part, output=printed)
        written.append(part.text())
        cells.append((part, {}))
    _write(path, "".join(written).encode("utf-8"))
    _write(path.parent / "notebooks" / f"{path.stem}.ipynb", notebook(cells))


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


def notebook(cells: list[tuple[Prose | Block, dict[str, bytes]]]) -> bytes:
    """The page as a notebook that has been run: pictures and printed lines are outputs of the cells above them."""
    from nbformat import v4, validate, writes

    made: list = []
    for part, pictures in cells:
        if isinstance(part, Block):
            made.append(v4.new_code_cell(_cell(part), execution_count=1) if _is_code(part) else _fenced(part))
            if part.output:
                made[-1].outputs.append(v4.new_output("stream", name="stdout", text=part.output))
            continue
        code = [cell for cell in made if cell.cell_type == "code"]
        for data in pictures.values():
            shown = {"image/png": base64.b64encode(data).decode("ascii")}
            code[-1].outputs.append(v4.new_output("display_data", data=shown))
        text = re.sub(r"\]\((?!https?:|#)([^)\s]+)\)", r"](../\1)", PICTURE.sub("", part.text)).strip()
        if text:
            made.append(v4.new_markdown_cell(text))
    for number, cell in enumerate(made):
        # Random ones would make another file of the same page.
        cell.id = f"cell-{number}"
    for number, cell in enumerate((cell for cell in made if cell.cell_type == "code"), start=1):
        cell.execution_count = number
    about = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    whole = v4.new_notebook(cells=made, metadata=about)
    validate(whole)
    content = f"{writes(whole)}\n".encode()
    if len(content) > MOST_BYTES:
        raise ValueError(f"a notebook of {len(content)} bytes; at most {MOST_BYTES} were wanted")
    return content


def _is_code(block: Block) -> bool:
    return block.runs or "file" in block.words


def _fenced(block: Block):
    from nbformat import v4

    return v4.new_markdown_cell(f"```{block.language}\n{block.code}```")


def _cell(block: Block) -> str:
    """The source of a cell: commands and files are magics of IPython."""
    if "file" in block.words:
        return f"%%writefile {block.words['file']}\n{block.code}".rstrip()
    return (f"%%bash\n{block.code}" if block.language == "sh" else block.code).rstrip()


def main() -> None:
    """The command line: one page here, more of them in a process each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path, help="pages, or folders of pages")
    parser.add_argument("--prose", action="store_true", help="run nothing: only prose has changed, for the notebooks")
    asked = parser.parse_args()
    pages = [page for place in asked.places for page in (sorted(place.glob("*.md")) if place.is_dir() else [place])]
    if len(pages) == 1:
        page = pages[0].resolve()
        sys.path.insert(0, "")  # What the page writes may be imported, as where a reader works.
        with tempfile.TemporaryDirectory(prefix="page-") as folder, contextlib.chdir(folder):
            run_page(page, run=not asked.prose)
        return
    options = ["--prose"] if asked.prose else []
    for page in pages:
        subprocess.run([sys.executable, __file__, str(page), *options], check=True, env=environment())


if __name__ == "__main__":
    main()
