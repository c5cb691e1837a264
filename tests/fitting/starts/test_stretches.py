"""Where a search begins, how its arcs grow, and starts carried from there to the first sample."""

import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples
from fitting.starts.carry import carried_back
from fitting.starts.growing import FIRST_ARC, arc_ends
from fitting.starts.multi_start import Starts
from fitting.starts.stretches import MANY, longest_stretch, searched_samples
from jaxsat.time import Epoch


def lit_between(t, *stretches):
    return np.any([(t >= begin) & (t <= end) for begin, end in stretches], axis=0)


@pytest.mark.parametrize("cadence", [10.0, 64.0])
def test_the_search_begins_at_the_longest_stretch(cadence):
    t = np.arange(0.0, 4500.0, cadence)
    assert longest_stretch(t, lit_between(t, (0.0, 2700.0), (4000.0, 4500.0))) == 0
    begin = longest_stretch(t, lit_between(t, (0.0, 200.0), (1500.0, 4000.0)))
    assert t[begin - 1] < 1500.0 <= t[begin]


def test_lost_samples_are_no_shadow():
    t = np.arange(0.0, 4500.0, 64.0)
    lit = np.ones(len(t), bool)
    lit[3:7] = False
    assert longest_stretch(t, lit) == 0


def test_of_many_samples_each_channel_keeps_one_in_each_part_of_a_turn():
    """At 0.05 rad/s ten seconds are half a radian; a slow channel loses none that is the only one there."""
    t = np.arange(3.0 * MANY)
    slow = np.where(t % 30.0 == 4.0, t, np.nan)[:, None]
    samples = Samples(t, {"fast": t[:, None], "slow": slow}, {}, Epoch.from_utc(2020, 1, 1), {})
    kept = searched_samples(samples, 100, 0.05)
    fast = np.arange(100, 3 * MANY, 10)
    np.testing.assert_array_equal(kept, np.union1d(fast, np.arange(124, 3 * MANY, 30)))
    few = samples.part(slice(MANY))
    np.testing.assert_array_equal(searched_samples(few, 3, 0.05), np.arange(3, MANY))


@pytest.mark.slow
def test_the_true_motion_is_carried_back_to_its_start(munin_case):
    """From the truth of another program at a sample after the shadow to that at the first one."""
    case = munin_case("a-nominal-exact", ("rods",))
    parameters, truth, begin = case.parameters, case.truth, 65
    x = np.zeros((2, len(parameters.names)))
    x[:, 3:6] = truth.w[begin] / RATE_UNIT
    x[1, 3] = np.nan
    starts = Starts(x, np.array([truth.q[begin]] * 2), np.array([1.0, 2.0]))
    found = carried_back(starts, parameters, case.samples, begin, case.problem.model, case.around, 8.0)
    # The second start is none any more, and is left behind.
    assert len(found.cost) == 1 and found.cost[0] == 1.0
    overlap = abs(float(found.reference[0] @ truth.q[0]))
    assert np.degrees(2.0 * np.arccos(min(overlap, 1.0))) < 0.1
    np.testing.assert_allclose(found.x[0, 3:6] * RATE_UNIT, truth.w[0], atol=2e-6)
    assert not found.x[0, :3].any() and not found.x[0, 6:].any()


@pytest.mark.parametrize("dark", ["none", "before", "between", "after"])
@pytest.mark.parametrize("count", [7, 8, 9, 20, 51, 400])
def test_arcs_grow_to_the_whole_session(count, dark):
    lit, shadow = np.ones(count, bool), np.zeros(15, bool)
    lit = {
        "none": lit,
        "before": np.concatenate([shadow, lit]),
        "between": np.insert(lit, count // 2, shadow),
        "after": np.concatenate([lit, shadow]),
    }[dark]
    last = len(lit) - 1
    ends = arc_ends(np.flatnonzero(lit), last)
    assert ends[-1] == last and all(0 <= end <= last for end in ends)
    assert all(isinstance(end, int) for end in ends)
    assert ends == sorted(set(ends))
    held = [int(lit[: end + 1].sum()) for end in ends]
    assert held[0] >= min(FIRST_ARC, count)
    # No arc is more than twice the one before: the next rate must lie inside the basin of the last.
    assert all(after <= 2 * before for before, after in zip(held, held[1:], strict=False))
