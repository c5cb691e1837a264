"""What `jaxsat fit --as` takes: one change of the data a text, `WORD:...`."""

import math
import re
from dataclasses import dataclass

FORMS = {
    "swapped": "swapped:A,B: what the table has in column B is read in place of A, and A for B (of more a cycle)",
    "axes": "axes:CHANNEL:+y-x+z: the body directions that its columns read",
    "without": "without:COLUMN: as if it were empty",
    "scaled": "scaled:CHANNEL:FACTOR: readings times the factor",
    "offset": "offset:CHANNEL:NUMBER: readings less a constant, in the channel's unit, light not below zero",
    "drifting": "drifting:CHANNEL:SHARE: readings divided by a line from 1 to 1 + SHARE over the session",
    "noise": "noise:CHANNEL:SIGMA: its noise, in the channel's unit",
    "late": "late:CHANNEL:SECONDS: its stamps are late by so much (of positions: `positions`)",
    "jump": "jump:TIME:SECONDS: stamps after the time are late by so much",
    "pace": "pace:SHARE: stamps run fast by this share of the time since the first",
    "dated": "dated:ISO: UTC of the first row",
    "frame": "frame:ecef: positions and velocities are in axes that turn with the Earth",
}
"""What each word takes."""
DIRECTION = re.compile(r"[+-][xyz]")


@dataclass(frozen=True)
class AsIf:
    """One change of the data, read from its text."""

    text: str
    word: str
    arguments: tuple[str, ...]

    @staticmethod
    def of(text: str) -> "AsIf":
        """Reads the text; raises ValueError where it is none of `FORMS`."""
        word, colon, rest = text.partition(":")
        if word not in FORMS or not colon:
            raise ValueError(f"expected one of {', '.join(FORMS)} with a colon behind it, got {text!r}")
        form = FORMS[word].partition(": ")[0]
        # Instants have colons of their own, and names of columns may.
        count = form.count(":")
        arguments: tuple[str, ...] = tuple(rest.rsplit(":", count - 1)) if word != "dated" else (rest,)
        if len(arguments) != count or not all(arguments):
            raise ValueError(f"expected {form}, got {text!r}")
        if word in ("scaled", "offset", "drifting", "noise", "late", "jump", "pace"):
            for number in arguments if word in ("jump", "pace") else arguments[1:]:
                _number(number, text, positive=word in ("scaled", "noise"))
        last = arguments[-1]
        if word == "axes" and len(DIRECTION.findall(last)) * 2 != len(last):
            raise ValueError(f"expected directions such as +y-x+z, got {last!r}")
        if word == "swapped" and len(set(arguments[0].split(","))) < max(arguments[0].count(",") + 1, 2):
            raise ValueError(f"expected two or more columns with commas between, got {arguments[0]!r}")
        if word == "frame" and last != "ecef":
            raise ValueError(f"expected frame:ecef, got {text!r}")
        if word in ("drifting", "pace") and float(last) <= -1.0:
            raise ValueError(f"expected a share above -1, got {last}")
        return AsIf(text, word, arguments)


def _number(text: str, whole: str, *, positive: bool) -> float:
    try:
        found = float(text)
    except ValueError:
        raise ValueError(f"expected a number for {text!r} in {whole!r}") from None
    if not math.isfinite(found) or (positive and found <= 0.0):
        raise ValueError(f"expected a {'positive' if positive else 'finite'} number, got {text!r} in {whole!r}")
    return found
