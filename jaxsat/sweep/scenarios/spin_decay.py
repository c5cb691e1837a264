"""A spinning satellite slows down by eddy currents in the Earth's field.

A conducting satellite of equal moments on a polar orbit, in the field of a dipole along the Earth's axis, which turns
against the stars twice an orbit. The torque is k (w x B) x B (Smith 1964): what spins along the field is not slowed
at once. A case has succeeded once the spin is below a tenth of that at the start.
"""

import functools
import math
from collections.abc import Mapping

import numpy as np

from jaxsat.sweep.history import History
from jaxsat.sweep.scenario import Factory, Metric, Option, Reader, Scenario, case_keys, chunk_of

NAME = "spin-decay"
STATUSES = ("succeeded", "still spinning", "diverged")
METRICS = {
    "decay_time_s": Metric("s", "until the spin was below a tenth of that at the start; none in a case that was not"),
    "final_rate_deg_s": Metric("deg/s", "angular rate at the end"),
    "turned_deg": Metric("deg", "by which the axis of the spin turned"),
}
OPTIONS = (
    Option("rate_deg_s", "5", "largest rate at the start"),
    Option("moment_kg_m2", "0.05", "moment of inertia"),
    Option("conductance", "2000", "k, of the torque over rate and field squared, N m s/T^2"),
    Option("days", "2", "simulated time"),
)
ASSUMPTIONS = ("the tensor of the currents is a number, as of a sphere", "a dipole along the Earth's axis, 700 km")
CHUNK = 500
ORBITAL_RATE, FIELD_T = 1.06e-3, 2.3e-5
"""Of 700 km: of the orbit [rad/s], and on the magnetic equator."""
STEP_S = 60.0


@functools.lru_cache(maxsize=4)
def _program(moment: float, conductance: float, rate: float, steps: int):
    """Compiled `run(keys)`: rates over time [cases time 3] in inertial axes [rad/s]."""
    import jax
    import jax.numpy as jnp

    from jaxsat.math import unit

    def step(w, number):
        place = ORBITAL_RATE * STEP_S * (number + 0.5)
        b = FIELD_T * jnp.stack([-3.0 * jnp.sin(place) * jnp.cos(place), 0.0 * place, 1.0 - 3.0 * jnp.sin(place) ** 2])
        # The part across the field dies away, the part along it stays: exact while the field stands.
        along = b * jnp.sum(w * b) / jnp.sum(b * b)
        w = along + (w - along) * jnp.exp(-conductance / moment * jnp.sum(b * b) * STEP_S)
        return w, w

    def one(key):
        axis, size = jax.random.split(key)
        w = rate * (0.2 + 0.8 * jax.random.uniform(size)) * unit(jax.random.normal(axis, (3,)))
        return jnp.concatenate([w[None], jax.lax.scan(step, w, jnp.arange(steps, dtype=float))[1]])

    return jax.jit(jax.vmap(one))


def _outcome(w: np.ndarray) -> dict[str, np.ndarray]:
    size = np.linalg.norm(w, axis=2)
    sound = np.isfinite(size).all(axis=1)
    slow = size < 0.1 * size[:, :1]
    cosine = np.sum(w[:, 0] * w[:, -1], axis=1) / (size[:, 0] * size[:, -1])
    return {
        "status": np.where(sound, np.where(slow.any(axis=1), 0, 1), 2),
        "decay_time_s": np.where(sound & slow.any(axis=1), STEP_S * np.argmax(slow, axis=1), np.nan),
        "final_rate_deg_s": np.where(sound, np.degrees(size[:, -1]), np.nan),
        "turned_deg": np.where(sound, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), np.nan),
    }


def _build(options: Mapping[str, str]) -> Scenario:
    number = Reader(options).number
    moment, conductance = number("moment_kg_m2", low=1e-6, high=1e6), number("conductance", low=0.0, high=1e9)
    rate = math.radians(number("rate_deg_s", low=0.001, high=360.0))
    steps = math.ceil(number("days", low=0.01, high=30.0) * 86400.0 / STEP_S)

    def rates(seed: int, cases: np.ndarray) -> np.ndarray:
        return np.asarray(_program(moment, conductance, rate, steps)(case_keys(seed, cases)))

    def history(seed: int, case: int) -> History:
        w = np.degrees(rates(seed, chunk_of(case, CHUNK))[case % CHUNK])
        columns = {f"rate_{c}_deg_s": w[:, k] for k, c in enumerate("xyz")}
        panels = {
            "angular rate in inertial axes, deg/s": dict(zip("xyz", w.T, strict=True)),
            "its size, deg/s": {"": np.linalg.norm(w, axis=1)},
        }
        return History(STEP_S * np.arange(len(w)), columns, panels)

    return Scenario(NAME, STATUSES, METRICS, CHUNK, lambda seed, cases: _outcome(rates(seed, cases)), history=history)


make = Factory(_build, OPTIONS, ASSUMPTIONS)
