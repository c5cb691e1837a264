"""Scenarios in files of the user's own: found, loaded, known by their content, and their errors told in a line."""

import functools
import hashlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from jaxsat.errors import InputError
from jaxsat.sweep.scenario import Scenario

OURS = ("jaxsat", "fitting")
"""Packages of this project: their scenarios are known by the version, and errors in them are no user's."""
FACTORY = "make"
"""Name of the factory in a file of which no other is said."""
_LONGEST = 400
"""Characters of a message of JAX's that are told."""


class CodeError(InputError):
    """What went wrong in the user's own code, with its file and line; the cause is the exception itself."""


def located(address: str) -> str:
    """An address with the whole path of its file, where it is one: `my.py`, `my.py:make`, or `my:make` of ./my.py.

    Any other address stays as it is.
    """
    path, name = _split(address)
    if path is None and ":" in address and not _ours(address):
        module, _, name = address.partition(":")
        beside = Path(*module.split(".")).with_suffix(".py") if module.replace(".", "").isidentifier() else None
        path = beside if beside is not None and beside.is_file() else None
    return address if path is None else f"{path.absolute()}:{name}"


def is_file(address: str) -> bool:
    """Whether an address is that of a file, there or not."""
    return _split(address)[0] is not None


def _split(address: str) -> tuple[Path | None, str]:
    """File and name of an address of a file; None for any other."""
    if address.endswith(".py"):
        return Path(address), FACTORY
    head, _, name = address.rpartition(":")
    return (Path(head), name) if head.endswith(".py") else (None, "")


def code_of(address: str) -> str:
    """SHA-256 of the file that a scenario is written in; empty for one of this project's, or without a file."""
    path = _file_of(address)
    return "" if path is None else hashlib.sha256(_read(path)).hexdigest()


def _file_of(address: str) -> Path | None:
    path, _ = _split(address)
    if path is not None:
        return path
    module = address.partition(":")[0]
    origin = getattr(sys.modules.get(module), "__file__", None)
    return Path(origin) if origin and not _ours(address) else None


def _ours(address: str) -> bool:
    """Whether an address is that of a module of this project, wherever one stands."""
    return address.partition(".")[0] in OURS


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        hint = f"; jaxsat sweep --new {path.name} writes one" if isinstance(error, FileNotFoundError) else ""
        raise CodeError(f"{error.strerror or error}{hint}", file=_shown(path)) from None


def load(address: str) -> Any:
    """What an address of a file names; `CodeError` where the file cannot be run or does not have it."""
    path, name = _split(address)
    if path is None:
        raise ValueError(f"load: expected the address of a file, got {address!r}")
    module = _module(str(path), _read(path))
    try:
        return getattr(module, name)
    except AttributeError:
        raise CodeError(f"defines no {name}, the factory of its scenario", file=_shown(path)) from None


@functools.lru_cache(maxsize=8)
def _module(path: str, content: bytes) -> ModuleType:
    """The module of a file, run from the very bytes that are given; its folder is where it may import from."""
    folder = str(Path(path).parent)
    if folder not in sys.path:
        sys.path.insert(0, folder)
    name = f"own_scenario_{Path(path).stem}"
    spec = importlib.util.spec_from_loader(name, loader=None, origin=path)
    assert spec is not None  # noqa: S101
    module = importlib.util.module_from_spec(spec)
    module.__file__ = path
    sys.modules[name] = module
    try:
        exec(compile(content, path, "exec"), module.__dict__)
    except Exception as error:
        del sys.modules[name]
        raise told(error, path) from error
    return module


def told(error: Exception, path: str) -> CodeError:
    """An exception in one line: the deepest line of the file `path` that led to it, its kind and what it says."""
    text = " ".join(str(error).split())
    text = text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
    line = None
    if isinstance(error, SyntaxError) and error.filename == path:
        line, text = error.lineno, error.msg
    for frame in traceback.extract_tb(error.__traceback__):
        if frame.filename == path:
            line = frame.lineno
    return CodeError(f"{type(error).__name__}: {text}" if text else type(error).__name__, file=_shown(path), row=line)


def guarded(scenario: Scenario, address: str) -> Scenario:
    """The same with functions whose errors are `CodeError`s, where its code is the user's own."""
    path = _file_of(address)
    if path is None:
        return scenario

    def guard(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def called(*arguments: Any) -> Any:
            try:
                return function(*arguments)
            except (InputError, OSError):
                # Told well enough as they are.
                raise
            except Exception as error:
                raise told(error, str(path)) from error

        return called

    return replace(
        scenario,
        run=guard(scenario.run),
        draw=scenario.draw and guard(scenario.draw),
        history=scenario.history and guard(scenario.history),
        run_moved=scenario.run_moved and guard(scenario.run_moved),
        inputs=tuple(replace(one, of=guard(one.of)) for one in scenario.inputs),
    )


def _shown(path: str | Path) -> str:
    """As short as it is from the working folder."""
    try:
        beside = os.path.relpath(path)
    except ValueError:
        return str(path)
    return str(path) if beside.startswith("..") else beside
