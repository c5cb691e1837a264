"""Element sets: one published set in its five written forms, and one clear line for everything damaged."""

import json
from pathlib import Path

import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.telemetry import nearest_element_set, read_element_sets
from jaxsat.telemetry.elements.tle_lines import checksum, line_epoch
from jaxsat.time import Epoch

# CCSDS 502.0-B gives this set both as two lines and as a message.
NAME = "GOES 9 [P]"
FIRST = "1 23581U 95025A   07064.44075725 -.00000113  00000-0  10000-3 0  9250"
SECOND = "2 23581   3.0539  81.7939 0005013 249.2363 150.1602  1.00273272 43169"
FIELDS = {
    "OBJECT_NAME": NAME,
    "OBJECT_ID": "1995-025A",
    "CENTER_NAME": "EARTH",
    "REF_FRAME": "TEME",
    "TIME_SYSTEM": "UTC",
    "MEAN_ELEMENT_THEORY": "SGP/SGP4",
    "EPOCH": "2007-064T10:34:41.4264",
    "MEAN_MOTION": "1.00273272",
    "ECCENTRICITY": "0.0005013",
    "INCLINATION": "3.0539",
    "RA_OF_ASC_NODE": "81.7939",
    "ARG_OF_PERICENTER": "249.2363",
    "MEAN_ANOMALY": "150.1602",
    "GM": "398600.8",
    "EPHEMERIS_TYPE": "0",
    "CLASSIFICATION_TYPE": "U",
    "NORAD_CAT_ID": "23581",
    "ELEMENT_SET_NO": "0925",
    "REV_AT_EPOCH": "4316",
    "BSTAR": "0.0001",
    "MEAN_MOTION_DOT": "-0.00000113",
    "MEAN_MOTION_DDOT": "0.0",
}
UNITS = {"MEAN_MOTION": "rev/day", "INCLINATION": "deg", "BSTAR": "1/ER", "GM": "km**3/s**2"}
METADATA = list(FIELDS)[:6]
ISS = (
    "1 25544U 98067A   22028.21808647  .00007418  00000-0  13935-3 0  9994",
    "2 25544  51.6438 309.7475 0006790  70.1663  84.4979 15.49675244323476",
)


def tle(fields=None):
    return f"{NAME}\n{FIRST}\n{SECOND}\n"


def kvn(fields=FIELDS):
    lines = ["CCSDS_OMM_VERS = 2.0", "CREATION_DATE = 2007-065T16:00:00", "COMMENT as published"]
    lines += [f"{name:20s} = {value} {f'[{UNITS[name]}]' if name in UNITS else ''}" for name, value in fields.items()]
    return "\n".join(lines) + "\n"


def xml(fields=FIELDS):
    def tags(names):
        units = {name: f" units='{unit}'" for name, unit in UNITS.items()}
        rows = (f"{name}{units.get(name, '')}>{fields[name]}</{name}" for name in names)
        return "\n".join(f"<{row}>" for row in rows)

    data = [name for name in fields if name not in METADATA]
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<ndm><omm id="CCSDS_OMM_VERS" version="2.0">\n<header>'
        "<CREATION_DATE>2007-065T16:00:00</CREATION_DATE></header><body><segment>\n<metadata>"
        f"<COMMENT>one</COMMENT><COMMENT>two</COMMENT>\n{tags([n for n in METADATA if n in fields])}\n</metadata><data>"
        f"<meanElements>\n{tags(data)}\n</meanElements></data></segment></body></omm></ndm>\n"
    )


def json_text(fields=FIELDS):
    return json.dumps([fields], indent=1)


def json_numbers(fields=FIELDS):
    numbers = {name: float(value) for name, value in fields.items() if name in UNITS or "MEAN_MOTION_D" in name}
    return json.dumps({**fields, **numbers, "NORAD_CAT_ID": 23581, "DECAY_DATE": None})


def csv_text(fields=FIELDS):
    return ",".join(fields) + "\r\n" + ",".join(fields.values()) + "\r\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "elements.txt"
    path.write_bytes(text.encode())
    return path


def message(folder: Path, text: str) -> str:
    path = write(folder, text)
    with pytest.raises(InputError) as caught:
        read_element_sets(path)
    line = str(caught.value)
    assert "\n" not in line and line.startswith(str(path)), line
    return line.removeprefix(str(path))


