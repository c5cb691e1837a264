"""`jaxsat check`: what it finds in tables made by hand with one thing wrong at a time, and what it refuses."""

import json
import re

import numpy as np
import pytest
from a_pass import EPOCH, FIELD, SUN_ECI, TLE, T
from scipy.spatial.transform import Rotation

from jaxsat.cli.main import run

SATELLITE = f"""
[body]
inertia_kg_m2 = [1e-3, 1e-3, 1e-3]
[orbit]
tle = ["{TLE[0]}", "{TLE[1]}"]
[time]
column = "utc"
[sensors.mag]
kind = "magnetometer"
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100
"""
SUN = """
[sensors.sv]
kind = "sun_vector"
[channels.sv]
columns = ["sx", "sy", "sz"]
unit = "1"
sigma = 0.01
"""
BODY = Rotation.from_rotvec(T[:, None] * np.radians([0.3, 0.4, -0.2]))
RNG = np.random.default_rng(1)
MEASURED = BODY.inv().apply(FIELD) + RNG.normal(scale=100.0, size=FIELD.shape)
SUN_SEEN = BODY.inv().apply(SUN_ECI) + RNG.normal(scale=0.01, size=FIELD.shape)


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


@pytest.fixture
def odd(tmp_path):
    """What is odd about columns, by `check.json`."""

    def check(columns: dict[str, np.ndarray], satellite: str = SATELLITE, t: np.ndarray = T) -> list[str]:
        stamps = [f"{each}Z" for each in EPOCH.iso_texts(t)]
        cells = (["" if np.isnan(each) else repr(float(each)) for each in values] for values in columns.values())
        rows = zip(stamps, *cells, strict=True)
        text = ",".join(["utc", *columns]) + "\n" + "".join(",".join(row) + "\n" for row in rows)
        (tmp_path / "pass.csv").write_text(text)
        (tmp_path / "sat.toml").write_text(satellite)
        assert run(["check", "pass.csv", "--satellite", "sat.toml", "--out", "out"]) == 0
        document = json.loads((tmp_path / "out" / "check.json").read_text())
        assert document["schema"] == "jaxsat.check/1" and document["readings"]["mag"] == len(t)
        return document["odd"]

    return check


def mag(values=MEASURED):
    return dict(zip(["bx", "by", "bz"], values.T, strict=True))


def test_nothing_is_odd_about_a_good_table(odd, capsys):
    assert odd(mag()) == []
    printed = capsys.readouterr().out
    assert "nothing odd" in printed and "results in out" in printed
    ratio = re.search(r"\|B\| over that of IGRF ([0-9.]+) in the middle", printed)
    assert ratio and abs(float(ratio[1]) - 1.0) < 0.005


@pytest.mark.parametrize(
    ("columns", "satellite", "said"),
    [
        (mag(1e-3 * MEASURED), SATELLITE, "mag: .*is the unit 'nT' right\\?; as uT it would fit"),
        (mag(MEASURED + [0, 0, 30e3]), SATELLITE, "mag: .*not the field alone: a bias"),
        (
            mag(np.where(T[:, None] == 400, -99999.0, MEASURED)),
            SATELLITE,
            "mag: 1 reading far from the field.*t = 400 s",
        ),
        (mag(np.roll(MEASURED, 15, axis=0)[15:]), SATELLITE, "mag: .*fits IGRF better 300 s earlier"),
        (mag(MEASURED * [1, 0, 1] + [0, 7, 0]), SATELLITE, "mag: column by is 7 nT in all rows"),
    ],
)
def test_one_thing_wrong_with_the_field(odd, columns, satellite, said):
    t = T[-len(columns["bx"]) :]
    found = odd(columns, satellite, t)
    assert any(re.match(said, each) for each in found), found


