"""Tables of telemetry: stamps, units, rows left out, several files, and what is refused in one line."""

import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from jaxsat.errors import InputError
from jaxsat.telemetry import read_telemetry

GYRO = """
[sensors.gyro]
kind = "gyro"
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.1
quantum = 0.2
"""
ROWS = """utc,bx,by,bz,mode
2021-05-01T00:00:00Z,1000,-2000,3000,0
2021-05-01T00:00:02.5Z,1010,,3010,0
2021-05-01T00:00:05Z,,,,0
2021-05-01T00:00:07Z,99999,-2010,3020,1
"""


def test_channels_are_si_and_empty_cells_are_not_measured(table, satellite):
    session = read_telemetry(table(ROWS), satellite())
    mag = session.channels["mag"]
    assert session.epoch.iso() == "2021-05-01T00:00:00.000"
    assert np.array_equal(mag.t_s, [0.0, 2.5, 7.0])
    expected = [[1e-6, -2e-6, 3e-6], [1.01e-6, np.nan, 3.01e-6], [99.999e-6, -2.01e-6, 3.02e-6]]
    assert np.allclose(mag.values, expected, rtol=1e-14, equal_nan=True)
    assert mag.sigma == pytest.approx(1e-7) and mag.to_unit == pytest.approx(1e9) and mag.unit == "nT"
    assert session.unused == ("mode",) and session.rejections == () and session.remarks == ()


def test_rounding_is_part_of_the_noise(table, satellite):
    text = "utc,bx,by,bz,gx,gy,gz\n2021-05-01T00:00:00Z,1,2,3,180,0,-90\n"
    gyro = read_telemetry(table(text), satellite(more=GYRO)).channels["gyro"]
    assert np.allclose(gyro.values, [[math.pi, 0.0, -math.pi / 2]])
    assert gyro.sigma == pytest.approx(math.radians(math.sqrt(0.1**2 + 0.2**2 / 12)))
    assert gyro.quantum == pytest.approx(math.radians(0.2))


@pytest.mark.parametrize(
    ("time", "stamps", "epoch", "t_s"),
    [
        ('form = "unix"', ("1619827200.25", "1619827201"), "2021-05-01T00:00:00.250", 0.75),
        ('form = "unix"\nunit = "ms"', ("1619827200250", "1619827201000"), "2021-05-01T00:00:00.250", 0.75),
        ('form = "seconds"\nepoch = "2021-05-01T00:00:00Z"', ("10", "12.5"), "2021-05-01T00:00:10.000", 2.5),
        ('form = "iso"', ("2021-05-01 02:00:00+02:00", "2021-04-30T23:00:01.5-0100"), "2021-05-01T00:00:00.000", 1.5),
        ('zone = "UTC"', ("2021-05-01 00:00:00", "2021-05-01 00:00:03"), "2021-05-01T00:00:00.000", 3.0),
        ('zone = "-01:30"', ("2021-04-30T22:30:00", "2021-04-30T22:30:03"), "2021-05-01T00:00:00.000", 3.0),
        ('form = "unix"\noffset_s = 18.0', ("1619827218", "1619827219"), "2021-05-01T00:00:00.000", 1.0),
        # The leap second at the end of 2016 is one more second between midnights, and a row of its own.
        ('form = "iso"', ("2016-12-31T23:59:59Z", "2017-01-01T00:00:01Z"), "2016-12-31T23:59:59.000", 3.0),
        ('form = "iso"', ("2016-12-31T23:59:59Z", "2016-12-31T23:59:60.5Z"), "2016-12-31T23:59:59.000", 1.5),
    ],
)
def test_forms_of_stamps(table, satellite, time, stamps, epoch, t_s):
    found = satellite(time=f'[time]\ncolumn = "utc"\n{time}\n')
    session = read_telemetry(table("utc,bx,by,bz\n" + "".join(f"{stamp},1,2,3\n" for stamp in stamps)), found)
    assert session.epoch.iso() == epoch
    assert np.allclose(session.channels["mag"].t_s, [0.0, t_s], rtol=0, atol=1e-9)


