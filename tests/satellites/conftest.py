"""Files written by the tests."""

from pathlib import Path

import pytest


@pytest.fixture
def file(tmp_path):
    """Writes a satellite file and gives its path."""

    def write(text: str, name: str = "sat.toml") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write
