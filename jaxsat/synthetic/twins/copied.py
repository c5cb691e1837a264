"""The satellite file beside a simulated session, so that a fit finds there all that it names."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jaxsat.errors import InputError
from jaxsat.synthetic.twins.source import with_orbit
from jaxsat.synthetic.twins.twin import Twin
from jaxsat.telemetry.table.orbit import beside

_HEADER = re.compile(r"\s*\[\[?\s*([^\]]+?)\s*\]")
_ORBIT_KEY = re.compile(r"\s*orbit\s*[.=]")


def satellite_files(twin: Twin, name: str) -> dict[str, bytes]:
    """Returns content by file name: `NAME.sat.toml`, the orbit's file, modules of sensors of one's own.

    Only the table `[orbit]` of the satellite file changes, and only where it names a file. Raises `InputError` where
    it cannot be told apart from the rest.
    """
    satellite = twin.satellite
    text = satellite.path.read_text(encoding="utf-8")
    found = _modules(twin, tomllib.loads(text))
    settings = satellite.orbit
    if settings.columns is None:
        flown = satellite if twin.orbit is None else with_orbit(satellite, twin.orbit)
        kinds = {key: getattr(flown.orbit, key) for key in ("tle", "omm", "oem")}
        for kind, source in kinds.items():
            if isinstance(source, str):
                found[f"{name}.{kind}"] = beside(flown, source).read_bytes()
                text = _with_orbit_file(text, kind, f"{name}.{kind}", satellite.path)
    found[f"{name}.sat.toml"] = text.encode("utf-8")
    return found


def _with_orbit_file(text: str, kind: str, file: str, path: Path) -> str:
    """The text with another table `[orbit]`; all else stays to the letter, comments too."""
    before = tomllib.loads(text)
    if before["orbit"] == {kind: file}:
        return text
    kept, inside = [], False
    for line in text.splitlines():
        header = _HEADER.match(line)
        if header:
            inside = header[1].split(".")[0].strip("\"' ") == "orbit"
        if not (inside or _ORBIT_KEY.match(line)):
            kept.append(line)
    changed = "\n".join(kept).rstrip() + f'\n\n[orbit]\n{kind} = "{file}"\n'
    if _or_none(changed) != {**before, "orbit": {kind: file}}:
        raise InputError("write it as a table [orbit] of its own, so that a copy can name another file", file=path)
    return changed


def _or_none(text: str) -> dict[str, Any] | None:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return None


def _modules(twin: Twin, tables: Mapping[str, Any]) -> dict[str, bytes]:
    """Modules of `kind = "module:Class"` that lie beside the satellite file."""
    found = {}
    for name, table in tables.get("sensors", {}).items():
        place, colon, _ = table["kind"].partition(":")
        file = twin.satellite.path.parent / Path(*place.split(".")).with_suffix(".py")
        if colon and file.is_file():
            if "." in place:
                reason = "a module in a folder is not copied: put it beside the satellite file"
                raise InputError(reason, file=twin.satellite.path, field=f"sensors.{name}.kind")
            found[file.name] = file.read_bytes()
    return found
