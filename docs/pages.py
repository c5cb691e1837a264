"""What a page is made of, and how its blocks are run; `run_pages.py` says how they are marked."""

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

ROOT = Path(__file__).parent.parent
WIDTH = 84
"""Of the terminal, in characters."""
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
        return self.language in RUN and not {"file", "not run"} & self.words.keys()

    def for_check(self) -> "Block":
        """With the smaller sizes that a check takes."""
        code = self.code
        for change in filter(None, self.words.get("in checks", "").split(" | ")):
            old, new = change.split(" => ")
            if old not in code:
                raise ValueError(f"in checks: {old!r} does not stand in\n{code}")
            code = code.replace(old, new)
        return replace(self, code=code)

    def prepare(self) -> None:
        """What is there before it runs, and the file that it is."""
        if "before" in self.words:
            bash(self.words["before"])
        if "file" in self.words:
            Path(self.words["file"]).write_text(self.code, "utf-8")

    @property
    def numbers(self) -> bool:
        """Whether those of the output are the same each time."""
        return "numbers vary" not in self.words

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

    names: dict = field(default_factory=lambda: {"__name__": "__main__"})
    """The variables of its Python."""

    def run(self, block: Block) -> str:
        """Does what a reader does with a block; returns what it prints."""
        if "with" in block.words:
            for part in parts_of((ROOT / "docs" / block.words["with"]).read_text("utf-8")):
                if isinstance(part, Block):
                    part.prepare()
        block.prepare()
        if not block.runs:
            return ""
        if block.language == "sh":
            return bash(block.code, int(block.words.get("status", 0)))
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            exec(compile(block.code, "<page>", "exec"), self.names)
        return told.getvalue()


def bash(commands: str, status: int = 0) -> str:
    """Runs commands as a reader would, and returns what they printed.

    Raises:
        RuntimeError: they end with another status; what they said is in it.
    """
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", commands], capture_output=True, text=True, env=environment()
    )
    if done.returncode != status:
        raise RuntimeError(f"{commands}\nended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def environment() -> dict[str, str]:
    """A terminal of one width without colours, in which this environment comes first."""
    paths = [str(Path(sys.executable).parent), os.environ.get("PATH", "")]
    own = {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "MPLBACKEND": "Agg", "PYTHONPATH": str(ROOT)}
    return {**os.environ, **own, "PATH": os.pathsep.join(paths), "DOCS": str(ROOT / "docs")}
