"""A satellite file drafted from a table: what its columns are, guessed by their names and sizes."""

from jaxsat.telemetry.draft.text import drafted as drafted
