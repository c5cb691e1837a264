"""`jaxsat view`: the same page again from the files of a run, and one line for whatever is wrong with them."""

import http.client
import json
import shutil
import socket
import struct
import threading
import time
import webbrowser
from pathlib import Path

import pytest

from fitting.report.stored_run import read_run
from jaxsat.cli.main import run
from jaxsat.cli.view.serving import MOST_AT_ONCE, serve
from jaxsat.errors import InputError


@pytest.fixture
def fitted(fitted_run, tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("jaxsat.cli.view.command.sys.platform", "linux")
    return shutil.copytree(fitted_run, tmp_path / "run")


@pytest.mark.slow
def test_the_page_is_the_same_again(fitted, capsys):
    before = (fitted / "report.html").read_text()
    names = {entry.name for entry in fitted.iterdir()}
    assert run(["view", "run"]) == 0
    assert capsys.readouterr().out == "run/report.html\n"
    assert (fitted / "report.html").read_text() == before
    for name in names:
        if name.endswith(".png"):
            (fitted / name).unlink()
    assert run(["view", "run", "--out", "elsewhere"]) == 0
    assert len(Path("elsewhere/report.html").read_text()) < len(before) - 100_000
    assert {entry.name for entry in fitted.iterdir()} == {name for name in names if not name.endswith(".png")}


def test_the_page_is_opened_where_there_is_a_screen(fitted, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    run(["view", "run"])
    monkeypatch.setenv("DISPLAY", ":0")
    run(["view", "run", "--no-open"])
    assert opened == []
    run(["view", "run"])
    assert opened == [(fitted / "report.html").as_uri()]


def test_a_run_of_an_older_version_has_a_page_without_motion(fitted, capsys):
    (fitted / "scene.json").unlink()
    assert run(["view", "run"]) == 0
    assert "no scene.json" in capsys.readouterr().err
    assert '"scene":null' in (fitted / "report.html").read_text()


def spoil_json(path: Path, **changes) -> None:
    document = json.loads(path.read_text())
    path.write_text(json.dumps({k: v for k, v in {**document, **changes}.items() if v != "gone"}))


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda d: shutil.rmtree(d), "no fit.json; expected results of a fit"),
        (lambda d: (d / "fit.json").rename(d / "summary.json"), "holds several runs"),
        (lambda d: (d / "fit.json").write_text("{"), "fit.json: is no JSON"),
        (lambda d: (d / "fit.json").write_text("[]"), "fit.json: is no fit.json: expected an object"),
        (
            lambda d: spoil_json(d / "scene.json", schema="jaxsat.scene/9"),
            "expected jaxsat.scene/1, got jaxsat.scene/9",
        ),
        (lambda d: spoil_json(d / "fit.json", diagnostics="gone"), "fit.json: diagnostics: Field required"),
        (lambda d: spoil_json(d / "provenance.json", orbit="gone"), "provenance.json: orbit: Field required"),
        (lambda d: (d / "provenance.json").unlink(), "provenance.json: no such file"),
        (lambda d: spoil_json(d / "fit.json", dof=[1]), "fit.json: dof: Input should be a valid integer"),
        (
            lambda d: replace(d / "fit.json", '"chi2": ', '"chi2": 1e999, "was": '),
            "fit.json: is no JSON: chi2: a number",
        ),
        (lambda d: replace(d / "scene.json", '"begin_s": ', '"begin_s": Infinity, "x": '), "Infinity is no number"),
        (lambda d: replace(d / "attitude.csv", "t_s,utc", '"' + "x" * 140000), "attitude.csv: damaged CSV"),
        (lambda d: (d / "channel-cells.csv").write_text("t_s,utc\n"), "channel-cells.csv:1: expected the"),
        (
            lambda d: replace(d / "attitude.csv", "2001-01-18T04:54:15.000,", "2001-01-18T04:54:15.000,x"),
            "q_w: expected a",
        ),
        (lambda d: replace(d / "attitude.csv", "\n64,", "\n64,,"), "attitude.csv:3: 18 fields; expected 17"),
    ],
)
def test_wrong_files_are_one_line(fitted, capsys, spoil, expected):
    before = (fitted / "report.html").read_bytes()
    spoil(fitted)
    assert run(["view", "run"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    assert captured.err.startswith("jaxsat: error: ") and expected in captured.err
    assert not fitted.exists() or (fitted / "report.html").read_bytes() == before


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_a_picture_that_is_a_link_or_none_is_not_shown(fitted):
    for name in ("orbit.png", "attitude.png"):
        (fitted / name).unlink(missing_ok=True)
    (fitted.parent / "secret").write_text("secret of another")
    (fitted / "orbit.png").symlink_to(fitted.parent / "secret")
    (fitted / "attitude.png").write_text("no picture")
    found = read_run(fitted).pictures
    assert "orbit.png" not in found and "attitude.png" not in found


@pytest.mark.parametrize("arguments", [["view"], ["view", "run", "--port", "0"], ["view", "run", "--prot", "8000"]])
def test_wrong_usage(arguments, capsys):
    assert run(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_serving(capsys, tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"port {port}: cannot be used"):
            serve(b"page", port)
    (tmp_path / "a+b.csv").write_text("t_s\n1\n")
    (tmp_path / "link.csv").symlink_to(tmp_path / "a+b.csv")
    tables = {name: tmp_path / name for name in ("a+b.csv", "link.csv", "gone.csv")}
    threading.Thread(target=serve, args=(b"a page", port, tables), daemon=True).start()
    for _ in range(100):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
        try:
            connection.request("GET", "/anything")
            break
        except ConnectionRefusedError:
            time.sleep(0.02)
    answer = connection.getresponse()
    assert (answer.status, answer.read()) == (200, b"a page")
    connection.close()
    # Its tables and nothing else: what is no file of the run is the page.
    for name, content in (
        ("a%2Bb.csv", b"t_s\n1\n"),
        ("link.csv", b"a page"),
        ("gone.csv", b"a page"),
        ("x.csv", b"a page"),
    ):
        connection.request("GET", f"/{name}")
        assert connection.getresponse().read() == content
        connection.close()
    for host, status in (
        ("localhost:9000", 200),
        ("LOCALHOST", 200),
        ("evil.example:80", 403),
        ("127.0.0.1.example", 403),
    ):
        connection.request("GET", "/", headers={"Host": host})
        assert connection.getresponse().status == status
        connection.close()
    # More silent ones than it has threads for, then all of them gone: the next is served again, and nothing is said.
    silent = [socket.create_connection(("127.0.0.1", port)) for _ in range(2 * MOST_AT_ONCE)]
    assert silent[-1].recv(1) == b"" and threading.active_count() < 2 * MOST_AT_ONCE
    for each in silent:
        each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        each.close()
    for _ in range(100):
        try:
            connection.request("GET", "/")
            assert connection.getresponse().status == 200
            break
        except (ConnectionError, http.client.HTTPException):
            connection.close()
            time.sleep(0.02)
    else:
        pytest.fail("not served again")
    connection.close()
    assert capsys.readouterr().err == ""
