"""Is the Earth always found within 20 minutes, as Melnikov et al. 2022 say? Their search and a better one, same cases.

Prints a table, writes JSON and the distribution of the search time. `jaxsat sweep earth-search` is the same with files
and pictures of the cases.

    .venv/bin/python experiments/earth_search/study.py --cases 20000 --out out/earth-study
"""

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

STRATEGIES = ("published", "fast", "guarded")
CONDITIONS: dict[str, dict[str, str]] = {
    "800 km, large": {},
    "0.01 deg/s and nothing else": {"tracking": "published"},
    "even Earth, no Moon, no Sun": {"brightness": "even", "moon": "no", "sun": "none"},
    "still Earth": {"earth": "still"},
    "still Earth, 0.01 deg/s and nothing else": {"earth": "still", "tracking": "published"},
    "still and even Earth, no Moon, no Sun": {"earth": "still", "brightness": "even", "moon": "no", "sun": "none"},
    "no Moon": {"moon": "no"},
    "no Sun": {"sun": "none"},
    "Sun not blocked": {"sun": "unblocked"},
    "presence inside always": {"inside": "always"},
    "presence inside never": {"inside": "never"},
    "presence inside at random": {"inside": "random"},
    "failed sensor replaced": {"failure": "replaced"},
    "failed sensor silent": {"failure": "silent"},
    "failed sensor stuck": {"failure": "stuck"},
    "start about the diagonal": {"start_axis_deg": "45"},
    "400 km, sensors for 800 km": {"altitude_km": "400"},
    "600 km, sensors for 800 km": {"altitude_km": "600"},
    "1500 km, sensors for 800 km": {"altitude_km": "1500"},
    "400 km, sensors for it": {"altitude_km": "400", "mounting_deg": "0"},
    "1500 km, sensors for it": {"altitude_km": "1500", "mounting_deg": "0"},
    "400 to 1500 km, sensors for 950 km": {"altitude_km": "950", "altitude_spread_km": "550", "mounting_deg": "0"},
    "800 km, small": {"spacecraft": "small"},
    "presence inside never, small": {"spacecraft": "small", "inside": "never"},
}


def study(options: dict[str, str], cases: int, seed: int) -> tuple[dict, np.ndarray]:
    """Counts and percentiles of one condition over all of its cases, and its search times [s], inf where the Earth was
    not found (null in the file)."""
    from jaxsat.sweep.scenarios import earth_search

    scenario = earth_search.make(options)
    chunks = np.split(np.arange(-(-cases // scenario.chunk) * scenario.chunk), -(-cases // scenario.chunk))
    scenario.run(seed, chunks[0])
    began = time.perf_counter()
    # XLA runs such a program on one core and releases the GIL.
    with ThreadPoolExecutor(2) as pool:
        parts = list(pool.map(lambda numbers: scenario.run(seed, numbers), chunks))
    seconds = time.perf_counter() - began
    found = {name: np.concatenate([part[name] for part in parts])[:cases] for name in parts[0]}
    status, searched = found["status"], found["search_time_s"]
    times = np.where(np.isfinite(searched), searched, np.inf)
    first = np.where(np.isfinite(found["first_capture_s"]), found["first_capture_s"], np.inf)
    p50, p95, p99 = np.quantile(times, [0.5, 0.95, 0.99], method="nearest").tolist()
    worst = np.argsort(times)[::-1][:5]
    return {
        "options": options,
        "seconds_warm": seconds,
        "status": {name: int(np.sum(status == k)) for k, name in enumerate(scenario.statuses)},
        "over_20_min": float(np.mean(times > earth_search.LIMIT_S)),
        "first_capture_over_20_min": float(np.mean(first > earth_search.LIMIT_S)),
        "search_time_s": {"p50": p50, "p95": p95, "p99": p99, "max": float(times.max())},
        "captures": float(np.mean(found["captures"])),
        "final_error_deg": float(np.median(found["final_error_deg"][status == 0])) if np.any(status == 0) else None,
        "worst_cases": worst.tolist(),
    }, times


def picture(times: dict[str, np.ndarray]) -> bytes:
    """Share of the cases that have found the Earth, over time."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.style import INK, dress, new_figure

    cases = len(next(iter(times.values())))
    figure = new_figure(8.0, 4.2, "Earth search, large spacecraft at 800 km", f"{cases} cases; dashed: 20 minutes")
    axes = figure.add_axes((0.09, 0.12, 0.88, 0.70))
    for name, values in times.items():
        known = np.sort(values[np.isfinite(values)])
        style = "--" if name == STRATEGIES[-1] else "-"
        share = np.arange(1, len(known) + 1) / cases
        axes.step(known / 60.0, share, where="post", linewidth=1.4, linestyle=style, label=name)
    axes.axvline(20.0, color=INK, linewidth=0.8, linestyle="--")
    axes.set_ylim(0.0, 1.02)
    axes.legend(fontsize=8, frameon=False, loc="lower right")
    dress(axes, x_label="time, min", y_label="share that tracks the Earth for good")
    return png_bytes(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1, help="another than that of tune.py")
    parser.add_argument("--strategies", nargs="+", default=STRATEGIES, choices=STRATEGIES)
    parser.add_argument("--conditions", nargs="+", default=list(CONDITIONS), choices=list(CONDITIONS), metavar="NAME")
    parser.add_argument("--out", type=Path, default=Path("out/earth-study"), help="directory of the results")
    arguments = parser.parse_args()

    from jaxsat.files.json_files import json_text, plain
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    arguments.out.mkdir(parents=True, exist_ok=True)
    runs, drawn = [], {}
    print(
        "| condition | strategy | tracks at the end | over 20 min | first capture over 20 min | p50, p95, p99, max, s |"
    )
    print("|---|---|---|---|---|---|")
    for condition in arguments.conditions:
        for strategy in arguments.strategies:
            options = {**CONDITIONS[condition], "strategy": strategy}
            found, times = study(options, arguments.cases, arguments.seed)
            runs.append({"condition": condition, "strategy": strategy, **found})
            spans = ", ".join(f"{x:.0f}" for x in found["search_time_s"].values())
            share = f"{found['status']['succeeded'] / arguments.cases:.2%}"
            late = f"{found['over_20_min']:.2%} | {found['first_capture_over_20_min']:.2%}"
            print(f"| {condition} | {strategy} | {share} | {late} | {spans} |", flush=True)
            # Written after each, so that a long study can be stopped.
            content = {"cases": arguments.cases, "seed": arguments.seed, "runs": runs}
            (arguments.out / "study.json").write_text(json_text(plain(content)[0]))
            if condition == next(iter(CONDITIONS)):
                drawn[strategy] = times
    if drawn:
        (arguments.out / "search_time.png").write_bytes(picture(drawn))


if __name__ == "__main__":
    main()
