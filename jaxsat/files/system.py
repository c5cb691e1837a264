"""What the operating system does for files: locks, what is on the disk, two directories exchanged at one instant."""

import ctypes
import errno
import os
import sys
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows, whose unfinished files are then left to the user.
    fcntl = None

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2


def lock(handle: int, *, wait: bool = True) -> bool:
    """Whether the lock of an open file or directory was got; False also where there are no locks.

    The kernel gives it back when the process dies: what can be locked is a leftover.
    """
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def sync_directory(directory: Path) -> None:
    """Brings names given or taken in a directory to the disk, where the system can."""
    if os.name == "posix":
        _sync(directory)


def sync_files(directory: Path) -> None:
    """Brings the files of a directory, and their names, to the disk, where the system can."""
    if os.name == "posix":
        for entry in os.scandir(directory):
            if entry.is_file(follow_symlinks=False):
                _sync(entry.path)
        _sync(directory)


def _sync(path: str | Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def exchange(one: Path, other: Path) -> None:
    """Gives each of two directories the other's name, at one instant; OSError where the system cannot (Linux can)."""
    call = _renameat2()
    if call is None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS), str(other))
    if call(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number), str(other))


@cache
def _renameat2():
    if not sys.platform.startswith("linux"):
        return None
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if call is not None:
        call.argtypes = (ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_uint)
    return call


def stood_in(directory: Path) -> bool:
    """Whether a directory is the working one of this process, or of another as far as one may see."""
    own = directory.stat()
    places = [Path("."), *Path("/proc").glob("[0-9]*/cwd")]
    return any(_same(place, own) for place in places)


def _same(place: Path, own: os.stat_result) -> bool:
    try:
        return os.path.samestat(place.stat(), own)
    except OSError:
        return False
