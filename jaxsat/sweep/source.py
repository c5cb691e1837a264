"""Where a scenario comes from, in words that another process understands as well."""

import dataclasses
import functools
import importlib
import inspect
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jaxsat.errors import InputError
from jaxsat.sweep.own_code import CodeError, code_of, guarded, is_file, load, located, told
from jaxsat.sweep.scenario import Factory, Scenario


@dataclass(frozen=True)
class Source:
    """A factory's address, the options it gets, and what a fresh process has to do before."""

    address: str
    """`module:name` of a `Factory`, or of a function that takes a mapping of options and has none declared; a file,
    `folder/my.py` or `folder/my.py:name`, stands for a module."""
    options: tuple[tuple[str, str], ...] = ()
    """Every declared option and its value."""
    prepare: str = ""
    """`module:name` of a function that is called once in each process; none where empty."""
    code: str = ""
    """SHA-256 of the file of a scenario of the user's own: another process finds the same one there, or says so."""
    arguments: tuple[str | None, ...] = ()
    """Which `prepare` gets."""
    chunk: int = 0
    """Cases of a chunk; 0: as many as the scenario has by itself."""

    @staticmethod
    def of(
        address: str, given: Mapping[str, str], *, prepare: str = "", arguments: tuple[str | None, ...] = ()
    ) -> "Source":
        """Source with the defaults of the options that are not given; `InputError` for unknown ones.

        An address of a file in the working folder gets its whole path.
        """
        address = located(address)
        options = tuple(factory(address).filled(given).items())
        return Source(address, options, prepare, code_of(address), arguments)

    def scenario(self) -> Scenario:
        """The scenario, made once in each process."""
        made = _made(dataclasses.replace(self, chunk=0))
        return dataclasses.replace(made, chunk=self.chunk) if self.chunk else made


def factory(address: str) -> Factory:
    """The factory at `module:name` or in a file; `InputError` where there is none."""
    address = located(address)
    found = load(address) if is_file(address) else _load(address)
    if isinstance(found, Factory):
        return found
    if not inspect.isfunction(found):
        raise InputError("is neither a Factory nor a function that makes a scenario", field=address)
    build: Callable[..., Any] = found
    return Factory(build)


@functools.lru_cache(maxsize=8)
def _made(source: Source) -> Scenario:
    if source.prepare:
        _prepared(source.prepare, source.arguments)
    if source.code and is_file(source.address) and code_of(source.address) != source.code:
        raise CodeError("has changed since the sweep began; begin another", file=source.address)
    made = factory(source.address)
    try:
        scenario = made(dict(source.options))
    except InputError:
        raise
    except Exception as error:
        if is_file(source.address):
            raise told(error, source.address.rpartition(":")[0]) from error
        raise InputError(f"makes no scenario: {_told(error)}", field=source.address) from error
    if not isinstance(scenario, Scenario):
        raise InputError(f"made {type(scenario).__name__}, expected a Scenario", field=source.address)
    return guarded(scenario, source.address)


@functools.cache
def _prepared(address: str, arguments: tuple[str | None, ...]) -> None:
    function: Callable[..., Any] = _load(address)
    function(*arguments)


def _load(address: str) -> Any:
    module, _, name = address.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except Exception as error:
        # Whatever a module does as it is imported.
        reason = f"cannot be imported: {_told(error)}; it must be in the working folder or in PYTHONPATH"
        raise InputError(reason, field=address) from error


def _told(error: Exception) -> str:
    """An error in one line, with the place in the module that raised it."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"