def test_conditions_leave_rows_out_with_their_reason(table, satellite):
    found = satellite(more='[rows]\nkeep = ["mode == 0", "abs(bx) < 60000 or by > 0"]\n')
    path = table(ROWS)
    session = read_telemetry(path, found)
    assert session.channels["mag"].t_s.tolist() == [0.0, 2.5]
    (left,) = session.rejections
    assert (left.path, left.row, left.column, left.reason, left.detail) == (
        path,
        5,
        "mode",
        "not mode == 0",
        "mode = 1",
    )
    assert session.rejected_by_reason == {"not mode == 0": 1} and session.unused == ()


def test_texts_in_conditions_and_texts_that_mean_not_measured(table, satellite):
    rows = (
        ROWS.replace("mode\n", "state\n")
        .replace(",0\n", ",SAFE\n")
        .replace(",1\n", ",SUN\n")
        .replace(",,3010", ",nan,3010")
    )
    found = satellite(more='[rows]\nkeep = ["state != \'SUN\'"]\nnot_measured = ["nan"]\n')
    session = read_telemetry(table(rows), found)
    assert session.channels["mag"].t_s.tolist() == [0.0, 2.5] and np.isnan(session.channels["mag"].values[1, 1])


def test_the_epoch_is_that_of_the_first_row_that_counts(table, satellite):
    rows = ROWS.replace("3000,0", "3000,1")
    session = read_telemetry(table(rows), satellite(more='[rows]\nkeep = ["mode == 0"]\n'))
    assert session.epoch.iso() == "2021-05-01T00:00:02.500" and session.channels["mag"].t_s.tolist() == [0.0]


def test_rows_out_of_order_and_readings_of_one_instant(table, satellite):
    lines = ROWS.splitlines()
    path = table("\n".join([lines[0], lines[2], lines[1], lines[1], lines[1].replace("1000", "1001"), lines[4]]) + "\n")
    session = read_telemetry(path, satellite())
    mag = session.channels["mag"]
    assert mag.t_s.tolist() == [0.0, 2.5, 7.0] and mag.values[0, 0] == pytest.approx(1e-6)
    assert session.rejected_by_reason == {"the same reading again": 1, "another reading of an instant that has one": 1}
    assert [(each.row, each.detail) for each in session.rejections] == [
        (4, "row 3 has 0 s too"),
        (5, "row 3 has 0 s too"),
    ]
    (remark,) = session.remarks
    assert remark == "pass.csv: stamps go back 1 times, at row 3; rows are put in order"


def test_several_files_are_joined_by_time(table, satellite):
    first = table("utc,bx,by,bz\n2021-05-01T00:00:01Z,1,2,3\n2021-05-01T00:00:03Z,1,2,4\n", "a.csv")
    second = table("# from the gyro\nutc;gx;gy;gz\n2021-05-01T00:00:00Z;1;2;3\n\n2021-05-01T00:00:03Z;1;2;4\n", "b.csv")
    session = read_telemetry([first, second], satellite(more=GYRO))
    assert session.epoch.iso() == "2021-05-01T00:00:00.000" and session.paths == (first, second)
    assert session.channels["mag"].t_s.tolist() == [1.0, 3.0] and session.channels["gyro"].t_s.tolist() == [0.0, 3.0]
    assert session.span_s == (0.0, 3.0) and session.name == "a"


def test_commands_and_measured_currents(table, satellite):
    coil = '[[coils]]\naxis = "+x"\narea_turns_m2 = 2\ncolumn = "coil"\nunit = "mA"\n'
    text = "utc,bx,by,bz,coil\n2021-05-01T00:00:00Z,1,2,3,\n2021-05-01T00:00:02Z,,,,50\n2021-05-01T00:00:02Z,,,,60\n"
    session = read_telemetry(table(text), satellite(more=coil))
    t, values = session.columns["coil"]
    # Two commands of one instant: the later row holds.
    assert t.tolist() == [2.0] and values.tolist() == pytest.approx([0.06])


