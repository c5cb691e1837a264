"""`jaxsat init`: the template reads back, and so does what is drafted from tables of several kinds."""

import re
from pathlib import Path

import numpy as np
import pytest

from jaxsat.cli.main import run
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.satellites.template import TEMPLATE
from jaxsat.sensors import Gyroscope, Magnetometer, Panels, Photodiodes, StarTracker, SunVector
from jaxsat.telemetry import TableSession, read_telemetry
from jaxsat.time import Epoch


@pytest.fixture
def drafted(tmp_path: Path, capsys):
    """The text that is drafted from a table, the satellite that it makes, and the table read by it."""

    def draft(text: str) -> tuple[str, Satellite, TableSession]:
        table = tmp_path / "pass.csv"
        table.write_text(text)
        assert run(["init", str(table)]) == 0
        printed = capsys.readouterr().out
        (tmp_path / "sat.toml").write_text(printed)
        satellite = read_satellite(tmp_path / "sat.toml")
        assert isinstance(satellite, Satellite)
        return printed, satellite, read_telemetry(table, satellite)

    return draft


def table_of(columns: dict[str, np.ndarray], stamps: list[str], name: str = "utc") -> str:
    rows = zip(stamps, *([f"{x:.8g}" for x in values] for values in columns.values()), strict=True)
    return ",".join([name, *columns]) + "\n" + "".join(",".join(row) + "\n" for row in rows)


RNG = np.random.default_rng(3)
N = 60
T = 2.0 * np.arange(N)
ISO = [f"{each}Z" for each in Epoch.from_iso("2021-05-01T00:00:00Z").iso_texts(T)]
TURN = np.stack([np.cos(0.02 * T), np.sin(0.02 * T), 0.3 * np.ones(N)]) / np.sqrt(1.09)


def noisy(values, sigma):
    return values + RNG.normal(scale=sigma, size=np.shape(values))


def test_the_template_reads_back(capsys, tmp_path):
    assert run(["init"]) == 0
    printed = capsys.readouterr().out
    assert printed == TEMPLATE.read_text()
    assert isinstance(read_satellite(TEMPLATE), Satellite)


def test_what_the_template_comments_out_is_right_too(tmp_path):
    text = TEMPLATE.read_text()
    kept = [re.sub(r"^# (?=\[|\w+ = )", "", line) for line in text.splitlines()]
    # Keys that stand beside others which they would contradict.
    others = (
        "omm =",
        "oem =",
        "elements =",
        "columns = {",
        'columns = ["qw"',
        "facets =",
        'unit = "ms"',
        "unit_vector =",
    )
    text = "\n".join(line for line in kept if not line.startswith((*others, "sense =", "scalar =", "frame =")))
    for name, columns in (("gyro", 3), ("sun", 5), ("cells", 6), ("star", 4), ("coarse", 2)):
        unit = {"gyro": "deg/s", "cells": "mA", "coarse": "deg"}.get(name, "1")
        names = ", ".join(f'"{name}{k}"' for k in range(columns))
        text += f'\n[channels.{name}]\ncolumns = [{names}]\nunit = "{unit}"\nsigma = 1.0\n'
    path = tmp_path / "all.toml"
    path.write_text(text)
    found = read_satellite(path)
    assert isinstance(found, Satellite)
    assert set(found.channels) == {"mag", "gyro", "sun", "cells", "star", "coarse"}
    assert found.model.spacecraft.hysteresis_rods is not None and len(found.model.spacecraft.parts) == 4


@pytest.mark.parametrize(("unit", "factor"), [("nT", 1e9), ("uT", 1e6), ("mG", 1e7), ("G", 1e4), ("T", 1.0)])
def test_a_magnetometer_by_name_and_size(drafted, unit, factor):
    field = noisy(3.5e-5 * TURN, 1e-7) * factor
    text, satellite, session = drafted(table_of(dict(zip(["Bx", "By", "Bz"], field, strict=True)), ISO))
    (name,) = session.channels
    mag = session.channels[name]
    assert isinstance(satellite.model.sensors[name], Magnetometer) and mag.unit == unit
    assert np.allclose(np.linalg.norm(mag.values, axis=1), 3.5e-5, rtol=0.02)
    assert 0.5e-7 < mag.sigma < 2e-7
    assert "mass_kg = 1.0                  # CHANGE" in text and "neither name nor size" not in text
    # A box is no body: what moves the satellite is free, or no fit is one.
    free = {leaf.name for leaf in satellite.leaves if leaf.sigma is not None}
    assert {"inertia.xx", "inertia.yz", "magnet.x"} <= free and "albedo.diffuse" not in free


