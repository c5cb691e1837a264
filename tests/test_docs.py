"""README and docs speak of what is there: links, files, modules, commands; their example runs as it stands."""

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from cyclopts import CycloptsError

from jaxsat.satellites import Satellite, read_satellite
from jaxsat.sensors import View

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
MOST_PAGES = 15
"""Of one folder."""
ON_EACH_PAGE = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
SOURCES = "jaxsat|fitting|experiments|tests|docs"


def spans(text: str) -> list[str]:
    """Code in backticks, and the lines of code blocks."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    inline = re.findall(r"`([^`]+)`", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE))
    return [" ".join(span.split()) for span in inline] + [line for block in blocks for line in block.splitlines()]


def anchors(page: Path) -> set[str]:
    """Addresses of the page's headings, as they are made by MkDocs and GitHub."""
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower()) for heading in headings}


@ON_EACH_PAGE
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
        if link.startswith("https://"):
            continue
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link
        # The site holds nothing from outside docs.
        assert page.parent == ROOT or ROOT / "docs" in target.resolve().parents, link


@ON_EACH_PAGE
def test_files_that_are_named_exist(page):
    for span in spans(page.read_text("utf-8")):
        for path in re.findall(rf"(?<![\w./$-])(?:{SOURCES})/[\w./-]*\w", span):
            assert (ROOT / path).exists(), path


def named(text: str) -> Iterator[str]:
    """Dotted names of this project's own modules and of what is in them; `jaxsat.fit/1` is a schema."""
    for span in spans(text):
        yield from re.findall(r"(?<![\w./-])(?:jaxsat|fitting)(?:\.[A-Za-z_]\w*)+(?![\w/*-]|\.\w)", span)


@ON_EACH_PAGE
def test_modules_that_are_named_exist(page):
    assert [name for name in named(page.read_text("utf-8")) if not is_there(name)] == []


def source(module: str) -> Path:
    """Where a module stands, whether it does or not."""
    place = ROOT.joinpath(*module.split("."))
    return place / "__init__.py" if place.is_dir() else place.with_suffix(".py")


def is_there(name: str) -> bool:
    """Whether it is a module, or something that one defines or imports; nothing is run for it."""
    module, _, member = name.rpartition(".")
    if ROOT.joinpath(*name.split(".")).is_dir() or source(name).exists():
        return True
    if not source(module).exists():
        return False
    nodes = list(ast.walk(ast.parse(source(module).read_text("utf-8"))))
    defined = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    defined |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    imported = (node for node in nodes if isinstance(node, ast.ImportFrom))
    return member in defined | {alias.asname or alias.name for node in imported for alias in node.names}


@ON_EACH_PAGE
def test_commands_that_are_named_exist(page):
    from jaxsat.cli.main import app

    known = set(app)
    for span in spans(page.read_text("utf-8")):
        for command in re.findall(r"(?:^|[\s/])jaxsat ([a-z][\w-]*)", span):
            # That of the example in CONTRIBUTING is not there yet.
            assert command in known | {"perigee"}, span


