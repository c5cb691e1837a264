"""The robust loss in closed form, the bounded step against NumPy, and the solver on a real session."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT, Prediction
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.groups import Group
from fitting.solvers import least_squares
from fitting.solvers.least_squares import Point, Settings, normal_equations, robust_loss, sample_loss
from fitting.starts.multi_start import NONE, Stage, solve

CURRENTS = Group("cells", 6)
PLAIN = 1e4
solve_bounded = jax.jit(least_squares.solve_bounded)


def test_robust_loss_is_pseudo_huber():
    r = np.array([[-30.0, -3.0, 0.0, 0.3, 3.0, 300.0]])
    c = 3.0
    expected = 2.0 * c**2 * (np.sqrt(1.0 + (r / c) ** 2) - 1.0)
    square = jnp.asarray(r**2)
    np.testing.assert_allclose(robust_loss(square, jnp.asarray(c)), expected, rtol=1e-13)
    np.testing.assert_allclose(robust_loss(1e-16 * square, jnp.asarray(c)), 1e-16 * r**2, rtol=1e-10)
    # Without robustness no digit is lost: plain squares to (r/c)^2 / 4.
    np.testing.assert_allclose(robust_loss(square, jnp.asarray(1e9)), r**2, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.5, 3.0, 1e4])
def test_gradient_is_the_derivative_of_the_cost(scale):
    """Of the pseudo-Huber loss over all magnitudes, of readings at the floor and above, and of the mixture."""
    rng = np.random.default_rng(0)
    residual = jnp.asarray(np.abs(rng.normal(size=(50, 6))) * 10.0 ** np.linspace(-4, 2, 50)[:, None])
    floor = jnp.where(jnp.asarray(rng.uniform(size=(50, 6))) < 0.5, 0.25, NO_FLOOR)
    J, weight = jnp.asarray(rng.normal(size=(50, 6, 3))), jnp.asarray(rng.uniform(size=(50, 6)))
    none = jnp.asarray(NONE)
    settings = Settings(jnp.asarray(0), jnp.asarray(0), jnp.asarray(scale), jnp.ones(3, bool), none, jnp.asarray(1.0))
    slope, gradient = slope_and_gradient(jnp.zeros(3), residual, 1e-3 * J, weight, settings, floor)
    np.testing.assert_allclose(gradient, slope, rtol=1e-9, atol=1e-14)


@jax.jit
def slope_and_gradient(x, residual, J, weight, settings, floor):
    def equations(x):
        return normal_equations(residual + J @ x, J, weight, settings, floor, (CURRENTS,))[:2]

    return jax.grad(equations, has_aux=True)(x)


@pytest.mark.parametrize(("tail", "ceiling"), [(NONE, NONE), (6.0, NONE), (NONE, 30.0), (4.0, 20.0)])
def test_loss_of_a_sample(tail, ceiling):
    """Minus twice the logarithm of Student's density, mixed with that of an outlier; the weight is its slope."""
    numbers = jnp.asarray(tail), jnp.asarray(ceiling)
    square = jnp.asarray([0.0, 1e-6, 0.5, 6.0, 29.0, 31.0, 300.0])
    (loss, weight), slope = loss_and_slope(square, *numbers)
    heavy = np.asarray(square) if tail == NONE else tail * np.log(1.0 + np.asarray(square) / tail)
    outlier = np.exp(-0.5 * ceiling)
    expected = -2.0 * np.log((np.exp(-0.5 * heavy) + outlier) / (1.0 + outlier))
    np.testing.assert_allclose(loss, expected, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(weight, slope, rtol=1e-12, atol=1e-20)
    if ceiling != NONE:
        # As likely as not to be an outlier where the loss without outliers is the ceiling.
        at = tail * np.expm1(ceiling / tail) if tail != NONE else ceiling
        share = 1.0 if tail == NONE else tail / (tail + at)
        (_, weight), _ = loss_and_slope(jnp.full(len(square), at), *numbers)
        np.testing.assert_allclose(weight, 0.5 * share, rtol=1e-9)


@jax.jit
def loss_and_slope(square, tail, ceiling):
    slope = jax.grad(lambda s: jnp.sum(sample_loss(s, tail, ceiling)[0]))(square)
    return sample_loss(square, tail, ceiling), slope


def point(hessian, gradient, x, damping=0.0):
    """A start with a quadratic model; everything that a step does not look at is zero."""
    prediction = Prediction(jnp.zeros((2, 6)), jnp.zeros((2, 4)), jnp.zeros((2, 3)), jnp.zeros((2, 3, len(x))))
    identity = jnp.array([1.0, 0.0, 0.0, 0.0])
    model = (jnp.asarray(1.0), jnp.asarray(gradient), jnp.asarray(hessian), jnp.asarray(damping))
    return Point(jnp.asarray(x), identity, jnp.ones((2, 6)), *model, prediction, jnp.asarray(jnp.inf))


def step_of(start, lower, upper, active=(True,) * 6):
    settings = Settings(
        jnp.asarray(0), jnp.asarray(1), jnp.asarray(PLAIN), jnp.asarray(active), *[jnp.asarray(NONE)] * 2
    )
    step, decrement = solve_bounded(start, jnp.asarray(lower), jnp.asarray(upper), settings)
    return np.asarray(step), float(decrement)


@pytest.fixture(scope="module")
def quadratic():
    """Hessian and gradient whose unknowns differ by five orders in curvature."""
    rng = np.random.default_rng(4)
    scale = np.array([1.0, 1e3, 1e-2, 1.0, 10.0, 0.1])
    root = rng.normal(size=(20, 6)) * scale
    return root.T @ root, rng.normal(size=6) * scale


NOWHERE = (np.full(6, -np.inf), np.full(6, np.inf))


@pytest.mark.slow
def test_undamped_step_is_newtons(quadratic):
    hessian, gradient = quadratic
    expected = -np.linalg.solve(hessian, gradient)
    step, decrement = step_of(point(hessian, gradient, np.zeros(6)), *NOWHERE)
    np.testing.assert_allclose(step, expected, rtol=1e-9)
    assert decrement == pytest.approx(-0.5 * gradient @ expected, rel=1e-9)


def test_damping_turns_the_step_towards_the_scaled_gradient(quadratic):
    hessian, gradient = quadratic
    damping = 1e6
    step, _ = step_of(point(hessian, gradient, np.zeros(6), damping), *NOWHERE)
    np.testing.assert_allclose(step, -gradient / (damping * np.diagonal(hessian)), rtol=1e-4)


def test_inactive_and_pressed_unknowns_stay(quadratic):
    hessian, gradient = quadratic
    lower, upper = (bound.copy() for bound in NOWHERE)
    # 0 pressed from below, 1 from above, 2 on a bound that it leaves, 3 inactive.
    lower[0], upper[1] = 0.0, 0.0
    gradient = np.array([1.0, -1e3, gradient[2], gradient[3], gradient[4], gradient[5]])
    if gradient[2] < 0:
        lower[2] = 0.0
    else:
        upper[2] = 0.0
    step, _ = step_of(point(hessian, gradient, np.zeros(6)), lower, upper, (True, True, True, False, True, True))
    assert step[0] == step[1] == step[3] == 0.0 and not np.signbit(step[0])
    free = [2, 4, 5]
    expected = -np.linalg.solve(hessian[np.ix_(free, free)], gradient[free])
    np.testing.assert_allclose(step[free], np.clip(expected, lower[free], upper[free]), rtol=1e-9)


def test_step_ends_at_the_bound():
    step, _ = step_of(point(np.eye(6), np.full(6, -3.0), np.zeros(6)), np.full(6, -1.0), np.full(6, 0.5))
    np.testing.assert_array_equal(step, np.full(6, 0.5))


class Session:
    """The exact session with the state free, and its true attitude and rate as a start."""

    def __init__(self, case):
        self.problem, self.parameters, self.weight = case.problem, case.parameters, case.weight
        self.q = case.truth.q
        self.unknowns = len(self.parameters.everything)
        self.x = np.concatenate([np.zeros(3), case.truth.w[0] / RATE_UNIT, np.zeros(self.unknowns - 6)])[None]

    def state(self, *numbers):
        """Unknowns of which only those of the state are given."""
        return np.array([*numbers, *[type(numbers[0])(0)] * (self.unknowns - 6)])

    def solve(self, x=None, q=None, problem=None, **changes):
        stage = Stage(len(self.q) - 1, 1, 20, PLAIN, self.parameters.everything)
        x = self.x if x is None else x
        q = self.q[:1] if q is None else q
        return solve(problem or self.problem, self.parameters, dataclasses.replace(stage, **changes), x, q, self.weight)


@pytest.fixture(scope="module")
def session(munin_case):
    return Session(munin_case("a-nominal-exact", ["state"]))


def error_deg(session, points, k=0):
    overlap = np.abs(np.sum(points.prediction.quaternion[k, : len(session.q)] * session.q, axis=1))
    return np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0)))


