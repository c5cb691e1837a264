"""Where results go if nobody says: one name a command, which `.gitignore` knows by its pattern."""

from pathlib import Path


def default_folder(command: str) -> Path:
    """Returns the default of `--out` of a command."""
    return Path(f"jaxsat-{command}")
