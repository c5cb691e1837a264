"""A reader of stdout or stderr that goes away costs what it would have read, and nothing else."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

SCRIPT = "import sys; sys.path.insert(0, {tests!r}); from jaxsat.cli.main import main; main()"
COMMAND = [sys.executable, "-c", SCRIPT.format(tests=str(Path(__file__).parents[2] / "sweep"))]


def unread(arguments: list[str], cwd: Path, stream: str) -> subprocess.CompletedProcess:
    """A command one of whose streams nobody reads from the beginning."""
    reading, writing = os.pipe()
    os.close(reading)
    other = "stderr" if stream == "stdout" else "stdout"
    streams: dict[str, Any] = {stream: writing, other: subprocess.PIPE}
    try:
        return subprocess.run([*COMMAND, *arguments], cwd=cwd, text=True, **streams)
    finally:
        os.close(writing)


def test_a_sweep_whose_progress_nobody_reads_is_whole(tmp_path):
    done = unread(["sweep", "fake_scenario:plain", "--cases", "9", "--out", "out"], tmp_path, "stderr")
    assert done.returncode == 0
    assert json.loads((tmp_path / "out/summary.json").read_text())["cases"] == 9


def test_a_sweep_whose_summary_nobody_reads_is_whole(tmp_path):
    done = unread(["sweep", "fake_scenario:plain", "--cases", "9", "--out", "out"], tmp_path, "stdout")
    assert done.returncode == 0 and "Error" not in done.stderr
    assert json.loads((tmp_path / "out/summary.json").read_text())["cases"] == 9


def test_an_error_that_nobody_reads_is_an_error(tmp_path):
    assert unread(["sweep", "fake_scenario:nothing"], tmp_path, "stderr").returncode == 2
