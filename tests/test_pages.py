"""Pages run: every block in its order, in an empty folder, and what it prints is what the page shows.

As a reader would, by a process of its own for each page (docs/run_pages.py), but for three things: sizes that a page
marks are smaller; numbers may differ by two in their last shown digit or by a thousandth; times at will
(docs/outputs.py). They take as long as all other tests together, so they are run by `-m pages` alone, in .ci/run.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "docs"))

from notebooks import MOST_BYTES
from outputs import alike, renewed
from pages import Block, Page, Prose, parts_of

from experiments.flight.iss import EXCERPT
from experiments.twins.draw import draw
from experiments.twins.write import write_session

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
BLOCKS = {page: [part for part in parts_of(page.read_text("utf-8")) if isinstance(part, Block)] for page in PAGES}
RUN = [page for page, blocks in BLOCKS.items() if any(block.runs for block in blocks)]
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
REASONS = {
    ".ci/run does so in an environment of its own",
    "that of the queue",
    "the frames are not in the repository",
    "the tests that it runs are tests themselves",
    "there is no GPU",
    "there is no SLURM",
    "there is no second machine",
}
"""Why a block may be left out."""


@pytest.mark.slow
@pytest.mark.pages
@pytest.mark.parametrize("page", RUN, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_block_of_a_page_prints_what_it_shows(page):
    # A reader has XLA's newer code generator, and no flags.
    environment = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    command = [sys.executable, DOCS / "run_pages.py", "--check", page]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"


def test_blocks_that_are_not_run_say_why():
    left = {block.words["not run"] for blocks in BLOCKS.values() for block in blocks if "not run" in block.words}
    assert left == REASONS
    languages = {block.language for blocks in BLOCKS.values() for block in blocks if not block.runs}
    # Commands and Python that are run stand in blocks of these two kinds.
    assert languages <= {"sh", "python", "toml", "text", "matlab", "html"}


def test_keys_of_blocks_are_those_that_are_known():
    import run_pages

    told = run_pages.__doc__ or ""

    keys = {key for blocks in BLOCKS.values() for block in blocks for key in block.words}
    assert keys <= set(re.findall(r"^    ([a-z]+(?: [a-z]+)?)(?::|  )", told, re.MULTILINE))


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)
def test_a_notebook_is_its_page(path):
    """`docs/run_pages.py` was run after the last change: the same code with the same outputs."""
    file = path.parent / "notebooks" / f"{path.stem}.ipynb"
    assert file.stat().st_size < MOST_BYTES
    cells = [cell for cell in json.loads(file.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    parts = list(parts_of(path.read_text("utf-8")))
    blocks = [part for part in parts if isinstance(part, Block) and (part.runs or "file" in part.words)]
    assert len(cells) == len(blocks)
    for cell, block in zip(cells, blocks, strict=True):
        assert "".join(cell["source"]).endswith(block.code.rstrip())
        streams = [output for output in cell["outputs"] if output["output_type"] == "stream"]
        assert "".join("".join(output["text"]) for output in streams) == block.output
    shown = [name for part in parts if isinstance(part, Prose) for name in part.pictures()]
    pictures = [output for cell in cells for output in cell["outputs"] if output["output_type"] == "display_data"]
    assert len(pictures) == len(shown)


def test_tables_are_those_that_are_told(tmp_path):
    """The pass that another program makes, and every tenth row of the excerpt of the station's."""
    data = DOCS / "tutorials" / "data"
    table = write_session(draw("1u-coils", 3), tmp_path)
    assert table.read_text() == (data / "pass.csv").read_text()
    assert table.with_suffix(".tle").read_text() == (data / "pass.tle").read_text()
    truth = json.loads(table.with_suffix(".truth.json").read_text())["parameters"]
    for name, value in json.loads((data / "pass.truth.json").read_text()).items():
        scale = {"mag.bias": 1e6, "gyro.bias": 57.29577951308232}.get(name.rpartition(".")[0], 1.0)
        assert value == pytest.approx(scale * truth[name.replace("diodes", "sun")]["value"], rel=1e-6)
    rows = EXCERPT.read_text("ascii").splitlines()
    assert (data / "iss.csv").read_text("ascii").splitlines() == [rows[0], *rows[1::10]]


def test_a_changed_output_is_caught():
    shown = "mag  0.278 ± 0.010 uT\ntime import 4.4 s, total\n 26.8 s\n"
    assert alike(shown, "mag  0.279 ± 0.010 uT\n\ntime import 1.0 s, total 3 s")
    assert alike("3.090e-08", "3.091e-08") and not alike("3.090e-08", "3.094e-08")
    assert not alike(shown, shown.replace("0.278", "0.288"))
    assert not alike(shown, shown.replace("uT", "nT")) and not alike(shown, shown + "more")
    assert alike(shown, shown.replace("0.278", "9.9"), numbers=False)
    assert not alike("3 cases", "-3 cases") and not alike("3 cases", "4 cases") and alike("1000", "1001")
    assert alike("inf s", "12 s", numbers=False)


def test_lines_of_dots_stand_for_others():
    printed = "a\nb\nc 3.001\n"
    assert all(alike(shown, printed) for shown in ("a\n...\nc 3.000\n", "a\n...\n", "...\nb\n...\n", "...\nc 3.00\n"))
    assert not any(alike(shown, printed) for shown in ("a\n", "...\nb\n", "b\n...\n", "...\nb\n...\na\n...\n"))
    assert not alike("", "a\n") and not alike("a\n", "")
    assert renewed("a\n...\nc 4.000\n", printed) == printed.replace("b", "...")
    assert renewed("...\nb\n...\n", printed) == "...\nb\n...\n"
    with pytest.raises(ValueError, match="d\n"):
        renewed("d\n...\n", printed)


def test_a_page_is_taken_apart_and_put_together(tmp_path, monkeypatch):
    text = "# T\n\n<!-- in checks: 50 => 2 | n + => 1 + -->\n```python\nn = 50\nprint(n + 50)\n```\n"
    text += "\n```text\n100\n```\n"
    text += "\nThen\n\n<!-- before: echo 1 > b -->\n<!-- file: a -->\n```toml\na = 1\n```\n"
    parts = list(parts_of(text))
    assert "".join(part.text() if isinstance(part, Block) else part.text for part in parts) == text
    block, other = (part for part in parts if isinstance(part, Block))
    assert block.for_check().code == "n = 2\nprint(1 + 2)\n" and block.output == "100\n"
    with pytest.raises(ValueError, match="does not stand"):
        Block("<!-- in checks: 5 => 2 -->\n", "python", "6 + 6\n").for_check()
    monkeypatch.chdir(tmp_path)
    page = Page()
    assert page.run(block.for_check()) == "3\n" and page.run(other) == ""
    assert Path("a").read_text() == "a = 1\n" and Path("b").read_text() == "1\n"
    with pytest.raises(RuntimeError, match="ended with 3"):
        page.run(Block("", "sh", "exit 3\n"))
    assert page.run(Block("<!-- status: 3 -->\n", "sh", "echo so; exit 3\n")) == "so\n"
