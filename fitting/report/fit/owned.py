"""The names of the files of a fit: known before it, so that a directory is looked at first."""

import re
from collections.abc import Iterable
from pathlib import Path

FILES = ("fit.json", "report.html", "provenance.json", "scene.json", "curves.json", "attitude.csv")
PICTURES = ("attitude.png", "field_angle.png", "orbit.png", "parameters.png", "worth.png")
OLD = ("currents.csv", "currents.png")
"""What fits of earlier versions wrote."""


def owned_files(directory: Path, channels: Iterable[str]) -> list[str]:
    """All names that a fit with such channels may write, and those that earlier fits have left in the directory."""
    own = [f"{stem}.{ending}" for stem in file_stems(channels).values() for ending in ("csv", "png")]
    patterns = ("channel-*.csv", "channel-*.png", "profile-*.png")
    left = [path.name for pattern in patterns for path in sorted(directory.glob(pattern))]
    return list(dict.fromkeys([*FILES, *PICTURES, *OLD, *own, *left]))


def file_stems(names: Iterable[str]) -> dict[str, str]:
    """Names of files without their endings by channel: any name may stand in a satellite file, not all in a folder."""
    found: dict[str, str] = {}
    for name in names:
        stem = f"channel-{re.sub(r'[^A-Za-z0-9_+-]', '_', name)}"
        while stem in found.values():
            stem += "_"
        found[name] = stem
    return found
