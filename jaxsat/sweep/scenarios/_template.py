"""A 3U CubeSat stops tumbling by its coils, with a magnetometer that is noisy and not always there.

Change what you like: the first line above is the summary in lists. Run it, look at one case, ask for its options:

    jaxsat sweep my_scenario.py --cases 1000 --seed 1 --out results
    jaxsat sweep my_scenario.py --case 17 --out results
    jaxsat sweep my_scenario.py --list
    jaxsat sensitivity my_scenario.py --by gain
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.dynamics import rigid_body_rates
from jaxsat.environment import Surroundings, igrf_field, orbit_from_elements_km_deg
from jaxsat.math import cross, quaternion, safe_norm
from jaxsat.math.runge_kutta import RK4, runge_kutta_step
from jaxsat.sweep import Factory, History, Input, Knob, Metric, Option, Scenario, case_keys, number_of

NAME = "my-scenario"
STATUSES = ("succeeded", "still tumbling", "diverged")  # 0 is success
METRICS = {
    "detumbling_time_s": Metric("s", "until the rate stays below the limit", endless=True),
    "final_rate_deg_s": Metric("deg/s", "angular rate at the end"),
    "coils_A_m2_s": Metric("A m2 s", "sum of the three dipoles' sizes over time"),
}
OPTIONS = (
    Option("tipoff_deg_s", "5", "1-sigma of the first rate about each body axis"),
    Option("limit_deg_s", "0.5", "rate that counts as stopped"),
    Option("inertia", "0.05", "1-sigma of each moment of inertia, relative"),
    Option("dipole_A_m2", "0.2", "largest dipole of each coil"),
    Option("gain", "50000", "of the law m = -gain dB/dt, A m2 s/T"),
    Option("noise_nT", "100", "1-sigma of each reading of the field"),
    Option("lost", "0.02", "share of readings that are lost"),
    Option("hours", "2", "simulated time"),
)
ASSUMPTIONS = (
    "circular orbit of 550 km and 97.6 deg, IGRF of 2026; no torque but that of the coils",
    "the coils are off while the field is measured, and have no residual dipole",
)
CHUNK = 500  # cases that run at once; part of what makes the numbers
PERIOD_S = 2.0
MOMENTS = (0.033, 0.033, 0.0067)  # of the inertia, kg m2, body axes


def build(options: Mapping[str, str]) -> Scenario:
    tipoff = np.radians(number_of(options, "tipoff_deg_s", low=0.0, high=50.0))
    limit = np.radians(number_of(options, "limit_deg_s", low=0.01, high=50.0))
    spread = number_of(options, "inertia", low=0.0, high=0.2)
    largest = number_of(options, "dipole_A_m2", low=0.0, high=100.0)
    gain = number_of(options, "gain", low=0.0)
    noise = 1e-9 * number_of(options, "noise_nT", low=0.0, high=1e5)
    lost = number_of(options, "lost", low=0.0, high=1.0)
    periods = int(np.ceil(3600.0 * number_of(options, "hours", low=0.01, high=100.0) / PERIOD_S))

    def draw_one(key):
        """What a case begins with, by its key alone."""
        normal = jax.random.normal(key, (10,))
        moments = jnp.array(MOMENTS) * (1.0 + spread * normal[7:])
        case = {"q": quaternion.normalize(normal[:4]), "rate": tipoff * normal[4:7], "moments": moments, "key": key}
        # Factors of the knobs below.
        return case | {"gain": jnp.ones(()), "largest": jnp.ones(())}

    def field(times):
        """Along the orbit, inertial axes, T: the same for all cases, so worked out once."""
        orbit = orbit_from_elements_km_deg(
            a_km=6928.0, e=0.0, i_deg=97.6, raan_deg=40.0, argp_deg=0.0, mean_anomaly_deg=0.0
        )
        return Surroundings(orbit, igrf_field(2026.0), greenwich_angle_0=0.0)(times).b_field_eci

    def fly(case, fields, record):
        """One case: its metrics, and what a person would plot of every period."""
        inertia, inverse = jnp.diag(case["moments"]), jnp.diag(1.0 / case["moments"])

        def period(state, given):
            q, w, seen, dipole, stopped_s, spent = state
            number, end_s, b_eci = given
            b_body = quaternion.rotate_inverse(q, b_eci)
            # The sensor: noise, and readings that are lost.
            *shake, luck = jax.random.normal(jax.random.fold_in(case["key"], number + 1), (4,))
            reading = b_body + noise * jnp.stack(shake)
            known = jax.scipy.stats.norm.cdf(luck) >= lost
            # The law: the dipole stays as it was where there is no new reading.
            most = largest * case["largest"]
            wanted = jnp.clip(-gain * case["gain"] * (reading - seen) / PERIOD_S, -most, most)
            dipole = jnp.where(known & (number > 0), wanted, dipole)
            seen = jnp.where(known, reading, seen)

            def rates(motion, field_eci):
                q, w = motion
                torque = cross(dipole, quaternion.rotate_inverse(q, field_eci))
                return rigid_body_rates(q, w, torque, inertia, inverse)

            # The field is taken for constant over a step.
            q, w = runge_kutta_step(RK4, rates, (q, w), PERIOD_S, (b_eci,) * 4)
            q = quaternion.normalize(q)
            stopped_s = jnp.where(safe_norm(w) > limit, end_s, stopped_s)
            state = (q, w, seen, dipole, stopped_s, spent + PERIOD_S * jnp.sum(jnp.abs(dipole)))
            return state, (w, dipole, b_body) if record else None

        begin = (case["q"], case["rate"], jnp.zeros(3), jnp.zeros(3), jnp.zeros(()), jnp.zeros(()))
        (_, w, _, _, stopped_s, spent), samples = jax.lax.scan(
            period, begin, (jnp.arange(periods), jnp.asarray(ends_s), fields)
        )
        rate, sound = safe_norm(w), jnp.all(jnp.isfinite(w))
        stopped = rate < limit
        metrics = {
            "status": jnp.where(sound, jnp.where(stopped, 0, 1), 2),
            "detumbling_time_s": jnp.where(stopped, stopped_s, jnp.nan),
            "final_rate_deg_s": jnp.where(sound, jnp.degrees(rate), jnp.nan),
            "coils_A_m2_s": jnp.where(sound, spent, jnp.nan),
        }
        return metrics, samples

    ends_s = PERIOD_S * np.arange(1, periods + 1)
    along = jax.jit(field)
    drawn = jax.jit(jax.vmap(draw_one))
    many = jax.jit(jax.vmap(lambda case, fields: fly(case, fields, False)[0], in_axes=(0, None)))
    recorded = jax.jit(lambda case, fields: fly(case, fields, True)[1])

    def draw(seed, cases):
        return drawn(case_keys(seed, cases))

    def run(seed, cases):
        return jax.device_get(many(draw(seed, cases), along(ends_s - PERIOD_S)))

    def run_moved(seed, cases, moved):
        """The same with knobs moved: column k of `moved` is the logarithm of the factor of knob k."""
        factors = {knob.name: jnp.exp(moved[:, k]) for k, knob in enumerate(knobs)}
        return many(draw(seed, cases) | factors, along(ends_s - PERIOD_S))

    def history(seed, case):
        one = jax.tree.map(lambda leaf: leaf[0], draw(seed, np.array([case])))
        w, dipole, b_body = jax.device_get(recorded(one, along(ends_s - PERIOD_S)))
        rates, fields = np.degrees(w), 1e6 * b_body
        columns = {
            **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
            **{f"dipole_{c}_A_m2": dipole[:, k] for k, c in enumerate("xyz")},
            **{f"field_{c}_uT": fields[:, k] for k, c in enumerate("xyz")},
        }
        charts = {
            "angular rate, deg/s": dict(zip("xyz", rates.T, strict=True)),
            "dipoles, A m2": dict(zip("xyz", dipole.T, strict=True)),
            "field in body axes, uT": dict(zip("xyz", fields.T, strict=True)),
        }
        return History(ends_s, columns, charts)

    # What was drawn, for cases.parquet: of what has no spread there is no column.
    inputs = [Input("rate", "deg/s", "at the start, body axes", lambda c: np.degrees(c["rate"]), ("x", "y", "z"))]
    if spread > 0.0:
        inputs.append(Input("inertia", "kg m2", "moments, body axes", lambda c: c["moments"], ("xx", "yy", "zz")))
    # What `jaxsat sensitivity my_scenario.py` may turn: without these, and run_moved, it has nothing to turn.
    turned = (("gain", "A m2 s/T", "of the law", gain), ("largest", "A m2", "dipole of each coil", largest))
    knobs = tuple(Knob(*each) for each in turned if each[-1] > 0.0)
    more = {"history": history, "inputs": tuple(inputs), "draw": draw, "horizon_s": PERIOD_S * periods}
    return Scenario(NAME, STATUSES, METRICS, CHUNK, run, knobs=knobs, run_moved=run_moved, **more)


make = Factory(build, OPTIONS, ASSUMPTIONS)