def test_bias_and_scale_by_the_size_of_the_field(odd, tmp_path, capsys):
    # Columns read x, -z and y of a sensor with a bias and a scale.
    read = MEASURED * [1.04, 1.0, 0.97] + [2000.0, -1500.0, 800.0]
    axes = SATELLITE.replace('kind = "magnetometer"', 'kind = "magnetometer"\naxes = ["+x", "-z", "+y"]\nunit = "uT"')
    (said,) = odd(mag(read[:, [0, 2, 1]] * [1, -1, 1]), axes)
    assert said.endswith("; bias.x, bias.y, scale.x are further off than the file allows")
    findings = json.loads((tmp_path / "out" / "check.json").read_text())["findings"]
    (told,) = (each["numbers"] for each in findings if "bias_x_T" in each["numbers"])
    # 270 readings of 100 nT, along three unknowns each: 30 nT at 1 sigma.
    np.testing.assert_allclose([told[f"bias_{c}_T"] for c in "xyz"], [2e-6, -1.5e-6, 8e-7], atol=1e-7)
    np.testing.assert_allclose([told[f"scale_{c}"] for c in "xyz"], [1.04, 1.0, 0.97], atol=4e-3)
    assert told["misses_after_T"] == pytest.approx(1e-7, rel=0.15) and told["misses_before_T"] > 1e-6
    assert "for [sensors.mag]: bias = [2.0" in " ".join(capsys.readouterr().out.split())
    # What the file allows is not odd.
    wide = "bias = {value = [0, 0, 0], sigma = 1.0}\nscale = {value = [1, 1, 1], sigma = 0.05}\n"
    assert odd(mag(read[:, [0, 2, 1]] * [1, -1, 1]), axes.replace("[channels", f"{wide}[channels")) == []
    # A bias of several times the field looks like a wrong unit, and is told all the same.
    found = odd(mag(MEASURED + [0.0, 0.0, 2e5]))
    assert any(each.endswith("; bias.z is further off than the file allows") for each in found), found


def sun(values=SUN_SEEN):
    return dict(zip(["sx", "sy", "sz"], values.T, strict=True))


def test_the_angle_between_field_and_sun(odd, capsys):
    # The Sun is seen in the shadow too, which a sensor of the Sun cannot do.
    (only,) = odd(mag() | sun(), SATELLITE + SUN)
    assert re.match(r"sv: (\d+) of \1 readings in the computed shadow see light", only)
    assert "angle between field (mag) and Sun (sv) is off by 0." in " ".join(capsys.readouterr().out.split())
    found = odd(mag() | sun(SUN_SEEN * [1, 1, -1]), SATELLITE + SUN)
    # A sign of either: the angle cannot tell which.
    assert any(
        re.match("mag, sv: .*; 0.4 deg with --as axes:mag:[+]x[+]y-z or --as axes:sv:[+]x[+]y-z", each)
        for each in found
    )
    found = odd(mag() | sun(Rotation.from_rotvec([0.5, -0.4, 0.3]).apply(SUN_SEEN)), SATELLITE + SUN)
    assert any(re.match("mag, sv: .*: axes, a sign", each) for each in found)


def test_the_angle_is_known_between_two_readings_too(odd, capsys):
    every_third = np.where(np.arange(T.size)[:, None] % 3 == 0, SUN_SEEN, np.nan)
    odd(mag() | sun(every_third), SATELLITE + SUN)
    # 180 rows are lit, 60 of them with a reading of the Sun; between them it turns by less than 30 deg.
    found = re.search(
        r"\(sv\) is off by ([0-9.]+) deg in the middle of (\d+)", " ".join(capsys.readouterr().out.split())
    )
    assert found and float(found[1]) < 2.0 and int(found[2]) > 120