def test_parquet(tmp_path, satellite):
    stamps = pa.array([0, 2_500_000, 5_000_000], pa.timestamp("us", tz="UTC"))
    columns = {
        "utc": stamps,
        "bx": [1.0, None, float("nan")],
        "by": pa.array([4, 5, None], pa.int32()),
        "bz": [7.0] * 3,
    }
    pq.write_table(pa.table(columns), tmp_path / "pass.parquet")
    session = read_telemetry(tmp_path / "pass.parquet", satellite())
    assert session.epoch.iso() == "1970-01-01T00:00:00.000" and session.channels["mag"].t_s.tolist() == [0.0, 2.5, 5.0]
    expected = [[1.0, 4.0, 7.0], [np.nan, 5.0, 7.0], [np.nan, np.nan, 7.0]]
    assert np.allclose(session.channels["mag"].values * 1e9, expected, equal_nan=True)


def test_parquet_stamps_without_a_zone_are_refused(tmp_path, satellite):
    columns = {"utc": pa.array([0], pa.timestamp("us")), "bx": [1.0], "by": [1.0], "bz": [1.0]}
    pq.write_table(pa.table(columns), tmp_path / "pass.parquet")
    with pytest.raises(InputError, match="pass.parquet:1: utc: .* names no time zone"):
        read_telemetry(tmp_path / "pass.parquet", satellite())
    found = satellite(time='[time]\ncolumn = "utc"\nzone = "UTC"\n')
    assert read_telemetry(tmp_path / "pass.parquet", found).epoch.iso() == "1970-01-01T00:00:00.000"


WRONG = [
    ("bx,by", "bx,bq", r"pass.csv: by: no such column; did you mean 'bx'\?|pass.csv: by: no such column"),
    ("bx,by", "bx,bx", r"pass.csv:1: bx: expected each column once"),
    ("bx,by", "bx,", r"pass.csv:1: column 3 has no name"),
    (
        ",1000,",
        ",nan,",
        r"pass.csv:2: bx: expected a plain finite decimal number.*found 'nan'; write rows.not_measured",
    ),
    (",1000,", ",inf,", r"pass.csv:2: bx: .*found 'inf'"),
    (",1000,", ",1e999,", r"pass.csv:2: bx: .*found '1e999'"),
    (",1000,", ",1_0,", r"pass.csv:2: bx: .*found '1_0'"),
    (",1000,", ",١٠,", r"pass.csv:2: bx: .*found '١٠'"),
    (",1000,", ",1,0,", r"pass.csv:2: expected 5 cells as in the header, found 6; a decimal comma"),
    (",1000,", ",", r"pass.csv:2: expected 5 cells as in the header, found 4"),
    ("00:00:02.5Z", "00:00:02.5", r"pass.csv:3: utc: .* names no time zone; write Z .* time.zone"),
    ("00:00:02.5Z", "00:00:62Z", r"pass.csv:3: utc: expected an instant"),
    ("00:00:02.5Z", "00:00:60Z", r"pass.csv:3: utc: .*second must be"),
    ("05-01T00:00:02.5Z", "02-30T00:00:02Z", r"pass.csv:3: utc: .*day must be in 1..28"),
    ("2021-05-01T00:00:02.5Z", "1619827200", r"pass.csv:3: utc: expected an instant"),
    ("2021-05-01T00:00:02.5Z", "01.05.2021 00:00", r"pass.csv:3: utc: expected an instant"),
    ("2021-05-01T00:00:05Z,", '"2021', r"pass.csv:\d: damaged CSV|pass.csv:4"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG)
def test_a_bad_table_is_one_line(table, satellite, old, new, said):
    assert old in ROWS
    with pytest.raises(InputError, match=said) as caught:
        read_telemetry(table(ROWS.replace(old, new, 1)), satellite())
    assert "\n" not in str(caught.value)


def test_tables_that_hold_nothing(table, tmp_path, satellite):
    found = satellite(more='[rows]\nkeep = ["mode == 7"]\n')
    with pytest.raises(InputError, match=r"no row is left of 4: not mode == 7 \(4\)"):
        read_telemetry(table(ROWS), found)
    for text, said in (
        ("", "file is empty"),
        ("utc,bx,by,bz\n", "holds no row below its header"),
        ("utc,bx,by,bz\n2021-05-01T00:00:00Z,,,\n", "holds no reading of any channel"),
        ("utc,bx,by,bz\n,1,2,3\n", r"no row is left of 1: no stamp \(1\)"),
        ("\xff", "utf-8"),
    ):
        path = tmp_path / "x.csv"
        path.write_bytes(text.encode("latin-1"))
        with pytest.raises(InputError, match=f"(?i)x.csv.*{said}"):
            read_telemetry(path, satellite())
    with pytest.raises(InputError, match="no such file"):
        read_telemetry(tmp_path / "nowhere.csv", satellite())
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match="damaged Parquet"):
        read_telemetry(tmp_path / "bad.parquet", satellite())


