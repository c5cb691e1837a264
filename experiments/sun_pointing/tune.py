"""Gains of Sun pointing tuned by derivatives of means over 1000 cases, and what that gained on 1000 others.

The goal is the mean of settling time [s] + `PRICE` x impulse [N s]: what a newton second is worth in seconds. Descent
along the derivative by the logarithms of four parameters, in steps of at most 15 %.

    .venv/bin/python experiments/sun_pointing/tune.py --steps 12 --out out/sun-tune.json
"""

import argparse
import json
from pathlib import Path

import numpy as np
from rich.progress import track

NAMES = ("attitude_gain", "rate_gain", "slew_rate", "search_rate")
PRICE = 3.0
STEP = 0.15
PERIODS = 1200


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--out", type=Path, default=Path("sun-tune.json"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    import jax
    import jax.numpy as jnp

    from jaxsat.control.sun_pointing.cases import run_cases
    from jaxsat.control.sun_pointing.draw import Dispersions, draw_cases
    from jaxsat.control.sun_pointing.law import SunPointingLaw
    from jaxsat.control.sun_pointing.sensing import LoopSettings
    from jaxsat.control.sun_pointing.sensitivity import impulse, scaled, sensitivities, settling_time
    from jaxsat.sweep import case_keys

    settings, sun_eci = LoopSettings(), jnp.array([1.0, 0.0, 0.0])

    def goal(state):
        return settling_time(state) + PRICE * impulse(state)

    metrics = (goal, settling_time, impulse)

    def cases(first: int):
        return draw_cases(Dispersions(), case_keys(0, np.arange(first, first + arguments.cases)))

    @jax.jit
    def evaluate(law, drawn):
        state = run_cases(settings, law, drawn, sun_eci, PERIODS)
        return jnp.stack([metric(state) for metric in metrics])

    def means(law, drawn) -> dict[str, float]:
        found = np.asarray(evaluate(law, drawn))
        good = np.isfinite(found).all(axis=0)
        keys = ("goal_s", "settling_time_s", "impulse_N_s", "settled")
        return dict(zip(keys, [*found[:, good].mean(axis=1).tolist(), float(good.mean())], strict=True))

    nominal = SunPointingLaw()
    training, others = cases(0), cases(10**6)
    log_factor, history = np.zeros(len(NAMES)), []
    best = (np.inf, log_factor)
    for number in track(range(arguments.steps), "steps"):
        law, _ = scaled(nominal, training, NAMES, jnp.tile(jnp.asarray(log_factor), (arguments.cases, 1)))
        found = sensitivities(settings, law, training, sun_eci, PERIODS, NAMES, metrics, jax.random.key(number))
        slope = found[0].gradient
        history.append({"log_factor": log_factor.tolist(), "mean_goal_s": found[0].mean, "gradient": slope.tolist()})
        best = min(best, (found[0].mean, log_factor), key=lambda each: each[0])
        # The steps shrink, so that the noise of the derivatives averages out.
        log_factor = log_factor - STEP / (1.0 + 0.2 * number) * slope / np.abs(slope).max()
    tuned, _ = scaled(nominal, others, NAMES, jnp.tile(jnp.asarray(best[1]), (arguments.cases, 1)))
    result = {
        "parameters": {
            name: {"before": float(getattr(nominal, name)), "after": float(np.asarray(getattr(tuned, name))[0])}
            for name in NAMES
        },
        "others_before": means(nominal, others),
        "others_after": means(tuned, others),
        "history": history,
    }
    for name, value in result["parameters"].items():
        print(f"{name:15s} {value['before']:.4g} -> {value['after']:.4g}")
    for name, before in result["others_before"].items():
        print(f"{name:15s} {before:.4g} -> {result['others_after'][name]:.4g}   (cases that were not tuned on)")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
