"""Attitudes, sensitivities and Sun pointings on a GPU, both precisions: time, cases a second, share of the GPU's peak.

For whoever has a GPU that JAX finds; without one it says so and runs a few cases on the CPU, to try the script. Each
precision is a process of its own. The work is that of `integrators.py`: 10^4, 10^5 and 10^6 attitudes over 4500 s by
`simulate_many`, and 7 x 13 sensitivities; and 10^6 Sun pointings as `jaxsat sweep sun-pointing` runs them. Operations
are an estimate: those of one right-hand side as XLA counts them (`cost_analysis`), times the evaluations of all steps,
and the two sums of twelve slopes; the peak is of the table below, or `--peak`. What is not begun after `--minutes` is
left out, and said. Sweeps of other scenarios on a GPU are `gpu_sweeps.py`.

    .venv/bin/pip install -e . 'jax[cuda13]'
    .venv/bin/python experiments/benchmarks/gpu.py --out gpu.json
"""

import argparse
import json
import multiprocessing
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from gpu_sweeps import has_gpu

LANES, FEW_LANES = (10_000, 100_000, 1_000_000), (256, 1024)
SENSITIVE, FEW_SENSITIVE = (512, 10_000), (64,)
POINTINGS, FEW_POINTINGS, CHUNK, FEW_CHUNK = 1_000_000, 512, 65_536, 256
REPEATS, SEED = 3, 0
PRECISIONS = ("float64", "float32")
STEPS = {"float64": 3.6, "float32": 3.0}
"""Of the attitudes [s]: the best that each precision has (`precision.py`)."""
ROUGH = 0.1
"""Tolerance that single precision asks to be told."""
PEAKS = {
    "H200": (34e12, 67e12),
    "H100": (34e12, 67e12),
    "A100": (9.7e12, 19.5e12),
    "V100": (7.8e12, 15.7e12),
    "L40S": (1.43e12, 91.6e12),
    "RTX 4090": (1.29e12, 82.6e12),
}
"""Operations a second in float64 and float32 without tensor cores, by a part of the device's name (data sheets)."""
Row = dict[str, Any]


def measure(sender: Connection, precision: str, device: str, peak: float | None) -> None:
    """For a process of its own: sends rows, or what went wrong."""
    from jaxsat.numerics import set_up_jax

    set_up_jax(precision, device)  # pyright: ignore[reportArgumentType]
    import jax

    kind = jax.devices()[0].device_kind
    place = PRECISIONS.index(precision)
    known = next((both[place] for name, both in PEAKS.items() if name in kind), None)
    few = device == "cpu"
    lanes, sensitive = (FEW_LANES, FEW_SENSITIVE) if few else (LANES, SENSITIVE)
    works: list[Callable[[], Row]] = [
        # First, for the others import `integrators`, from where on JAX works in 64 bits unless it is told otherwise.
        lambda: pointings(*((FEW_POINTINGS, FEW_CHUNK) if few else (POINTINGS, CHUNK))),
        *(lambda n=n: attitudes(n, precision) for n in lanes),
        *(lambda n=n: sensitivities(n, precision) for n in sensitive),
    ]
    for work in works:
        try:
            row = work() | {"device": kind, "precision": precision}
            row["share_of_peak"] = (
                row["flops"] / row["s"] / (peak or known) if row["flops"] and (peak or known) else None
            )
            sender.send(row)
        except Exception as error:  # Others may run where this one has not enough memory.
            sender.send(f"{type(error).__name__}: {str(error).splitlines()[0][:120]}")
    sender.send(None)


