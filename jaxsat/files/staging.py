"""A directory of results appears whole or not at all."""

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from jaxsat.errors import InputError


@contextmanager
def staged_directory(target: Path, owned: Sequence[str] = ()) -> Iterator[Path]:
    """Gives an empty directory to write into; its files become those of `target` when the block ends well.

    Files of `target` that have the same names are replaced; those named in `owned` and not written this time are
    removed, so that no result of an earlier run stands beside a new one; all others stay. If the block raises, `target`
    and its parents are as they were: nothing was written there.
    Raises `InputError` where `target` cannot be such a directory, before the block is entered.
    """
    _umask()
    made = _make_parents(target)
    try:
        stage = _make_stage(target)
        try:
            yield stage
            _publish(stage, target, owned)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
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
    except OSError as error:
        for parent in reversed(made):
            parent.rmdir()
        raise InputError(f"cannot create this directory for the results: {error.strerror}", file=target) from None
    return made


def _make_stage(target: Path) -> Path:
    if target.exists() and not target.is_dir():
        raise InputError("is a file; expected a directory for the results", file=target)
    try:
        if target.is_dir() and not os.access(target, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
        # Beside the real directory, also where `target` is a link: a rename must stay on one file system.
        real = target.resolve()
        return Path(tempfile.mkdtemp(prefix=f".{real.name}.part-", dir=real.parent))
    except OSError as error:
        raise InputError(f"cannot write results here: {error.strerror}", file=target) from None


@cache
def _umask() -> int:
    # It can only be read by changing it, which must not happen while another thread makes a directory.
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _publish(stage: Path, target: Path, owned: Sequence[str]) -> None:
    """Moves the staged files to `target`; on any failure puts back what had been there."""
    # A directory of mkdtemp is private to the user; results follow the user's mask as any other new directory.
    stage.chmod(0o777 & ~_umask())
    if not target.exists():
        stage.rename(target)
        return
    files = sorted(entry.name for entry in stage.iterdir() if entry.is_file())
    replaced: list[tuple[Path, Path]] = []
    new: list[Path] = []
    with tempfile.TemporaryDirectory(prefix=".old-", dir=stage) as aside:
        try:
            for name in dict.fromkeys([*owned, *files]):
                place, kept = target / name, Path(aside) / name
                if place.exists() or place.is_symlink():
                    place.rename(kept)
                    replaced.append((kept, place))
            for name in files:
                (stage / name).rename(target / name)
                new.append(target / name)
        except BaseException as error:
            for place in new:
                place.unlink(missing_ok=True)
            for kept, place in replaced:
                kept.rename(place)
            if isinstance(error, OSError):
                raise InputError(f"cannot write results here: {error.strerror}", file=target) from None
            raise
