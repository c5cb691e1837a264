"""Files among the options of a scenario: a path with a digest of its content, so that a sweep stays one sweep."""

import hashlib
import re
import tomllib
from pathlib import Path

from jaxsat.errors import InputError

_PINNED = re.compile(r"(?P<path>.+)@(?P<digest>[0-9a-f]{16})", re.DOTALL)
_BESIDE = ("tle", "omm", "oem")
"""Keys of the section `orbit` that name a file beside a satellite file."""


def pinned(text: str, *, name: str) -> str:
    """`PATH@DIGEST` of an option `name` that is a path, or that itself; empty stays empty.

    Raises `InputError` where the file cannot be read, and where it no longer holds what the digest is of.
    """
    if not text:
        return text
    found = _PINNED.fullmatch(text)
    path = path_of(text)
    digest = _digest(path)
    if found is not None and found["digest"] != digest:
        raise InputError(f"has changed since the sweep with this --{name} began; take another --out", file=path)
    return f"{path}@{digest}"


def path_of(text: str) -> Path:
    """The file of a pinned option."""
    found = _PINNED.fullmatch(text)
    return Path(found["path"] if found else text)


def _digest(path: Path) -> str:
    content = _content(path)
    known = hashlib.sha256(content)
    for other in _files_beside(content):
        known.update(_content(path.parent / other))
    return known.hexdigest()[:16]


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None


def _files_beside(content: bytes) -> list[str]:
    """Orbit files that a satellite file names."""
    try:
        orbit = tomllib.loads(content.decode("utf-8")).get("orbit", {})
    except (UnicodeDecodeError, tomllib.TOMLDecodeError):
        return []
    named = [orbit.get(key) for key in _BESIDE] if isinstance(orbit, dict) else []
    return [name for name in named if isinstance(name, str)]
