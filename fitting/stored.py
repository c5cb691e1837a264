"""Traced programs kept on disk beside XLA's compiled ones.

XLA's own cache spares the compilation of a program that it has seen, but not the seconds that Python takes to trace
it. Here the traced program is kept too (`jax.export`), under a name that holds everything it depends on: this
package's sources, the versions, the platform, and the structure, shapes and static parts of the arguments.
"""

import dataclasses
import hashlib
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.export
import numpy as np

_compiler = ThreadPoolExecutor(2, thread_name_prefix="compile")


class Stored:
    """A function compiled for its arguments, whose traced program outlives the process.

    It does as `equinox.filter_jit`, which stands in where no cache directory is set: arrays are traced, other leaves
    are static. `like` returns any object with the structure of the result.
    """

    def __init__(self, function: Callable[..., Any], like: Callable[[], Any]):
        self._function, self._like = function, like
        self._plain = eqx.filter_jit(function)
        self._programs: dict[str, Future] = {}
        self._lock = threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        """The function's result."""
        directory = _directory()
        if directory is None:
            return self._plain(*arguments)
        program, leaves = self._program(directory, arguments)
        return jax.tree.unflatten(jax.tree.structure(self._like()), program.result()(*leaves))

    def compile(self, *arguments: Any) -> Future | None:
        """Traces for such arguments now and compiles in the background; without a directory, does nothing."""
        directory = _directory()
        return None if directory is None else self._program(directory, arguments)[0]

    def _program(self, directory: Path, arguments: tuple) -> tuple[Future, list]:
        dynamic, static = eqx.partition(arguments, lambda leaf: isinstance(leaf, jax.Array | np.ndarray))
        leaves, structure = jax.tree.flatten(dynamic)
        shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
        text = repr((self._function.__qualname__, _surroundings(), structure, jax.tree.leaves(static), shapes))
        name = f"{self._function.__name__}-{hashlib.sha256(text.encode()).hexdigest()[:32]}"
        with self._lock:
            self._start(name, directory, structure, static, leaves)
        return self._programs[name], leaves

    def _start(self, name: str, directory: Path, structure: Any, static: tuple, leaves: list) -> None:
        known = self._programs.get(name)
        if known is None or (known.done() and known.exception()):

            def flat(*leaves):
                result = self._function(*eqx.combine(jax.tree.unflatten(structure, leaves), static))
                return jax.tree.leaves(result)

            exported = _load(directory / f"{name}.stablehlo") or _trace(flat, leaves, directory / f"{name}.stablehlo")
            # Tracing and lowering hold Python's lock and gain nothing from a second thread; XLA releases it.
            self._programs[name] = _compiler.submit(jax.jit(exported.call).lower(*leaves).compile)


def hollow(module: type, **children: Any) -> Any:
    """An `equinox.Module` of a structure without its contents: `children` where they are given, else a leaf.

    What may be absent is absent unless it is among `children`.
    """
    instance = object.__new__(module)
    for field in dataclasses.fields(module):
        content = None if field.default is None else 0.0
        object.__setattr__(instance, field.name, children.get(field.name, content))
    return instance


def _directory() -> Path | None:
    directory = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    enabled = jax.config.jax_enable_compilation_cache  # pyright: ignore[reportAttributeAccessIssue]
    return Path(directory) if directory and enabled else None


def _load(path: Path) -> jax.export.Exported | None:
    try:
        return jax.export.deserialize(bytearray(path.read_bytes()))
    except FileNotFoundError:
        return None
    except Exception:  # A damaged file, whatever it does to the reader, costs a second's work and no more.
        return None


def _trace(flat: Callable, leaves: list, path: Path) -> jax.export.Exported:
    exported = jax.export.export(jax.jit(flat))(*leaves)
    unfinished = path.with_suffix(f".{os.getpid()}")
    try:
        unfinished.write_bytes(exported.serialize())
        unfinished.replace(path)
    except OSError:  # A full disk: the program is traced again next time.
        unfinished.unlink(missing_ok=True)
    return exported


@cache
def _surroundings() -> tuple[str, ...]:
    """Digest of the sources, versions and platform."""
    digest = hashlib.sha256()
    for package in ("jaxsat", "fitting"):
        for source in sorted(Path(str(files(package))).rglob("*.py")):
            digest.update(source.read_bytes())
    return (
        digest.hexdigest(),
        jax.__version__,
        eqx.__version__,
        version("optax"),
        jax.default_backend(),
        str(jax.dtypes.canonicalize_dtype(float)),
    )
