"""The one error that a user's input can cause, worded as a single line."""

from pathlib import Path


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
        parts = [part for part in (place, field, " ".join(reason.split())) if part]
        super().__init__(": ".join(parts))
        self.reason, self.file, self.row, self.field = reason, file, row, field
