"""`jaxsat almanac`: what it writes, the accuracy of the series, and what it refuses."""

import csv
import json
import math
from datetime import date

import pytest

from jaxsat.cli.main import run


@pytest.fixture(autouse=True)
def in_an_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def read():
    with open("out/almanac.json") as stream:
        return json.load(stream)


def test_one_instant_with_the_series_of_1994(capsys):
    assert run(["almanac", "2001-01-18T04:54:15", "--series", "1994", "--harmonics", "2", "--out", "out"]) == 0
    document = read()
    assert document["schema"] == "jaxsat.almanac/1" and len(document["instants"]) == 1
    now, errors = document["instants"][0], document["series"]["largest_error_deg"]
    assert now["sun_declination_deg"] == pytest.approx(-20.528, abs=0.005)
    apart = abs(now["series_sun_declination_deg"] - now["sun_declination_deg"])
    assert apart == pytest.approx(errors["sun_declination"], abs=1e-9)
    # Penkov et al. 2009, section 3.6: within 0.2 and 0.06 deg; two harmonics are what that says.
    assert 0.0 < errors["sun_right_ascension"] < 0.2 and 0.0 < errors["sun_declination"] < 0.2
    # The file's coefficients, summed by hand, give the very series.
    series, days = document["series"], (date(2001, 1, 18) - date(1994, 1, 1)).days + (4 * 3600 + 54 * 60 + 15) / 86400
    phase = math.radians(360.0 * days / series["year_days"])

    def summed(c):
        return c[0] + sum(c[2 * k - 1] * math.cos(k * phase) + c[2 * k] * math.sin(k * phase) for k in (1, 2))

    ascension = math.degrees(phase) + summed(series["sun_right_ascension_deg"])
    assert ascension % 360.0 == pytest.approx(now["series_sun_right_ascension_deg"], abs=1e-8)
    assert summed(series["sun_declination_deg"]) == pytest.approx(now["series_sun_declination_deg"], abs=1e-9)
    with open("out/series.csv") as stream:
        head, *rows = csv.reader(stream)
    assert head[0] == "harmonic" and [row[0] for row in rows] == ["0", "1", "2"]
    own = [float(row[3 + j]) for row in rows for j in range(2)]
    assert own[:1] + own[2:] == pytest.approx(series["sun_declination_deg"], rel=1e-10) and own[1] == 0.0
    printed = capsys.readouterr().out
    assert "300.26" in printed and max(map(len, printed.splitlines())) <= 80


def test_a_range_counts_both_ends():
    assert run(["almanac", "2001-01-18", "--until", "2001-01-19", "--step", "3600", "--out", "out"]) == 0
    assert [read()["instants"][k]["utc"] for k in (0, -1)] == ["2001-01-18T00:00:00.000", "2001-01-19T00:00:00.000"]
    with open("out/almanac.csv") as stream:
        assert len(stream.readlines()) == 26


@pytest.mark.parametrize(
    ("arguments", "status", "expected"),
    [
        (["2001-13-01"], 1, "DATE: 2001-13-01T00:00:00: month must be in 1..12"),
        (["18.01.2001"], 1, "DATE: expected a UTC instant"),
        (["2001-01-18", "--until", "2001-01-17"], 1, "--until: expected an instant after"),
        (["2001-01-18", "--until", "2002-01-18", "--step", "1"], 1, "at most 100000"),
        (["2001-01-18", "--step", "nan"], 2, "positive number"),
        (["2001-01-18", "--series", "1994.5"], 2, "whole number"),
    ],
)
def test_bad_input_is_one_line(arguments, status, expected, capsys):
    assert run(["almanac", *arguments]) == status
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1
