"""Where a scenario comes from, in words that another process understands as well."""

import functools
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from jaxsat.errors import InputError
from jaxsat.sweep.scenario import Factory, Scenario


@dataclass(frozen=True)
class Source:
    """A factory's address, the options it gets, and what a fresh process has to do before."""

    address: str
    """`module:name` of a `Factory`, or of a function that takes a mapping of options and has none declared."""
    options: tuple[tuple[str, str], ...] = ()
    """Every declared option and its value."""
    prepare: str = ""
    """`module:name` of a function without arguments, called once in each process; none where empty."""

    @staticmethod
    def of(address: str, given: Mapping[str, str], *, prepare: str = "") -> "Source":
        """Source with the defaults of the options that are not given; `InputError` for unknown ones."""
        return Source(address, tuple(factory(address).filled(given).items()), prepare)

    def scenario(self) -> Scenario:
        """The scenario, made once in each process."""
        return _made(self)


def factory(address: str) -> Factory:
    """The factory at `module:name`; `InputError` where there is none."""
    found = _load(address)
    if isinstance(found, Factory):
        return found
    if not callable(found):
        raise InputError("is neither a Factory nor a function that makes a scenario", field=address)
    build: Callable[..., Any] = found
    return Factory(build)


@functools.lru_cache(maxsize=8)
def _made(source: Source) -> Scenario:
    if source.prepare:
        _prepared(source.prepare)
    scenario = factory(source.address)(dict(source.options))
    if not isinstance(scenario, Scenario):
        raise InputError(f"made {type(scenario).__name__}, expected a Scenario", field=source.address)
    return scenario


@functools.cache
def _prepared(address: str) -> None:
    function: Callable[[], Any] = _load(address)
    function()


def _load(address: str) -> Any:
    module, _, name = address.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(f"cannot be imported: {error}; its folder must be in PYTHONPATH", field=address) from None
