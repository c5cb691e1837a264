"""A directory of results appears whole or not at all."""

import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from jaxsat.errors import InputError
from jaxsat.files.publishing import finish_publishing, publish, refuse_folders
from jaxsat.files.system import lock


@contextmanager
def staged_directory(target: Path, owned: Sequence[str] = ()) -> Iterator[Path]:
    """Gives an empty directory to write into; its files become those of `target` when the block ends well.

    Files of `target` that have the same names are replaced; those named in `owned` and not written this time are
    removed, so that no result of an earlier run stands beside a new one; all others stay. If the block raises, `target`
    and its parents are as they were: nothing was written there. If the process is killed, the next one that comes here
    removes what it left. Raises `InputError` where `target` cannot be such a directory, or holds a folder under a name
    of `owned`, before the block is entered.
    """
    mask = _umask()
    made = _make_parents(target)
    try:
        real = _real_directory(target, owned)
        stage, handle = _make_stage(real, target)
        try:
            yield stage
            publish(stage, real, owned, mode=0o777 & ~mask)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
            if handle is not None:
                os.close(handle)
    except BaseException:
        for parent in reversed(made):
            with suppress(OSError):
                parent.rmdir()
        raise


def _make_parents(target: Path) -> list[Path]:
    """Creates the missing parents of `target` and returns them, outermost first."""
    missing = [parent for parent in target.absolute().parents if not parent.exists()][::-1]
    made: list[Path] = []
    try:
        for parent in missing:
            parent.mkdir()
            made.append(parent)
    except (OSError, ValueError) as error:
        for parent in reversed(made):
            parent.rmdir()
        raise InputError(f"cannot create this directory for the results: {_reason(error)}", file=target) from None
    return made


def _real_directory(target: Path, owned: Sequence[str]) -> Path:
    """The directory itself, also where `target` is a link to it."""
    try:
        # Links that lead round in a circle are a RuntimeError.
        real = target.resolve()
        if os.path.lexists(real) and not real.is_dir():
            raise InputError("is a file; expected a directory for the results", file=target)
        if real.is_dir() and not os.access(real, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
    except (OSError, RuntimeError) as error:
        raise InputError(f"cannot write results here: {_reason(error)}", file=target) from None
    refuse_folders(real, owned)
    return real


def _reason(error: Exception) -> str:
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)


def _make_stage(real: Path, target: Path) -> tuple[Path, int | None]:
    """An empty directory on the file system of `real`, and the handle that holds its lock."""
    # A rename stays on one file system, and a directory that is mounted is one by itself.
    inside = real.is_dir() and (real.stat().st_dev != real.parent.stat().st_dev or not os.access(real.parent, os.W_OK))
    home = real if inside else real.parent
    prefix = f".{real.name}.part-"
    try:
        _remove_stale(home, prefix, real)
        while True:
            stage = Path(tempfile.mkdtemp(prefix=prefix, dir=home))
            handle = _held(stage, wait=True)
            if stage.exists():
                return stage, handle
            # Another process took it for a leftover, before its lock.
            if handle is not None:
                os.close(handle)
    except OSError as error:
        raise InputError(f"cannot write results here: {_reason(error)}", file=target) from None


def _held(directory: Path, *, wait: bool) -> int | None:
    """A handle that holds the lock of a directory; None where it was not got."""
    try:
        handle = os.open(directory, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return None
    if lock(handle, wait=wait):
        return handle
    os.close(handle)
    return None


def _remove_stale(home: Path, prefix: str, real: Path) -> None:
    """Removes the stages of killed processes; one that was half moved is moved to its end before."""
    pattern = re.compile(re.escape(prefix) + "[a-z0-9_]{8}")
    for name in [entry.name for entry in os.scandir(home) if pattern.fullmatch(entry.name)]:
        stage = home / name
        handle = _held(stage, wait=False)
        if handle is None:
            continue
        try:
            if os.fstat(handle).st_uid == os.geteuid():
                finish_publishing(stage, real)
                shutil.rmtree(stage, ignore_errors=True)
        finally:
            os.close(handle)


@cache
def _umask() -> int:
    # It can only be read by changing it, which must not happen while another thread makes a directory.
    mask = os.umask(0)
    os.umask(mask)
    return mask
