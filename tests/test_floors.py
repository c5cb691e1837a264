"""The house stands: every import goes down its floors, and the top level holds only what docs/house.md allows."""

import ast
import fnmatch
from collections import Counter
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

# From the ground up. Modules of one floor may import each other, but for wings, which stand apart.
FLOORS: tuple[tuple[str, ...], ...] = (
    ("jaxsat.errors", "jaxsat.significant", "jaxsat.panel_names", "jaxsat.bundled"),
    ("jaxsat.numerics", "jaxsat.versions", "jaxsat.setting_types", "jaxsat.physical"),
    ("jaxsat.math",),
    ("jaxsat.constants", "jaxsat.time", "jaxsat.frames", "jaxsat.given"),
    ("jaxsat.files",),
    ("jaxsat.environment",),
    ("jaxsat.spacecraft",),
    ("jaxsat.torques", "jaxsat.munin"),
    ("jaxsat.dynamics", "jaxsat.integrators", "jaxsat.simulate"),
    ("jaxsat.sensors",),
    ("jaxsat.estimation",),
    ("jaxsat.control",),
    ("jaxsat.telemetry", "jaxsat.satellites"),
    ("jaxsat.sweep",),
    ("jaxsat.plotting", "jaxsat.report"),
    ("jaxsat.synthetic",),
    ("fitting",),
    ("jaxsat.cli",),
)
WINGS = {"jaxsat.plotting", "jaxsat.report"}
LEVEL = {unit: level for level, units in enumerate(FLOORS) for unit in units}
SOURCES = ("jaxsat", "fitting", "experiments", "tests")
MOST_FILES = 15
"""Source files of one folder."""
TOP_LEVEL = {
    *("pyproject.toml", "mkdocs.yml", "jaxsat", "fitting", "experiments", "tests", "docs"),
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "CITATION.cff", "LICENSE"),
}


def unit_of(module: str) -> str | None:
    """The part of the house that a module belongs to, as `jaxsat.math`; None for other libraries."""
    parts = module.split(".")
    if parts[0] == "fitting":
        return "fitting"
    return ".".join(parts[:2]) if parts[0] == "jaxsat" else None


def imported(source: str, module: str, is_package: bool) -> Iterator[tuple[int, str]]:
    """Line and full name of everything that a module imports, inside functions and `TYPE_CHECKING` too."""
    package = module if is_package else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parents = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*parents, base] if base else parents)
            # `from jaxsat import cli` names the module only with the alias.
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)


def violations(source: str, module: str, *, is_package: bool = False) -> list[str]:
    """One line for each import of `source` that does not go down."""
    own = unit_of(module)
    # The package's own __init__ is its table of contents: it may name anything of the simulator.
    contents = module == "jaxsat"
    if not contents and own not in LEVEL:
        return [f"{module}: {own} is on no floor; give it one in docs/house.md and in this test"]
    found = []
    for line, name in imported(source, module, is_package):
        other = unit_of(name)
        if other is None or other == own:
            continue
        if other not in LEVEL:
            found.append(f"{module}:{line}: {name} is on no floor")
        elif contents:
            if other in ("fitting", "jaxsat.cli"):
                found.append(f"{module}:{line}: the simulator must not know {other}")
        elif LEVEL[other] > LEVEL[str(own)]:
            found.append(f"{module}:{line}: imports {name}, which is above {own}")
        elif LEVEL[other] == LEVEL[str(own)] and own in WINGS:
            found.append(f"{module}:{line}: imports {name}, another wing beside {own}")
    return found


def modules() -> list[tuple[str, Path]]:
    """Name and file of each module of the house."""
    files = [file for package in ("jaxsat", "fitting") for file in sorted((ROOT / package).rglob("*.py"))]
    names = (".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for file in files)
    return list(zip(names, files, strict=True))


def test_every_import_goes_down():
    found = [
        line
        for module, file in modules()
        for line in violations(file.read_text("utf-8"), module, is_package=file.name == "__init__.py")
    ]
    assert not found, "\n".join(found)


def graph(sources: Mapping[str, tuple[str, bool]]) -> dict[str, set[str]]:
    """Modules that each module imports, of (source, whether a package) by name."""
    found = {}
    for module, (source, is_package) in sources.items():
        names = {name for _, name in imported(source, module, is_package)}
        # `from a.b import c` names a module a.b.c or something in a.b.
        places = {name if name in sources else name.rpartition(".")[0] for name in names}
        found[module] = (places & sources.keys()) - {module}
    return found


def circle(imports: Mapping[str, set[str]]) -> list[str]:
    """A circle of imports, if there is one."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_files_import_each_other():
    sources = {module: (file.read_text("utf-8"), file.name == "__init__.py") for module, file in modules()}
    assert not circle(graph(sources))


def test_a_circle_is_caught():
    sources = {"a": ("def f():\n    import b.c", False), "b": ("", True), "b.c": ("from a import f", False)}
    assert {"a", "b.c"} <= set(circle(graph(sources)))
    assert not circle(graph({**sources, "a": ("import b", False)}))


def test_no_folder_is_too_full():
    files = [file for top in SOURCES for file in (ROOT / top).rglob("*.py")]
    counts = Counter(file.parent.relative_to(ROOT) for file in files if "node_modules" not in file.parts)
    assert not {str(folder): count for folder, count in counts.items() if count > MOST_FILES}


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("jaxsat.math.vector", "from jaxsat.time import Epoch"),
        ("jaxsat.torques", "import jaxsat.sensors.solar_panels"),
        ("jaxsat.environment.orbit", "def f():\n    from jaxsat.dynamics import step"),
        ("jaxsat.simulate", "from fitting import fit"),
        ("jaxsat.simulate", "from jaxsat import cli"),
        ("jaxsat", "from jaxsat.cli.main import main as main"),
        ("fitting.estimate", "from jaxsat.cli.settings.sections import Config"),
        ("jaxsat.plotting.style", "from jaxsat.report.html import page"),
        ("jaxsat.math.vector", "from ..time import Epoch"),
        ("jaxsat.math.vector", "from .. import cli"),
        ("jaxsat.newcomer", "import math"),
        ("jaxsat.sensors.noise", "from jaxsat.nowhere import x"),
    ],
)
def test_a_violation_is_caught(module, source):
    assert violations(source, module)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("jaxsat.cli.fit.command", "from fitting.run import fit"),
        (
            "fitting.measurements.problem",
            "from jaxsat.sensors.solar_panels import currents\nfrom .transforms import exp",
        ),
        ("jaxsat.simulate", "from jaxsat.integrators import rk4\nimport jax"),
        ("jaxsat.math.quaternion", "from .safe import safe_norm"),
        ("jaxsat", "from jaxsat.simulate import simulate as simulate"),
    ],
)
def test_a_lawful_import_is_not(module, source):
    assert not violations(source, module)


def test_top_level_holds_only_what_is_allowed():
    ignored = [line.strip("/\n ") for line in (ROOT / ".gitignore").read_text().splitlines() if line.strip()]
    names = {entry.name for entry in ROOT.iterdir() if not entry.name.startswith(".")}
    foreign = {name for name in names - TOP_LEVEL if not any(fnmatch.fnmatch(name, pattern) for pattern in ignored)}
    assert not foreign
