"""RAW_SUN reading: the bundled files as they stand, and one clear line for everything that is not such a file."""

import math
import os
import time
from pathlib import Path

import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.telemetry import clean, read_raw_sun

DATA = Path(__file__).parents[3] / "jaxsat" / "data" / "munin"
SESSIONS = sorted(DATA.glob("*.RAW_SUN"))
B = (DATA / "b-specular50.RAW_SUN").read_bytes().replace(b"\r\n", b"\n").decode().splitlines()


def write(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode())
    return path


def with_field(row: str, number: int, value: str) -> str:
    """The row with its field `number` (from 1) replaced."""
    fields = row.split()
    fields[number - 1] = value
    return " ".join(fields)


def message(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_raw_sun(path)
    text = str(caught.value)
    assert "\n" not in text and text.startswith(str(path)), text
    return text


@pytest.mark.parametrize("path", SESSIONS, ids=lambda path: path.stem)
def test_reads_every_number_of_the_file(path):
    raw = read_raw_sun(path)
    table = np.array([[float(x) for x in line.split()] for line in path.read_text().splitlines()[3:]])
    columns = [raw.sample_time, raw.reception_time, raw.position_eci_km, raw.velocity_eci_km_s, raw.currents_mA]
    columns += [raw.current_sum_mA[:, None], raw.magnetometer_uT]
    np.testing.assert_array_equal(np.hstack(columns), table)
    np.testing.assert_array_equal(raw.row, np.arange(4, 4 + len(table)))
    assert raw.satellite == "MUNIN" and raw.tle[0].startswith("1 26621U") and raw.tle[1].startswith("2 26621")


def test_line_ends_make_no_difference(tmp_path):
    unix = read_raw_sun(write(tmp_path / "unix.RAW_SUN", B))
    dos = read_raw_sun(write(tmp_path / "dos.RAW_SUN", B, "\r\n"))
    mixed = read_raw_sun(write(tmp_path / "mixed.RAW_SUN", [*B[:50], "", *B[50:], "", ""]))
    assert unix.satellite == dos.satellite and unix.tle == dos.tle
    for name in ("sample_time", "position_eci_km", "currents_mA", "magnetometer_uT"):
        np.testing.assert_array_equal(getattr(unix, name), getattr(dos, name))
        np.testing.assert_array_equal(getattr(unix, name), getattr(mixed, name))
    np.testing.assert_array_equal(unix.row, dos.row)
    assert mixed.row[-1] == unix.row[-1] + 1, "row numbers are those of the file, blank lines counted"


def test_name_may_be_utf8_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "x.RAW_SUN"
    path.write_bytes(b"\xef\xbb\xbf" + "\n".join(["Мунин", *B[1:]]).encode() + b"\n")
    assert read_raw_sun(path).satellite == "Мунин"


BAD_FIELDS = [
    (2, "13", "sample month", "expected 1 to 12"),
    (4, "24", "sample hour", "expected 0 to 23"),
    (5, "60", "sample minute", "expected 0 to 59"),
    (6, "60.0", "sample second", "no leap second"),
    (6, "61", "sample second", "below 61"),
    (6, "-1", "sample second", "expected 0"),
    (1, "1960", "sample year", "1972"),
    (3, "1.5", "sample day", "whole number"),
    (8, "0", "reception month", "expected 1 to 12"),
    (13, "nan", "position X [km]", "plain decimal"),
    (13, "1e7", "position X [km]", "expected -1e+06"),
    (14, "inf", "position Y [km]", "plain decimal"),
    (14, "-Infinity", "position Y [km]", "plain decimal"),
    (15, "1e999", "position Z [km]", "expected -1e+06"),
    (16, "1_0", "velocity X [km/s]", "plain decimal"),
    (19, "1_0", "current 1 [mA]", "plain decimal"),
    (20, "0x10", "current 2 [mA]", "plain decimal"),
    (21, "12a", "current 3 [mA]", "plain decimal"),
    (24, "abc", "current 6 [mA]", "plain decimal"),
    (25, "-", "sum of currents [mA]", "plain decimal"),
    (26, "1,5", "magnetometer By [uT]", "plain decimal"),
    (27, "x" * 500, "magnetometer Bz [uT]", "..."),
]


@pytest.mark.parametrize(("number", "value", "field", "expected"), BAD_FIELDS)
def test_bad_field_is_named_with_its_row(tmp_path, number, value, field, expected):
    path = write(tmp_path / "bad.RAW_SUN", [*B[:40], with_field(B[40], number, value), *B[41:]])
    text = message(path)
    assert text.startswith(f"{path}:41: {field}: ") and expected in text and len(text) < len(str(path)) + 200


def test_day_must_exist_in_its_month(tmp_path):
    row = with_field(with_field(B[3], 2, "2"), 3, "29")
    assert "4: sample day: expected a day of 2001-02" in message(write(tmp_path / "x", [*B[:3], row, *B[4:]]))


def test_second_60_only_in_a_leap_second(tmp_path):
    def row(second: str, minute: str = "59") -> str:
        fields = B[3].split()
        return " ".join(["2016", "12", "31", "23", minute, second, *fields[6:]])

    raw = read_raw_sun(write(tmp_path / "leap", [*B[:3], row("59.0"), row("60.5")]))
    assert clean(raw).t_s.tolist() == [0.0, 1.5]
    assert "sample second" in message(write(tmp_path / "no", [*B[:3], row("60.5", "58")]))


@pytest.mark.parametrize("fields", [0, 1, 26, 28], ids=lambda n: f"{n}-fields")
def test_wrong_number_of_fields(tmp_path, fields):
    row = " ".join((B[10].split() + ["7"])[:fields]) or "x"
    text = message(write(tmp_path / "x", [*B[:10], row, *B[11:]]))
    assert ":11: expected 27 fields, found" in text
    assert ("'magnetometer Bz [uT]' on missing" in text) == (fields == 26)


def test_last_row_cut_within_its_last_number(tmp_path):
    path = tmp_path / "cut.RAW_SUN"
    path.write_bytes("\n".join(B).encode()[:-1])
    assert f":{len(B)}: row is cut short" in message(path)


def test_non_ascii_digits_are_refused(tmp_path):
    path = write(tmp_path / "x", [*B[:5], B[5].replace("2001", "２００１", 1), *B[6:]])
    assert ":6: byte 0xef at column 1" in message(path)


def test_files_without_samples(tmp_path):
    empty = tmp_path / "empty"
    empty.touch()
    assert "file is empty" in message(empty)
    assert "no samples after the three header lines" in message(write(tmp_path / "header", B[:3]))
    assert "file ends after 2 line(s)" in message(write(tmp_path / "two", B[:2]))
    assert "file is empty" in message(write(tmp_path / "blank", ["", " ", ""]))


TLE_DAMAGE = {
    "checksum": (1, 68, "5", ":2: TLE checksum: is 5"),
    "digit": (2, 10, "7", ":3: TLE checksum"),
    "letter in epoch": (1, 20, "A", ":2: TLE epoch"),
    "line number": (2, 0, "3", ":3: TLE line number"),
    "decimal point": (2, 11, " ", ":3: TLE inclination"),
}


@pytest.mark.parametrize("damage", TLE_DAMAGE.values(), ids=TLE_DAMAGE.keys())
def test_damaged_element_set(tmp_path, damage):
    line, column, character, expected = damage
    lines = list(B)
    lines[line] = lines[line][:column] + character + lines[line][column + 1 :]
    assert expected in message(write(tmp_path / "x", lines))


def test_element_lines_of_wrong_length_or_of_two_satellites(tmp_path):
    text = message(write(tmp_path / "short", [B[0], B[1][:-1], *B[2:]]))
    assert ":2: TLE line 1: expected 69 characters of an element set, found 68" in text
    # 26622 and checksum one higher.
    other = B[2].replace("26621", "26622")[:-1] + str((int(B[2][-1]) + 1) % 10)
    text = message(write(tmp_path / "two", [*B[:2], other, *B[3:]]))
    assert ":3: TLE satellite number: differs" in text


def test_two_gigabytes_of_zeros_are_answered_at_once(tmp_path):
    path = tmp_path / "zeros.RAW_SUN"
    path.touch()
    os.truncate(path, 2 * 2**30)
    start = time.perf_counter()
    text = message(path)
    assert "file has 2048.0 MiB; a RAW_SUN file has at most 16 MiB" in text
    assert time.perf_counter() - start < 0.1


def test_what_is_no_text_file(tmp_path):
    zeros = tmp_path / "zeros"
    zeros.write_bytes(bytes(1000))
    assert ":1: NUL byte" in message(zeros)
    utf16 = tmp_path / "utf16"
    utf16.write_text("\n".join(B), encoding="utf-16")
    assert "NUL byte" in message(utf16)
    assert "is a directory" in message(tmp_path)
    assert "no such file" in message(tmp_path / "missing")
    os.mkfifo(tmp_path / "pipe")
    assert "device or a pipe" in message(tmp_path / "pipe")
    with pytest.raises(InputError, match="cannot be read"):
        read_raw_sun("a\0b")


@pytest.mark.parametrize("seed", range(4))
def test_damaged_bytes_give_numbers_or_one_line(tmp_path, seed):
    """Cut and corrupt at random: either every number is finite or it is an InputError; nothing else escapes."""
    generator = np.random.default_rng(seed)
    whole = (DATA / "b-specular50.RAW_SUN").read_bytes()[:4000]
    whole = whole[: whole.rindex(b"\n") + 1]
    path = tmp_path / "fuzz"
    read = 0
    for _ in range(60):
        data = bytearray(whole[: generator.integers(1, len(whole))] if generator.random() < 0.3 else whole)
        for place in generator.integers(0, len(data), generator.integers(0, 3)):
            data[place] = (
                generator.integers(0, 256) if generator.random() < 0.5 else ord(generator.choice(list("09 .-\n")))
            )
        path.write_bytes(data)
        try:
            session = clean(read_raw_sun(path))
        except InputError as error:
            assert "\n" not in str(error)
            continue
        read += 1
        assert math.isfinite(np.sum(session.currents_mA) + np.sum(session.position_eci_m) + np.sum(session.t_s))
    assert read > 0
