"""The satellite file with all keys."""

from pathlib import Path

TEMPLATE = Path(__file__).parent / "template.toml"
