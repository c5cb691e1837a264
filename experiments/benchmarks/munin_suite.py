"""Time of the Munin suite's programs on many samples: wall clock, and processor time for busy machines.

.venv/bin/python experiments/benchmarks/munin_suite.py --samples 10000 --out out/munin-suite.json
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("out/munin-suite.json"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    jobs = local_programs(arguments.samples) | other_programs(arguments.samples)
    result = {"samples": arguments.samples, "programs": {}}
    for name, job in jobs.items():
        wall, processor = [], []
        for _ in range(arguments.repeats + 1):
            begin, used = time.perf_counter(), time.process_time()
            job()
            wall.append(time.perf_counter() - begin)
            processor.append(time.process_time() - used)
        times = {"first_s": wall[0], "warm_s": min(wall[1:]), "processor_s": min(processor[1:])}
        result["programs"][name] = times
        print(f"{name:30s} " + "  ".join(f"{key} {value:6.2f}" for key, value in times.items()), flush=True)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(result, indent=1))


def local_programs(count: int) -> dict:
    """The programs on `count` samples of random attitudes, within 30 deg of the field, of one orbit in sunlight."""
    import jax
    import jax.numpy as jnp

    from fitting.local.session import LocalSamples, solve_field_roll, solve_five_parameters
    from fitting.local.shares import mirror_earth
    from fitting.local.sun_and_field import sun_and_field_attitude
    from fitting.local.turn import turned_sample
    from jaxsat.environment import LightTable
    from jaxsat.estimation.vectors import weighted_attitude
    from jaxsat.math import quaternion
    from jaxsat.sensors import Albedo, panel_currents
    from jaxsat.spacecraft import SolarPanels, box_normals

    rng = np.random.default_rng(0)

    def units(*shape):
        v = rng.normal(size=(*shape, 3))
        return v / np.linalg.norm(v, axis=-1, keepdims=True)

    shape = (count, 0)
    parts = (units(count), np.ones(count), units(count), np.full(count, 0.3), np.zeros((*shape, 3)), np.zeros(shape))
    light = LightTable(*map(jnp.asarray, parts))
    field = 3e-5 * units(count)
    q = rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    earth = Albedo(jnp.asarray(0.5), jnp.asarray(0.0))
    currents = jax.jit(jax.vmap(lambda q, light: panel_currents(q, panels, earth, light)))(q, light)
    noisy = np.maximum(np.round(1e3 * np.asarray(currents) + rng.normal(scale=2.0, size=(count, 6))), 0.0) * 1e-3
    samples = LocalSamples(np.arange(count), noisy, field, light, panels, mirror_earth(), 2e-3)
    sun_body, field_body = (
        np.asarray(jax.vmap(quaternion.rotate_inverse)(jnp.asarray(q), v)) for v in (light.sun_eci, jnp.asarray(field))
    )
    two_axes = np.where(np.arange(3) == 0, np.nan, field_body)
    solve = jax.jit(jax.vmap(sun_and_field_attitude, in_axes=(0, 0, 0, 0, None, None)))
    sigmas = jnp.radians(1.0), jnp.asarray(2e-7)
    both = np.stack([sun_body, field_body / 3e-5], 1), np.stack([np.asarray(light.sun_eci), field / 3e-5], 1)
    davenport = jax.jit(jax.vmap(weighted_attitude, in_axes=(0, 0, None)))
    turn = jax.jit(
        jax.vmap(
            lambda a, axis, own, seen, b, at: turned_sample(a[None], axis, own, seen, b, panels, mirror_earth(), at)
        )
    )
    angles = jnp.asarray(rng.uniform(0.0, 2.0 * np.pi, count))
    lit = int(np.sum(np.sum(noisy >= 2e-3, axis=1) >= 4))
    print(f"{count} samples, {lit} of them with four panels at 2 mA")
    return {
        "field roll (OrbfiGraf)": lambda: solve_field_roll(samples),
        "five parameters (OptLoc)": lambda: solve_five_parameters(samples),
        "the same, x both ways": lambda: solve_five_parameters(samples, directions=(1.0, -1.0)),
        "Sun and 3 axes (OrSB)": lambda: jax.block_until_ready(
            solve(sun_body, field_body, light.sun_eci, field, *sigmas)
        ),
        "Sun and 2 axes (OrSB)": lambda: jax.block_until_ready(
            solve(sun_body, two_axes, light.sun_eci, field, *sigmas)
        ),
        "q-method, two vectors": lambda: jax.block_until_ready(davenport(*both, jnp.ones(2))),
        "turned by an angle (OrB, OrS)": lambda: jax.block_until_ready(
            turn(angles, light.sun_eci, sun_body, noisy, field, light)
        ),
    }


def other_programs(count: int) -> dict:
    """The programs that know of no session: outlines in the mirror, almanac, orbit and simulation, 6.4 s apart."""
    import jax
    import jax.numpy as jnp

    from fitting.orbit.orbit_fit import fit_without_doubtful, states
    from jaxsat.environment import KeplerOrbit, ephemeris
    from jaxsat.sensors import mirror_currents, polygon_panels
    from jaxsat.synthetic.files import write_simulation
    from jaxsat.synthetic.session import SessionPlan, make_session
    from jaxsat.synthetic.settings import SimulationSettings

    t = 6.4 * np.arange(count)
    plan = SessionPlan(SimulationSettings(sampling_s=6.4, duration_s=6.4 * (count - 0.5)))
    session = make_session(plan)
    truth, epoch = session.truth, session.epoch
    square = 0.1 * np.array([[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]])
    faces = polygon_panels([s * np.roll(square, k, 1)[::s] for k in range(3) for s in (1, -1)], 6.0)
    mirror = jax.jit(jax.vmap(lambda q, r, sun: mirror_currents(q, faces, r, sun, 6371e3)))
    seen = tuple(map(jnp.asarray, (truth.quaternion, truth.position_eci, truth.sun_eci)))
    rng = np.random.default_rng(1)
    position, velocity = states(KeplerOrbit(**session.elements), t)
    noisy = position + 200.0 * rng.normal(size=position.shape), velocity + 0.3 * rng.normal(size=position.shape)

    def write():
        with tempfile.TemporaryDirectory() as directory:
            write_simulation(Path(directory), session, plan, plots=False)

    return {
        "six outlines (mirrKub)": lambda: jax.block_until_ready(mirror(*seen)),
        "almanac (God_ads)": lambda: ephemeris(epoch, t),
        "almanac, hourly": lambda: ephemeris(epoch, 3600.0 * np.arange(count)),
        "elements, twice (raw_Or)": lambda: fit_without_doubtful(t, *noisy),
        "simulation (Orfs)": lambda: make_session(plan),
        "its files": write,
    }


if __name__ == "__main__":
    main()
