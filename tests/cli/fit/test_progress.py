"""Progress is a line a stage in a log and a bar on a terminal."""

import io

from jaxsat.cli.fit.progress import StageProgress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def drive(monkeypatch, stream: io.StringIO) -> str:
    monkeypatch.setattr("sys.stderr", stream)
    with StageProgress("a") as progress:
        for done in range(3):
            progress("arc 448 s", done, 3)
        progress("writing", 0, 0)
    return stream.getvalue()


def test_a_log_gets_one_line_a_stage(monkeypatch):
    lines = drive(monkeypatch, io.StringIO()).splitlines()
    assert [line.split(" (")[0] for line in lines] == ["a: arc 448 s", "a: writing"]


def test_a_terminal_gets_a_bar_that_is_gone_at_the_end(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    text = drive(monkeypatch, Terminal())
    assert "a: writing" in text and "\x1b[" in text
    # The last thing written clears the bar's line.
    assert text.rstrip("\r\n").endswith("\x1b[2K")
