"""A motion known to its errors behind a shadow, and what it was before it."""

import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import build_problem
from fitting.starts.before import Before
from fitting.starts.carry import carried_back
from fitting.starts.cloud import grown_slowly
from fitting.starts.multi_start import Starts

OFF_DEG_S = np.array([0.06, -0.06, 0.06])
"""Of the rate; over the shadow it makes a turn beyond all basins."""


@pytest.fixture(scope="module")
def case(munin_case):
    return munin_case("a-nominal-exact", ("rods",))


def off_deg(q, true):
    return np.degrees(2.0 * np.arccos(np.minimum(np.abs(np.asarray(q) @ true), 1.0)))


def start_at(case, number):
    x = np.zeros((1, len(case.parameters.names)))
    x[0, 3:6] = (case.truth.w[number] + np.radians(OFF_DEG_S)) / RATE_UNIT
    return Starts(x, case.truth.q[[number]], np.zeros(1))


def problem_from(case, number):
    part = case.samples.part(slice(number, None))
    steps = {"delayed": (), "max_step": 16.0, "room_for": 6.0}
    return build_problem(part, case.problem.model, case.around, whole=case.samples, **steps)


def lit(case):
    return np.flatnonzero(np.nanmax(case.samples.values["cells"], axis=1) > 0.02)


@pytest.mark.slow
def test_a_motion_found_behind_a_shadow_is_found_before_it(case):
    seen, last = lit(case), len(case.samples.t) - 1
    begin = int(seen[np.argmax(np.diff(seen)) + 1])
    assert case.samples.t[begin] - case.samples.t[begin - 1] < 0.2 * np.ptp(case.samples.t[[seen[0], begin]])
    start = start_at(case, begin)
    alone = carried_back(start, case.parameters, case.samples, begin, case.problem.model, case.around, 8.0)
    assert off_deg(alone.reference[0], case.truth.q[0]) > 20.0
    before = Before(
        case.samples, case.problem.model, case.around, case.parameters,
        lambda number: problem_from(case, number), case.weight, seen, last,
    )  # fmt: skip
    found = before.carried(start, begin, 8.0)
    assert off_deg(found.reference[0], case.truth.q[0]) < 1.0


@pytest.mark.slow
def test_a_motion_found_before_a_shadow_is_found_behind_it(case):
    seen, last = lit(case), len(case.samples.t) - 1
    end = int(seen[np.argmax(np.diff(seen))])
    found = grown_slowly(case.problem, case.parameters, start_at(case, 0), (end, last), seen, case.weight)
    assert found is not None
    assert off_deg(found.reference[0], case.truth.q[0]) < 1.0
    assert np.degrees(np.linalg.norm(found.x[0, 3:6] * RATE_UNIT - case.truth.w[0])) < 0.003