@pytest.mark.parametrize("form", [tle, kvn, xml, json_text, json_numbers, csv_text])
def test_one_set_in_every_form(form, tmp_path):
    (found,) = read_element_sets(write(tmp_path, form()))
    satellite = found.satellite
    assert (found.name, found.catalog_number) == (NAME, 23581)
    assert found.epoch.iso(4) == "2007-03-05T10:34:41.4264"
    degrees = [satellite.inclo, satellite.nodeo, satellite.argpo, satellite.mo]
    np.testing.assert_allclose(np.degrees(degrees), [3.0539, 81.7939, 249.2363, 150.1602], rtol=1e-14)
    assert satellite.ecco == pytest.approx(0.0005013, rel=1e-14) and satellite.bstar == pytest.approx(1e-4, rel=1e-14)
    assert satellite.no_kozai * 1440 / (2 * np.pi) == pytest.approx(1.00273272, rel=1e-14)
    # SGP4's own report of the rates, in radians and minutes.
    assert satellite.ndot * 1440**2 / (2 * np.pi) == pytest.approx(-1.13e-6, rel=1e-12)


def test_every_form_gives_the_same_motion(tmp_path):
    states = []
    for form in (tle, kvn, xml, json_text, csv_text):
        (found,) = read_element_sets(write(tmp_path, form()))
        code, position, _ = found.satellite.sgp4_tsince(1440.0)
        assert code == 0
        states.append(position)
    # The day of the two lines has eight decimals, the second of the messages four: 0.0001 s at 3 km/s.
    np.testing.assert_allclose(states, np.tile(states[0], (5, 1)), rtol=0, atol=5e-4)


def test_many_sets_of_a_file(tmp_path):
    text = f"\n0 ISS (ZARYA)\r\n{ISS[0]}\r\n{ISS[1]}  \r\n\r\n{tle()}{FIRST}\n{SECOND}"
    sets = read_element_sets(write(tmp_path, text))
    assert [(one.name, one.catalog_number, one.row) for one in sets] == [
        ("ISS (ZARYA)", 25544, 3),
        (NAME, 23581, 7),
        ("", 23581, 9),
    ]
    assert nearest_element_set(sets, Epoch.from_utc(2021, 1, 1)) is sets[0]
    assert nearest_element_set(sets, Epoch.from_utc(2010, 1, 1)) is sets[1]
    with pytest.raises(ValueError, match="at least one"):
        nearest_element_set([], Epoch.from_utc(2021, 1, 1))
    double = xml().replace("</omm>", "</omm>" + xml().split("<ndm>")[1].split("</ndm>")[0])
    assert [one.row for one in read_element_sets(write(tmp_path, double))] == [3, 29]
    assert len(read_element_sets(write(tmp_path, kvn() + kvn()))) == 2
    assert len(read_element_sets(write(tmp_path, csv_text() + csv_text().splitlines()[1]))) == 2


def test_a_blank_in_front_is_found_where_it_stands(tmp_path):
    assert message(tmp_path, f" {FIRST}\n {SECOND}\n").startswith(":1: TLE line: a blank stands in front")


def test_comments_are_no_names(tmp_path):
    text = f"# from a catalogue\n# of yesterday\n{ISS[0]}\n{ISS[1]}\n#\n{tle()}"
    assert [(s.name, s.row) for s in read_element_sets(write(tmp_path, text))] == [("", 3), (NAME, 7)]
    (found,) = read_element_sets(write(tmp_path, f"COMMENT hello\n\n{kvn()}"))
    assert (found.name, found.row) == (NAME, 3)
    blanks = with_sum(SECOND.replace("0005013", "   5013"))
    assert read_element_sets(write(tmp_path, f"{FIRST}\n{blanks}\n"))[0].satellite.ecco == 0.0005013
    (found,) = read_element_sets(write(tmp_path, json_text({**FIELDS, "MEAN_ELEMENT_THEORY": "TLE"})))
    assert found.satellite.ecco == 0.0005013


def test_numbers_beyond_five_digits(tmp_path):
    lines = [line.replace("25544", "T0001") for line in ISS]
    lines = [line[:68] + str(checksum(line)) for line in lines]
    assert read_element_sets(write(tmp_path, "\n".join(lines)))[0].catalog_number == 270001
    (found,) = read_element_sets(write(tmp_path, kvn({**FIELDS, "NORAD_CAT_ID": "799501234"})))
    assert found.catalog_number == 799501234


