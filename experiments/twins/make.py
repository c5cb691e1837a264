"""Synthetic sessions of satellites that are not Munin, and their truth, by a program that has nothing of `jaxsat`.

.venv/bin/python -m experiments.twins.make 1u-unitmag --seed 1 --seeds 10 --out twins
"""

import argparse
import time
from pathlib import Path

from experiments.twins.draw import SPREAD, draw
from experiments.twins.presets import PRESETS
from experiments.twins.write import write_session


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=[*PRESETS, "all"])
    parser.add_argument("--seed", type=int, default=1, help="of the first session")
    parser.add_argument("--seeds", type=int, default=1, help="how many, one after the other")
    parser.add_argument("--spread", type=float, default=SPREAD, help="scatter of the truth over the file's sigmas")
    parser.add_argument("--out", type=Path, default=Path("twins"))
    asked = parser.parse_args()
    for kind in PRESETS if asked.kind == "all" else [asked.kind]:
        for seed in range(asked.seed, asked.seed + asked.seeds):
            began = time.perf_counter()
            table = write_session(draw(kind, seed, asked.spread), asked.out)
            print(f"{table}  {time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    main()