@pytest.mark.parametrize(
    ("stamp", "said"), [("1619827200123", "is time.unit ms"), ("2021-05-01T00:00:00Z", "plain finite")]
)
def test_unix_stamps_that_are_none(table, satellite, stamp, said):
    found = satellite(time='[time]\ncolumn = "utc"\nform = "unix"\n')
    with pytest.raises(InputError, match=f"pass.csv:2: utc: .*{said}"):
        read_telemetry(table(f"utc,bx,by,bz\n{stamp},1,2,3\n"), found)


def _made_up(mag, gyro):
    """A table of 40 rows; `mag` and `gyro` give the cells of row k, None those of the motion."""
    lines = ["utc,bx,by,bz,gx,gy,gz"]
    for k in range(40):
        b = 30000 * np.array([math.sin(0.1 * k), math.cos(0.1 * k), 0.3 + 0.001 * k])
        w = [1.0 + 0.01 * k, -2.0, 0.02 * k]
        cells = mag(k) or [f"{x:.1f}" for x in b]
        cells = [*cells, *(gyro(k) or [f"{x:.3f}" for x in w])]
        lines.append(f"2021-05-01T00:00:{k:02d}Z,{','.join(cells)}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("mag", "gyro", "left_out"),
    [
        (lambda k: None, lambda k: None, {}),
        # Of nT -999 is within what each axis reads; of deg/s it is beyond.
        (lambda k: ["-999"] * 3 if k % 6 == 5 else None, lambda k: None, {"bx": 6, "by": 6, "bz": 6}),
        (lambda k: None, lambda k: [f"{1 + 0.01 * k}", "-999", "0.5"] if k % 6 == 5 else None, {"gy": 6}),
        (lambda k: ["0"] * 3 if k % 2 else None, lambda k: ["9999"] * 3 if k > 36 else None, {"bx": 20, "gx": 3}),
        # A gyroscope at rest, of coarse steps: zero is what it reads.
        (lambda k: None, lambda k: ["0", "0", "0"] if k < 30 else ["0.2", "0", "0"], {}),
    ],
)
def test_fillers_are_no_readings(table, satellite, mag, gyro, left_out):
    session = read_telemetry(table(_made_up(mag, gyro)), satellite(more=GYRO))
    found = {column: sum(each.column == column for each in session.rejections) for column in left_out}
    assert found == left_out
    assert len(session.rejections) == {0: 0, 3: 18, 1: 6, 2: 69}[len(left_out)]
    assert all(each.reason == "a number again and again that is no reading" for each in session.rejections)


def test_the_end_of_a_range_is_no_reading(table, satellite):
    clipped = [f"{min(1.5, 2.0 * math.sin(0.2 * k) + 1e-3 * (k * 7 % 11)):.4f}" for k in range(40)]
    text = _made_up(lambda k: None, lambda k: [clipped[k], "1.0", f"{0.02 * k:.2f}"])
    session = read_telemetry(table(text), satellite(more=GYRO))
    assert [each.column for each in session.rejections] == ["gx"] * clipped.count("1.5000")
    assert len(session.rejections) > 10 and not np.isfinite(session.channels["gyro"].values[10, 0])


def test_what_is_stuck_is_no_reading(table, satellite):
    text = _made_up(
        lambda k: ["1234.5", f"{30000 * math.cos(0.1 * k):.1f}", f"{k}"] if k > 25 else None, lambda k: None
    )
    session = read_telemetry(table(text), satellite(more=GYRO))
    assert [(each.column, each.row) for each in session.rejections] == [("bx", k + 2) for k in range(26, 40)]
