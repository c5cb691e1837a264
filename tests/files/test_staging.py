"""Results appear at one instant, whenever their writer is killed; the next writer clears away what that one left."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from jaxsat.errors import InputError
from jaxsat.files import publishing, staging
from jaxsat.files.staging import staged_directory

# Kills itself at the k-th call that changes the directory tree, for every k, each in a process of its own.
KILLED = """
import os, signal, sys
from pathlib import Path
from jaxsat.files.publishing import publish
from jaxsat.files import publishing
from jaxsat.files.staging import staged_directory

EVENTS = {"os.rename", "os.link", "os.remove", "os.rmdir", "os.mkdir", "exchange"}
home, aside = Path(sys.argv[1]), sys.argv[2] == "one by one"

def child(k, out):
    left = [k]
    def count(event, arguments):
        if event in EVENTS:
            left[0] -= 1
            if left[0] < 0:
                os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(count)
    exchange = publishing.exchange
    def counted(one, other):
        sys.audit("exchange")
        exchange(one, other)
        sys.audit("exchange")
    publishing.exchange = counted
    if aside:
        os.chdir(out)
    with staged_directory(out, ("a", "b", "old")) as stage:
        (stage / "a").write_text("new")
        (stage / "b").write_text("new")

for k in range(1000):
    out = home / str(k) / "out"
    out.mkdir(parents=True)
    for name in ("a", "b", "old", "mine"):
        (out / name).write_text("old" if name != "mine" else "mine")
    pid = os.fork()
    if pid == 0:
        child(k, out)
        os._exit(0)
    if os.waitpid(pid, 0)[1] == 0:
        break
print(k)
"""
OLD = {"a": "old", "b": "old", "old": "old", "mine": "mine"}
NEW = {"a": "new", "b": "new", "mine": "mine"}


def contents(directory: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in directory.iterdir()}


def killed_everywhere(home: Path, how: str) -> int:
    command = [sys.executable, "-c", KILLED, str(home), how]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path(staging.__file__).parents[2])
    return int(done.stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="exchanges directories")
def test_killed_anywhere_the_directory_is_the_old_or_the_new_one(tmp_path):
    count = killed_everywhere(tmp_path, "at once")
    assert count >= 6
    found = [contents(tmp_path / str(k) / "out") for k in range(count)]
    turn = found.index(NEW)
    assert turn > 0 and found == [OLD] * turn + [NEW] * (count - turn)
    left = 0
    for k in range(count):
        left += len(list((tmp_path / str(k)).iterdir())) - 1
        with pytest.raises(RuntimeError), staged_directory(tmp_path / str(k) / "out", ("a",)):
            raise RuntimeError
        assert [path.name for path in (tmp_path / str(k)).iterdir()] == ["out"]
        assert contents(tmp_path / str(k) / "out") == found[k]
    assert left > 0


@pytest.mark.skipif(os.name != "posix", reason="knows dead writers by their locks")
def test_where_a_directory_must_stay_itself_the_next_writer_finishes(tmp_path):
    """As somebody stands in it: files are moved one by one."""
    count = killed_everywhere(tmp_path, "one by one")
    mixed = 0
    for k in range(count):
        out = tmp_path / str(k) / "out"
        mixed += contents(out) not in (OLD, NEW)
        with pytest.raises(RuntimeError), staged_directory(out, ("a",)):
            raise RuntimeError
        assert [path.name for path in (tmp_path / str(k)).iterdir()] == ["out"]
        assert contents(out) in (OLD, NEW)
    assert mixed > 0


def test_a_folder_of_the_user_is_refused_before_any_work(tmp_path):
    (tmp_path / "prepare.json").mkdir()
    (tmp_path / "prepare.json" / "mine").write_text("mine")
    with pytest.raises(InputError, match=r"e\.json: is a directory"), staged_directory(tmp_path, ("prepare.json",)):
        pytest.fail("entered")
    # Also one that nobody said would be written.
    with pytest.raises(InputError, match="is a directory"), staged_directory(tmp_path) as stage:
        (stage / "prepare.json").write_text("new")
    assert (tmp_path / "prepare.json" / "mine").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_folders_open_files_and_links_of_the_user_stay(tmp_path, monkeypatch):
    out = tmp_path / "out"
    (out / "folder").mkdir(parents=True)
    for again in range(2):
        # With a folder one by one, without it at one instant.
        with (out / "log").open("a") as log:
            (out / "link").unlink(missing_ok=True)
            (out / "link").symlink_to("nowhere")
            with staged_directory(out) as stage:
                (stage / "a").write_text("new")
            log.write("on")
        assert (out / "log").read_text() == "on" * (again + 1) and (out / "a").read_text() == "new"
        assert os.readlink(out / "link") == "nowhere" and [p.name for p in tmp_path.iterdir()] == ["out"]
        assert (out / "folder").is_dir() != bool(again)
        (out / "folder").rmdir() if not again else None
    monkeypatch.setattr(publishing, "exchange", lambda *_: pytest.fail("exchanged"))
    monkeypatch.chdir(out)
    with staged_directory(Path(".")) as stage:
        (stage / "a").write_text("newer")
    assert Path("a").read_text() == "newer"


def test_a_stage_that_is_written_is_no_leftover(tmp_path):
    with staged_directory(tmp_path / "out") as stage:
        with staged_directory(tmp_path / "out") as other:
            (other / "b").write_text("b")
        (stage / "a").write_text("a")
    assert contents(tmp_path / "out") == {"a": "a", "b": "b"} and [p.name for p in tmp_path.iterdir()] == ["out"]


def test_links_in_a_circle_are_said(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(InputError, match="cannot write results here"), staged_directory(tmp_path / "a"):
        pytest.fail("entered")
