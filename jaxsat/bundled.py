"""The synthetic sessions that come with the program, and how results call a session's file."""

from pathlib import Path

BUNDLED = Path(__file__).parent / "data" / "munin" / "b-specular50.RAW_SUN"
"""The session taken where no file is given. All sessions beside it are synthetic, and results say so."""

MUNIN_SATELLITE = Path(__file__).parent / "satellites" / "munin.sat.toml"
"""Satellite file of these sessions."""

CUBESAT = Path(__file__).parent / "satellites" / "3u.sat.toml"
"""The satellite of sweeps where no file is given: a made-up CubeSat of three units with torquers and wheels."""

PASSIVE = Path(__file__).parent / "satellites" / "1u-passive.sat.toml"
"""The same for a satellite that settles along the field: a made-up CubeSat of one unit with a magnet and rods."""


def told_names(path: Path) -> tuple[str, str]:
    """Returns the file as results name it, and a short name for titles; bundled ones with the word synthetic."""
    if path.resolve().parent == BUNDLED.resolve().parent:
        return f"{path.name} (bundled, synthetic)", f"{path.stem} (bundled, synthetic)"
    return str(path), path.stem
