"""Reading a small text file whole, whatever is really there: every way it can go wrong is one `InputError`."""

import re
import stat
import unicodedata
from pathlib import Path

from jaxsat.errors import InputError

REAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")
"""A plain decimal number: stricter than float(), which takes nan, inf, 1_0 and the digits of other scripts."""


def read_small_file(path: str | Path, *, limit_bytes: int, kind: str) -> bytes:
    """Returns the bytes of a regular file of at most `limit_bytes`; `kind` names the format in messages.

    The size is checked before anything is read, so that a huge or endless file is answered at once and without memory.
    Raises `InputError` for a missing, unreadable, empty, oversized or special file (directory, device, pipe) and for
    NUL bytes, which no text file holds (UTF-16 text and binary files do).
    """
    path = Path(path)
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise InputError(f"is a directory; expected a {kind} file", file=path)
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"is a device or a pipe; expected a regular {kind} file", file=path)
        if status.st_size > limit_bytes:
            raise InputError(_too_long(status.st_size, limit_bytes, kind), file=path)
        with path.open("rb") as stream:
            # One byte more than allowed: the file may have grown since its size was asked.
            data = stream.read(limit_bytes + 1)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"no such file; expected a {kind} file", file=path) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"cannot be read: {reason}", file=repr(str(path)) if "\0" in str(path) else path) from None
    if len(data) > limit_bytes:
        raise InputError(_too_long(len(data), limit_bytes, kind), file=path)
    if not data.strip():
        raise InputError(f"file is empty; expected a {kind} file", file=path)
    nul = data.find(b"\0")
    if nul >= 0:
        row = data.count(b"\n", 0, nul) + 1
        raise InputError(f"NUL byte: binary data or UTF-16; expected {kind} as plain text", file=path, row=row)
    return data


def hidden_character(text: str) -> str:
    """What a text holds that no line of text shows, as `character U+001B`; empty where all of it can be seen."""
    hidden = next((c for c in text if unicodedata.category(c)[0] == "C" or c in "\u2028\u2029"), "")
    return hidden and f"character U+{ord(hidden):04X}"


def _too_long(size: int, limit: int, kind: str) -> str:
    return f"file has {size / 2**20:.1f} MiB; a {kind} file has at most {limit / 2**20:g} MiB"
