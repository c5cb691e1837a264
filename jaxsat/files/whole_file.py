"""Files that are there whole or not at all, whenever their writer is killed."""

import os
import uuid
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from jaxsat.files.system import lock, sync_directory

_PART = ".part"
_EIO = 5


def write_whole(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Writes a file beside `path`, brings it to the disk and renames it; OSError with the path in it on failure."""
    try:
        while not _written(path, write):
            pass
        sync_directory(path.parent)
    except OSError as error:
        raise OSError(error.errno or _EIO, error.strerror or " ".join(str(error).split()), str(path)) from None


def _written(path: Path, write: Callable[[IO[bytes]], object]) -> bool:
    """Whether the file came to its place; not so where another process took the part for a leftover before its lock."""
    # By hand and not by tempfile, so that the user's mask says who may read it.
    part = path.parent / f".{path.name}.{uuid.uuid4().hex}{_PART}"
    try:
        with part.open("xb") as stream:
            held = lock(stream.fileno())
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
            if held:
                return _renamed(part, path)
        return _renamed(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _renamed(part: Path, path: Path) -> bool:
    try:
        part.replace(path)
    except FileNotFoundError:
        if not path.parent.is_dir():
            raise
        return False
    return True


def remove_leftovers(directory: Path, names: Collection[str]) -> int:
    """Removes what killed writers of the files called `names` left in a directory; returns how many there were."""
    removed = 0
    for part in directory.glob(f".*{_PART}"):
        name = part.name[1:].removesuffix(_PART).rpartition(".")[0]
        if name in names:
            # Somebody may have given it its name just now.
            with suppress(FileNotFoundError), part.open("rb+") as stream:
                if lock(stream.fileno(), wait=False):
                    part.unlink()
                    removed += 1
    return removed


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Only one process at a time is inside, where the file system knows locks."""
    with path.open("ab") as stream:
        lock(stream.fileno())
        yield
