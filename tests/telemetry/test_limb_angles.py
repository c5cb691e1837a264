"""Limb angle files: what is read, what is refused with one clear line, and which sample a row belongs to."""

import dataclasses
import hashlib

import numpy as np
import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.errors import InputError
from jaxsat.telemetry import clean, match_limb_angles, read_limb_angles, read_raw_sun

HEADER = "utc,distance_deg,turn_deg"
GOOD = "2001-01-18T04:54:15.000,35.25,-120"


@pytest.fixture(scope="module")
def session():
    return clean(read_raw_sun(BUNDLED.with_name("a-nominal-exact.RAW_SUN")))


def write(tmp_path, *rows, header=HEADER, end="\n"):
    path = tmp_path / "limb.csv"
    path.write_bytes(end.join([header, *rows, ""]).encode())
    return path


def test_rows_are_read_as_they_stand(tmp_path):
    rows = [GOOD, "", "2001-01-18T04:55:19Z, 1e1 ,", "2001-01-18T04:53:11.5,,.5", "2001-01-18T04:59:00,,"]
    path = write(tmp_path, *rows, end="\r\n")
    found = read_limb_angles(path)
    np.testing.assert_array_equal(found.distance_deg, [35.25, 10.0, np.nan])
    np.testing.assert_array_equal(found.turn_deg, [-120.0, np.nan, 0.5])
    # The last row measures nothing.
    assert found.row.tolist() == [2, 4, 5]
    assert [time.iso(1)[11:] for time in found.time] == ["04:54:15.0", "04:55:19.0", "04:53:11.5"]
    assert found.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_byte_order_mark_is_passed_over(tmp_path):
    assert len(read_limb_angles(write(tmp_path, GOOD, header="\ufeff" + HEADER)).row) == 1


BAD = {
    "header": ((GOOD,), {"header": "t_s,distance_deg,turn_deg"}, ":1: expected the header utc,distance_deg,turn_deg"),
    "no header": ((), {"header": GOOD}, ":1: expected the header"),
    "no rows": ((), {}, "holds no angle below its header"),
    "no angles": (("2001-01-18T04:54:15,,",), {}, "holds no angle"),
    "cells": ((GOOD, "2001-01-18T04:55:19,3"), {}, ":3: expected 3 cells, utc,distance_deg,turn_deg, found 2"),
    "surplus": ((GOOD + ",0",), {}, ":2: expected 3 cells"),
    "instant": (("18.01.2001 04:54:15,1,2",), {}, ":2: utc: expected a UTC instant such as 2001-01-18T04:54:15.000"),
    "no instant": ((",1,2",), {}, ":2: utc: expected a UTC instant"),
    "month": (("2001-13-18T04:54:15,1,2",), {}, ":2: utc: 2001-13-18T04:54:15: month must be in 1..12, got 13"),
    "second": (("2001-01-18T04:54:60,1,2",), {}, ":2: utc: 2001-01-18T04:54:60: second must be"),
    "nan": (("2001-01-18T04:54:15,nan,2",), {}, ":2: distance_deg: expected a plain decimal number"),
    "infinity": (("2001-01-18T04:54:15,1,-inf",), {}, ":2: turn_deg: expected a plain decimal number"),
    "underscore": (("2001-01-18T04:54:15,1_0,2",), {}, ":2: distance_deg: expected a plain decimal number"),
    "overflow": (("2001-01-18T04:54:15,1,1e999",), {}, ":2: turn_deg: expected -360 to 360, found '1e999'"),
    "range": (("2001-01-18T04:54:15,-91,2",), {}, ":2: distance_deg: expected -90 to 180, found '-91'"),
    "other digits": (("2001-01-18T04:54:15,\u0663,2",), {}, ":2: byte 0xd9 at column 21 is not plain ASCII text"),
    "quoted": (('"2001-01-18T04:54:15",1,2',), {}, ":2: utc: expected a UTC instant"),
    "twice": ((GOOD, "2001-01-18T04:54:20,1,2", GOOD), {}, ":4: utc: expected each instant once, that of line 2 again"),
}


@pytest.mark.parametrize(("rows", "options", "expected"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_one_line(tmp_path, rows, options, expected):
    path = write(tmp_path, *rows, **options)
    with pytest.raises(InputError) as error:
        read_limb_angles(path)
    assert str(error.value).startswith(str(path)) and expected in str(error.value) and "\n" not in str(error.value)


def test_no_file_and_an_empty_one(tmp_path):
    with pytest.raises(InputError, match="no such file; expected a limb angle file"):
        read_limb_angles(tmp_path / "missing.csv")
    (tmp_path / "empty.csv").write_bytes(b"\n")
    with pytest.raises(InputError, match="file is empty"):
        read_limb_angles(tmp_path / "empty.csv")


def row(session, t, distance, turn):
    return f"{session.epoch.shifted(float(t)).iso(6)},{distance},{turn}"


def test_rows_go_to_the_nearest_sample(tmp_path, session):
    t = session.t_s
    rows = [row(session, *each) for each in ((t[3] + 0.4, 3, ""), (t[0] - 0.49, 1, -90), (t[-1], 7, 8))]
    found = match_limb_angles(read_limb_angles(write(tmp_path, *rows)), session)
    expected = np.full((len(t), 2), np.nan)
    expected[[0, 3, -1]] = np.radians([[1.0, -90.0], [3.0, np.nan], [7.0, 8.0]])
    np.testing.assert_allclose(found.angles, expected, rtol=1e-12)
    assert found.unmatched.tolist() == [] and found.remarks() == []
    # The session's time zero may have been moved.
    moved = match_limb_angles(found.file, session.with_time_zero(100.0))
    np.testing.assert_array_equal(moved.angles, found.angles)


def test_rows_without_a_sample_are_counted_and_named(tmp_path, session):
    t = session.t_s
    times = [t[2] + 0.3, t[2] - 0.1, t[5] + 0.51, t[-1] + 1e5, t[6]]
    rows = [row(session, each, number, 0) for number, each in enumerate(times)]
    found = match_limb_angles(read_limb_angles(write(tmp_path, *rows)), session)
    assert np.flatnonzero(np.isfinite(found.angles[:, 0])).tolist() == [2, 6]
    assert np.degrees(found.angles[2, 0]) == pytest.approx(1.0)
    assert found.unmatched.tolist() == [2, 4, 5]
    (remark,) = found.remarks()
    assert "limb.csv: 3 of 5 rows with limb angles are not used" in remark and "line 2, 4, 5" in remark


def test_a_file_of_another_day_is_refused(tmp_path, session):
    path = write(tmp_path, *(row(session, each + 86400.0, 1, 2) for each in session.t_s[:4]))
    with pytest.raises(InputError, match=r"limb.csv: utc: none of 4 rows lies within 0.5 s of a sample .*2001-01-18T"):
        match_limb_angles(read_limb_angles(path), session)
    alone = dataclasses.replace(session, t_s=session.t_s[:1])
    assert match_limb_angles(read_limb_angles(write(tmp_path, GOOD)), alone).angles.shape == (1, 2)
