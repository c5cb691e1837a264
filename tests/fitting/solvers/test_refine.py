"""Refinement of a session with limited charge current from the truth: exactly the limited samples are left out."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import build_problem
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.refine import LIKELIHOODS, MAX_MINIMA, MORE_ROUNDS, candidates, refine
from fitting.starts.multi_start import Starts, solve
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "c-specular50-limited.RAW_SUN"
ROOM_S = 6.0  # As a whole fit has it, whose programs are then used.


class Limited:
    """The session with everything free, at its finest usual grid."""

    def __init__(self):
        settings = FitSettings(free="state,magnet,rods,imax,inertia,albedo")
        self.data = prepare_session(read_telemetry(SESSION)).observations()
        self.problem = build_problem(self.data, noise=2.02e-3, max_step=16.0, room_for=ROOM_S)
        self.parameters = parametrization(nominal_model(read_satellite()), settings.free_names, settings.prior_sigma)
        self.truth = json.loads(SESSION.with_suffix(".truth.json").read_text())
        bright = self.data.currents.max(axis=1) > 6e-3
        self.lit = bright & (np.asarray(self.problem.light.illumination)[: len(bright)] > 0.5)
        self.weight = np.asarray(self.problem.valid).astype(float)
        self.weight[: len(bright)][bright != self.lit] = 0.0

    def true_shifts(self):
        """True parameters at the scale of |magnet| = 0.3, less the nominal ones, in units of their prior sigma."""
        true = self.truth["cfg"]
        scale, J = 0.3 / np.linalg.norm(true["magnet"]), np.array(true["inertia"])
        inertia = [J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
        values = [*(scale * np.array([*true["magnet"], *true["rods"], *inertia])), 1e-3 * true["imax"]]
        values += [*true["panel_ratio"], true["albedo_specular"], true["albedo_diffuse"], *np.zeros(12)]
        return self.parameters.shifts(np.array(values))

    def refine(self, *, offsets=((0.0, 0.0, 0.0),), likelihood="mixture", **options):
        """From the truth, in the fit's gauge, with rates off by `offsets` [rad/min]."""
        count = len(offsets)
        x = np.zeros((count, len(self.parameters.names)))
        x[:, 6:] = self.true_shifts()
        x[:, 3:6] = np.array(self.truth["w"][0]) / RATE_UNIT + np.array(offsets)
        starts = Starts(x, np.array(self.truth["q"][:1] * count), np.arange(float(count)))
        weight = np.repeat(self.weight[:, None], 6, axis=1)
        return refine(
            self.problem, self.parameters, starts, weight, likelihood=likelihood, progress=lambda *_: None, **options
        )


@pytest.fixture(scope="module")
def limited():
    return Limited()


@pytest.fixture(scope="module")
def refined(limited):
    return limited.refine(offsets=((0.0, 0.0, 0.0), (1e-3, -1e-3, 1e-3), (0.0, 2e-3, 0.0)))


def test_exactly_the_limited_samples_are_left_out(limited, refined):
    begin, end = limited.truth["cfg"]["clip"][:2]
    t = limited.data.t
    expected = np.zeros(len(limited.weight), bool)
    expected[: len(t)] = (t >= begin) & (t <= end) & limited.lit
    assert expected.sum() == 8
    np.testing.assert_array_equal(refined.limited[0, :, 0], expected)
    assert not refined.points.weight[0][expected].any() and not refined.hopeless[0]


def test_starts_that_meet_are_one_minimum(refined):
    assert len(refined.score) == len(refined.limited) == len(refined.hopeless) == len(refined.points.cost) == 1


def test_score_is_half_the_truncated_squares_and_priors(limited, refined):
    squares = np.sum(refined.points.prediction.residual[0] ** 2, axis=1)
    x = refined.points.x[0]
    expected = 0.5 * np.sum(np.minimum(squares, 30.0) * limited.weight) + 0.5 * np.sum(x[6:] ** 2)
    assert refined.score[0] == pytest.approx(expected, rel=1e-12)
    # Eight samples at the limit of 30, the others at the noise: six currents each, with ever-dark panels silent.
    assert refined.score[0] < 0.5 * (8 * 30 + 6 * limited.lit.sum())


def test_minimum_is_the_true_motion_within_its_bounds(limited, refined):
    q = refined.points.prediction.quaternion[0, : len(limited.data.t)]
    overlap = np.abs(np.sum(q * np.array(limited.truth["q"]), axis=1))
    assert np.degrees(np.sqrt(np.mean((2 * np.arccos(np.minimum(overlap, 1.0))) ** 2))) <= 1.5
    lower, upper = limited.parameters.bounds()
    assert np.all(refined.points.x >= lower) and np.all(refined.points.x <= upper)


@pytest.mark.parametrize("likelihood", ["normal", "student"])
def test_without_a_state_of_samples_nothing_is_left_out(limited, likelihood):
    result = limited.refine(likelihood=likelihood)
    assert not result.limited.any() and not result.hopeless.any()
    np.testing.assert_array_equal(result.points.weight[0].T, np.tile(limited.weight, (6, 1)))


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
