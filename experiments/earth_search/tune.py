"""Start axis and rates of the Earth search tried on one set of cases, the best judged on another.

The best is that with the fewest cases of more than 20 minutes, among rates to 0.25 deg/s (Melnikov et al. 2022, large
spacecraft) and among all that are tried. Prints tables, writes JSON and a picture.

    .venv/bin/python experiments/earth_search/tune.py --out out/earth-tune
"""

import argparse
import json
from pathlib import Path

AXES_DEG = (0.0, 22.5, 45.0)
SEARCH_DEG_S = (0.15, 0.2, 0.25, 0.35, 0.5)
APPROACH_DEG_S = (0.1, 0.15, 0.2, 0.25, 0.35, 0.5)
PUBLISHED_DEG_S = 0.25
STRATEGY = "fast"
SEED, JUDGE_SEED = 100, 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2000, help="to tune on, as many as to judge on")
    parser.add_argument("--out", type=Path, default=Path("out/earth-tune"), help="directory of the results")
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from study import study

    tried = []
    for axis in AXES_DEG:
        for search in SEARCH_DEG_S:
            for approach in APPROACH_DEG_S:
                options = options_of(axis, search, approach)
                found, _ = study(options, arguments.cases, SEED)
                tried.append({"axis_deg": axis, "search_deg_s": search, "approach_deg_s": approach, **found})
    slow = [one for one in tried if max(one["search_deg_s"], one["approach_deg_s"]) <= PUBLISHED_DEG_S]
    as_fast = next(one for one in slow if one["axis_deg"] == 0.0 and at_rates(one, PUBLISHED_DEG_S))
    chosen = {"fast as it is": as_fast, "best to 0.25 deg/s": min(slow, key=rank), "best of all": min(tried, key=rank)}
    print("share over 20 minutes, axis 0 deg; down: search, across: approach and corrections, deg/s")
    print("| | " + " | ".join(f"{x:g}" for x in APPROACH_DEG_S) + " |\n" + "|---" * (1 + len(APPROACH_DEG_S)) + "|")
    for search in SEARCH_DEG_S:
        row = [one for one in tried if one["axis_deg"] == 0.0 and one["search_deg_s"] == search]
        print(f"| {search:g} | " + " | ".join(f"{one['over_20_min']:.1%}" for one in row) + " |")
    print("\n| | axis, deg | search, approach, deg/s | over 20 min tuned on | judged on | p95, max, s |")
    print("|---|---|---|---|---|---|")
    judged = {}
    for name, one in chosen.items():
        options = options_of(one["axis_deg"], one["search_deg_s"], one["approach_deg_s"])
        judged[name], _ = study(options, arguments.cases, JUDGE_SEED)
        times = judged[name]["search_time_s"]
        print(
            f"| {name} | {one['axis_deg']:g} | {one['search_deg_s']:g}, {one['approach_deg_s']:g} "
            f"| {one['over_20_min']:.2%} | {judged[name]['over_20_min']:.2%} | {times['p95']:.0f}, {times['max']:.0f} |"
        )
    arguments.out.mkdir(parents=True, exist_ok=True)
    content = {"seed": SEED, "judge_seed": JUDGE_SEED, "cases": arguments.cases, "tried": tried, "judged": judged}
    (arguments.out / "tune.json").write_text(json.dumps(content, indent=1))
    (arguments.out / "tune.png").write_bytes(picture(tried))


def options_of(axis_deg: float, search_deg_s: float, approach_deg_s: float) -> dict[str, str]:
    return {
        "strategy": STRATEGY,
        "start_axis_deg": f"{axis_deg:g}",
        "search_rate_deg_s": f"{search_deg_s:g}",
        "approach_rate_deg_s": f"{approach_deg_s:g}",
    }


def at_rates(one: dict, rate: float) -> bool:
    return one["search_deg_s"] == rate == one["approach_deg_s"]


def rank(one: dict) -> tuple[float, float]:
    return one["over_20_min"], one["search_time_s"]["p95"]


def picture(tried: list[dict]) -> bytes:
    """Share over 20 minutes over the rate of the approach, a curve for each rate of the search, a panel an axis."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.style import dress, head, new_figure

    figure = new_figure(9.6, 3.8, "Rates and start axis of the Earth search", "share over 20 minutes, %")
    axes = figure.subplots(
        1, len(AXES_DEG), sharey=True, gridspec_kw={"left": 0.05, "right": 0.985, "top": 0.72, "bottom": 0.17}
    )
    for each, axis in zip(axes, AXES_DEG, strict=True):
        for search in SEARCH_DEG_S:
            part = [one for one in tried if one["axis_deg"] == axis and one["search_deg_s"] == search]
            shares = [100.0 * one["over_20_min"] for one in part]
            label = f"search {search:g} deg/s"
            each.plot([one["approach_deg_s"] for one in part], shares, linewidth=1.2, marker=".", label=label)
        dress(each, x_label="approach and corrections, deg/s")
        head(each, f"first axis {axis:g} deg from x")
    curves = axes[0].get_lines()
    figure.legend(handles=curves, loc="upper right", ncols=3, fontsize=8, frameon=False)
    return png_bytes(figure)


if __name__ == "__main__":
    main()