def test_a_direction_alone_is_a_unit_vector(drafted):
    _, satellite, session = drafted(table_of(dict(zip(["mag_x", "mag_y", "mag_z"], TURN, strict=True)), ISO))
    assert satellite.model.sensors["mag"].unit_vector  # type: ignore[attr-defined]
    assert session.channels["mag"].unit == "1"


def test_many_sensors_in_one_table(drafted):
    columns = dict(zip(["gx_dps", "gy_dps", "gz_dps"], noisy(2.0 * TURN, 0.1), strict=True))
    columns |= dict(zip(["svx", "svy", "svz"], TURN, strict=True))
    columns |= dict(zip(["qw", "qx", "qy", "qz"], [*(0.5 * np.ones((3, N))), 0.5 * np.ones(N)], strict=True))
    panels = ["i_px", "i_mx", "i_py", "i_my", "i_pz", "i_mz"]
    columns |= dict(zip(panels, 400.0 * np.maximum(RNG.normal(size=(6, N)), 0), strict=True))
    columns |= {f"s{k}": RNG.uniform(size=N) for k in range(1, 6)}
    columns |= dict(zip(["coil_x_mA", "coil_y_mA", "coil_z_mA"], np.zeros((3, N)), strict=True))
    columns |= {"ax": np.ones(N), "ay": np.ones(N), "az": np.ones(N), "battery": 8.0 * np.ones(N)}
    text, satellite, session = drafted(table_of(columns, [f"{1619827200 + t:.2f}" for t in T], "time"))
    kinds = {name: type(sensor) for name, sensor in satellite.model.sensors.items()}
    assert kinds == {"gyro": Gyroscope, "sun": SunVector, "star": StarTracker, "cells": Panels, "diodes": Photodiodes}
    assert session.channels["gyro"].unit == "deg/s" and session.channels["star"].columns == ("qw", "qx", "qy", "qz")
    assert np.allclose(satellite.model.sensors["cells"].normals[:3], [[1, 0, 0], [-1, 0, 0], [0, 1, 0]])  # type: ignore[attr-defined]
    assert satellite.columns == dict.fromkeys(["coil_x_mA", "coil_y_mA", "coil_z_mA"], "mA")
    assert session.epoch.iso() == "2021-05-01T00:00:00.000"
    assert "Columns of which nothing is made: ax, ay, az, battery" in text
    assert "albedo.diffuse" in {leaf.name for leaf in satellite.leaves if leaf.sigma is not None}


@pytest.mark.parametrize(
    ("name", "stamps", "said"),
    [
        ("Date/Time", [each[:-1].replace("T", " ") for each in ISO], 'zone = "UTC"    # CHANGE'),
        ("t", [f"{each:g}" for each in T], 'epoch = "2021-01-01T00:00:00Z"    # CHANGE'),
        ("when", ISO, 'column = "when"\nform = "iso"'),
        ("timestamp", [f"{1000 * (1619827200 + t):.0f}" for t in T], 'form = "unix"\nunit = "ms"'),
    ],
)
def test_stamps_of_other_forms(drafted, name, stamps, said):
    text, _, session = drafted(table_of(dict(zip(["bx", "by", "bz"], 35000.0 * TURN, strict=True)), stamps, name))
    assert said in text and np.allclose(session.channels["mag"].t_s, T)


def test_positions_and_cells_that_hold_words(drafted):
    columns = dict(zip(["bx", "by", "bz"], 35000.0 * TURN, strict=True))
    columns |= dict(zip(["pos_x_km", "pos_y_km", "pos_z_km"], 6900.0 * TURN, strict=True))
    text = table_of(columns, ISO)
    first = text.splitlines()[1]
    text = text.replace(first, first.split(",")[0] + ",nan,nan,nan," + ",".join(first.split(",")[4:]))
    printed, satellite, session = drafted(text)
    assert 'not_measured = ["nan"]' in printed and session.channels["mag"].t_s.size == N - 1
    assert satellite.orbit.columns is not None and satellite.orbit.columns.unit == "km"
    assert session.positions is not None and np.allclose(np.linalg.norm(session.positions[1], axis=1), 6.9e6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "pass.csv: file is empty; expected a CSV or Parquet file"),
        ("a,b\n1\n", "pass.csv:2: expected 2 cells as in the header, found 1"),
        ("name,colour\none,red\n", "pass.csv: has no column of stamps that could be told"),
    ],
)
def test_what_is_no_table(tmp_path, capsys, text, said):
    (tmp_path / "pass.csv").write_text(text)
    assert run(["init", str(tmp_path / "pass.csv")]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and said in captured.err and captured.err.count("\n") == 1
