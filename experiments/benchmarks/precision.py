"""Single against double precision: error and speed of the job of `integrators.py` over steps, as a table.

The first line moves the states in double precision after rounding them to single: what no method can better.

.venv/bin/python experiments/benchmarks/precision.py --out precision.json
"""

import argparse
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from integrators import in_dtype, spacecraft, states, surroundings
from models.attitude_job import Array, Job, error_of_each, timed

from jaxsat.simulate import simulate_many
from jaxsat.torques import GravityGradient, PermanentMagnet

jax.config.update("jax_enable_x64", True)

STEPS = (2.5, 3.0, 3.6, 3.75)
"""The last is beyond what stability allows in the fastest cases."""
FINE = 1.25
"""Step of the run in double precision that errors are taken from [s]; it is good to 1e-9."""


def final(job: Job, dtype: type, step: float, *, begun: type | None = None):
    """A call of `simulate_many` that returns the final quaternions in double precision; states rounded to `begun`."""
    craft, start = in_dtype(spacecraft(job.inertia, job.magnet), dtype), states(job, begun or dtype)
    start = in_dtype(start, dtype)
    around, times = surroundings(job), np.array([job.duration])
    torques = (GravityGradient(), PermanentMagnet())

    def run() -> Array:
        # The tolerance says that errors are expected: they are what is measured.
        motion = simulate_many(craft, start, around, times, torques=torques, max_step=step, tolerance=0.1)
        return np.asarray(motion.quaternion[:, -1], float)

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("precision.json"))
    arguments = parser.parse_args()
    job = Job()
    reference = final(job, float, FINE)()
    rows = []
    print(f"{'':8s}{'step s':>8s}{'ms':>8s}{'median q':>10s}{'99 %':>10s}{'worst':>10s}")
    runs = [("rounded", final(job, float, FINE, begun=np.float32), FINE)]
    for dtype in (jnp.float64, jnp.float32):
        runs += [(dtype.__name__, final(job, dtype, step), step) for step in STEPS]
    for name, run, step in runs:
        errors = error_of_each(run(), reference)
        median, most, worst = (float(np.quantile(errors, share)) for share in (0.5, 0.99, 1.0))
        row = {"precision": name, "step_s": step, "ms": 1e3 * timed(run).best}
        rows.append({**row, "median": median, "q99": most, "worst": worst})
        print(f"{name:8s}{step:8.3f}{row['ms']:8.0f}{median:10.1e}{most:10.1e}{worst:10.1e}", flush=True)
    arguments.out.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
