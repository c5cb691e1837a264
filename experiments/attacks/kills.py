"""Commands killed at random: they leave the old or the new results whole, and the next run clears away the rest.

Half of the kills come at a random time, the others at a random change of the file system (a file opened for writing, a
name given or taken), which a clock seldom hits.
"""

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path

MAIN = """
import os, signal, sys
left = [int(sys.argv.pop(1))]
out = sys.argv.pop(1)
EVENTS = {"os.rename", "os.link", "os.remove", "os.mkdir", "os.rmdir", "shutil.rmtree", "open"}
def count(event, arguments):
    if event not in EVENTS or left[0] < 0 or not any(out in str(a) for a in arguments[:2]):
        return
    if event == "open" and not (isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")):
        return
    left[0] -= 1
    if left[0] < 0:
        os.kill(os.getpid(), signal.SIGKILL)
if left[0] >= 0:
    sys.addaudithook(count)
from jaxsat.cli.main import main
main()
"""
LONGEST_S = 120.0


def digests(directory: Path) -> dict[str, str]:
    """Of the files of a directory by name."""
    files = (path for path in directory.iterdir() if path.is_file())
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def killed(arguments: list[str], out: Path, rng: random.Random, *, seconds: float, changes: int) -> bool:
    """Whether the command was killed before its end, at a random time or at a random change below `out`."""
    at_change = rng.random() < 0.5
    number = rng.randrange(changes) if at_change else -1
    # Both the directory and the stage beside it begin so.
    command = [sys.executable, "-c", MAIN, str(number), out.name, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(LONGEST_S if at_change else rng.uniform(0.0, seconds))
    except subprocess.TimeoutExpired:
        process.kill()
    return process.wait() == -signal.SIGKILL


def finished(arguments: list[str]) -> None:
    """Runs the command to its end."""
    command = [sys.executable, "-c", MAIN, "-1", "", *arguments]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=LONGEST_S)


def kill_prepare(folder: Path, runs: int, rng: random.Random) -> dict[str, int]:
    """Two preparations of other settings in turn into one directory, with a file of the user's beside."""
    work, out = folder / "prepare", folder / "prepare" / "results"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    ways = [["prepare", "--no-plots", "--out", str(out), *more] for more in ([], ["--drop", "1000", "1500"])]
    known = []
    for way in ways:
        finished(way)
        (out / "mine.txt").write_text("mine")
        known.append(digests(out))
    found = {"killed": 0, "mixed or missing": 0, "stages left": 0, "stages after the next run": 0}
    for k in range(runs):
        found["killed"] += killed(ways[k % 2], out, rng, seconds=3.0, changes=8)
        found["mixed or missing"] += digests(out) not in known
        found["stages left"] += len(list(work.iterdir())) - 1
        if k % 10 == 9:
            finished(ways[k % 2])
            found["stages after the next run"] += len(list(work.iterdir())) - 1
            found["mixed or missing"] += digests(out) != known[k % 2]
    return found


def kill_sweep(folder: Path, runs: int, rng: random.Random) -> dict[str, int]:
    """Sweeps killed and resumed until they are done, their table compared with that of one that was left in peace."""
    work = folder / "sweep"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    command = ["sweep", "experiments.attacks.throws:make", "--cases", "400", "--no-plots"]
    finished([*command, "--out", str(work / "whole")])
    whole = digests(work / "whole")["cases.parquet"]
    found = {"killed": 0, "resumed to the end": 0, "other numbers": 0, "leftovers": 0}
    number = 0
    for _ in range(runs):
        out = work / f"part-{number}"
        again = ["--resume"] if out.exists() else []
        found["killed"] += killed([*command, *again, "--out", str(out)], out, rng, seconds=4.0, changes=60)
        if rng.random() < 0.2 and out.exists():
            finished([*command, "--resume", "--out", str(out)])
            found["resumed to the end"] += 1
            found["other numbers"] += digests(out)["cases.parquet"] != whole
            found["leftovers"] += sum(path.name.endswith(".part") for path in out.rglob("*"))
            number += 1
    return found


def kills(folder: Path, runs: int, seed: int) -> dict[str, dict[str, int]]:
    """Half of the runs of each command."""
    os.environ["PYTHONPATH"] = str(Path(__file__).parents[2])
    rng = random.Random(seed)
    found = {"prepare": kill_prepare(folder, runs // 2, rng)}
    print(json.dumps(found), flush=True)
    return {**found, "sweep": kill_sweep(folder, runs - runs // 2, rng)}