def commands(text: str) -> Iterator[list[str]]:
    """Words of each `jaxsat` command in console blocks and shell scripts, without what the shell makes of the rest."""
    for kind, block in re.findall(r"^```(console|sh)\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE):
        for line in block.replace("\\\n", "").splitlines():
            if kind == "sh" or line.startswith("$ "):
                for part in re.split(r"&&|;|\||>", re.sub(r"\s#.*", "", line.removeprefix("$ "))):
                    found = re.match(r"\s*(?:[A-Z_]+=\S+ )*(?:\S*/)?jaxsat\s(.*)", part)
                    if found:
                        yield shlex.split(found[1])


def test_commands_are_understood():
    """With all their options, which are read and not run."""
    from jaxsat.cli.main import app

    every = [(page.name, words) for page in PAGES for words in commands(page.read_text("utf-8"))]
    assert len(every) > 50
    for page, words in every:
        try:
            app.parse_args(words, print_error=False, exit_on_error=False)
        except CycloptsError as error:
            pytest.fail(f"{page}: jaxsat {shlex.join(words)}: {error}")


def test_python_blocks_import_what_is_there():
    """Those that no test runs, too: they are Python, and what they import of this project exists."""
    blocks = [
        (page.name, block)
        for page in PAGES
        for block in re.findall(r"^```(?:py|python)\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    ]
    assert len(blocks) > 20
    for page, block in blocks:
        for node in ast.walk(ast.parse(block, page)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in ("jaxsat", "fitting"):
                missing = [alias.name for alias in node.names if not is_there(f"{node.module}.{alias.name}")]
                assert not missing, (page, node.module, missing)


@pytest.mark.parametrize("text", ["`jaxsat.nowhere`", "`fitting.run.fit_all`", "`x = jaxsat.control.emergency_law.f`"])
def test_a_name_that_is_not_there_is_caught(text):
    assert not any(map(is_there, named(text)))
    assert list(named(text))


def test_every_page_has_its_place():
    contents = (ROOT / "mkdocs.yml").read_text("utf-8")
    pages = {str(page.relative_to(ROOT / "docs")) for page in PAGES if page.parent != ROOT}
    assert pages == set(re.findall(r": ([\w/-]+\.md)$", contents, flags=re.MULTILINE))
    folders = [page.parent for page in PAGES]
    assert max(map(folders.count, folders)) <= MOST_PAGES


def test_a_sensor_of_ones_own_reads_a_satellite_file(tmp_path):
    text = (ROOT / "docs" / "satellites" / "sensors.md").read_text("utf-8")
    ((code, keys),) = re.findall(
        r"^<!-- file: my_sensors.py -->\n```python\n(.*?)^```\n\n```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE
    )
    (tmp_path / "my_sensors.py").write_text(code)
    (tmp_path / "sat.toml").write_text(
        '[body]\ninertia_kg_m2 = [1.0, 1.0, 1.0]\n[time]\ncolumn = "utc"\n[orbit]\ntle = "a.tle"\n' + keys
    )
    satellite = read_satellite(tmp_path / "sat.toml")
    assert isinstance(satellite, Satellite)
    none, field = jnp.zeros(3), jnp.array([3e-5, 0.0, -4e-5])
    view = View(jnp.array([1.0, 0.0, 0.0, 0.0]), none, jnp.array(0.0), jnp.array([7e6, 0.0, 0.0]), none, field)
    np.testing.assert_allclose(satellite.model.sensors["size"](view), [5e-5], rtol=1e-15)
    assert [leaf.name for leaf in satellite.leaves if leaf.sigma is not None] == ["size.gain"]


def test_what_contributors_start_from_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    blocks = re.findall(r"^<!-- runs -->\n```python\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    there: dict = {"__name__": "contributed"}
    for block in blocks:
        exec(block, there)
    assert len(blocks) == 5 and "GravityGradient(), EddyDamping(" in capsys.readouterr().out
    field = jnp.array([2e-5, 0.0, 1e-5])
    reading = there["magnetometer_reading"](there["Magnetometer"](np.ones(3)), jnp.array([0.0, 1.0, 0.0, 0.0]), field)
    np.testing.assert_allclose(reading, [1.00002, 1.0, 0.99999], rtol=1e-15)
    Path("t.csv").write_text("t_s,celsius\n0,20\n1,-273.15\n")
    np.testing.assert_allclose(there["read_temperatures"]("t.csv").kelvin, [293.15, 0.0])
    Path("t.csv").write_text("t_s,celsius\n0,warm\n")
    with pytest.raises(ValueError, match=r"t\.csv:2: expected two numbers"):
        there["read_temperatures"]("t.csv")
    found = there["make"]({"spread_deg": "0"}).run(1, np.arange(512))
    assert not found["status"].any() and there["perigee"](7630.0, 0.0727) == 0
    assert capsys.readouterr().out == "704.099\n"
