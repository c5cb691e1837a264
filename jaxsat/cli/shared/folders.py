"""Where a command writes when nobody says where: `jaxsat-COMMAND` in the working directory, which git ignores."""

from pathlib import Path

PREFIX = "jaxsat-"


def default_folder(command: str) -> Path:
    """Default output folder of a command."""
    return Path(f"{PREFIX}{command}")