def with_sum(line: str) -> str:
    return line[:68] + str(checksum(line))


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (FIRST[:-1] + "1", SECOND, ":2: TLE checksum: is 1, but the line sums to 0"),
        (FIRST.replace("07064.4", "07o64.4"), SECOND, ":2: TLE epoch: malformed"),
        (
            with_sum(FIRST.replace("07064.4", "07366.4")),
            SECOND,
            ":2: TLE epoch: expected day of 2007 from 1 to below 366",
        ),
        (
            with_sum(FIRST.replace("07064.4", "07000.4")),
            SECOND,
            ":2: TLE epoch: expected day of 2007 from 1 to below 366",
        ),
        (with_sum(FIRST.replace("07064.4", "58064.4")), SECOND, ":2: TLE epoch: expected a year from 1960"),
        (with_sum(FIRST.replace(" 0  925", " 4  925")), SECOND, ":2: TLE ephemeris type: expected 0 or 2"),
        (FIRST, with_sum(SECOND.replace("  3.0539", "183.0539")), ":3: TLE inclination: expected 0 to 180"),
        (FIRST, with_sum(SECOND.replace(" 81.7939", "381.7939")), ":3: TLE right ascension of the node: expected"),
        (FIRST, with_sum(SECOND.replace("150.1602", "360.1602")), ":3: TLE mean anomaly: expected 0 to 360"),
        (FIRST, with_sum(SECOND.replace(" 1.00273272", "00.00000000")), ":3: TLE mean motion: expected above 0"),
        (
            with_sum(FIRST.replace("23581", "I3581")),
            with_sum(SECOND.replace("23581", "I3581")),
            ":2: TLE satellite number",
        ),
        (FIRST, with_sum(SECOND.replace("23581", "23582")), ":3: TLE satellite number: differs"),
        (FIRST, SECOND[:40], ":3: TLE line 2: expected 69 characters"),
        (FIRST, "", ":2: TLE line 2: expected a line that begins with '2 ', found 'the end of the file'"),
        ("", SECOND, ":3: TLE line 1: expected a line that begins with '1 ', found '2 23581"),
        (FIRST, "\n" + SECOND, ":3: TLE line 2: a blank line or a comment stands within the set"),
        (FIRST, with_sum(SECOND.replace("81.7939", "8 .7939")), ":3: TLE right ascension of the node: malformed"),
        (FIRST, with_sum(SECOND.replace("249.2363", "2 9.2363")), ":3: TLE argument of perigee: malformed"),
        (with_sum(FIRST.replace("10000-3", " 0000-3")), SECOND, ":2: TLE drag term: malformed"),
        (with_sum(FIRST.replace("07064", "0 064")), SECOND, ":2: TLE epoch: malformed"),
        (with_sum(FIRST.replace("95025A", "9 025A")), SECOND, ":2: TLE international designator: malformed"),
        (" " + FIRST, SECOND, ":2: TLE line 1: expected a line"),
        (FIRST, SECOND + "\n/EX", ":4: no element set follows '/EX'; the trailer"),
        (FIRST, NAME, ":3: TLE line 2: expected a line that begins with '2 ', found 'GOES 9 [P]'"),
    ],
)
def test_damaged_lines(first, second, expected, tmp_path):
    assert message(tmp_path, f"{NAME}\n{first}\n{second}\n").startswith(expected)


