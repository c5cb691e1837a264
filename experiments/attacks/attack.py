"""Damaged files for every reader, and commands killed at random: what still fails.

    .venv/bin/python -m experiments.attacks.attack --inputs 200000 --kills 100 --jobs 2 --out attacks

Every input is drawn from the seed, its kind and its number. Counted are tracebacks (warnings are errors), inputs that
take more than `LIMIT_S`, errors that are no clear line, and what was taken although `readers` finds it wrong. Writes
OUT/attacks.json, and to OUT/failures the inputs that failed, the first of each place in the code.
"""

import argparse
import json
import multiprocessing
import random
import signal
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from experiments.attacks.mutate import mutated
from jaxsat.errors import InputError

LIMIT_S = 5.0
BATCH = 500
OUTCOMES = ("refused", "taken", "traceback", "hang", "unclear", "silent")
BAD = OUTCOMES[2:]


class Late(BaseException):
    """The time of an input is over."""


def batch(kind: str, begin: int, end: int, seed: int, folder: Path) -> tuple[str, Counter, dict[str, bytes]]:
    """Tries the inputs of a kind with numbers from `begin` to below `end`; outcomes, and what failed by its place."""
    from experiments.attacks.readers import readers
    from experiments.attacks.sources import sources
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    contents = sources(folder)[kind]
    ending, _, read = readers(folder / "run")[kind]
    signal.signal(signal.SIGALRM, _late)
    counts: Counter = Counter()
    failures: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("error")
        for number in range(begin, end):
            rng = random.Random(f"{seed} {kind} {number}")
            data = mutated(rng.choice(contents), rng)
            path = Path(place) / f"input{ending}"
            path.write_bytes(data)
            outcome, where = tried(read, path)
            counts[outcome] += 1
            if outcome in BAD:
                failures.setdefault(f"{outcome}: {where}", data)
    return kind, counts, failures


def _late(*_: Any) -> None:
    raise Late


def tried(read: Any, path: Path) -> tuple[str, str]:
    """One of `OUTCOMES`, and where it came from."""
    signal.setitimer(signal.ITIMER_REAL, LIMIT_S)
    try:
        wrong = read(path)
        return ("silent", wrong) if wrong else ("taken", "")
    except InputError as error:
        clear = str(error).isprintable() and len(str(error)) < 2000
        return ("refused", "") if clear else ("unclear", repr(str(error)[:80]))
    except Late as error:
        return "hang", _place(error)
    except Exception as error:
        return "traceback", f"{type(error).__name__} in {_place(error)}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _place(error: BaseException) -> str:
    """The innermost line that is ours."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "site-packages" not in f.filename]
    own = [f for f in frames if "/jaxsat/" in f.filename or "/fitting/" in f.filename] or frames
    return f"{Path(own[-1].filename).name}:{own[-1].lineno}"


def attacked(inputs: int, seed: int, jobs: int, out: Path) -> dict[str, Any]:
    """Outcomes by kind, and the places of what failed."""
    from experiments.attacks.readers import readers
    from experiments.attacks.sources import sources

    sources(out)
    shares = {kind: share for kind, (_, share, _) in readers(out / "run").items()}
    total = sum(shares.values())
    counts = {kind: Counter() for kind in shares}
    places: Counter = Counter()
    (out / "failures").mkdir(exist_ok=True)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        tasks = []
        for kind, share in shares.items():
            size = round(inputs * share / total)
            tasks += [
                pool.submit(batch, kind, begin, min(begin + BATCH, size), seed, out) for begin in range(0, size, BATCH)
            ]
        for task in as_completed(tasks):
            kind, found, failures = task.result()
            counts[kind] += found
            for where, data in failures.items():
                if places[f"{kind}: {where}"] == 0:
                    name = f"{len(places):03d}-{kind.replace(' ', '_')}.bin"
                    (out / "failures" / name).write_bytes(data)
                    print(f"{kind}: {where}: {name}", flush=True)
                places[f"{kind}: {where}"] += 1
    return {"counts": {kind: {name: found[name] for name in OUTCOMES} for kind, found in counts.items()}}


def main() -> None:
    """From the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", type=int, default=200_000)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("attacks"))
    asked = parser.parse_args()
    out: Path = asked.out.absolute()
    out.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    found: dict[str, Any] = {"seed": asked.seed, **attacked(asked.inputs, asked.seed, asked.jobs, out)}
    total = Counter()
    print(f"{'kind':24s}" + "".join(f"{name:>11s}" for name in OUTCOMES))
    for kind, counts in found["counts"].items():
        total.update(counts)
        print(f"{kind:24s}" + "".join(f"{counts[name]:11d}" for name in OUTCOMES))
    print(f"{'all ' + str(sum(total.values())):24s}" + "".join(f"{total[name]:11d}" for name in OUTCOMES), flush=True)
    if asked.kills:
        from experiments.attacks.kills import kills

        found["kills"] = kills(out, asked.kills, asked.seed)
        print(json.dumps(found["kills"], indent=1))
    found["seconds"] = round(time.perf_counter() - begin, 1)
    (out / "attacks.json").write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
