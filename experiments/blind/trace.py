"""Where a blind fit lost the truth: its growing arcs, stage by stage, beside the minimum into which the truth runs.

For each stage: how many starts enter, the least cost, the cost of the truth's own minimum (nominal satellite, true
attitude and rate), how many starts ended cheaper and whether one ended there.

    .venv/bin/python experiments/blind/trace.py 18 35 --cache blind-sessions
"""

import argparse
from pathlib import Path

import numpy as np

SAME_RAD = 0.15
"""Two minima are one if their attitudes and, over the arc, their turns differ by less."""


def trace(number: int, cache: Path, *, hard: bool, seed: int = 0, starts: int = 256) -> list[str]:
    """One line a stage."""
    # JAX is set up before anything of it is imported.
    import jax
    import jax.numpy as jnp
    from session import blind_session, problem_of, step_s, true_start

    from fitting.estimate import COARSE_TOLERANCE
    from fitting.measurements.abstract import RATE_UNIT
    from fitting.parameters.names import STATE
    from fitting.parameters.parametrization import parametrization
    from fitting.starts.first_guesses import Sightings, filled_in, first_guesses, first_unknowns, silent_panels
    from fitting.starts.multi_start import HOPELESS, Starts, advance, distinct
    from fitting.starts.schedule import arc_schedule
    from fitting.starts.stretches import longest_stretch

    session = blind_session(number, cache, hard=hard)
    max_rate = np.radians(session.settings.max_rate_deg_s)
    samples, problem, use = problem_of(session, step_s(session, max_rate, COARSE_TOLERANCE))
    parameters = parametrization(session.nominal, session.settings.free_names, session.settings.prior_sigma)
    usable = (problem.bright() & problem.sunlit())[: len(samples.t)]
    begin = longest_stretch(samples.t, usable)
    if begin > 0:
        samples, problem, use = problem_of(session, step_s(session, max_rate, COARSE_TOLERANCE), begin)
        usable = usable[begin:]
    lit = np.flatnonzero(usable)[:2]
    measured, noise = np.asarray(problem.measured), float(problem.noise)
    silent = silent_panels(measured, noise, parameters)
    currents = filled_in(measured, noise, silent, session.nominal.max_current)
    seen = Sightings.of(problem, parameters, currents, lit)
    attitude, rate = first_guesses(seen, jax.random.key(seed), starts, jnp.asarray(max_rate))
    x = np.tile(first_unknowns(parameters, silent), (len(attitude), 1))
    x[:, 3:6] = np.asarray(rate) / RATE_UNIT
    points = Starts(x, np.asarray(attitude), np.zeros(len(x)))
    x_true, q_true, _ = true_start(session, float(samples.t[0]))
    x_true[len(STATE) :] = 0.0
    truth = Starts(x_true[None], q_true[None], np.zeros(1))

    def apart(a: Starts, b: Starts, arc_s: float) -> np.ndarray:
        """[starts of a] the larger of attitude and turn over the arc between each of `a` and the one of `b` [rad]."""
        angle = 2.0 * np.arccos(np.minimum(np.abs(a.reference @ b.reference[0]), 1.0))
        return np.maximum(angle, RATE_UNIT * arc_s * np.linalg.norm(a.x[:, 3:6] - b.x[0, 3:6], axis=1))

    spin = np.degrees(RATE_UNIT * np.linalg.norm(x_true[3:6]))
    lines = [
        f"session {number}: {spin:.2f} deg/s at the first lit sample, {int(usable.sum())} lit, begins at sample {begin}"
    ]
    for index, stage in enumerate(arc_schedule(usable, len(samples.t) - 1, session.settings.free_names)):
        arc_s = float(samples.t[stage.last_sample] - samples.t[0])
        entering = points.take(np.arange(min(stage.keep, len(points.cost))))
        nearest = float(apart(entering, truth, arc_s).min())
        own = advance(problem, parameters, stage, truth, use)
        points = advance(problem, parameters, stage, entering, use)
        points = points.take(distinct(points, attitude=2e-3, rate=2e-3))
        there = np.flatnonzero(apart(points, own, arc_s) < SAME_RAD)
        text = f"  arc {arc_s:6.0f} s: {len(entering.cost):3d} enter, nearest to the truth {nearest:5.2f} rad; "
        text += f"least cost {points.cost[0]:8.1f}, that of the truth's minimum {own.cost[0]:8.1f} "
        text += (
            f"({apart(own, truth, arc_s)[0]:.2f} rad from the truth), {int(np.sum(points.cost < own.cost[0])):2d} below"
        )
        lines.append(f"{text}; {f'reached, place {there[0] + 1}' if len(there) else 'not reached'}")
        if index > 0:
            points = points.take(np.flatnonzero(points.cost <= HOPELESS[0] * points.cost[0] + HOPELESS[1]))
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", type=int, nargs="+", help="of the sessions")
    parser.add_argument("--hard", action="store_true", help="of the hard ones")
    parser.add_argument("--seed", type=int, default=0, help="of the random starts")
    parser.add_argument("--starts", type=int, default=256, help="random starts")
    parser.add_argument("--cache", type=Path, default=Path("blind-sessions"), help="directory of the sessions")
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    for number in arguments.numbers:
        how = {"hard": arguments.hard, "seed": arguments.seed, "starts": arguments.starts}
        print("\n".join(trace(number, arguments.cache, **how)), flush=True)


if __name__ == "__main__":
    main()