@pytest.mark.parametrize("form", [kvn, xml, json_text, csv_text])
@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("INCLINATION", "183.0539", "expected 0 to 180, found 183.0539"),
        ("INCLINATION", "nan", "expected a plain decimal number, found 'nan"),
        ("ECCENTRICITY", "1.0", "expected 0 to 1, found 1.0"),
        ("MEAN_MOTION", "1_0", "expected a plain decimal number, found '1_0'"),
        ("MEAN_MOTION", "0.0", "expected 1e-06 to 20, found 0.0"),
        ("MEAN_ANOMALY", "١٢", "expected a plain decimal number"),
        ("BSTAR", "1e999", "expected -1000 to 1000"),
        ("NORAD_CAT_ID", "23581.0", "expected a whole number"),
        ("EPOCH", "2007-13-05T10:34:41", "2007-13-05T10:34:41: month"),
        ("EPOCH", "2007-366T10:34:41", "expected a day of 2007, found 366"),
        ("EPOCH", "2007-064T10:34:60", "seconds below 60"),
        ("EPOCH", "2007-03-05 10:34:41", "expected a UTC instant"),
        ("REF_FRAME", "EME2000", "expected TEME"),
        ("MEAN_ELEMENT_THEORY", "SGP4-XP", "expected SGP4 or SGP/SGP4"),
        ("EPHEMERIS_TYPE", "4", "expected 0 or 2"),
        ("TIME_SYSTEM", "GPS", "expected UTC"),
        ("EPOCH", "2220-03-05T10:34:41", "year must be in 1960..2200"),
        ("BSTAR", None, "is missing"),
    ],
)
def test_damaged_messages(form, name, value, expected, tmp_path):
    fields = {key: x for key, x in FIELDS.items() if key != name or value is not None}
    if value is not None:
        fields[name] = value
    text = form(fields)
    found = message(tmp_path, text)
    assert f"{name}: " in found and expected in found, found
    if form is not json_text and value is not None:
        rows = enumerate(text.split("\n"), 1)
        row = 2 if form is csv_text else next(k for k, line in rows if line.strip("<").startswith(name))
        assert found.startswith(f":{row}: OMM {name}: ")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (kvn().replace("[deg]", "[rad]"), ":13: OMM INCLINATION: expected the unit deg, found 'rad'"),
        (kvn().replace("2.0", "9.9", 1), ":1: OMM CCSDS_OMM_VERS: expected 2.0 or 3.0, as"),
        (xml().replace('"2.0"', '"9.9"'), ":2: OMM version: expected 2.0 or 3.0, found '9.9'"),
        (
            kvn().replace("MOTION_DOT", "MOTION_DTO"),
            ":24: OMM MEAN_MOTION_DTO: is not known; did you mean",
        ),
        (json_text().replace("MEAN_MOTION_DOT", "Mean_Motion_Dot"), ": OMM 1: Mean_Motion_Dot: is not known; did you"),
        (json_text().replace("GOES", "GO\\u001bES"), ": OMM 1: OBJECT_NAME: character U+001B has no place here"),
        (json_text().replace("GOES", "GO\\ud800ES"), ": OMM 1: OBJECT_NAME: character U+D800 has no place here"),
        ("CCSDS_OMM_VERSION = 2.0\n", ":1: expected CCSDS_OMM_VERS = ..., found 'CCSDS_OMM_VERSION'"),
        ("\ufeff\n", ": file is empty"),
        (csv_text().replace(",", ";"), ":1: the fields stand between semicolons; expected commas"),
        ("<ndm>" + "<a>" * 100000, ":1: <a> is nested too deeply"),
        (json.dumps({f"k{i}": 0 for i in range(200000)}), ": OMM 1: k500: is beyond 500 fields"),
        (kvn() + "BSTAR = 1\n", ":26: OMM BSTAR: is given twice"),
        (kvn() + "BSTAR\n", ":26: expected NAME = VALUE, found 'BSTAR'"),
        (kvn() + "A = " + "[ " * 10000 + "\n", ":26: expected NAME = VALUE"),
        (xml().replace("</BSTAR>", ""), ":28: damaged XML at column 3: mismatched tag"),
        (xml()[:300], ":7: damaged XML"),
        ("<!DOCTYPE omm [<!ENTITY a 'b'>]>" + xml().split("\n", 1)[1], ":1: a document type declaration"),
        ("<html></html>", ":1: expected a message <omm> or <ndm>, found <html>"),
        ("<omm></omm>", ": holds no orbit mean-elements message"),
        ("[]", ": holds no orbit mean-elements message"),
        ("[1]", ": expected an object of named fields as message 1"),
        ('{"BSTAR": NaN}', ": expected numbers, found NaN"),
        ('{"BSTAR": 1, "BSTAR": 2}', ": OMM BSTAR: is given twice"),
        ('{"BSTAR": [1]}', ": OMM 1: BSTAR: expected a number or a text"),
        ('{"BSTAR": 1,', ":1: damaged JSON"),
        ("[" * 100000, ": damaged JSON: nested too deeply"),
        (csv_text().replace(",0.0\r", "\r"), ":2: expected 22 fields, found 21"),
        ("EPOCH,A\n", ": holds no orbit mean-elements message"),
        ("hello\nworld\n", ":2: TLE line 1: expected a line that begins with '1 ', found 'world'"),
    ],
)
def test_damaged_forms(text, expected, tmp_path):
    assert message(tmp_path, text).startswith(expected)


def test_elements_that_sgp4_refuses(tmp_path):
    # Case 33334 of the verification set of Vallado (2006), its checksums put right.
    first = with_sum("1 33334U 78066F   06174.85818871  .00000620  00000-0  10000-3 0  6809")
    second = with_sum("2 33334  68.4714 236.1303 5602877 123.7484 302.5767  0.00001000 67521")
    assert message(tmp_path, f"{first}\n{second}\n").startswith(
        ":1: SGP4 refuses the elements at their own epoch: pert"
    )


def test_no_file_and_foreign_bytes(tmp_path):
    with pytest.raises(InputError, match=r"no such file; expected a TLE or OMM file"):
        read_element_sets(tmp_path / "nothing")
    path = tmp_path / "latin.txt"
    path.write_bytes(tle().replace("GOES", "GÖES").encode("latin-1"))
    with pytest.raises(InputError, match=r"latin.txt:1: byte 0xd6 is not UTF-8"):
        read_element_sets(path)


def test_the_epoch_of_a_first_line_is_that_of_the_message():
    epoch = line_epoch(FIRST)
    assert epoch is not None
    # The line has eight decimals of a day: a millisecond.
    assert abs(epoch.seconds_since(Epoch.from_iso(FIELDS["EPOCH"]))) < 1e-3
    assert line_epoch(FIRST.replace("07064.4", "07367.4")) is None