def test_a_star_tracker_whose_quaternions_turn_the_other_way(odd, capsys):
    star = (
        '[sensors.star]\nkind = "star_tracker"\n[channels.star]\ncolumns = ["q0", "q1", "q2", "q3"]\nunit = "1"\n'
        "sigma = 0.001\n"
    )

    def quaternions(attitude):
        return dict(zip(["q0", "q1", "q2", "q3"], attitude.as_quat(scalar_first=True).T, strict=True))

    assert odd(mag() | quaternions(BODY), SATELLITE + star) == []
    said = " ".join(capsys.readouterr().out.split())
    # 100 nT across 20 to 50 uT.
    off = re.search(r"the field \(mag\) is ([0-9.]+) deg from where the attitude \(star\) puts it", said)
    assert off and float(off[1]) < 0.5
    (only,) = odd(mag() | quaternions(BODY.inv()), SATELLITE + star)
    assert re.search(r"and 0\.\d with its quaternions the other way round", only)


def test_stamps(odd, capsys):
    t = 2.0 * np.arange(T.size) + np.arange(T.size) % 2
    said = "mag: stamps are multiples of 1 s and unevenly spaced: rounded? Then time.resolution_s = 1"
    assert said in odd(mag(), t=t)
    assert said not in odd(mag(), SATELLITE.replace("[time]", "[time]\nresolution_s = 1.0"), t=t)
    gap = T > 2000.0
    found = odd(mag(), t=T + 3000.0 * gap)
    assert any("1 gap of more than 5 times that, up to 3020 s, after t = 2000 s" in each for each in found)


def test_a_gyro_in_another_unit_and_a_spin_too_fast_for_the_spacing(odd):
    gyro = '[sensors.gyro]\nkind = "gyro"\n[channels.gyro]\ncolumns = ["gx", "gy", "gz"]\nunit = "rad/s"\nsigma = 0.1\n'
    rates = dict(zip(["gx", "gy", "gz"], np.tile([0.3, 10.0, 0.1], (T.size, 1)).T, strict=True))
    found = odd(mag() | rates, SATELLITE + gyro)
    assert any(re.match("gyro: rates of 573 deg/s .*is the unit 'rad/s' right", each) for each in found)
    assert any(re.match("mag: the satellite turns by 1.*deg between readings", each) for each in found)


GYRO = '[sensors.gyro]\nkind = "gyro"\n[channels.gyro]\ncolumns = ["gx", "gy", "gz"]\nunit = "deg/s"\nsigma = 0.01\n'


@pytest.mark.parametrize(
    ("rates", "said"),
    [
        ([0.3, 0.4, -0.2], None),
        ([0.3, -0.4, -0.2], "gyro: directions of mag do not turn as the rates.*--as axes:gyro:[+]x-y[+]z fits"),
        ([-0.2, 0.4, 0.3], "gyro: directions of mag do not turn as the rates.*--as axes:gyro:[+]z[+]y[+]x fits"),
        (np.radians([0.3, 0.4, -0.2]), "gyro: directions of mag turn [0-9.]+ times.*--as scaled:gyro:57.29578"),
    ],
)
def test_a_gyro_against_the_turn_of_the_field(odd, rates, said):
    # Six times as fast and as far between, so that the field's own way along the orbit is little of it.
    t = np.linspace(0.0, 200.0, 60)
    field = np.stack([np.interp(t, T, column) for column in FIELD.T], axis=1)
    turning = Rotation.from_rotvec(6.0 * t[:, None] * np.radians([0.3, 0.4, -0.2])).inv().apply(field)
    noise = RNG.normal(scale=1e-3, size=(60, 3))
    read = dict(zip(["gx", "gy", "gz"], (6.0 * np.array(rates) + noise).T, strict=True))
    found = [each for each in odd(mag(turning) | read, SATELLITE + GYRO, t) if "directions" in each]
    assert found == [] if said is None else re.match(said, found[0]), found


def test_stamps_that_jump_and_axes_that_are_left_handed(odd):
    found = odd(mag(), t=T + 13.0 * (T > 2000.0))
    assert any("by -7.0 s after 2000 s (--as jump:2000.0:-7.0)" in each for each in found), found
    mirrored = SATELLITE.replace('"magnetometer"', '"magnetometer"\naxes = ["+x", "+y", "-z"]')
    said = "mag: its axes in the satellite file are a left-handed set"
    assert any(each.startswith(said) for each in odd(mag(), mirrored))


