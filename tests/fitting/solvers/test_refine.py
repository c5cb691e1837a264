"""Refinement of a session with limited charge current from the truth: exactly the limited samples are left out."""

import dataclasses

import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.solvers.refine import LIKELIHOODS, MAX_MINIMA, MORE_ROUNDS, candidates, refine
from fitting.starts.multi_start import Starts, solve

pytestmark = pytest.mark.slow

FREE = ["magnet", "rods", "imax", "inertia", "albedo"]
ENTRIES = ("xx", "yy", "zz", "xy", "xz", "yz")
CELLS = slice(0, 6)
"""Columns of the currents."""


class Limited:
    """The session with everything free, at its finest usual grid."""

    def __init__(self, case):
        self.case, self.problem, self.parameters, self.truth = case, case.problem, case.parameters, case.truth
        self.t = case.samples.t
        self.weight = np.array(case.weight)
        self.counts = self.weight[:, 0]
        bright = case.samples.values["cells"].max(axis=1) > 6e-3
        self.lit = bright & (np.asarray(self.problem.sky.light.illumination)[: len(bright)] > 0.5)

    def true_shifts(self):
        """True parameters at the scale of |magnet| = 0.3, less the nominal ones, in units of their prior sigma."""
        true = self.truth.numbers
        scale, J = 0.3 / np.linalg.norm(true["magnet"]), np.array(true["inertia"])
        values = {f"magnet.{axis}": scale * value for axis, value in zip("xyz", true["magnet"], strict=True)}
        values |= {f"rods.{axis}": scale * value for axis, value in zip("yz", true["rods"], strict=True)}
        values |= {f"inertia.{a}{b}": scale * J["xyz".index(a), "xyz".index(b)] for a, b in ENTRIES}
        values |= {f"albedo.{law}": true[f"albedo_{law}"] for law in ("specular", "diffuse")}
        return self.parameters.shifts(self.case.reordered({**values, "imax": 1e-3 * true["imax"]}))

    def refine(self, *, offsets=((0.0, 0.0, 0.0),), likelihood="mixture", **options):
        """From the truth, in the fit's gauge, with rates off by `offsets` [rad/min]."""
        count = len(offsets)
        x = np.zeros((count, len(self.parameters.names)))
        x[:, 6:] = self.true_shifts()
        x[:, 3:6] = self.truth.w[0] / RATE_UNIT + np.array(offsets)
        starts = Starts(x, np.repeat(self.truth.q[:1], count, axis=0), np.arange(float(count)))
        how = {"likelihood": likelihood, "progress": lambda *_: None, **options}
        return refine(self.problem, self.parameters, starts, self.weight, **how)


@pytest.fixture(scope="module")
def limited(munin_case):
    return Limited(munin_case("c-specular50-limited", FREE))


@pytest.fixture(scope="module")
def refined(limited):
    return limited.refine(offsets=((0.0, 0.0, 0.0), (1e-3, -1e-3, 1e-3), (0.0, 2e-3, 0.0)))


def test_exactly_the_limited_samples_are_left_out(limited, refined):
    begin, end = limited.truth.numbers["clip"][:2]
    t = limited.t
    expected = np.zeros(len(limited.weight), bool)
    expected[: len(t)] = (t >= begin) & (t <= end) & limited.lit
    assert expected.sum() == 8
    np.testing.assert_array_equal(refined.limited[0, :, 0], expected)
    assert not refined.points.weight[0][expected, CELLS].any() and not refined.hopeless[0]


def test_starts_that_meet_are_one_minimum(refined):
    assert len(refined.score) == len(refined.limited) == len(refined.hopeless) == len(refined.points.cost) == 1


