"""The tutorials run: every block in its order, in an empty folder, and what it prints is what the page shows.

As a reader would, but for three things: commands run in this process, where what they compile is at hand; sizes that a
page marks are smaller (`in tests: OLD => NEW`); and numbers may differ by two in their last shown digit or by a
thousandth, times at will (docs/outputs.py).
"""

import contextlib
import io
import json
import re
import shlex
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "docs"))

from outputs import alike, shortened
from run_pages import MOST_BYTES, WIDTH, Block, Page, Prose, bash, parts_of

from experiments.flight.iss import EXCERPT
from experiments.twins.draw import draw
from experiments.twins.write import write_session
from jaxsat.cli.main import run

FOLDER = Path(__file__).parents[1] / "docs" / "tutorials"
PAGES = sorted(FOLDER.glob("*.md"))


def in_process(commands: str) -> str:
    """What commands print; those of `jaxsat` in this process, the rest by bash."""
    told = []
    for line in commands.splitlines():
        command, _, otherwise = line.partition(" || ")
        words, _, target = command.partition(" > ")
        if not words.startswith("jaxsat "):
            told.append(bash(line))
            continue
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            status = run(shlex.split(words, comments=True)[1:])
        if otherwise:
            assert otherwise == 'echo "exit status $?"'
            out.write(f"exit status {status}\n" if status else "")
        else:
            assert status == 0, line
        if target:
            Path(target).write_text(out.getvalue(), "utf-8")
        else:
            told.append(out.getvalue())
    return "".join(told)


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """Where a page runs, with a terminal of the pages' width."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.setenv("NO_COLOR", "1")
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda *_: None)
    monkeypatch.setattr("jaxsat.set_up_jax", lambda *_: None, raising=False)
    yield
    # Modules that a page has written are those of that page alone.
    for name in [name for name, module in sys.modules.items() if str(tmp_path) in str(getattr(module, "__file__", ""))]:
        del sys.modules[name]
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.mark.slow
@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_block_of_a_tutorial_prints_what_it_shows(path, empty_folder):
    page, drawn = Page(FOLDER, in_process), []
    for part in parts_of(path.read_text("utf-8")):
        if isinstance(part, Prose):
            drawn += [name for name in part.pictures() if not Path(name).exists()]
            continue
        printed = part.told(page.run(part.for_tests()))
        same = not {"in tests", "numbers vary"} & part.words.keys()
        assert alike(part.output, printed, numbers=same), f"{part.code}\nshown:\n{part.output}\nprinted:\n{printed}"
    assert not drawn, "shown, but drawn by no block"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_a_notebook_is_its_page(path):
    """`docs/run_pages.py` was run after the last change: the same code with the same outputs."""
    file = FOLDER / "notebooks" / f"{path.stem}.ipynb"
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
    table = write_session(draw("1u-coils", 3), tmp_path)
    assert table.read_text() == (FOLDER / "data" / "pass.csv").read_text()
    assert table.with_suffix(".tle").read_text() == (FOLDER / "data" / "pass.tle").read_text()
    truth = json.loads(table.with_suffix(".truth.json").read_text())["parameters"]
    for name, value in json.loads((FOLDER / "data" / "pass.truth.json").read_text()).items():
        scale = {"mag.bias": 1e6, "gyro.bias": 57.29577951308232}.get(name.rpartition(".")[0], 1.0)
        assert value == pytest.approx(scale * truth[name.replace("diodes", "sun")]["value"], rel=1e-6)
    rows = EXCERPT.read_text("ascii").splitlines()
    assert (FOLDER / "data" / "iss.csv").read_text("ascii").splitlines() == [rows[0], *rows[1::10]]


def test_a_changed_output_is_caught():
    shown = "mag  0.278 ± 0.010 uT\ntime import 4.4 s, total\n 26.8 s\n"
    assert alike(shown, "mag  0.279 ± 0.010 uT\n\ntime import 1.0 s, total 3 s")
    assert alike("3.090e-08", "3.091e-08") and not alike("3.090e-08", "3.094e-08")
    assert not alike(shown, shown.replace("0.278", "0.288"))
    assert not alike(shown, shown.replace("uT", "nT")) and not alike(shown, shown + "more")
    assert alike(shown, shown.replace("0.278", "9.9"), numbers=False)
    assert not alike("3 cases", "-3 cases") and alike("inf s", "12 s", numbers=False)


def test_a_page_is_taken_apart_and_put_together():
    text = "# T\n\n<!-- in tests: 50 => 2 -->\n```python\nn = 50\nprint(n)\n```\n\n```text\n50\n```\n"
    text += "\nThen\n\n```toml\na = 1\n```\n"
    parts = list(parts_of(text))
    assert "".join(part.text() if isinstance(part, Block) else part.text for part in parts) == text
    block = next(part for part in parts if isinstance(part, Block))
    assert block.for_tests().code == "n = 2\nprint(n)\n" and block.output == "50\n"
    assert shortened("a\nb  \nc\nd\n", "1+1") == "a\n...\nd\n"
    with pytest.raises(ValueError, match="does not stand once"):
        Block("<!-- in tests: 5 => 2 -->\n", "python", "5 + 5\n").for_tests()


def test_in_tests_a_page_is_smaller_where_it_says_so_and_nowhere_else():
    marked = re.findall(r"^<!-- in tests: .* -->$", "".join(path.read_text("utf-8") for path in PAGES), re.MULTILINE)
    assert len(marked) == 2