def test_turns_by_directions_where_there_is_no_gyro(odd, capsys):
    assert odd(mag()) == []
    said = re.search(
        r"mag: its direction turns by ([0-9.]+) deg between readings", " ".join(capsys.readouterr().out.split())
    )
    # 0.54 deg/s for 20 s, seen from the field's side; the field itself turns by 1 to 2 deg in that time.
    assert said and 5.0 < float(said[1]) < 13.0
    fast = Rotation.from_rotvec(T[:, None] * np.radians([3.0, 4.0, -2.0])).inv().apply(FIELD)
    (only,) = odd(mag(fast))
    assert re.match("mag: its direction turns by [0-9.]+ deg between readings, .*: too far to tell", only)


def test_cells_against_the_shadow(odd):
    cells = (
        '[sensors.cells]\nkind = "panels"\nnormals = ["+x", "-x"]\nimax = 500\n[channels.cells]\n'
        'columns = ["i1", "i2"]\nunit = "mA"\nsigma = 5\n'
    )
    always = {"i1": 300.0 + 0.1 * np.arange(T.size), "i2": np.where(T == 600, -400.0, 0.01 * T)}
    found = odd(mag() | always, SATELLITE + cells)
    assert any(re.match(r"cells: \d+ of \d+ readings in the computed shadow see light: t = ", each) for each in found)
    assert any(re.match(r"cells: 1 reading below zero .*t = 600 s", each) for each in found)


def test_old_elements_unused_columns_and_rows_left_out(odd, capsys):
    old = SATELLITE.replace(TLE[0], TLE[0].replace("20326", "20320")[:68] + "7") + '[rows]\nkeep = ["abs(bx) < 1e9"]\n'
    columns = mag() | {"battery": np.ones(T.size)}
    found = odd(columns, old)
    assert any(
        re.match("orbit: element set of satellite 99001, 6.2 days old: a second or more", each) for each in found
    )
    assert "columns that the satellite file does not name: battery" in capsys.readouterr().out


def test_rows_that_are_left_out_are_listed(tmp_path, capsys):
    (tmp_path / "sat.toml").write_text(SATELLITE + '[rows]\nkeep = ["bx < 9"]\n')
    rows = "".join(f"2020-11-21T20:58:{k:02d}Z,{k},2,30000\n" for k in range(12))
    (tmp_path / "pass.csv").write_text("utc,bx,by,bz\n" + rows)
    assert run(["check", "pass.csv", "--satellite", "sat.toml"]) == 0
    assert "3 rows left out, not bx < 9: 11-13" in capsys.readouterr().out
    assert not (tmp_path / "check").exists()


@pytest.mark.parametrize(
    ("satellite", "table", "said"),
    [
        ("[spacecraft]\nimax_mA = 230.0\n", "utc\n2020-11-21T20:58:01Z\n", "no such column; there are utc"),
        (SATELLITE.replace("bx", "b1"), "utc,bx,by,bz\n2020-11-21T20:58:01Z,1,2,3\n", "pass.csv: b1: no such column"),
        (
            SATELLITE.replace("[sensors.mag]", "[sensor.mag]"),
            "",
            "sat.toml: sensor: unknown key; did you mean 'sensors'?",
        ),
        (SATELLITE, "utc,bx,by,bz\n2020-11-21T20:58:01Z,x,2,3\n", "pass.csv:2: bx: expected a plain finite decimal"),
    ],
)
def test_bad_input_is_one_line(tmp_path, capsys, satellite, table, said):
    (tmp_path / "sat.toml").write_text(satellite)
    (tmp_path / "pass.csv").write_text(table)
    assert run(["check", "pass.csv", "--satellite", "sat.toml", "--out", "out"]) == 1
    captured = capsys.readouterr()
    assert said in captured.err and captured.err.count("\n") == 1 and not (tmp_path / "out").exists()


def test_wrong_usage(capsys):
    assert run(["check", "pass.csv"]) == 2 and run(["check", "--satellite", "x.toml"]) == 2
