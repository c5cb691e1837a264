"""Traced programs kept on disk beside XLA's compiled ones.

XLA's own cache spares the compilation of a program that it has seen, but not the seconds that Python takes to trace
it. Here the traced program is kept too (`jax.export`), under a name that holds everything it depends on: this
package's sources, the versions, the platform, and the structure, shapes and static parts of the arguments.

A kept program knows arrays alone, so the object that its results belong in is pickled beside it, with nothing in the
places of its arrays. The directory is trusted as XLA's cache in it is: both run what they find there. What a disk or a
copy has damaged is not: a file begins with the digest of the rest.
"""

import hashlib
import logging
import os
import pickle
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.export
import numpy as np

from jaxsat.math.one_function import NO_LIBRARIES, REFUSED, in_one_function, whole_or_usual

R = TypeVar("R")
DIGEST_BYTES = 32
MANY_NUMBERS = 300_000
"""In the arguments of a program, as of a thousand samples of a few sensors: what it does is worth to be fast."""
_log = logging.getLogger(__name__)
_compiler = ThreadPoolExecutor(2, thread_name_prefix="compile")


Within = Callable[[Callable[..., Any]], Callable[..., Any]]
_within: ContextVar[Within] = ContextVar("within", default=lambda part: part)
"""What is made of the parts of a program that is traced."""


def part_of(function: Callable[..., R]) -> Callable[..., R]:
    """`function`, as one function of machine code in the programs that are compiled so (`in_parts`).

    For the loops of a motion and of its readings, whose small operations cost less than to hand them to XLA's threads.
    Two such parts take a third of the time to compile that one of both would take, and are compiled side by side.
    """
    return _within.get()(function)


@contextmanager
def in_parts(within: Within = in_one_function) -> Iterator[None]:
    """What is traced meanwhile has its parts made by `within`."""
    before = _within.set(within)
    try:
        yield
    finally:
        _within.reset(before)


class Stored:
    """A function compiled for its arguments, whose traced program outlives the process.

    It does as `equinox.filter_jit`, which stands in where no cache directory is set: arrays are traced, other leaves
    are static. Every leaf of the result is an array.
    """

    def __init__(self, function: Callable[..., Any], *, seldom: bool = False, quick: bool = False, parts: bool = False):
        """`seldom` says that it runs a few times only, so that a fast program is not worth the compiler's time; `quick`
        that for arguments of fewer than `MANY_NUMBERS` one a fifth slower is good enough, compiled in two thirds of it.

        Of a program with `parts` each of what it calls `part_of` is one function of machine code, where XLA can be told
        to.
        """
        self._function = function
        self._seldom, self._quick = seldom, quick
        self._parts = parts
        self._plain = whole_or_usual(self._within) if parts else eqx.filter_jit(function)
        self._programs: dict[str, tuple[Future, Any]] = {}
        self._lock = threading.Lock()

    def __call__(self, *arguments: Any) -> Any:
        """The function's result."""
        directory = _directory()
        if directory is None:
            return self._plain(*arguments)
        (program, structure), leaves = self._program(directory, arguments)
        return jax.tree.unflatten(structure, program.result()(*leaves))

    def _within(self, within: Within, *arguments: Any) -> Any:
        with in_parts(within):
            return self._function(*arguments)

    def compile(self, *arguments: Any) -> Future | None:
        """Traces for such arguments now and compiles in the background; without a directory, does nothing."""
        directory = _directory()
        return None if directory is None else self._program(directory, arguments)[0][0]

    def _program(self, directory: Path, arguments: tuple) -> tuple[tuple[Future, Any], list]:
        dynamic, static = eqx.partition(arguments, lambda leaf: isinstance(leaf, jax.Array | np.ndarray))
        leaves, structure = jax.tree.flatten(dynamic)
        shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
        how = self._parts and in_one_function(self._function) is not self._function
        text = repr((self._function.__qualname__, how, _surroundings(), structure, jax.tree.leaves(static), shapes))
        name = f"{self._function.__name__}-{hashlib.sha256(text.encode()).hexdigest()[:32]}"
        with self._lock:
            self._start(name, directory, structure, static, leaves)
        return self._programs[name], leaves

    def _start(self, name: str, directory: Path, structure: Any, static: tuple, leaves: list) -> None:
        known = self._programs.get(name)
        if known is None or (known[0].done() and known[0].exception()):

            def flat(*leaves):
                return self._function(*eqx.combine(jax.tree.unflatten(structure, leaves), static))

            path = directory / f"{name}.stablehlo"
            exported, empty = _load(path) or _trace(flat, leaves, path, self._parts)

            def usual():
                # Where XLA refuses one function: from then on the file holds the program as usual.
                return jax.jit(_trace(flat, leaves, path, False)[0].call).lower(*leaves)

            # Tracing and lowering hold Python's lock and gain nothing from a second thread; XLA releases it.
            lowered = jax.jit(exported.call).lower(*leaves)
            program = _compiler.submit(_compile, lowered, self._level(leaves), usual if self._parts else None)
            self._programs[name] = program, jax.tree.structure(empty)

    def _level(self, leaves: list) -> int | None:
        """Of XLA's optimisation; None for its own choice."""
        quick = self._quick and sum(np.size(leaf) for leaf in leaves) < MANY_NUMBERS
        return 0 if self._seldom else 1 if quick else None


