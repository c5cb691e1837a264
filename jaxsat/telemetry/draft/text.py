"""The text of a drafted satellite file."""

from pathlib import Path

import numpy as np

from jaxsat.files.text_file import REAL
from jaxsat.telemetry.draft.columns import grouped
from jaxsat.telemetry.draft.guesses import Guess, guessed
from jaxsat.telemetry.draft.stamps import StampGuess, guessed_stamps
from jaxsat.telemetry.table.raw import RawTable, read_raw_table

_TITLES = {
    "magnetometer": "mag",
    "gyro": "gyro",
    "sun_vector": "sun",
    "photodiodes": "diodes",
    "panels": "cells",
    "star_tracker": "star",
}
_WORDS = ("nan", "null", "none", "n/a", "na", "-")


def drafted(path: str | Path) -> str:
    """Returns a satellite file for a table, with what nobody can guess marked CHANGE.

    Raises `InputError` where it is no table, or has no stamps.
    """
    table = read_raw_table(path)
    stamps = guessed_stamps(table)
    not_measured = _words(table)
    values = {name: found for name in table.columns if (found := _column(table, name, not_measured)) is not None}
    values.pop(stamps.column, None)
    groups = grouped(list(values))
    guesses = [guess for group in groups if (guess := guessed(group, np.stack([values[n] for n in group.columns], 1)))]
    used = {name for guess in guesses for name in guess.group.columns} | {stamps.column}
    parts = [_head(table), *_albedo(guesses), _orbit(guesses, table), _time(stamps), _rows(not_measured)]
    parts += _commands(guesses)
    names: list[str] = []
    for guess in guesses:
        if guess.kind in _TITLES:
            title = _TITLES[guess.kind]
            others = sum(name.startswith(title) for name in names)
            names.append(f"{title}{others + 1}" if others else title)
            parts.append(_sensor(names[-1], guess))
    left = [name for name in table.columns if name not in used]
    if left:
        parts.append("# Columns of which nothing is made: " + ", ".join(left) + "\n")
    if not names:
        parts.append("# No column looks like a sensor's: `jaxsat init` alone prints all kinds.\n")
    return "\n".join(parts)


def _column(table: RawTable, name: str, not_measured: list[str]) -> np.ndarray | None:
    """Numbers of a column, NaN where a cell is none; None where most are none."""
    cells = table.columns[name]
    if isinstance(cells, np.ndarray):
        return None if cells.dtype.kind == "M" else np.where(np.isfinite(cells), cells, np.nan)
    plain = [bool(REAL.fullmatch(cell)) for cell in cells]
    filled = sum(bool(cell) and cell not in not_measured for cell in cells)
    if not filled or sum(plain) < 0.9 * filled:
        return None
    return np.array([float(cell) if good else np.nan for cell, good in zip(cells, plain, strict=True)])


def _words(table: RawTable) -> list[str]:
    """Texts that stand for what is not measured, as they are written."""
    found: dict[str, None] = {}
    for cells in table.columns.values():
        if not isinstance(cells, np.ndarray):
            found |= dict.fromkeys(cell for cell in set(cells) if cell.lower() in _WORDS)
    return sorted(found)


def _head(table: RawTable) -> str:
    return f"""# Satellite file drafted from {table.path.name}: what its columns are was guessed, so look at each line.
# What nobody can guess says CHANGE. All keys: `jaxsat init`. Then: jaxsat check {table.path.name} --satellite THIS.toml

[body]
mass_kg = 1.0                  # CHANGE
size_m = [0.1, 0.1, 0.1]       # CHANGE: edges along the body axes
inertia_kg_m2 = {{value = [0.0017, 0.0017, 0.0017], sigma = 0.0002}}    # CHANGE: of a box, mass / 12 (y2 + z2), ...

[magnet]                       # a wide prior: a dipole that nobody mentions is found
dipole_A_m2 = {{value = [0.0, 0.0, 0.0], sigma = 1.0}}
"""


def _albedo(guesses: list[Guess]) -> list[str]:
    """Of the Earth, whose light cells see."""
    if not any(guess.kind in ("photodiodes", "panels") for guess in guesses):
        return []
    return ["[albedo]                       # of the Earth\ndiffuse = {value = 0.3, sigma = 0.2}\n"]


def _orbit(guesses: list[Guess], table: RawTable) -> str:
    for guess in guesses:
        if guess.kind == "positions":
            frame = "ecef" if "ecef" in guess.group.stem.lower() else "gcrf"
            keys = f"position = {_list(guess.group.columns)}\nunit = {_quoted(guess.unit)}\nframe = {_quoted(frame)}"
            return f"[orbit.columns]\n{keys}    # CHANGE: gcrf (also J2000), eci (true of date), ecef\n"
    beside = sorted(table.path.parent.glob(f"{table.path.stem}*.tle"))
    name = beside[0].name if beside else f"{table.path.stem}.tle"
    note = "" if beside else "    # CHANGE: element sets of these days, as from Space-Track or CelesTrak"
    return f"[orbit]\ntle = {_quoted(name)}{note}\n"