def test_score_is_half_the_truncated_squares_and_priors(limited, refined):
    squares = np.sum(refined.points.prediction.residual[0, :, CELLS] ** 2, axis=1)
    x = refined.points.x[0]
    expected = 0.5 * np.sum(np.minimum(squares, 30.0) * limited.counts) + 0.5 * np.sum(x[6:] ** 2)
    assert refined.score[0] == pytest.approx(expected, rel=1e-12)
    # Eight samples at the limit of 30, the others at the noise: six currents each, with ever-dark panels silent.
    assert refined.score[0] < 0.5 * (8 * 30 + 6 * limited.lit.sum())


def test_minimum_is_the_true_motion_within_its_bounds(limited, refined):
    q = refined.points.prediction.quaternion[0, : len(limited.t)]
    overlap = np.abs(np.sum(q * limited.truth.q, axis=1))
    assert np.degrees(np.sqrt(np.mean((2 * np.arccos(np.minimum(overlap, 1.0))) ** 2))) <= 1.5
    lower, upper = limited.parameters.bounds()
    assert np.all(refined.points.x >= lower) and np.all(refined.points.x <= upper)


@pytest.mark.parametrize("likelihood", ["normal", "student"])
def test_without_a_state_of_samples_nothing_is_left_out(limited, likelihood):
    result = limited.refine(likelihood=likelihood)
    assert not result.limited.any() and not result.hopeless.any()
    np.testing.assert_array_equal(result.points.weight[0], limited.weight)


def test_ways_of_being_robust_agree(limited, refined):
    """Limited samples cost a normal likelihood several sigmas; the others agree within a third of one."""
    x = refined.points.x[0, 6:]
    sigma = np.sqrt(np.diagonal(np.linalg.inv(refined.points.hessian[0])))[6:]
    off = {name: np.abs(limited.refine(likelihood=name).points.x[0, 6:] - x) / sigma for name in LIKELIHOODS}
    assert off["trimmed"].max() < 1e-2 and off["student"].max() < 0.7 and off["normal"].max() > 2.0, off


def test_a_model_that_explains_little_keeps_every_sample(limited):
    """Where a third and more of the samples would be left out, the model is wrong: they all stay."""
    far = limited.refine(offsets=((0.9, 0.7, -0.8),))
    assert far.hopeless[0] and not far.limited[0].any()


def test_candidates_are_few_and_near_the_best():
    assert candidates(np.array([10.0, 11.0, 69.9, 70.1, 500.0])).tolist() == [0, 1, 2]
    assert candidates(np.full(100, 3.0)).tolist() == list(range(MAX_MINIMA))
    assert candidates(np.array([0.0])).tolist() == [0]


def test_a_minimum_that_is_not_reached_gets_more_rounds(limited, refined, monkeypatch):
    """With one step a round, the usual three rounds stop far off; the ones after them go on with fresh damping."""
    rounds = []

    def one_step(problem, parameters, stage, *inputs):
        point = solve(problem, parameters, dataclasses.replace(stage, iterations=1), *inputs)
        rounds.append(float(point.cost[0]))
        return point

    monkeypatch.setattr("fitting.solvers.refine.solve", one_step)
    limited.refine(offsets=((1e-2, 0.0, 0.0),))
    # More of the robust first one, and of the last.
    assert len(rounds) == 1 + MORE_ROUNDS + len(LIKELIHOODS["mixture"]) + MORE_ROUNDS
    last = rounds[-1 - MORE_ROUNDS :]
    assert last == sorted(last, reverse=True) and last[-1] < last[0]


def test_a_damped_solver_that_is_stuck_is_helped_by_undamped_steps(limited, refined, monkeypatch):
    """As on a kink, where each damped step was refused: two clean sessions of 88 ended 0.2 above their minimum."""

    def stuck(problem, parameters, stage, *start):
        return solve(problem, parameters, dataclasses.replace(stage, iterations=0), *start)

    monkeypatch.setattr("fitting.solvers.refine.solve", stuck)
    helped = limited.refine(offsets=((0.0, 1e-3, 0.0),))
    assert helped.points.cost[0] == pytest.approx(refined.points.cost[0], abs=2e-2)
