"""What drives a closed loop on average: derivatives through it, and where they say nothing. The emergency mode.

A satellite with coils turns into its orbital attitude (`jaxsat sweep emergency-mode`), one orbit, from random errors,
rates, moments of inertia and fields, all normal. Exact derivatives of three metrics by each of ten inputs, over all of
them: mean, and root mean square with the bound that it sets to the total Sobol index (Sobol & Kucherenko 2009). Then

- the same by finite differences of the very same cases, and
- the mean derivative without any derivative: of normal inputs it is Cov(f, x)/V(x) (Stein 1981).

The largest error is smooth, all three agree. The error at the end and what the coils spend jump where the law changes
between its two equations: derivatives along a path see nothing of that, and the third says so. Prints tables, writes
JSON.

    .venv/bin/python experiments/sensitivity/derivatives.py --points 2048 --out out/derivatives.json
"""

import argparse
import json
import math
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.sensitivity.sweeps import derivative_measures, sobol_indices
from fitting.sensitivity.sweeps.derivatives import poincare_normal
from jaxsat.control.emergency_mode.cases import run_leg
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.loop import ALWAYS_ON, first_state
from jaxsat.control.emergency_mode.orbit import fly, leg, orbital_period
from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S, nominal_vehicle
from jaxsat.math import inverse_3x3, quaternion
from jaxsat.numerics import set_up_jax

SIGMA = {
    **{f"error {c}": math.radians(5.0) for c in "xyz"},
    **{f"rate {c}": math.radians(0.003) for c in "xyz"},
    **{f"inertia {c}{c}": 0.05 for c in "xyz"},
    "field": 0.02,
}
"""1-sigma of the attitude error [rad], the rate [rad/s], moments of inertia and field [relative]."""
CHUNK, STEP = 128, 1e-5
"""Points at once; finite differences over the 1-sigma."""


def loop():
    """The metrics of one case, a function of ten inputs."""
    flight = fly(1.2 * 6000.0 / 86400.0)
    around = leg(flight, 0, round(orbital_period(flight) / CONTROL_PERIOD_S))
    nominal, law = nominal_vehicle(), EmergencyLaw()

    def metrics(x):
        inertia = nominal.inertia * (jnp.eye(3) + jnp.diag(x[6:9]))
        changed = (inertia, inverse_3x3(inertia), (1.0 + x[9]) * jnp.eye(3))
        vehicle = eqx.tree_at(lambda v: (v.inertia, v.inverse_inertia, v.field_error), nominal, changed)
        start = first_state(around, quaternion.from_rotation_vector(x[:3]), x[3:6], vehicle)
        state, samples = run_leg(ALWAYS_ON, law, vehicle, around, start)
        error = jnp.degrees(jnp.sqrt(jnp.sum(samples.error**2, axis=1)))
        return {
            "largest_error_deg": jnp.max(error),
            "final_error_deg": error[-1],
            "magnetic_impulse_A_m2_s": state.impulse,
        }

    return metrics


def differences(metrics, points: np.ndarray, sigma: np.ndarray) -> dict[str, np.ndarray]:
    """Central differences of each metric [points inputs]."""
    run = jax.jit(jax.vmap(metrics))
    slopes: dict[str, list[np.ndarray]] = {}
    for k, size in enumerate(sigma):
        step = STEP * size * np.eye(len(sigma))[k]
        parts = range(0, len(points), CHUNK)
        up, down = ([jax.device_get(run(points[b : b + CHUNK] + sign * step)) for b in parts] for sign in (1.0, -1.0))
        for name in up[0]:
            rise = np.concatenate([part[name] for part in up]) - np.concatenate([part[name] for part in down])
            slopes.setdefault(name, []).append(rise / (2.0 * STEP * size))
    return {name: np.stack(columns, axis=1) for name, columns in slopes.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=2048, help="a multiple of 128")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    set_up_jax()
    sigma, metrics = np.array(list(SIGMA.values())), loop()
    points = np.random.default_rng(1).normal(size=(args.points, len(sigma))) * sigma
    measures = derivative_measures(metrics, points, chunk=CHUNK)
    slopes = differences(metrics, points[:CHUNK], sigma)
    exact = derivative_measures(metrics, points[:CHUNK], chunk=CHUNK)
    run = jax.jit(jax.vmap(metrics))
    values = [jax.device_get(run(points[b : b + CHUNK])) for b in range(0, len(points), CHUNK)]
    found = {}
    for name, own in measures.items():
        output = np.concatenate([part[name] for part in values])
        indices = sobol_indices({label: points[:, k] for k, label in enumerate(SIGMA)}, output).inputs
        stein = np.array([indices[label].slopes[label] for label in SIGMA]).T * sigma
        differ = np.abs(slopes[name].mean(axis=0) - exact[name].mean_derivative) * sigma
        found[name] = {
            "mean_derivative": (own.mean_derivative * sigma).tolist(),
            "mean_derivative_error": (own.mean_derivative_error * sigma).tolist(),
            "without_derivatives": stein[0].tolist(),
            "without_derivatives_error": stein[1].tolist(),
            "rms_derivative": (np.sqrt(own.mean_square) * sigma).tolist(),
            "bound_of_total": own.bounds(np.array([poincare_normal(one) for one in sigma])).tolist(),
            "total": [indices[label].total.value for label in SIGMA],
            "total_low": [indices[label].total.low for label in SIGMA],
            "total_high": [indices[label].total.high for label in SIGMA],
            "differences_off": float(differ.max() / np.abs(own.mean_derivative * sigma).max()),
        }
        print(f"\n{name}: finite differences of means are off by {found[name]['differences_off']:.1e}")
        print(f"  {'by 1-sigma of':26s}", " ".join(f"{label:>10s}" for label in SIGMA))
        for key, row in found[name].items():
            if isinstance(row, list):
                print(f"  {key:26s}", " ".join(f"{value:10.4g}" for value in row))
    if args.out:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        args.out.write_text(
            json.dumps({"points": args.points, "inputs": list(SIGMA), "metrics": found}, indent=1) + "\n"
        )


if __name__ == "__main__":
    main()