def _time(stamps: StampGuess) -> str:
    lines = ["[time]", f"column = {_quoted(stamps.column)}", f"form = {_quoted(stamps.form)}"]
    if stamps.form == "seconds":
        lines.append('epoch = "2021-01-01T00:00:00Z"    # CHANGE: UTC of zero')
    if stamps.unit != "s":
        lines.append(f"unit = {_quoted(stamps.unit)}")
    if stamps.zone_missing:
        lines.append('zone = "UTC"    # CHANGE where it is not: the stamps name no time zone')
    return "\n".join(lines) + "\n"


def _rows(not_measured: list[str]) -> str:
    lines = ["[rows]", 'keep = []    # conditions on columns, as "mode == 0"']
    if not_measured:
        lines.append(f"not_measured = {_list(not_measured)}")
    return "\n".join(lines) + "\n"


def _commands(guesses: list[Guess]) -> list[str]:
    found = []
    for guess in guesses:
        if guess.kind == "coils":
            for axis, column in zip("xyz", guess.group.columns, strict=True):
                found.append(
                    f'[[coils]]\naxis = "+{axis}"\narea_turns_m2 = 1.0    # CHANGE\ncolumn = {_quoted(column)}\n'
                    f"unit = {_quoted(guess.unit)}{_doubt(guess)}\n"
                )
    return found


def _sensor(name: str, guess: Guess) -> str:
    lines = [f"[sensors.{name}]", f"kind = {_quoted(guess.kind)}"]
    if guess.kind in ("magnetometer", "gyro", "sun_vector"):
        lines.append(
            'axes = ["+x", "+y", "+z"]    # body direction that each column reads; "unknown" where nobody knows'
        )
    if guess.kind == "magnetometer":
        if guess.unit_vector:
            lines.append("unit_vector = true    # only the direction is sent")
        lines += ['unit = "uT"', "bias = {value = [0.0, 0.0, 0.0], sigma = 2.0}"]
        lines += ["scale = {value = [1.0, 1.0, 1.0], sigma = 0.03}", "turn = {value = [0.0, 0.0, 0.0], sigma = 0.05}"]
    elif guess.kind == "gyro":
        lines += ['unit = "deg/s"', "bias = {value = [0.0, 0.0, 0.0], sigma = 0.5}"]
    elif guess.kind == "photodiodes":
        lines += _faces(guess)
        if guess.unit != "1":
            lines.append(f"unit = {_quoted(guess.unit)}")
        most = guess.largest if guess.largest > 0.0 else 1.0
        lines.append(
            f"gain = {{value = {most:.3g}, sigma = {0.2 * most:.2g}}}    # CHANGE: reading with the Sun on the axis"
        )
    elif guess.kind == "panels":
        lines += [*_faces(guess), f"unit = {_quoted(guess.unit)}"]
        most = guess.largest if guess.largest > 0.0 else 500.0
        lines.append(
            f"imax = {{value = {most:.3g}, sigma = {0.2 * most:.2g}}}    # CHANGE: current of one that faces the Sun"
        )
        lines += ["gain = {value = 1.0, sigma = 0.05}"]
    elif guess.kind == "star_tracker":
        lines.append('sense = "inertial_from_body"    # CHANGE where it is "body_from_inertial"; scalar first')
    lines += ["", f"[channels.{name}]", f"columns = {_list(guess.group.columns)}"]
    lines.append(f"unit = {_quoted(guess.unit)}{_doubt(guess)}")
    sigma = guess.sigma or 0.01
    lines.append(f"sigma = {_number(sigma)}    # by differences of neighbours, at most")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Two significant digits without an exponent where that is short."""
    return f"{float(f'{value:.2g}'):g}"


def _faces(guess: Guess) -> list[str]:
    if guess.group.faces:
        return [f"normals = {_list(guess.group.faces)}"]
    usual = ["+x", "-x", "+y", "-y", "+z", "-z"]
    names = [usual[k % 6] for k in range(len(guess.group.columns))]
    return [f"normals = {_list(names)}    # CHANGE: where each looks"]


def _doubt(guess: Guess) -> str:
    return "" if guess.sure else "    # CHANGE: neither name nor size says the unit"


def _list(words) -> str:
    return "[" + ", ".join(map(_quoted, words)) + "]"


def _quoted(word: str) -> str:
    return '"' + word.replace("\\", "\\\\").replace('"', '\\"') + '"'
