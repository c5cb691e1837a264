"""Sun pointing beside the same loop in numba: do both find the same of 100 cases, and how long do they take?

Both use the published estimator, float64, one control period a second, 1500 s. Ours runs 10 000 cases as a sweep does,
numba 100 of them, one after the other on one core; times of 10 000 are to scale. Prints a table, writes JSON.

    .venv/bin/pip install -e '.[benchmarks]'
    .venv/bin/python experiments/benchmarks/sun_pointing_peers.py --out sun-peers.json
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

CASES, PEER_CASES, PERIODS, SEED = 10_000, 100, 1500, 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("sun-peers.json"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from models.sun_pointing_numba import all_cases
    from models.sun_pointing_ours import timed_sweep

    from jaxsat.control.sun_pointing.draw import Dispersions, draw_cases
    from jaxsat.control.sun_pointing.law import SunPointingLaw
    from jaxsat.control.sun_pointing.vehicle import INERTIA_KG_M2, LEVER_M, MIN_PULSE_S, TORQUE_N_M
    from jaxsat.sweep import case_keys
    from jaxsat.sweep.scenarios import sun_pointing

    law = SunPointingLaw()
    names = ("attitude_gain", "rate_gain", "slew_rate", "search_rate", "search_turn", "damped_rate", "rate_dead_band")
    numbers = tuple(float(getattr(law, name)) for name in (*names, "settled_angle", "settled_rate", "hold_time"))
    drawn = draw_cases(Dispersions(), case_keys(SEED, np.arange(PEER_CASES)))
    q, w = np.asarray(drawn.quaternion), np.asarray(drawn.angular_velocity)
    craft = (INERTIA_KG_M2, np.linalg.inv(INERTIA_KG_M2), numbers, TORQUE_N_M[0], LEVER_M, MIN_PULSE_S)
    all_cases(q[:1], w[:1], *craft, 10)
    began = time.perf_counter()
    theirs = all_cases(q, w, *craft, PERIODS)
    peer_s = time.perf_counter() - began

    ours_s, _, found = timed_sweep("published", seed=SEED, cases=CASES, chunk=sun_pointing.CHUNK)
    ours = np.stack([found["settling_time_s"][:PEER_CASES], found["impulse_N_s"][:PEER_CASES]], axis=1)
    same = np.abs(ours[:, 0] - theirs[:, 0]) < 0.5
    result = {
        "ours_10000_s": ours_s,
        "numba_100_s": peer_s,
        "numba_10000_two_cores_s": peer_s * CASES / PEER_CASES / 2.0,
        "same_settling_time": int(same.sum()),
        "largest_difference_s": float(np.abs(ours[:, 0] - theirs[:, 0]).max()),
        "largest_difference_of_impulse": float(np.abs(ours[:, 1] / theirs[:, 1] - 1.0).max()),
    }
    ratio = result["numba_10000_two_cores_s"] / result["ours_10000_s"]
    print(f"ours, 10 000 cases, two threads: {result['ours_10000_s']:.2f} s")
    print(
        f"numba, 100 cases: {peer_s:.3f} s; 10 000 on two cores to scale {result['numba_10000_two_cores_s']:.2f} s, "
        f"{ratio:.1f} times ours"
    )
    print(
        f"{result['same_settling_time']} of {PEER_CASES} settle in the same second, the others within "
        f"{result['largest_difference_s']:.0f} s; impulse within {100 * result['largest_difference_of_impulse']:.2g} %"
    )
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
