"""Blind fits of random sessions of Munin: how often the truth is found, and whether the stated sigmas hold.

Every session is fitted with everything free from the nominal satellite, without a first guess; gains too for the hard
ones. Where the truth was missed, the fit that starts at the truth says which of the two minima is the better one.

    .venv/bin/python experiments/blind/study.py --sessions 30 --cache blind-sessions --out blind/study.json
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from generate import REGIMES, regime_of
from report import picture, table
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

REACHED_DEG = 2.0
"""Median attitude error below which the truth's minimum was found."""
SAME_CHI2 = 9.0
"""Or chi2 no more than this above that of the fit from the truth: as good an answer at three sigmas."""


def run(number: int, cache: Path, *, hard: bool) -> dict[str, Any]:
    """One blind fit, judged."""
    # JAX is set up before anything of it is imported.
    from session import blind_session, compare, fit_from_truth, left_out, truncated_cost

    from jaxsat.errors import InputError

    session = blind_session(number, cache, hard=hard)
    spin = float(np.degrees(np.linalg.norm(session.truth["w"], axis=1).max()))
    row: dict[str, Any] = {"session": number, "hard": hard, "regime": REGIMES[regime_of(number)], "spin_deg_s": spin}
    row["lit"] = int(np.sum(session.truth["lit"]))
    began = time.perf_counter()
    try:
        result = session.fit()
    except InputError as error:
        return row | {
            "status": "refused",
            "message": str(error),
            "reached": False,
            "seconds": time.perf_counter() - began,
        }
    row |= {"seconds": time.perf_counter() - began, "timing_s": result.timing_s}
    row |= {"status": result.status, "message": result.message, "chi2": result.chi2, "dof": result.dof}
    row |= {"left_out": left_out(result), "alternatives": list(result.alternatives)}
    row |= compare(session, result)
    row["reached"] = row["attitude_median_deg"] < REACHED_DEG
    if not row["reached"] or result.status != "converged":
        from_truth = fit_from_truth(session)
        excess = truncated_cost(session, result) - truncated_cost(session, from_truth)
        at_truth = compare(session, from_truth)
        row["from_truth"] = {
            "cost_of_fit_above": excess,
            "chi2": from_truth.chi2,
            "dof": from_truth.dof,
            "status": from_truth.status,
            "message": from_truth.message,
            "left_out": left_out(from_truth),
            "attitude_median_deg": at_truth["attitude_median_deg"],
        }
        row["reached"] = row["reached"] or abs(excess) < SAME_CHI2
    return row


def line(row: dict[str, Any]) -> str:
    """One session in a line."""
    text = f"{row['session']:4d} {row['regime']:24s} {row['spin_deg_s']:5.2f} deg/s {row['lit']:4d} lit"
    text += f"  {row['status']:13s}"
    if row["status"] == "refused":
        return f"{text} {row['message']}"
    text += f" median {row['attitude_median_deg']:7.2f} deg, chi2/dof {row['chi2'] / max(row['dof'], 1):7.2f}"
    text += f", {row['left_out']:3d} left out, {row['seconds']:5.1f} s"
    if "from_truth" in row:
        other = row["from_truth"]
        text += f"; cost {row['from_truth']['cost_of_fit_above']:+.1f} from that of the truth's minimum, which is "
        text += f"{other['attitude_median_deg']:.2f} deg off with chi2/dof {other['chi2'] / max(other['dof'], 1):.2f}"
    return text if row["reached"] else f"{text}  MISSED"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=30, help="how many")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--hard", action="store_true", help="with samples and a panel lost, and gains unknown")
    parser.add_argument("--regimes", type=int, nargs="+", default=[0, 1, 2], help="which of the three: 0 1 2")
    parser.add_argument("--out", type=Path, default=Path("study.json"), help="results; the picture is written beside")
    parser.add_argument("--cache", type=Path, default=Path("blind-sessions"), help="directory of the sessions")
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    columns = (TextColumn("{task.description}"), BarColumn(24), MofNCompleteColumn(), TimeElapsedColumn())
    numbers = range(arguments.first, arguments.first + arguments.sessions)
    numbers = [number for number in numbers if regime_of(number) in arguments.regimes]
    rows: list[dict[str, Any]] = []
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    with Progress(*columns, TimeRemainingColumn()) as progress:
        task = progress.add_task("blind fits", total=len(numbers))
        for number in numbers:
            rows.append(run(number, arguments.cache, hard=arguments.hard))
            progress.console.print(line(rows[-1]), soft_wrap=True, highlight=False)
            # Written after each, so that a long study can be stopped.
            arguments.out.write_text(json.dumps({"schema": "jaxsat.blind/1", "runs": rows}, indent=1))
            progress.advance(task)
    picture(rows, arguments.out.with_suffix(".png"))
    print("\n" + table(rows))


if __name__ == "__main__":
    main()
