"""A first guess from a file: attitude.csv of a fit or of `jaxsat local`, their directory, or a few lines of TOML."""

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from fitting.starts.guess import Guess
from fitting.starts.ladder import finite_turn_rates
from jaxsat.errors import InputError
from jaxsat.files.json_files import read_json
from jaxsat.files.text_file import REAL, read_small_file
from jaxsat.files.toml_files import LARGEST, read_toml, validated
from jaxsat.setting_types import Positive, Section, Vector
from jaxsat.time import Epoch

KIND = "first guess"
MAX_BYTES = 64 * 2**20
ATTITUDES, RUN = "attitude.csv", "fit.json"
NEIGHBOURS = 3.0
"""Times the usual spacing between two attitudes, beyond which their turn tells no rate."""
RATES = {"rate_{}_rad_s": 1.0, "rate_{}_deg_s": np.radians(1.0)}
"""Columns of rates, and what makes them rad/s."""
SIGMAS = ([f"attitude_sigma_{axis}_deg" for axis in "xyz"], ["sigma_deg"])


class GuessFile(Section):
    """An instant with attitude and rate."""

    utc: str | None = Field(default=None, description="UTC of it")
    t_s: float = Field(default=0.0, description="or seconds after the session's epoch")
    quaternion: Annotated[tuple[float, float, float, float], Field(strict=False)]
    rate_deg_s: Vector
    attitude_sigma_deg: Positive | None = None
    rate_sigma_deg_s: Positive | None = None
    parameters: dict[str, Any] = {}


def read_guess(path: Path) -> Guess:
    """Returns the guess of a file, or of a directory that holds attitude.csv, and may hold fit.json.

    Of `jaxsat local` the best attitude of each sample counts, solved ones where there are such, and rates are those of
    the turns between neighbours where the file has none. Raises `InputError`.
    """
    if path.is_dir():
        values = _numbers(path / RUN) if (path / RUN).exists() else {}
        return _of_table(path / ATTITUDES, values)
    return _of_toml(path) if path.suffix.lower() == ".toml" else _of_table(path, {})


def _of_toml(path: Path) -> Guess:
    found = validated(GuessFile, read_toml(path, kind=KIND), path)
    if not any(found.quaternion):
        raise InputError("expected a quaternion, not zeros", file=path, field="quaternion")
    turn, speed = found.attitude_sigma_deg, found.rate_sigma_deg_s
    return Guess(
        np.array([found.quaternion]),
        np.radians([found.rate_deg_s]),
        np.array([found.t_s]),
        None if found.utc is None else _instant(found.utc, path, None),
        None if turn is None else np.radians([turn]),
        None if speed is None else np.radians([speed]),
        dict(_flat(found.parameters, "", path)),
        str(path),
    )


def _flat(table: dict[str, Any], above: str, path: Path) -> Iterator[tuple[str, float]]:
    for name, value in table.items():
        own = f"{above}.{name}" if above else name
        if isinstance(value, dict):
            yield from _flat(value, own, path)
        elif isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputError(f"expected a number, found {value!r}", file=path, field=f"parameters.{own}")
        else:
            yield own, float(value)


def _numbers(path: Path) -> dict[str, float]:
    """What was free in a fit, in units of results."""
    found = read_json(path, limit_bytes=MAX_BYTES, kind="result of a fit").get("parameters")
    try:
        return {name: float(each["value"]) for name, each in dict(found or {}).items() if each["free"]}
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError("is no result of a fit: its parameters are out of order", file=path) from None


