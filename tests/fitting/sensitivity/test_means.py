"""Slopes of means: exact on quadratics, true within their errors for what has no derivative, and of whole scenarios."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fitting.sensitivity.design import descended
from fitting.sensitivity.means import MeanSlopes, slopes_of_means, slopes_of_runs
from jaxsat.errors import InputError
from jaxsat.sweep import Knob, Metric, Scenario

STARTS = 400


def chaotic(x, start, times=60) -> Any:
    """The logistic map after many turns: its derivative by x is astronomical, its mean moves slowly."""
    for _ in range(times):
        start = x * start * (1.0 - start)
    return start


@pytest.mark.parametrize("together", [False, True])
def test_of_a_quadratic_they_are_its_gradient_without_error(together):
    bend = np.array([[2.0, 0.3], [0.3, -1.0]])

    def run(moved):
        return {"f": moved @ [1.0, -4.0] + 0.5 * np.einsum("ki,ij,kj->k", moved, bend, moved)}

    at = np.array([0.7, -0.2])
    found = slopes_of_runs(run, 2, 50, width=0.1, seed=3, together=together, at=at)["f"]
    np.testing.assert_allclose(found.slopes, [1.0, -4.0] + bend @ at, rtol=1e-10)
    assert np.all(found.sigma < 1e-10) and not found.left_out.any()


def test_of_a_staircase_it_is_the_slope_of_its_smoothed_mean_within_the_error_that_is_told():
    # The mean of a step is the normal distribution function, whose slope at x is the density over s.
    at, width, seeds = 0.1, 0.2, 60
    off = []
    for seed in range(seeds):

        def run(moved):
            return {"step": np.where(moved[:, 0] > 0.0, 1.0, 0.0)}

        found = slopes_of_runs(run, 1, STARTS, width=width, seed=seed, together=True, at=np.array([at]))["step"]
        density = math.exp(-0.5 * (at / width) ** 2) / (width * math.sqrt(2.0 * math.pi))
        off.append((found.slopes[0] - density) / found.sigma[0])
    # Mean and spread of so many errors in their own sigma.
    assert abs(np.mean(off)) < 4.0 / math.sqrt(seeds)
    assert 0.75 < np.std(off) < 1.3


def test_alone_it_is_the_slope_of_the_mean_over_the_width_with_its_error():
    # Stairs at places spread normally: of the uniform mean over the width the slope is a difference of their share.
    width, off = 0.3, []
    for seed in range(60):
        places = np.random.default_rng(seed).standard_normal(STARTS)
        found = slopes_of_runs(lambda moved, at=places: {"step": (moved[:, 0] > at) * 2.0}, 1, STARTS, width=width)
        share = 0.5 * math.erf(width / math.sqrt(2.0))
        off.append((found["step"].slopes[0] - 2.0 * share / width) / found["step"].sigma[0])
    assert abs(np.mean(off)) < 4.0 / math.sqrt(60)
    assert 0.75 < np.std(off) < 1.3


def test_the_slope_of_a_chaotic_mean_is_that_of_a_brute_average():
    rng = np.random.default_rng(0)
    starts = rng.uniform(0.1, 0.9, 4000)

    def run(moved):
        return {"end": chaotic(np.clip(3.8 + moved[:, 0], 0.0, 4.0), starts)}

    found = slopes_of_runs(run, 1, len(starts), width=0.03, together=True)["end"]
    own = [
        np.mean(chaotic(3.8 + 0.03 * rng.standard_normal(100_000) + by, rng.uniform(0.1, 0.9, 100_000)).clip(0, 1))
        for by in (-0.01, 0.01)
    ]
    assert abs(found.slopes[0] - (own[1] - own[0]) / 0.02) < 4.0 * math.hypot(found.sigma[0], 0.08)
    # A derivative along the motion, which is exact, is of another size altogether.
    small = chaotic(3.8 + 1e-12, starts[:100], 30) - chaotic(3.8, starts[:100], 30)
    assert np.median(np.abs(small)) / 1e-12 > 1e3 * abs(found.slopes[0])


def test_starts_without_a_value_are_left_out_and_counted():
    def run(moved):
        return {"f": np.where(np.arange(len(moved)) < 10, np.nan, moved[:, 0])}

    found = slopes_of_runs(run, 1, STARTS)["f"]
    assert found.left_out == [10] and np.isnan(found.influence[:10]).all()
    np.testing.assert_allclose(found.slopes, [1.0])
    failing: tuple[tuple[Any, dict[str, Any], str], ...] = (
        (lambda moved: {"f": np.full(len(moved), np.nan)}, {}, "only 0 of"),
        (run, {"width": 0.0}, "positive widths"),
        (lambda moved: {"f": moved}, {}, "shape"),
    )
    for function, settings, told in failing:
        with pytest.raises(ValueError, match=told):
            slopes_of_runs(function, 1, STARTS, **settings)


HORIZON = 3.0


def made(**changed) -> Scenario:
    """Exponential times with the mean `lag`, seen up to the horizon; of a few cases with bad luck nothing is known."""

    def draws(seed, cases):
        return np.array([np.random.default_rng([seed, case]).uniform(size=2) for case in cases])

    def run_moved(seed, cases, moved):
        lag, push = np.exp(np.asarray(moved)[:, 0]), np.asarray(moved)[:, 1]
        luck, bad = draws(seed, cases).T
        time = -lag * np.log(luck)
        status = np.where(bad < 0.02, 2, np.where(time < HORIZON, 0, 1))
        return {
            "status": status,
            "time_s": np.where(status == 0, time, np.nan),
            "miss_deg": np.where(status == 2, np.nan, luck * (2.0 + push)),
        }

    metrics = {"time_s": Metric("s", "until it is there", endless=True), "miss_deg": Metric("deg", "by how much")}
    knobs = (Knob("lag", "s", "mean time", 1.0), Knob("push", "deg", "added", 0.0, shift=1.0))
    scenario = Scenario(
        "made",
        ("succeeded", "late", "lost"),
        metrics,
        512,
        lambda seed, cases: run_moved(seed, cases, np.zeros((len(cases), 2))),
        knobs=knobs,
        run_moved=run_moved,
        horizon_s=HORIZON,
    )
    return dataclasses.replace(scenario, **changed)


def test_slopes_of_a_scenario_are_those_of_closed_forms():
    """Of exponential times with mean m: the share within T, and the restricted mean m (1 - exp(-T/m))."""
    found = slopes_of_means(made(), cases=8000, width=0.1)
    assert list(found.metrics) == ["success", "time_s", "miss_deg"] and sum(found.ended.values()) == 8000
    late, lost = math.exp(-HORIZON), 0.02
    for name, mean, slope in (
        ("success", (1.0 - late) * (1.0 - lost), -HORIZON * late * (1.0 - lost)),
        # A case that is lost never got there.
        ("time_s", (1.0 - late) * (1.0 - lost) + HORIZON * lost, (1.0 - late - HORIZON * late) * (1.0 - lost)),
        ("miss_deg", 1.0, 0.0),
    ):
        one = found.metrics[name]
        assert abs(one.mean - mean) < 4.0 * one.mean_sigma
        # The smoothing is off by a share of about the square of its width.
        assert abs(one.slopes.slopes[0] - slope) <= 4.0 * one.slopes.sigma[0] + 0.02 * abs(slope), name
    time_s, miss = found.metrics["time_s"], found.metrics["miss_deg"]
    assert time_s.horizon_s == HORIZON and set(time_s.without) == {"late", "lost"} and not time_s.slopes.left_out.any()
    assert miss.horizon_s is None and set(miss.without) == {"lost"}
    assert list(miss.slopes.left_out) == [miss.without["lost"]] * 2 == [found.ended["lost"]] * 2
    assert miss.slopes.slopes[1] == pytest.approx(0.5, abs=4.0 * miss.slopes.sigma[1])
    # What a knob does not change has no slope; a count is never told to be exact.
    success = found.metrics["success"].slopes
    assert success.slopes[1] == 0.0 and success.sigma[1] == pytest.approx(0.5 / (0.1 * 8000))


def test_chosen_knobs_and_metrics_of_any_number_of_cases():
    found = slopes_of_means(made(), ["push"], ["miss_deg"], cases=600, at={"lag": 0.2, "push": 1.0})
    assert list(found.metrics) == ["miss_deg"] and [knob.name for knob in found.knobs] == ["push"]
    assert found.metrics["miss_deg"].mean == pytest.approx(1.5, rel=0.1)
    # Without a horizon the mean is that of those who got there, and the rest is counted.
    bare = slopes_of_means(made(horizon_s=None), ["lag"], ["time_s"], cases=600).metrics["time_s"]
    assert bare.horizon_s is None and bare.slopes.left_out[0] >= sum(bare.without.values()) > 0
    wrong: tuple[tuple[Scenario, dict[str, Any], str], ...] = (
        (made(), {"knobs": ["lagg"]}, "lagg: no such knob of this scenario; did you mean lag?"),
        (made(), {"metrics": ["time"]}, "time: no such metric of this scenario; did you mean time_s?"),
        (made(), {"cases": 3}, "cases: expected at least 8"),
        (made(), {"width": 0.0}, "width: expected a number above 0"),
        (made(knobs=(), run_moved=None), {}, "scenario made has no knobs"),
        (made(), {"exact": True, "cases": 8}, "scenario made has no exact derivatives"),
    )
    for scenario, given, told in wrong:
        with pytest.raises(InputError) as caught:
            slopes_of_means(scenario, **given)
        assert told in str(caught.value)


def test_a_descent_finds_the_least_inside_and_stays_at_bounds():
    best = np.array([0.3, 2.0])

    def slopes_at(design, number):
        noise = np.random.default_rng(number).normal(size=2)
        return MeanSlopes(0.0, 0.0, (design - best) + 0.05 * noise, np.full(2, 0.05), np.zeros(2), np.zeros((1, 2)))

    low, high = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    found, way = descended(slopes_at, np.array([-0.9, -0.9]), low=low, high=high, step=0.5, steps=60)
    # The second number wants to go beyond its bound. Steps are still 0.06 at the end.
    np.testing.assert_allclose(found, [0.3, 1.0], atol=0.06)
    assert len(way) == 60
    with pytest.raises(ValueError, match="low < high"):
        descended(slopes_at, best, low=high, high=low, step=0.5, steps=60)