@pytest.mark.slow
def test_solver_reaches_the_minimum_beside_the_truth(session):
    # 2 deg and 5e-5 rad/s off: several times the width of the linear range over 4480 s.
    x = session.x + session.state(0.03, -0.02, 0.01, 3e-3, -2e-3, 1e-3)
    points = session.solve(np.concatenate([session.x, x]), session.q[[0, 0]])
    for k in range(2):
        # Gradient in sigmas: what is left to gain is below 1e-6 of a unit of chi2.
        gradient, hessian = points.gradient[k], points.hessian[k]
        assert gradient @ np.linalg.solve(hessian, gradient) < 1e-6
        assert np.sqrt(np.mean(error_deg(session, points, k) ** 2)) < 0.3
        assert not np.any(points.x[k, :3])
    np.testing.assert_allclose(points.x[0], points.x[1], atol=1e-6)
    assert abs(points.reference[0] @ points.reference[1]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
def test_inactive_unknowns_do_not_move(session):
    x = session.x + session.state(*[1e-3] * 6)
    points = session.solve(x, active=session.state(True, True, True, False, True, False))
    np.testing.assert_array_equal(points.x[0, [3, 5]], x[0, [3, 5]])
    assert points.x[0, 4] != x[0, 4] and np.any(points.reference[0] != session.q[0])


@pytest.mark.slow
def test_no_iteration_leaves_the_start_where_it_is(session):
    points = session.solve(iterations=0)
    np.testing.assert_array_equal(points.x, session.x)
    np.testing.assert_allclose(points.reference, session.q[:1], atol=1e-15)
    # Integration error over the session at steps of 16 s; the orbit is fitted to positions rounded to a metre.
    assert error_deg(session, points).max() < 0.3


@pytest.mark.slow
def test_samples_after_the_arc_are_not_looked_at(session):
    measured = {name: np.array(values) for name, values in session.problem.measured.items()}
    measured["cells"][20:] = 0.123
    other = dataclasses.replace(session.problem, measured=measured)
    points, changed = session.solve(last_sample=19), session.solve(last_sample=19, problem=other)
    for name in ("x", "reference", "cost", "hessian"):
        np.testing.assert_array_equal(getattr(points, name), getattr(changed, name))
    assert points.cost[0] != session.solve(last_sample=20).cost[0]


@pytest.mark.slow
def test_number_of_starts_does_not_change_a_start(session):
    """Chunks of fixed size padded with copies: seven starts give what each gives alone, in their order."""
    shift = np.linspace(-1e-3, 1e-3, 7)[:, None] * session.state(0.0, 0, 0, 1.0, 1.0, 1.0)
    x, q = session.x + shift, np.repeat(session.q[:1], 7, axis=0)
    together = session.solve(x, q, last_sample=15, iterations=2)
    assert together.x.shape == (7, session.unknowns)
    alone = session.solve(x[5:6], q[5:6], last_sample=15, iterations=2)
    np.testing.assert_array_equal(together.x[5], alone.x[0])
    np.testing.assert_array_equal(together.cost[5], alone.cost[0])


@pytest.mark.parametrize(("loss", "expected"), [(None, 1e-6), ("normal", 1.0), ("student", 3.0 / (3.0 + 300.0))])
def test_losses_of_channels(loss, expected):
    """One sample of three readings with squares of 100 each: an outlier, a plain sample, or one of a heavy tail."""
    none = jnp.asarray(NONE)
    settings = Settings(jnp.asarray(0), jnp.asarray(1), none, jnp.ones(1, bool), none, jnp.asarray(1.0))
    r, floor = jnp.full((1, 3), 10.0), jnp.full((1, 3), NO_FLOOR)
    groups = (Group("mag", 3, loss=loss),)
    _, gradient, _ = normal_equations(r, jnp.ones((1, 3, 1)), jnp.ones((1, 3)), settings, floor, groups)
    assert float(gradient[0]) / 30.0 == pytest.approx(expected, abs=1e-5)