def _of_table(path: Path, values: dict[str, float]) -> Guess:
    rows = _rows(path)
    head = rows[0][1].keys()
    q_names = [f"q_{c}" for c in "wxyz"]
    missing = [name for name in ("utc", *q_names) if name not in head]
    if missing:
        raise InputError(f"has no column {missing[0]}; expected an attitude.csv of a fit or of jaxsat local", file=path)
    # Of several attitudes that explain a sample the first is the best.
    rows = [(line, row) for line, row in rows if any(row[q] for q in q_names) and row.get("solution", "1") == "1"]
    rows = [each for each in rows if each[1].get("status") == "solved"] or rows
    if not rows:
        raise InputError("holds no attitude", file=path)
    quaternion = _columns(rows, q_names, path)
    for k in np.flatnonzero(~np.isfinite(quaternion).all(axis=1))[:1]:
        raise InputError("expected four numbers of a quaternion, or none", file=path, row=rows[k][0], field="q_w")
    if not np.linalg.norm(quaternion, axis=1).all():
        raise InputError("expected quaternions, not zeros", file=path, field="q_w")
    epoch = _instant(rows[0][1]["utc"], path, rows[0][0])
    t = np.array([_instant(row["utc"], path, line).seconds_since(epoch) for line, row in rows])
    sigma = next((_columns(rows, names, path) for names in SIGMAS if names[0] in head), np.zeros((len(rows), 0)))
    known = np.isfinite(sigma).all() and sigma.size > 0
    turn = np.radians(np.sqrt((sigma**2).mean(axis=1))) if known else None
    for pattern, unit in RATES.items():
        names = [pattern.format(axis) for axis in "xyz"]
        if names[0] in head:
            rate, speed = unit * _columns(rows, names, path), None
            break
    else:
        rate, speed = _turns(t, quaternion, turn)
    good = np.isfinite(rate).all(axis=1)
    if not good.any():
        raise InputError("tells no rate: no attitude has a near neighbour, and there are no columns of it", file=path)
    turn, speed = (None if each is None else each[good] for each in (turn, speed))
    return Guess(quaternion[good], rate[good], t[good], epoch, turn, speed, values, str(path))


def _turns(t: np.ndarray, quaternion: np.ndarray, sigma: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """[times 3] body rates by the shorter turn to the next attitude, and their 1-sigma; NaN where it is far."""
    rate, step = np.full((len(t), 3), np.nan), np.diff(t)
    if len(t) > 1 and (step > 0.0).all():
        rate[:-1] = finite_turn_rates(t, quaternion)
        rate[:-1][step > NEIGHBOURS * np.median(step)] = np.nan
        step = np.append(step, step[-1])
    return rate, None if sigma is None or len(step) < len(t) else np.sqrt(2.0) * sigma / step


def _rows(path: Path) -> list[tuple[int, dict[str, str]]]:
    try:
        text = read_small_file(path, limit_bytes=MAX_BYTES, kind=KIND).decode("utf-8-sig")
        found = list(csv.reader(io.StringIO(text), strict=True))
    except (UnicodeDecodeError, csv.Error):
        raise InputError("is no CSV in UTF-8", file=path) from None
    head, *below = found or [[]]
    if not below:
        raise InputError("has no row below a header", file=path)
    for number, row in enumerate(below, 2):
        if row and len(row) != len(head):
            raise InputError(f"expected {len(head)} cells, found {len(row)}", file=path, row=number)
    return [(number, dict(zip(head, row, strict=True))) for number, row in enumerate(below, 2) if row]


def _columns(rows: Sequence[tuple[int, dict[str, str]]], names: Sequence[str], path: Path) -> np.ndarray:
    """[rows names] numbers, NaN where a cell is empty."""
    for line, row in rows:
        for name in names:
            text = row.get(name, "")
            if text and not (REAL.fullmatch(text) and abs(float(text)) <= LARGEST):
                raise InputError(f"expected a number, found {text[:40]!r}", file=path, row=line, field=name)
    return np.array([[float(row.get(name, "") or "nan") for name in names] for _, row in rows])


def _instant(text: str, path: Path, row: int | None) -> Epoch:
    try:
        return Epoch.from_iso(text)
    except ValueError as error:
        raise InputError(str(error), file=path, row=row, field="utc") from None
