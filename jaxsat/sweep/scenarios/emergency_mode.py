"""Transition of the emergency mode: is the satellite in its orbital attitude after some orbits (Somov 2018, sec. 5)?

A case has succeeded if its attitude error stays below the limit for the last half orbit.
"""

import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from jaxsat.sweep.scenario import Factory, Metric, Option, Scenario, case_keys, choice_of, number_of

if TYPE_CHECKING:
    from jaxsat.control.emergency_mode.loop import Sample

NAME = "emergency-mode"
STATUSES = ("succeeded", "not settled", "diverged")
METRICS = {
    "first_error_deg": Metric("deg", "at the start"),
    "settling_time_s": Metric("s", "until the error stays below the limit; none in a case that did not settle"),
    "largest_error_deg": Metric("deg", "of the whole run"),
    "last_error_deg": Metric("deg", "largest of the last half orbit"),
    "final_error_deg": Metric("deg", "at the end"),
    "magnetic_impulse_A_m2_s": Metric("A m2 s", "sum of the three dipoles' sizes over time"),
}
OPTIONS = (
    Option("orbits", "4", "simulated time"),
    Option("limit_deg", "1", "error that counts as settled"),
    Option("min_error_deg", "0", "smallest error at the start"),
    Option("max_error_deg", "30", "largest error at the start"),
    Option("max_rate_deg_s", "0.01", "largest rate at the start"),
    Option("rest", "inertial", "what that rate is against: inertial, or orbital as in a return from swinging"),
    Option("panels", "fixed", "fixed at -90 deg, slew to it from 0 in 15 minutes, or sun: after it, once an orbit"),
    Option("inertia", "0", "1-sigma of the moments of inertia, relative, unknown to the computer"),
    Option("field", "0", "1-sigma of the true field over the model's, of its size, relative, and direction, rad"),
    Option("magnetometer", "0", "1-sigma of the elements of the magnetometer's matrix"),
)
CHUNK = 250


@functools.lru_cache(maxsize=4)
def _program(options: tuple[tuple[str, str], ...]):
    """The compiled `run(keys)` and the history of `one(keys)`, keys of one."""
    import jax
    import jax.numpy as jnp

    from jaxsat.control.emergency_mode.cases import run_leg
    from jaxsat.control.emergency_mode.draw import Dispersions, draw_cases
    from jaxsat.control.emergency_mode.law import EmergencyLaw
    from jaxsat.control.emergency_mode.loop import ALWAYS_ON
    from jaxsat.control.emergency_mode.orbit import SunFollowing, fly, leg, orbital_period
    from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S
    from jaxsat.control.rotating_panels import PanelSlew

    number, choice = functools.partial(number_of, dict(options)), functools.partial(choice_of, dict(options))
    orbits, limit = number("orbits", low=0.5, high=100.0), number("limit_deg", low=0.01, high=90.0)
    low, high = (number(f"{end}_error_deg", low=0.0, high=180.0) for end in ("min", "max"))
    dispersions = Dispersions(
        min_error_deg=min(low, high),
        max_error_deg=high,
        max_rate_deg_s=number("max_rate_deg_s", low=0.0, high=1.0),
        orbital=choice("rest", ("inertial", "orbital")) == "orbital",
        inertia=number("inertia", low=0.0, high=0.2),
        field=number("field", low=0.0, high=0.2),
        magnetometer=number("magnetometer", low=0.0, high=0.2),
    )

    panels = choice("panels", ("fixed", "slew", "sun"))

    @functools.cache
    def surroundings():
        """The leg, and control periods of half an orbit."""
        flight = fly((orbits + 0.2) * 6000.0 / 86400.0)
        orbit = round(orbital_period(flight) / CONTROL_PERIOD_S)
        turning = {"fixed": None, "slew": PanelSlew(0.0), "sun": SunFollowing(flight)}[panels]
        return leg(flight, 0, round(orbits * orbit), panels=turning), orbit // 2

    def history(around, cases):
        def one(case):
            return run_leg(EmergencyLaw(), ALWAYS_ON, case.vehicle, around, case.state, case.key)

        return jax.vmap(one)(cases)

    def metrics(around, keys, half):
        cases = draw_cases(dispersions, around, keys)
        state, samples = history(around, cases)
        error = jnp.degrees(jnp.sqrt(jnp.sum(samples.error**2, axis=2)))
        sound = jnp.all(jnp.isfinite(error), axis=1)
        last = jnp.max(error[:, -half:], axis=1)
        settled = last < limit
        above = jnp.max(jnp.where(error >= limit, 1 + jnp.arange(error.shape[1])[None], 0), axis=1)
        found = {
            # Four tangents of a quarter of the angle.
            "first_error_deg": jnp.degrees(4.0 * jnp.arctan(0.25 * jnp.linalg.norm(cases.state.seen.error, axis=1))),
            "settling_time_s": jnp.where(settled, CONTROL_PERIOD_S * above.astype(float), jnp.nan),
            "largest_error_deg": jnp.max(error, axis=1),
            "last_error_deg": last,
            "final_error_deg": error[:, -1],
            "magnetic_impulse_A_m2_s": state.impulse,
        }
        found = {name: jnp.where(sound, value, jnp.nan) for name, value in found.items()}
        return {"status": jnp.where(sound, jnp.where(settled, 0, 1), 2), **found}

    compiled = (
        jax.jit(metrics, static_argnums=2),
        jax.jit(lambda around, keys: history(around, draw_cases(dispersions, around, keys))),
    )

    def run(keys):
        around, half = surroundings()
        return jax.device_get(compiled[0](around, keys, half))

    def one(keys):
        return jax.device_get(compiled[1](surroundings()[0], keys)[1])

    return run, one


def _build(options: Mapping[str, str]) -> Scenario:
    # Whatever is wrong with the options is said before anything is computed.
    run, _ = _program(tuple(options.items()))
    return Scenario(NAME, STATUSES, METRICS, CHUNK, lambda seed, cases: run(case_keys(seed, cases)))


make = Factory(_build, OPTIONS)


def history(options: Mapping[str, str], seed: int, case: int) -> "Sample":
    """One case again: its samples, with the control periods in front."""
    import jax

    _, one = _program(tuple(make.filled(options).items()))
    return jax.tree.map(lambda leaf: np.asarray(leaf)[0], one(case_keys(seed, np.array([case]))))
