"""Each kind of file read as the commands read it, and what is asked of whatever is taken for good.

`READERS` maps a kind to (ending of the file, share of all inputs, function of the path). A function returns what is
wrong with what was taken, empty where nothing is; bad input is an `InputError`.
"""

import shutil
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from experiments.attacks.sources import SATELLITE
from fitting.report.stored_run import read_run
from fitting.starts.guess_files import read_guess
from jaxsat.files.text_file import hidden_character
from jaxsat.files.toml_files import read_toml, validated
from jaxsat.given import Given
from jaxsat.satellites import read_satellite
from jaxsat.satellites.reading import read_numbers
from jaxsat.sweep import read_plan
from jaxsat.telemetry import read_aem, read_element_sets, read_oem
from jaxsat.telemetry.limb_angles import read_limb_angles
from jaxsat.telemetry.raw_sun.reading import read_raw_sun
from jaxsat.telemetry.table.reading import read_tables


def first(remarks: Iterable[tuple[bool, str]]) -> str:
    """The first thing that is wrong."""
    return next((text for wrong, text in remarks if wrong), "")


def elements(path: Path) -> str:
    """Sets whose motion is finite; two lines must say what was made of them, read by their columns alone."""
    sets, lines = read_element_sets(path), path.read_bytes().decode("utf-8-sig").split("\n")
    for one in sets:
        code, position, velocity = one.satellite.sgp4_tsince(0.0)
        wrong = first(
            (
                (code != 0 or not np.isfinite([*position, *velocity]).all(), "no finite motion"),
                (not 1960 <= int(one.epoch.iso(0)[:4]) <= 2200, "epoch out of range"),
                (bool(hidden_character(one.name)), "hidden character in a name"),
            )
        )
        if not wrong and one.row is not None and lines[one.row - 1].startswith("1 "):
            wrong = _two_lines(one.satellite, lines[one.row - 1], lines[one.row])
        if wrong:
            return wrong
    return ""


def _two_lines(satellite: Any, line_1: str, line_2: str) -> str:
    sign = -1.0 if line_1[53] == "-" else 1.0
    told = {
        "inclination": (np.degrees(satellite.inclo), line_2[8:16]),
        "node": (np.degrees(satellite.nodeo), line_2[17:25]),
        "eccentricity": (satellite.ecco, "." + line_2[26:33].strip().zfill(7)),
        "perigee": (np.degrees(satellite.argpo), line_2[34:42]),
        "anomaly": (np.degrees(satellite.mo), line_2[43:51]),
        "motion": (satellite.no_kozai * 1440.0 / (2.0 * np.pi), line_2[52:63]),
        "drag": (satellite.bstar, str(sign * float("." + line_1[54:59]) * 10.0 ** float(line_1[59:61]))),
        "day": (satellite.epochdays, line_1[20:32]),
    }
    for name, (found, text) in told.items():
        if not abs(found - float(text.strip())) <= 1e-9 * max(1.0, abs(found)):
            return f"another {name} than the line says"
    return ""


def _times(t: np.ndarray) -> tuple[bool, str]:
    return not (np.isfinite(t).all() and (np.diff(t) > 0.0).all()), "times not in order"


def oem(path: Path) -> str:
    """States that a spacecraft may have, in order."""
    found = read_oem(path)
    remarks = [(len({o.metadata["TIME_SYSTEM"] for o in found}) != 1, "several time systems")]
    for o in found:
        states = np.hstack([o.position_m, o.velocity_m_s])
        remarks += [_times(o.t_s), (not (np.abs(states) <= 1e15).all(), "states beyond reason")]
        remarks += [(bool(hidden_character(o.object_name + o.frame)), "hidden character")]
    return first(remarks)


def aem(path: Path) -> str:
    """Unit quaternions between two frames, in order."""
    remarks: list[tuple[bool, str]] = []
    for a in read_aem(path):
        rate = np.zeros(3) if a.angular_velocity_b is None else np.array(a.angular_velocity_b)
        lengths = np.linalg.norm(a.quaternion_a_from_b, axis=1)
        remarks += [_times(a.t_s), (not np.allclose(lengths, 1.0, atol=1e-9), "no unit quaternion")]
        remarks += [(not np.isfinite(rate).all(), "rate not finite"), (a.frame_a == a.frame_b, "one frame twice")]
    return first(remarks)


