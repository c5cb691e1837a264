"""Progress is a line a stage in a log and a bar on a terminal, and for what is short nothing."""

import io
import time

import pytest

from jaxsat.cli.shared.progress import Stages


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def drive(monkeypatch):
    def driven(stream: io.StringIO, *, wait_s: float = 0.0, **how) -> str:
        monkeypatch.setattr("sys.stderr", stream)
        with Stages("a", **how) as progress:
            for done in range(3):
                progress("arc 448 s", done, 3)
            time.sleep(wait_s)
            progress("writing")
        return stream.getvalue()

    return driven


def test_a_log_gets_one_line_a_stage(drive):
    lines = drive(io.StringIO()).splitlines()
    assert [line.split(" (")[0] for line in lines] == ["a: arc 448 s", "a: writing"]
    assert drive(io.StringIO(), quiet=True) == ""


def test_a_terminal_gets_a_bar_that_is_gone_at_the_end(drive, monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    text = drive(Terminal())
    assert "a: writing" in text and "\x1b[" in text
    # The last thing written clears the bar's line.
    assert text.rstrip("\r\n").endswith("\x1b[2K")
    lines = drive(Terminal(), lines=True).splitlines()
    assert [line.split(" (")[0] for line in lines] == ["a: arc 448 s", "a: writing"]


def test_the_stage_under_way_is_told_once_patience_is_over(drive):
    assert drive(io.StringIO(), patience_s=60.0) == ""
    lines = drive(io.StringIO(), patience_s=0.02, wait_s=0.3).splitlines()
    assert [line.split(" (")[0] for line in lines] == ["a: arc 448 s", "a: writing"]
    assert drive(io.StringIO(), patience_s=0.02, wait_s=0.1, quiet=True) == ""
