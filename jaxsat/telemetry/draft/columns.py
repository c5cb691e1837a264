"""Columns of a table in groups by their names: triples, faces, quaternions, numbered rows of cells."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Shape = Literal["triple", "faces", "quaternion", "numbered"]


@dataclass(frozen=True)
class Group:
    """Columns that belong together, in the order of their axes."""

    stem: str
    """What their names share."""
    columns: tuple[str, ...]
    shape: Shape
    faces: tuple[str, ...] = ()
    """Of `faces`: +x, -z and so on, one a column."""


_AXIS = re.compile(r"(.*?)([xyz])((?:[_ (\[].*)?)", re.IGNORECASE)
"""An axis at the end, or before a unit: bx, MagX, gyro_z_dps, bx (nT)."""
_FACE = re.compile(r"(.*?)(?:([xyz])([pm+-]|plus|minus|pos|neg)|([pm+-]|plus|minus|pos|neg)_?([xyz]))((?:_.*)?)", re.I)
_QUATERNION = re.compile(r"(.*?)(?:q|quat)_?([0-4wxyzs])((?:_.*)?)", re.IGNORECASE)
_NUMBERED = re.compile(r"(.*?[a-z_])([0-9]{1,2})((?:_[a-z].*)?)", re.IGNORECASE)
_ORDERS = ("wxyz", "sxyz", "0123", "1234")


def grouped(names: Sequence[str]) -> list[Group]:
    """Returns the groups of columns in the order of their first ones; what belongs to none is left out."""
    found: dict[str, Group] = {}
    left = list(names)
    for finder in (_quaternions, _faces, _triples, _numbered):
        for group in finder(left):
            found[group.columns[0]] = group
            left = [name for name in left if name not in group.columns]
    return sorted(found.values(), key=lambda group: min(names.index(name) for name in group.columns))


def _matches(pattern: re.Pattern, names: Sequence[str]) -> dict[str, re.Match]:
    return {name: match for name in names if (match := pattern.fullmatch(name))}


def _quaternions(names: Sequence[str]) -> list[Group]:
    members: dict[tuple[str, str], dict[str, str]] = {}
    for name, match in _matches(_QUATERNION, names).items():
        members.setdefault((match[1], match[3]), {})[match[2].lower()] = name
    found = []
    for (stem, tail), parts in members.items():
        order = next((order for order in _ORDERS if set(order) <= set(parts)), None)
        if order:
            found.append(Group(f"{stem}q{tail}", tuple(parts[each] for each in order), "quaternion"))
    return found


def _faces(names: Sequence[str]) -> list[Group]:
    members: dict[tuple[str, str], dict[str, str]] = {}
    for name, match in _matches(_FACE, names).items():
        axis, sign = (match[2] or match[5]).lower(), (match[3] or match[4]).lower()
        face = ("+" if sign[0] in "p+" else "-") + axis
        members.setdefault((match[1], match[6]), {})[face] = name
    # Fewer than three faces, or of one axis, may be anything: `map_x`.
    return [
        Group(stem + tail, tuple(faces.values()), "faces", tuple(faces))
        for (stem, tail), faces in members.items()
        if len(faces) >= 3 and len({face[1] for face in faces}) >= 2 and len({face[0] for face in faces}) == 2
    ]


def _triples(names: Sequence[str]) -> list[Group]:
    members: dict[tuple[str, str], dict[str, str]] = {}
    for name, match in _matches(_AXIS, names).items():
        members.setdefault((match[1].lower(), match[3].lower()), {})[match[2].lower()] = name
    return [
        Group(stem + tail, tuple(parts[axis] for axis in "xyz"), "triple")
        for (stem, tail), parts in members.items()
        if set(parts) == set("xyz")
    ]


def _numbered(names: Sequence[str]) -> list[Group]:
    members: dict[tuple[str, str], list[str]] = {}
    for name, match in _matches(_NUMBERED, names).items():
        members.setdefault((match[1], match[3]), []).append(name)
    return [Group(stem + tail, tuple(each), "numbered") for (stem, tail), each in members.items() if len(each) >= 3]