def raw_sun(path: Path) -> str:
    """Finite numbers."""
    found = vars(read_raw_sun(path))
    arrays = {k: v for k, v in found.items() if isinstance(v, np.ndarray) and v.dtype.kind == "f"}
    return first((not np.isfinite(v).all(), f"{name} not finite") for name, v in arrays.items())


def limb(path: Path) -> str:
    """Angles within their limits, or not measured."""
    found = vars(read_limb_angles(path))
    arrays = {k: v for k, v in found.items() if isinstance(v, np.ndarray) and v.dtype.kind == "f"}
    return first((bool((np.abs(v) > 1e9).any()), f"{name} beyond reason") for name, v in arrays.items())


@cache
def _satellite() -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sat.toml"
        path.write_text(SATELLITE)
        return read_satellite(path)


def table(path: Path) -> str:
    """Channels whose readings are in order."""
    session = read_tables(path, _satellite())
    return first(_times(channel.t_s) for channel in session.channels.values() if channel.t_s.size)


def satellite(path: Path) -> str:
    """A satellite whose inertia is one."""
    found = read_satellite(path)
    inertia = np.asarray(found.tables.get("body", {}).get("size_m", [1.0]), float)
    return first([(not np.isfinite(inertia).all(), "size not finite")])


def numbers(path: Path) -> str:
    """Munin's numbers with others in their place."""
    return first([(not abs(read_numbers(path).spacecraft.imax_mA) <= 1e30, "current beyond reason")])


def given(path: Path) -> str:
    """What is given of orbit, Earth and Sun."""
    found = validated(Given, read_toml(path, kind="configuration"), path)
    known = found.orbit.elements(4e14) or {}
    return first(
        [
            (not np.isfinite(list(known.values())).all(), "elements not finite"),
            (not 0.0 < found.earth.radius_km <= 1e6, "an Earth beyond reason"),
            (not abs(found.time.zero_s) <= 1e9, "a time beyond reason"),
        ]
    )


def guess(path: Path) -> str:
    """Attitudes, rates and numbers that are finite."""
    found = read_guess(path)
    arrays = {name: v for name, v in vars(found).items() if isinstance(v, np.ndarray)}
    beyond = [(not (np.abs(v) <= 1e30).all(), f"{name} beyond reason") for name, v in arrays.items()]
    return first([*beyond, (not np.isfinite(list(found.values.values())).all(), "a number not finite")])


def plan(path: Path) -> str:
    """The plan of a sweep that can be run."""
    path.replace(path.with_name("sweep.json"))
    found = read_plan(path.parent)
    if found is None:
        return "no plan"
    return first([(not (found.chunks >= 1 and found.rows(0) >= 1 and 0 <= found.seed < 2**32), "cannot be run")])


def view_of(name: str, run: Path) -> Callable[[Path], str]:
    """Reads a run of which one file is damaged."""

    def view(path: Path) -> str:
        folder = path.parent / "run"
        if not folder.exists():
            shutil.copytree(run, folder)
        path.replace(folder / name)
        try:
            page = read_run(folder).page
            return first([("\x1b" in page or "\0" in page, "hidden character in the page")])
        finally:
            shutil.copyfile(run / name, folder / name)

    return view


def readers(run: Path) -> dict[str, tuple[str, float, Callable[[Path], str]]]:
    """All of them; `run` is a fit's directory."""
    found: dict[str, tuple[str, float, Callable[[Path], str]]] = {
        "tle": (".tle", 0.18, elements),
        **{f"omm {form}": (".omm", 0.08, elements) for form in ("kvn", "xml", "json", "csv")},
        "oem": (".oem", 0.10, oem),
        "aem": (".aem", 0.08, aem),
        "raw_sun": (".RAW_SUN", 0.06, raw_sun),
        "limb": (".csv", 0.04, limb),
        "table": (".csv", 0.06, table),
        "satellite": (".toml", 0.03, satellite),
        "numbers": (".toml", 0.02, numbers),
        "given": (".toml", 0.06, given),
        "plan": (".json", 0.06, plan),
        "guess": (".csv", 0.01, guess),
        "guess toml": (".toml", 0.01, guess),
    }
    for name, share in (("fit.json", 0.004), ("provenance.json", 0.004), ("scene.json", 0.002)):
        found[f"view {name}"] = (".json", share, view_of(name, run))
    for name in ("attitude.csv", "channel-cells.csv"):
        found[f"view {name}"] = (".csv", 0.002, view_of(name, run))
    return found
