"""The names under which results quote a satellite's numbers: those of the parts of its file, or the user's own."""

import difflib
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from jaxsat.satellites.model import Leaf
from jaxsat.satellites.sections.file import raise_all

_ENTRIES = ("x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz")


def with_names(leaves: Sequence[Leaf], names: Mapping[str, str], path: Path) -> tuple[Leaf, ...]:
    """The leaves under their new names, each with its part.

    `names` is by a leaf or what leaves begin with; of two that fit the longer one counts. Raises `InputError` with
    every name that is none of the satellite's, or that two leaves would have.
    """
    known = sorted({beginning for leaf in leaves for beginning in _beginnings(leaf.name)})
    wrong = []
    for old in names:
        if old not in known:
            close = difflib.get_close_matches(old, known, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            wrong.append((f"names.{old}", f"{old!r} is no number of this satellite{hint}"))
    new = [_renamed(leaf.name, names) for leaf in leaves]
    for name in sorted({name for name in new if new.count(name) > 1}):
        both = [leaf.name for leaf, each in zip(leaves, new, strict=True) if each == name]
        wrong.append(("names", f"{' and '.join(both)} would both be {name!r}"))
    if wrong:
        raise_all(wrong, path)
    of_parts: dict[str, list[str]] = {}
    for leaf, name in zip(leaves, new, strict=True):
        of_parts.setdefault(_part(leaf), []).append(name)
    parts = [_part_name(_part(leaf), of_parts[_part(leaf)]) for leaf in leaves]
    return tuple(replace(leaf, name=name, part=part) for leaf, name, part in zip(leaves, new, parts, strict=True))


def _beginnings(name: str) -> list[str]:
    """The name and what it begins with, the longest first."""
    words = name.split(".")
    return [".".join(words[:count]) for count in range(len(words), 0, -1)]


def _renamed(name: str, names: Mapping[str, str]) -> str:
    for beginning in _beginnings(name):
        if beginning in names:
            return names[beginning] + name.removeprefix(beginning)
    return name


def _part(leaf: Leaf) -> str:
    """By the file's own names: `mag.bias` of `mag.bias.x`, `inertia` of `inertia.xx`."""
    words = leaf.name.split(".")
    whole = leaf.restates or (len(words) == 2 and words[1] in _ENTRIES)
    return ".".join(words[: 1 if whole else 2])


def _part_name(part: str, names: Sequence[str]) -> str:
    """The part by the names of its leaves: as it is, or else what they all begin with."""
    if all(part in _beginnings(name) for name in names):
        return part
    return ".".join(os.path.commonprefix([name.split(".") for name in names])) or part