def best(run: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of the first call and of the best of some more."""
    import jax

    seconds = []
    for _ in range(1 + REPEATS):
        began = time.perf_counter()
        jax.block_until_ready(run())
        seconds.append(time.perf_counter() - began)
    return seconds[0], min(seconds[1:])


def operations(function: Callable, *arguments: Any) -> float:
    """Of a program without loops, as XLA counts them."""
    import jax

    cost = jax.jit(function).lower(*arguments).compile().cost_analysis()
    return float((cost or {}).get("flops", 0.0))


def right_hand_side(job: Any, precision: str) -> tuple[Callable, tuple[Any, Any]]:
    """The derivative of one case as a function of (q, w) and (magnet, moments), and where to take it."""
    import jax.numpy as jnp
    from integrators import TORQUES, spacecraft, surroundings

    from jaxsat.dynamics import AttitudeState, derivative, rigid_body

    dtype = jnp.dtype(precision)
    table = surroundings(job)(jnp.zeros(1))
    point = type(table)(table.position_eci[0].astype(dtype), table.b_field_eci[0].astype(dtype))

    def slope(state, given):
        body = rigid_body(spacecraft(jnp.diag(given[3:]), given[:3]), TORQUES)
        found = derivative(AttitudeState(state[:4], state[4:]), point, body)
        return jnp.concatenate([found.quaternion, found.angular_velocity])

    given = np.concatenate([job.magnet, job.principal[0]])
    return slope, (jnp.asarray(job.initial[0], dtype), jnp.asarray(given, dtype))


def of_adams(evaluation: float, numbers: int, steps: int) -> float:
    """Operations of a case: two evaluations a step, and two sums of twelve slopes of so many numbers."""
    return steps * (2.0 * evaluation + 2 * 2 * 12 * numbers)


def attitudes(count: int, precision: str) -> Row:
    """`simulate_many` over 4500 s, what surrounds the satellites included."""
    import jax.numpy as jnp
    from integrators import TORQUES, in_dtype, spacecraft, states, surroundings
    from models.attitude_job import Job

    from jaxsat.simulate import simulate_many

    job, dtype, step = Job(cases=count), jnp.dtype(precision), STEPS[precision]
    craft, start = in_dtype(spacecraft(job.inertia, job.magnet), dtype), states(job, dtype)
    around, times = surroundings(job), np.array([job.duration])
    tolerance = ROUGH if precision == "float32" else 1e-6

    def run():
        options: dict[str, Any] = {"torques": TORQUES, "max_step": step, "tolerance": tolerance}
        return simulate_many(craft, start, around, times, **options).quaternion

    first, seconds = best(run)
    slope, where = right_hand_side(job, precision)
    flops = count * of_adams(operations(slope, *where), 7, round(job.duration / step))
    return {"work": "attitudes", "cases": count, "first_s": first, "s": seconds, "flops": flops}


def sensitivities(count: int, precision: str) -> Row:
    """Derivatives of the last (q, w) by the 13 unknowns of `attitude_job`: tangents beside the motions."""
    import equinox as eqx
    import jax
    import jax.numpy as jnp
    from integrators import SENSITIVITY_STEP, TORQUES, spacecraft, surroundings
    from models.attitude_job import Job

    from jaxsat.dynamics import AttitudeState, rigid_body
    from jaxsat.integrators import AdamsGrid
    from jaxsat.simulate.parts import advance_parts

    job, dtype = Job(cases=count), jnp.dtype(precision)
    grid = AdamsGrid.through(np.array([job.duration]), start=0.0, max_step=SENSITIVITY_STEP)
    table = jax.tree.map(lambda x: x.astype(dtype), eqx.filter_jit(surroundings(job))(jnp.asarray(grid.node_times)))
    like = AttitudeState(jnp.zeros(4, dtype), jnp.zeros(3, dtype))

    def final(state, given):
        body = rigid_body(spacecraft(jnp.diag(given[3:]), given[:3]), TORQUES)
        return advance_parts(tuple(state), like, body, table, grid, last_only=True)[0]

    @jax.jit
    def jacobian(state, given):
        def along(direction):
            tangents = jnp.broadcast_to(direction[:7, None], state.shape), direction[7:]
            return jax.jvp(final, (state, given), tangents)[1]

        return jax.vmap(along)(jnp.eye(13, dtype=dtype))

    slope, (_, given) = right_hand_side(job, precision)
    state = jnp.asarray(job.initial.T, dtype)
    first, seconds = best(lambda: jacobian(state, given))
    pushed = lambda s, g: jax.vmap(lambda d: jax.jvp(slope, (s, g), (d[:7], d[7:]))[1])(jnp.eye(13, dtype=dtype))  # noqa: E731
    evaluation = operations(pushed, state[:, 0], given)
    flops = count * of_adams(evaluation, 7 * 14, grid.steps)
    return {"work": "7 x 13 sensitivities", "cases": count, "first_s": first, "s": seconds, "flops": flops}


def pointings(count: int, chunk: int) -> Row:
    """Sun pointings by chunks one after the other; how many operations a loop takes is not counted."""
    from jaxsat.sweep.scenarios import sun_pointing

    scenario = sun_pointing.make({})
    began = time.perf_counter()
    scenario.run(SEED, np.arange(chunk))
    first, began = time.perf_counter() - began, time.perf_counter()
    for begin in range(0, count, chunk):
        scenario.run(SEED, np.arange(begin, begin + chunk))
    done = -(-count // chunk) * chunk
    seconds = time.perf_counter() - began
    return {"work": "Sun pointings", "cases": done, "first_s": first, "s": seconds, "flops": None}


def rows_of(precision: str, device: str, peak: float | None, end: float) -> Iterator[Row | str]:
    """What a process measures, one after the other, until the time is over."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=measure, args=(sender, precision, device, peak), daemon=True)
    process.start()
    sender.close()
    while True:
        if not receiver.poll(max(0.0, end - time.perf_counter())):
            yield "the rest is left out: the minutes are over"
            break
        try:
            sent = receiver.recv()
        except EOFError:
            yield "its process has died; is there memory enough?"
            break
        if sent is None:
            break
        yield sent
    process.terminate()
    process.join()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("gpu.json"))
    parser.add_argument(
        "--peak", type=float, nargs=2, metavar=("F64", "F32"), help="of the device, operations a second"
    )
    parser.add_argument("--minutes", type=float, default=8.0)
    arguments = parser.parse_args()
    end = time.perf_counter() + 60.0 * arguments.minutes
    device = "gpu" if has_gpu() else "cpu"
    if device == "cpu":
        print("NO GPU: JAX finds the CPU alone; a few cases on it, which try the script and are no figures.")
    print(f"{'':23}{'':9}{'cases':>9}{'first, s':>10}{'time, s':>10}{'cases/s':>11}{'Tflop/s':>9}{'of peak':>9}")
    found: list[Row] = []
    for place, precision in enumerate(PRECISIONS):
        peak = None if arguments.peak is None else arguments.peak[place]
        # Half of what is left to the first, so that the second has its turn.
        until = end if place else time.perf_counter() + 0.55 * (end - time.perf_counter())
        for row in rows_of(precision, device, peak, until):
            if isinstance(row, str):
                print(f"{'':23}{precision:9}{row}", flush=True)
                continue
            found.append(row)
            speed = "-" if row["flops"] is None else f"{row['flops'] / row['s'] / 1e12:.3f}"
            share = "-" if row["share_of_peak"] is None else f"{row['share_of_peak']:.1%}"
            times = f"{row['first_s']:10.2f}{row['s']:10.4f}{row['cases'] / row['s']:11.0f}"
            print(f"{row['work']:23}{precision:9}{row['cases']:9}{times}{speed:>9}{share:>9}", flush=True)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps({"gpu": device == "gpu", "rows": found}, indent=1))


if __name__ == "__main__":
    main()
