"""`jaxsat local --satellite`: attitudes of a table whose field and Sun come from elsewhere; gaps, axes, refusals."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from a_pass import EPOCH, FIELD, SUN_ECI, TLE, T
from scipy.spatial.transform import Rotation

from jaxsat.cli.main import run

RATE = np.array([0.3, 0.4, -0.2])
BODY = Rotation.from_rotvec(T[:, None] * np.radians(RATE))
SATELLITE = f"""
[body]
inertia_kg_m2 = [1e-3, 1e-3, 1e-3]
[orbit]
tle = ["{TLE[0]}", "{TLE[1]}"]
[time]
column = "utc"
[sensors.mag]
kind = "magnetometer"
AXES
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100
[sensors.sv]
kind = "sun_vector"
[channels.sv]
columns = ["sx", "sy", "sz"]
unit = "1"
sigma = 0.01
"""
STAR = """
[sensors.star]
kind = "star_tracker"
[channels.star]
columns = ["q0", "q1", "q2", "q3"]
unit = "1"
sigma = 0.0005
"""
SHOWN = slice(0, 40)


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def columns(order=(0, 1, 2), signs=(1, 1, 1)) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    field = BODY.inv().apply(FIELD) + rng.normal(scale=100.0, size=FIELD.shape)
    sun = BODY.inv().apply(SUN_ECI) + rng.normal(scale=0.01, size=FIELD.shape)
    field = field[:, order] * signs
    return dict(zip(("bx", "by", "bz", "sx", "sy", "sz"), [*field.T, *sun.T], strict=True))


def written(table, satellite=SATELLITE, axes="", path="pass.csv"):
    stamps = EPOCH.iso_texts(T)[SHOWN]
    rows = zip(stamps, *(values[SHOWN] for values in table.values()), strict=True)
    lines = [",".join(["utc", *table]), *(",".join([f"{t}Z", *map(text, values)]) for t, *values in rows)]
    Path(path).write_text("\n".join(lines) + "\n")
    Path("sat.toml").write_text(satellite.replace("AXES", axes))


def text(value):
    return "" if np.isnan(value) else repr(float(value))


def solved(*more, files=("pass.csv",), status=0):
    assert run(["local", *files, "--satellite", "sat.toml", "--out", "out", *more]) == status
    with Path("out/attitude.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    return rows, json.loads(Path("out/local.json").read_text())


def off_deg(rows, chosen):
    q = np.array([[float(rows[k][f"q_{c}"]) for c in "wxyz"] for k in chosen])
    return np.degrees((Rotation.from_quat(q, scalar_first=True).inv() * BODY[chosen]).magnitude())


def test_attitudes_and_rates_of_two_tables(capsys):
    table = columns()
    for name in ("sx", "sy", "sz"):
        table[name][20:30] = np.nan
    for field, sun in (("bx", "sx"), ("by", "sy"), ("bz", "sz")):
        table[field][7] = 3e4 * table[sun][7]
    written({name: values for name, values in table.items() if name[0] == "b"}, path="field.csv")
    written({name: values for name, values in table.items() if name[0] == "s"}, path="sun.csv")
    rows, document = solved(files=("field.csv", "sun.csv"))
    assert document["telemetry"] == "field.csv, sun.csv" and document["sha256"].count(", ") == 1
    assert document["schema"] == "jaxsat.local/1" and document["method"] == "directions"
    assert document["status_counts"] == {"solved": 29, "inconsistent": 1, "unsolved": 10}
    assert document["reasons"]["only one direction is seen"] == 10
    assert rows[7]["status"] == "inconsistent" and rows[25]["q_w"] == "" and rows[25]["sigma_deg"] == ""
    assert rows[0]["seen"] == "mag sv" and rows[25]["seen"] == "mag"
    good = [k for k, row in enumerate(rows) if row["status"] == "solved"]
    off = off_deg(rows, good)
    # Sun of 0.6 deg an axis; the sigma has 3 deg of calibration in it, which is not wrong here.
    assert off.max() < 4.0 and np.all(off < 2.0 * np.array([float(rows[k]["sigma_deg"]) for k in good]))
    rates = np.array([[float(rows[k][f"rate_{c}_deg_s"]) for c in "xyz"] for k in good])
    np.testing.assert_allclose(np.median(rates, axis=0), RATE, atol=0.03)
    assert Path("out/attitude.png").read_bytes().startswith(b"\x89PNG")
    printed = capsys.readouterr().out
    assert "only one direction is seen" in printed and "rate by finite turns" in printed


def test_unknown_axes_are_ranked(capsys):
    # Column 1 reads -z, column 2 +x, column 3 -y.
    written(columns((2, 0, 1), (-1, 1, -1)), axes='axes = "unknown"')
    rows, document = solved("--no-plots")
    assert document["axes"][0]["axes"] == {"mag": ["-z", "+x", "-y"]}
    ranked = [each["mismatch_sigma"] for each in document["axes"]]
    assert len(ranked) == 24 and ranked == sorted(ranked) and ranked[1] > 3.0 * ranked[0]
    assert off_deg(rows, range(40)).max() < 4.0 and not Path("out/attitude.png").exists()
    assert "mag -z +x -y" in capsys.readouterr().out


def test_a_star_tracker_needs_no_other():
    q = BODY.as_quat(scalar_first=True)
    table = {"bx": np.full(T.size, np.nan), **dict(zip(("q0", "q1", "q2", "q3"), q.T, strict=True))}
    table["q0"][5] = np.nan
    written(table, SATELLITE.split("[sensors.mag]")[0] + STAR)
    rows, document = solved("--arc", "0", "300", "--no-plots")
    assert document["status_counts"] == {"solved": 15, "unsolved": 1}
    assert off_deg(rows, [0, 1, 2, 3, 4]).max() < 1e-4
    assert float(rows[0]["sigma_deg"]) == pytest.approx(np.degrees(0.0005), rel=1e-3)


def test_nothing_to_solve():
    table = columns()
    written({**table, **{name: np.full(T.size, np.nan) for name in ("sx", "sy", "sz")}})
    rows, document = solved("--no-plots", status=3)
    assert document["status_counts"] == {"unsolved": 40} and all(row["q_w"] == "" for row in rows)


@pytest.mark.parametrize(
    ("more", "status", "said"),
    [
        (["--albedo-max", "0.3"], 2, "--albedo-max cannot stand beside --satellite"),
        (["--arc", "9000", "9100"], 1, "no sample between 9000 and 9100 s"),
    ],
)
def test_refusals(more, status, said, capsys):
    written(columns())
    assert run(["local", "pass.csv", "--satellite", "sat.toml", *more]) == status
    assert said in " ".join(capsys.readouterr().err.replace("│", " ").split())


def test_directions_that_contradict_each_other_are_no_success():
    written(columns(signs=(-1, -1, -1)))
    _, document = solved("--no-plots", status=3)
    assert document["status_counts"]["inconsistent"] > 20


def test_tables_and_a_satellite_need_each_other(capsys):
    written(columns())
    assert run(["local", "--satellite", "sat.toml"]) == 2
    assert "needs at least one table" in capsys.readouterr().err
    assert run(["local", "pass.csv"]) == 1
    assert "pass.csv: a table needs a satellite file" in capsys.readouterr().err
    assert run(["local", "a.RAW_SUN", "b.RAW_SUN"]) == 2
    assert "one at a time" in capsys.readouterr().err
