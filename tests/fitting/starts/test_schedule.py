"""The schedule of arcs covers every session and never asks for a sample that is not there."""

import numpy as np
import pytest

from fitting.parameters.names import MODEL, STATE
from fitting.starts.schedule import FIRST_ARC_LIT, arc_schedule


@pytest.mark.parametrize("dark", ["none", "before", "between", "after"])
@pytest.mark.parametrize("count", [7, 8, 9, 20, 51, 400])
def test_arcs_grow_to_the_whole_session(count, dark):
    lit = np.ones(count, bool)
    shadow = np.zeros(15, bool)
    lit = {
        "none": lit,
        "before": np.concatenate([shadow, lit]),
        "between": np.insert(lit, count // 2, shadow),
        "after": np.concatenate([lit, shadow]),
    }[dark]
    last = len(lit) - 1
    stages = arc_schedule(lit, last, MODEL)
    ends = [stage.last_sample for stage in stages]
    assert ends[-1] == last and all(0 <= end <= last for end in ends)
    assert all(isinstance(end, int) for end in ends)
    # The shortest arcs are the whole session from the start: two halves, dynamics, everything.
    assert ends == sorted(ends) and ends.count(last) <= (4 if count < 9 else 2)
    assert stages[-1].active.all()
    held = [int(lit[: end + 1].sum()) for end in ends]
    assert held[0] >= min(FIRST_ARC_LIT, count)
    # No arc is more than twice the one before: the next rate must lie inside the basin of the last.
    assert all(after <= 2 * before for before, after in zip(held, held[1:], strict=False))
    assert [stage.keep for stage in stages] == sorted((stage.keep for stage in stages), reverse=True)
    assert stages[0].keep >= 65536 and stages[-1].keep >= 1


def test_what_is_free_grows_with_the_arc():
    names = np.array([*STATE, *MODEL])
    stages = arc_schedule(np.ones(60, bool), 59, MODEL)
    assert all(len(stage.active) == 38 and stage.active[:6].all() for stage in stages)
    first = set(names[stages[0].active])
    assert first == {*STATE, "albedo.specular", "albedo.diffuse"}
    assert all(np.all(a.active <= b.active) for a, b in zip(stages, stages[1:], strict=False))
    assert stages[-1].active.all()


def test_a_fit_of_the_state_alone_has_six_unknowns():
    stages = arc_schedule(np.ones(30, bool), 29, ())
    assert all(stage.active.shape == (6,) and stage.active.all() for stage in stages)
