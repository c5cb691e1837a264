"""Pages of the reference, made from the program when the site is built: commands, files, settings, schemas, packages.

MkDocs calls the functions that begin with `on_`.
"""

import ast
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import schemas
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from satellite_file import page as satellite_files

ROOT = Path(__file__).parent.parent
ROOF = "jaxsat.cli"
"""Has its own page, of commands."""
WIDTH = 92
"""Of help texts, in characters."""
SIGNS = {"ge": "≥", "gt": ">", "le": "≤", "lt": "<", "min_length": "items ≥", "max_length": "items ≤"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Puts the pages that are made below `Reference`."""
    (reference,) = (entry for entry in config.nav or () if isinstance(entry, dict) and "Reference" in entry)
    reference["Reference"] = [
        {"Commands": "reference/commands.md"},
        {"Satellite files": "reference/satellite-files.md"},
        {"Configuration": "reference/configuration.md"},
        *reference["Reference"],
        {"JSON Schemas": schemas.PAGE},
        {"Packages": [{name: _page(name)} for name in _packages()]},
    ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages."""
    made = {"reference/commands.md": commands(), "reference/satellite-files.md": satellite_files()}
    made["reference/configuration.md"] = configuration()
    made |= schemas.files()
    made |= {_page(name): package(name) for name in _packages()}
    for path, content in made.items():
        files.append(File.generated(config, path, content=content))
    return files


def commands() -> str:
    """What `--help` says of each command."""
    from jaxsat.cli.main import app

    names = sorted(name for name in app if not name.startswith("-"))
    parts = ["# Commands", "What `jaxsat COMMAND --help` prints.", _help([])]
    for name in names:
        parts += [f"## jaxsat {name}", _help([name])]
    return "\n\n".join(parts)


def _help(command: list[str]) -> str:
    from rich.console import Console

    from jaxsat.cli.main import app

    text = io.StringIO()
    app.help_print(command, console=Console(file=text, width=WIDTH, color_system=None))
    return f"```text\n{text.getvalue().strip()}\n```"


def configuration() -> str:
    """Every setting: key, meaning with unit, default, limits."""
    from jaxsat.cli.settings.sections import Config

    parts = [
        "# Configuration",
        "Keys of the TOML file that `--config` takes; `jaxsat config` prints them as a template. A key without default "
        "is found from the session.",
    ]
    for name, field in Config.model_fields.items():
        parts += _section(name, field.annotation)
    return "\n\n".join(parts)


def _section(path: str, model: Any) -> Iterator[str]:
    yield f"## [{path}]"
    yield (model.__doc__ or "").strip().partition("\n")[0]
    rows, nested = ["| key | meaning | default | limits |", "|---|---|---|---|"], []
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            nested.append((f"{path}.{name}", field.annotation))
            continue
        limits = ", ".join(dict.fromkeys([*_of_metadata(field.metadata), *_limits(field.annotation)]))
        cells = (f"`{name}`", field.description or "", _default(field), limits)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    if len(rows) > 2:
        yield "\n".join(rows)
    for inner, kind in nested:
        yield from _section(inner, kind)


def _default(field: FieldInfo) -> str:
    value = field.get_default(call_default_factory=True)
    if value is None:
        return f"found; as `{_text(field.examples[0])}`" if field.examples else "found"
    return f"`{_text(value)}`"


def _text(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_text(item) for item in value) + "]"
    return str(value)


def _limits(annotation: Any) -> Iterator[str]:
    """Limits in a type, those of the items of a list included."""
    if get_origin(annotation) is Literal:
        yield "one of " + ", ".join(_text(choice) for choice in get_args(annotation))
        return
    yield from _of_metadata(getattr(annotation, "__metadata__", ()))
    for inner in get_args(annotation):
        yield from _limits(inner)


def _of_metadata(metadata: Any) -> Iterator[str]:
    for limit in metadata:
        if isinstance(limit, FieldInfo):
            yield from _of_metadata(limit.metadata)
        for name, sign in SIGNS.items():
            bound = getattr(limit, name, None)
            if bound is not None:
                yield f"{sign}&nbsp;{bound:g}"


def package(name: str) -> str:
    """What a package's table of contents names; where it has none, what its files hold."""
    folder = ROOT.joinpath(*name.split("."))
    contents = _contents(folder / "__init__.py")
    parts = [f"# {name}", ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8"))) or ""]
    if contents:
        parts.append(f"Everything here is imported from `{name}`.")
        parts += [f"::: {name}.{member}" for member in contents]
    if not contents or name == "jaxsat":
        files = sorted(file for file in folder.glob("*.py") if not file.stem.startswith("_"))
        parts += [f"::: {name}.{file.stem}\n    options: {{show_root_full_path: true}}" for file in files]
    return "\n\n".join(parts)


def _contents(file: Path) -> list[str]:
    """Names that an `__init__` offers: those that it imports as themselves."""
    nodes = ast.walk(ast.parse(file.read_text("utf-8")))
    imports = (node for node in nodes if isinstance(node, ast.ImportFrom))
    return [alias.name for node in imports for alias in node.names if alias.asname == alias.name]


def _packages() -> list[str]:
    """Packages with something to show."""
    inits = [file for top in ("fitting", "jaxsat") for file in sorted((ROOT / top).rglob("__init__.py"))]
    names = (".".join(file.parent.relative_to(ROOT).parts) for file in inits)
    return [name for name in names if name != ROOF and not name.startswith(f"{ROOF}.")]


def _page(name: str) -> str:
    return f"reference/{name}.md"
