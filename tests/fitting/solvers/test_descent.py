"""Gradient descent and L-BFGS end where Levenberg-Marquardt does, within bounds, and give up on what is not finite."""

import dataclasses

import jax
import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.solvers.chunk import solve_chunk
from fitting.solvers.least_squares import Settings
from fitting.starts.multi_start import NONE
from jaxsat.integrators import BLOCK

pytestmark = pytest.mark.slow

SAMPLES = 16
PLAIN, ROBUST = 1e4, 3.0
LM = "levenberg_marquardt"
ENOUGH = {LM: 20, "lbfgs": 80, "adam": 400}


ALBEDO = "albedo.specular"


class Arc:
    """The first samples of the bundled session, the state and the specular albedo free, started 3 deg off the truth."""

    def __init__(self, case):
        self.problem, self.parameters, self.weight = case.problem, case.parameters, case.weight
        self.reference, self.albedo = case.truth.q[0], case.parameters.names.index(ALBEDO)
        self.x = np.zeros(len(self.parameters.everything))
        self.x[:6] = [0.03, -0.03, 0.02, *case.truth.w[0] / RATE_UNIT + [0.02, -0.02, 0.01]]

    def settings(self, iterations, scale=PLAIN, active=None):
        return Settings(
            blocks=np.asarray(-(-int(self.problem.grid.sample_index[SAMPLES - 1]) // BLOCK)),
            iterations=np.asarray(iterations),
            robust_scale=np.asarray(scale),
            active=self.parameters.everything if active is None else active,
            tail=np.asarray(NONE),
            ceiling=np.asarray(NONE),
        )

    def solve(self, name, *, iterations=None, bounds=None, problem=None, x=None, **changes):
        settings = self.settings(ENOUGH[name] if iterations is None else iterations, **changes)
        start = (self.x if x is None else x, self.reference, self.weight)
        points = solve_chunk(
            problem or self.problem,
            self.parameters.tree,
            name,
            dataclasses.replace(settings, active=np.asarray(settings.active)[None]),
            bounds or self.parameters.bounds(),
            *(np.asarray(each)[None] for each in start),
            np.asarray(1),
        )
        return jax.tree.map(lambda leaf: leaf[0], jax.device_get(points))


@pytest.fixture(scope="module")
def arc(munin_case):
    return Arc(munin_case("b-specular50", [ALBEDO], samples=SAMPLES, only=[ALBEDO]))


def angle(a, b):
    return 2.0 * np.arccos(min(abs(a.reference @ b.reference), 1.0))


@pytest.mark.parametrize("name", ["lbfgs", "adam"])
@pytest.mark.parametrize("scale", [PLAIN, ROBUST])
def test_minimum_is_that_of_levenberg_marquardt(arc, name, scale):
    point, expected = arc.solve(name, scale=scale), arc.solve(LM, scale=scale)
    # Each stops where a Gauss-Newton step would save less than 1e-4: differences below 0.015 sigma.
    assert point.decrement < 1e-4
    assert point.cost == pytest.approx(expected.cost, abs=2e-4)
    sigma = np.sqrt(np.diagonal(np.linalg.inv(expected.hessian)))
    assert np.all(np.abs(point.x - expected.x)[3:] < 0.03 * sigma[3:])
    assert angle(point, expected) < 0.05 * sigma[:3].max()
    assert not point.x[:3].any() and np.linalg.norm(point.reference) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("name", ["lbfgs", "adam"])
def test_bounds_hold_and_stop_what_presses_on_them(arc, name):
    free = arc.solve(LM)
    lower, upper = arc.parameters.bounds()
    # Half-way to where each would go: one from above, one from below.
    for k in (3, arc.albedo):
        middle = 0.5 * (arc.x[k] + free.x[k])
        (upper if free.x[k] > arc.x[k] else lower)[k] = middle
    point, expected = (arc.solve(each, bounds=(lower, upper)) for each in (name, LM))
    assert np.all(point.x >= lower) and np.all(point.x <= upper)
    np.testing.assert_array_equal(point.x[[3, arc.albedo]], expected.x[[3, arc.albedo]])
    assert point.cost == pytest.approx(expected.cost, abs=1e-2)


@pytest.mark.parametrize("name", ["lbfgs", "adam"])
def test_inactive_unknowns_do_not_move(arc, name):
    still = [3, 5, arc.albedo]
    active = arc.parameters.everything.copy()
    active[still] = False
    point = arc.solve(name, iterations=10, active=active)
    np.testing.assert_array_equal(point.x[still], arc.x[still])
    assert point.x[4] != arc.x[4] and np.any(point.reference != arc.reference)


@pytest.mark.parametrize("name", ["lbfgs", "adam"])
def test_more_iterations_never_end_higher(arc, name):
    start = arc.solve(name, iterations=0)
    np.testing.assert_array_equal(start.x[3:], arc.x[3:])
    assert start.cost == pytest.approx(arc.solve(LM, iterations=0).cost, rel=1e-14)
    few, more = arc.solve(name, iterations=5), arc.solve(name, iterations=40)
    assert more.cost < few.cost < start.cost


@pytest.mark.parametrize("name", ["lbfgs", "adam"])
def test_a_start_without_a_finite_cost_is_given_back(arc, name):
    measured = {name: np.array(values) for name, values in arc.problem.measured.items()}
    measured["cells"][3, 2] = np.nan
    point = arc.solve(name, problem=dataclasses.replace(arc.problem, measured=measured))
    assert not np.isfinite(point.cost)
    np.testing.assert_array_equal(point.x[3:], arc.x[3:])
