"""Sensors of the user's own: `kind = "module:Class"`, whose fields are the keys of the section."""

import dataclasses
import importlib
import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import create_model

from jaxsat.errors import InputError
from jaxsat.satellites.kinds.common import SensorKeys
from jaxsat.satellites.sections.fitted import Fitted

if TYPE_CHECKING:
    from jaxsat.satellites.leaves import LeafList
    from jaxsat.sensors.abstract import AbstractSensor


def own_class(kind: str, folder: Path) -> type:
    """The class of `module:Class`; the module is looked for in the folder of the satellite file, then among installed.

    Raises ValueError saying what is missing or no sensor.
    """
    from jaxsat.sensors.abstract import AbstractSensor

    place, _, name = kind.partition(":")
    try:
        module = _module(place, folder)
    except Exception as error:
        # Whatever the user's module raises while it is imported is what is wrong with it.
        raise ValueError(f"module {place!r} cannot be imported: {type(error).__name__}: {error}") from None
    found = getattr(module, name, None)
    if not (inspect.isclass(found) and issubclass(found, AbstractSensor)):
        what = "has no" if found is None else "has, but not as an AbstractSensor, a"
        raise ValueError(
            f"module {place!r} {what} class {name!r}; expected a class that is a jaxsat.sensors AbstractSensor"
        )
    if inspect.isabstract(found):
        raise ValueError(f"class {name!r} has no __call__: a sensor is a function of a view")
    return found


def _module(place: str, folder: Path) -> ModuleType:
    file = folder / Path(*place.split(".")).with_suffix(".py")
    if not file.is_file():
        return importlib.import_module(place)
    known = sys.modules.get(place)
    if known is not None and getattr(known, "__file__", None) == str(file):
        return known
    spec = importlib.util.spec_from_file_location(place, file)
    if spec is None or spec.loader is None:
        raise ImportError(f"{file} is no Python module")
    module = importlib.util.module_from_spec(spec)
    # Before it runs, as `import` does: dataclasses ask for the module of a class.
    sys.modules[place] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[place]
        raise
    return module


class OwnKeys(SensorKeys):
    """Keys of a class of one's own; its subclasses, one a class, have the fields."""

    @property
    def columns(self) -> int | None:
        return None

    def built(self, name: str, leaves: "LeafList") -> "AbstractSensor":
        import jax.numpy as jnp

        made = type(self).made_of()
        values: dict[str, Any] = {}
        for field in _fields(made):
            given = getattr(self, field.name)
            if given is _LEFT_OUT:
                continue
            values[field.name] = jnp.asarray(given.value) if isinstance(given, Fitted) else given
        try:
            sensor = made(**values)
        except Exception as error:
            reason = f"{made.__name__} refuses its numbers: {type(error).__name__}: {error}"
            raise InputError(reason, field=f"sensors.{name}") from None
        for field in _fields(made):
            found = getattr(sensor, field.name)
            if not field.metadata.get("static", False) and _is_numeric(found):
                given = getattr(self, field.name)
                _add(leaves, name, field.name, np.asarray(found), given if isinstance(given, Fitted) else None)
        return sensor

    @classmethod
    def made_of(cls) -> type:
        """The class of the sensor."""
        raise NotImplementedError


_LEFT_OUT: Any = None


def own_keys(made: type) -> type[OwnKeys]:
    """The section of a class: its fields, numbers as `Fitted`."""
    keys: dict[str, Any] = {}
    for field in _fields(made):
        required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        static = field.metadata.get("static", False)
        kind = Any if static else Fitted
        keys[field.name] = (kind, ...) if required else (kind | None, _LEFT_OUT)
    section = create_model(f"{made.__name__}Keys", __base__=OwnKeys, **keys)
    section.made_of = classmethod(lambda cls: made)  # type: ignore[method-assign]
    return section


def _fields(made: type) -> list[dataclasses.Field]:
    return [field for field in dataclasses.fields(made) if field.init]


def _is_numeric(found: Any) -> bool:
    return hasattr(found, "shape") and hasattr(found, "dtype") and np.issubdtype(found.dtype, np.floating)


def _add(leaves: "LeafList", name: str, key: str, values: np.ndarray, given: Fitted | None) -> None:
    """One leaf an entry: `.x .y .z` of three, else their numbers from 0."""
    if values.shape == (3,):
        suffixes = [".x", ".y", ".z"]
    else:
        suffixes = ["".join(f".{k}" for k in index) for index in np.ndindex(values.shape)]
    flat = Fitted(value=values.tolist() if values.ndim else float(values))
    if given is not None:
        sigma = given.sigma
        if sigma is not None and np.ndim(sigma):
            sigma = tuple(np.broadcast_to(np.asarray(sigma), values.shape).reshape(-1).tolist())
        flat = given.model_copy(update={"sigma": sigma})
    size = float(np.max(np.abs(values), initial=0.0))
    leaves.add(f"{name}.{key}", f"sensors.{name}.{key}", flat, suffixes, loose=0.3 * size or 1.0)
