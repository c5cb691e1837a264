"""The one error that a user's input can cause, worded as a single line."""

from pathlib import Path

_LONGEST, _LONGEST_NAME = 1000, 200


def _shown(text: str) -> str:
    """One line that any terminal can show: names of files and what they hold may have anything in them."""
    text = text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


class InputError(ValueError):
    """Bad input: says which file, row and field, what was found and what was expected.

    `str(error)` is one line of the form `FILE:ROW: FIELD: REASON`; parts that do not apply are left out.
    The command line prints it on stderr and exits with status 1.
    """

    def __init__(
        self, reason: str, *, file: str | Path | None = None, row: int | None = None, field: str | None = None
    ):
        place = "" if file is None else str(file)
        if row is not None:
            place += f":{row}"
        name = field if field is None or len(field) <= _LONGEST_NAME else field[: _LONGEST_NAME - 3] + "..."
        parts = [part for part in (place, name, " ".join(reason.split())) if part]
        super().__init__(_shown(": ".join(parts)))
        self.reason, self.file, self.row, self.field = reason, file, row, field
