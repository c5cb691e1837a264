"""Bad input through the real command: status 1, one line that names file, row and field, and nothing left behind."""

import datetime
from pathlib import Path

import pytest

from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run

GOOD = BUNDLED.with_name("a-nominal-exact.RAW_SUN")
HEADER = 3


@pytest.fixture(autouse=True)
def own_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)


def lines() -> list[str]:
    return GOOD.read_text().splitlines()


def with_field(row: int, number: int, text: str) -> str:
    """The good file with one field (from 1) of one row (from 1) replaced."""
    changed = lines()
    fields = changed[row - 1].split()
    fields[number - 1] = text
    changed[row - 1] = " ".join(fields)
    return "\n".join(changed) + "\n"


def with_currents(currents) -> str:
    """The good file with `currents(time, six currents)` in place of the six of each row."""
    changed = lines()
    for k in range(HEADER, len(changed)):
        fields = changed[k].split()
        time = datetime.datetime.strptime(" ".join(fields[:6]), "%Y %m %d %H %M %S.%f")
        new = currents(time, [float(field) for field in fields[18:24]])
        fields[18:25] = [f"{value:g}" for value in (*new, sum(new))]
        changed[k] = " ".join(fields)
    return "\n".join(changed) + "\n"


def cut_row() -> str:
    changed = lines()
    changed[9] = " ".join(changed[9].split()[:20])
    return "\n".join(changed) + "\n"


def first_minutes_only(time: datetime.datetime, currents: list[float]) -> list[float]:
    return currents if time < datetime.datetime(2001, 1, 18, 4, 58) else [0.0] * 6


BAD = {
    "empty": (lambda: "", ("file is empty",)),
    "blank": (lambda: " \n\n", ("file is empty",)),
    "header only": (lambda: "\n".join(lines()[:HEADER]) + "\n", (":3: no samples after the three header lines",)),
    "truncated row": (cut_row, (":10: ", "expected 27 fields, found 20", "current 3 [mA]")),
    "file cut in a row": (lambda: GOOD.read_text()[:1000], (":8: row is cut short",)),
    "letters": (lambda: with_field(6, 14, "seven"), (":6: position Y [km]: ", "'seven'")),
    "nan": (lambda: with_field(7, 19, "nan"), (":7: current 1 [mA]: ", "'nan'")),
    "infinity": (lambda: with_field(7, 16, "1e999"), (":7: velocity X [km/s]: ",)),
    "month 13": (lambda: with_field(8, 2, "13"), (":8: sample month: ", "1 to 12", "'13'")),
    "shadow": (lambda: with_currents(lambda *_: [0.0] * 6), ("currents: ", "71 samples are in shadow")),
    "one panel": (lambda: with_currents(lambda _, c: [c[0] + 50.0, 0, 0, 0, 0, 0]), ("currents: ", "only panel +X")),
    "four lit": (lambda: with_currents(first_minutes_only), ("currents: only 4 of 71 samples are lit",)),
}


def check(arguments, expected, capsys, tmp_path, *, keep=(), status=1):
    """The command fails with one line and the directory holds what it held."""
    assert run(["fit", *map(str, arguments), "--out", "results/of/this"]) == status
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1, captured.err
    assert captured.err.startswith("jaxsat: error: ") and all(text in captured.err for text in expected), captured.err
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(keep)


@pytest.mark.parametrize(("text", "expected"), BAD.values(), ids=BAD.keys())
def test_bad_telemetry(text, expected, capsys, tmp_path):
    bad = tmp_path / "bad.RAW_SUN"
    bad.write_text(text())
    check([bad], (str(bad), *expected), capsys, tmp_path, keep=["bad.RAW_SUN"])


def test_two_gigabytes_of_zeros(capsys, tmp_path):
    bad = tmp_path / "zeros.RAW_SUN"
    with bad.open("wb") as stream:
        stream.truncate(2 * 2**30)
    check([bad], (f"{bad}: file has 2048.0 MiB",), capsys, tmp_path, keep=["zeros.RAW_SUN"])


def test_zeros_of_a_usual_size(capsys, tmp_path):
    bad = tmp_path / "zeros.RAW_SUN"
    bad.write_bytes(bytes(4096))
    check([bad], (f"{bad}:1: NUL byte",), capsys, tmp_path, keep=["zeros.RAW_SUN"])


def test_what_is_no_file(capsys, tmp_path):
    check(["missing.RAW_SUN"], ("missing.RAW_SUN: no such file",), capsys, tmp_path)
    (tmp_path / "folder").mkdir()
    check(["folder"], ("folder: is a directory",), capsys, tmp_path, keep=["folder"])


def test_a_name_that_is_no_text_is_told_before_any_work(capsys, tmp_path):
    check(["pass-\udcff.csv"], (r"pass-\udcff.csv: its name is not UTF-8 text",), capsys, tmp_path)


def test_arc_without_samples(capsys, tmp_path, monkeypatch):
    assert run(["fit", str(GOOD), "--arc", "9000", "9900", "--out", "results"]) == 1
    captured = capsys.readouterr()
    last = captured.err.splitlines()[-1]
    assert last.startswith(f"jaxsat: error: {GOOD}: arc: no sample between 9000 and 9900 s")
    assert "0 to 4480 s" in last and captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_light_in_the_shadow_only(capsys, tmp_path):
    """Currents where the orbit says it is dark: known only after the tables are made."""
    bad = tmp_path / "night.RAW_SUN"
    bright = iter(range(10**6))
    bad.write_text(with_currents(lambda *_: [100.0, 0, 60.0, 0, 0, 50.0] if next(bright) < 5 else [0.0] * 6))
    assert run(["fit", str(bad), "--free", "state", "--out", "results"]) == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith(f"jaxsat: error: {bad}: only ") and "at least 7" in last
    assert [path.name for path in tmp_path.iterdir()] == ["night.RAW_SUN"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [(("--free", "magnets"), "magnets"), (("--arc", "900", "100"), "first before the second")],
)
def test_wrong_usage_is_status_2(arguments, expected, capsys, tmp_path):
    check([GOOD, *arguments], (expected,), capsys, tmp_path, status=2)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[fit]\nseed = = 3\n", ":2: TOML syntax"),
        ("[fit]\nsead = 3\n", "fit.sead: unknown key; did you mean 'seed'?"),
        ('[fit]\nfree = "magnets"\n', "fit.free: unknown free parameter 'magnets'"),
        ("", "file is empty"),
    ],
)
def test_bad_configuration(text, expected, capsys, tmp_path):
    config = tmp_path / "x.toml"
    config.write_text(text)
    check([GOOD, "--config", config], (str(config), expected), capsys, tmp_path, keep=["x.toml"])


def test_an_existing_directory_is_left_as_it_was(capsys, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "fit.json").write_text("earlier")
    assert run(["fit", str(Path("missing.RAW_SUN")), "--out", "out"]) == 1
    assert [(path.name, path.read_text()) for path in out.iterdir()] == [("fit.json", "earlier")]
    assert capsys.readouterr().err.count("\n") == 1
