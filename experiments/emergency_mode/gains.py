"""Gains of the emergency mode's magnetic laws, which Somov 2018 does not give, by gradient through the closed loop.

The loss is the mean over random starts (up to 30 deg off, turning slowly, inertia and field not as known) of a smooth
settling time, the time spent beyond about a degree in four orbits, and of the residual angle in the last orbit.
Derivatives by the logarithms of five parameters are taken forward through 1488 control periods with their noise,
saturation and duty test; they do not see the switches, yet over many starts Adam descends by them, on other starts at
each step. Prints loss and gains, compares starts not tuned on, writes JSON and a picture.

    .venv/bin/python experiments/emergency_mode/gains.py --out out/emergency-gains
"""

import argparse
import json
import math
import time
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax

NAMES = ("attitude_gain", "rate_gain", "fine_gain", "fine_lead", "fine_pole")
FIRST_GUESS = (1e-6, 2e-3, 1e-6, 2e-3, 0.8)
"""The actuator's authority, some 1e-6 rad/s^2, at a radian, with critical damping."""
CASES, STEPS, RATE = 48, 60, 0.08
ORBITS, SOFT_DEG, RESIDUAL_WEIGHT_S = 4, 1.0, 20_000.0


def law_of(parameters):
    """The law of a vector of parameters: logarithms, and the pole through a logistic function."""
    from jaxsat.control.emergency_mode.law import EmergencyLaw

    attitude, rate, fine, lead = jnp.exp(parameters[:4])
    return EmergencyLaw(attitude, rate, fine, lead, jax.nn.sigmoid(parameters[4]))


def parameters_of(values) -> np.ndarray:
    return np.array([*np.log(values[:4]), math.log(values[4] / (1.0 - values[4]))])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/emergency-gains"), help="directory for results")
    parser.add_argument("--steps", type=int, default=STEPS)
    arguments = parser.parse_args()
    folder = arguments.out
    folder.mkdir(parents=True, exist_ok=True)

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.control.emergency_mode.cases import run_leg
    from jaxsat.control.emergency_mode.draw import Dispersions, draw_cases
    from jaxsat.control.emergency_mode.loop import ALWAYS_ON
    from jaxsat.control.emergency_mode.orbit import fly, leg, orbital_period

    flight = fly(ORBITS * 6000.0 / 86400.0)
    orbit = round(orbital_period(flight) / 16.0)
    around = leg(flight, 0, ORBITS * orbit)
    spread = Dispersions(max_error_deg=30.0, max_rate_deg_s=0.01, inertia=0.05, field=0.02, magnetometer=0.01)

    def costs(parameters, keys):
        law, cases = law_of(parameters), draw_cases(spread, around, keys)

        def one(case):
            _, samples = run_leg(ALWAYS_ON, law, case.vehicle, around, case.state, case.key)
            square = jnp.sum(samples.error**2, axis=1)
            degrees = jnp.degrees(jnp.sqrt(square + math.radians(1e-3) ** 2))
            settling = 16.0 * jnp.sum(square / (square + math.radians(SOFT_DEG) ** 2))
            return settling + RESIDUAL_WEIGHT_S * jnp.mean(degrees[-orbit:]), (settling, jnp.max(degrees[-orbit:]))

        total, parts = jax.vmap(one)(cases)
        return jnp.mean(total), (jnp.mean(parts[0]), jnp.mean(parts[1]), jnp.mean(parts[1] < 1.0))

    gradient = eqx.filter_jit(lambda p, keys: (costs(p, keys), jax.jacfwd(lambda p: costs(p, keys)[0])(p)))
    value = eqx.filter_jit(costs)

    parameters = parameters_of(FIRST_GUESS)
    optimizer = optax.adam(optax.cosine_decay_schedule(RATE, arguments.steps, alpha=0.1))
    state, history = optimizer.init(parameters), []
    began = time.perf_counter()
    for step in range(arguments.steps + 1):
        keys = jax.random.split(jax.random.fold_in(jax.random.key(1), step), CASES)
        (loss, parts), slope = jax.device_get(gradient(parameters, keys))
        history.append({"loss": float(loss), "settling_s": float(parts[0]), "residual_deg": float(parts[1])})
        if step % 10 == 0:
            gains = ", ".join(f"{x:.3g}" for x in np.asarray(jax.tree.leaves(law_of(parameters))[:5]))
            print(f"{step:3d}  loss {loss:8.0f} s  settling {parts[0]:6.0f} s  residual {parts[1]:.3f} deg  {gains}")
        if step == arguments.steps:
            break
        updates, state = optimizer.update(slope, state)
        parameters = np.asarray(optax.apply_updates(parameters, updates))

    others = jax.random.split(jax.random.key(2), 4 * CASES)
    found = {}
    for name, p in (("first guess", parameters_of(FIRST_GUESS)), ("found", parameters)):
        loss, (settling, residual, share) = jax.device_get(value(p, others))
        gains = dict(zip(NAMES, map(float, jax.tree.leaves(law_of(p))[:5]), strict=True))
        numbers = {"settling_s": float(settling), "residual_deg": float(residual), "below_1_deg": float(share)}
        found[name] = {"gains": gains, "loss": float(loss), **numbers}
        print(
            f"{name:12s} on {len(others)} other starts: loss {loss:.0f} s, settling {settling:.0f} s, largest angle of "
            f"the last orbit {residual:.3f} deg, below 1 deg {100 * share:.1f} %"
        )
    print("gains:", ", ".join(f"{k} = {v:.3g}" for k, v in found["found"]["gains"].items()))
    print(f"{time.perf_counter() - began:.0f} s")
    picture(history, folder / "gains.png")
    report = {"history": history, "compared": found}
    (folder / "gains.json").write_text(json.dumps(report, indent=1))


def picture(history: list[dict], path: Path) -> None:
    from jaxsat.plotting.style import dress, new_figure, png_bytes

    figure = new_figure(7.0, 4.2, "Gains by gradient through the closed loop", "mean over the starts tuned on")
    axes = figure.add_axes((0.09, 0.13, 0.78, 0.7))
    axes.plot([each["settling_s"] / 3600.0 for each in history], color="#2340a8", lw=1.6, label="settling time")
    axes.plot([each["loss"] / 3600.0 for each in history], color="#8a4b20", lw=1.6, label="loss")
    dress(axes, y_label="hours", x_label="step")
    axes.set_ylim(bottom=0.0)
    other = axes.twinx()
    other.plot([each["residual_deg"] for each in history], color="#2e8b3d", lw=1.2, ls="--", label="residual, right")
    other.set(yscale="log")
    other.set_ylabel("largest angle of the last orbit, deg", fontsize=9)
    other.tick_params(which="both", labelsize=8)
    other.spines[["top"]].set_visible(False)
    lines = [*axes.get_lines(), *other.get_lines()]
    axes.legend(lines, [str(line.get_label()) for line in lines], frameon=False, fontsize=9)
    path.write_bytes(png_bytes(figure))


if __name__ == "__main__":
    main()