def _directory() -> Path | None:
    directory = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    enabled = jax.config.jax_enable_compilation_cache  # pyright: ignore[reportAttributeAccessIssue]
    return Path(directory) if directory and enabled else None


def _load(path: Path) -> tuple[jax.export.Exported, Any] | None:
    """The program of a file and an empty object like its results."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, rest = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
    if hashlib.sha256(rest).digest() != digest:
        # A second's work and no more; one wrong bit could make another result.
        _log.warning("%s is damaged and is made anew", path)
        return None
    program, empty = pickle.loads(rest)
    return jax.export.deserialize(bytearray(program)), empty


def _trace(function: Callable, leaves: list, path: Path, parts: bool) -> tuple[jax.export.Exported, Any]:
    structure: Any = None

    def flat(*leaves):
        nonlocal structure
        found, structure = jax.tree.flatten(function(*leaves))
        return found

    with in_parts() if parts else nullcontext():
        exported = jax.export.export(jax.jit(flat))(*leaves)
    empty = jax.tree.unflatten(structure, [0.0] * structure.num_leaves)
    unfinished = path.with_suffix(f".{os.getpid()}")
    rest = pickle.dumps((bytes(exported.serialize()), empty))
    try:
        unfinished.write_bytes(hashlib.sha256(rest).digest() + rest)
        unfinished.replace(path)
    except OSError:  # A full disk: the program is traced again next time.
        unfinished.unlink(missing_ok=True)
    return exported, empty


def _compile(lowered: Any, level: int | None, usual: Callable[[], Any] | None) -> Any:
    """`lowered`, or what `usual` lowers where XLA refuses that."""
    try:
        return _compiled(lowered, level)
    except jax.errors.JaxRuntimeError as error:
        if usual is None or not any(words in str(error) for words in REFUSED):
            raise
        return _compiled(usual(), level)


def _compiled(lowered: Any, level: int | None) -> Any:
    if jax.default_backend() == "cpu":
        # XLA's older code generator for CPUs takes two thirds of the time, and makes programs as fast.
        options = {
            "xla_cpu_use_fusion_emitters": False,
            **NO_LIBRARIES,
            **({} if level is None else {"xla_backend_optimization_level": level}),
        }
        try:
            return lowered.compile(compiler_options=options)
        except Exception:  # An XLA that has not these options any more; any other failure comes again.
            pass
    return lowered.compile()


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
