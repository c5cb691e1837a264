"""Which of the causes that were tried are told, and in which order; the lowest chi2 along a number; orders in words."""

import numpy as np
import pytest

from fitting.doctor.causes.axes import exchanged
from fitting.doctor.lines import lowest
from fitting.doctor.trial import Trial, ranked

FACES = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


def trial(kind: str, chi2: float, added: int = 1, cause: str = "") -> Trial:
    return Trial(kind, cause or kind, "", chi2, added)


def test_the_best_of_each_kind_is_told_the_best_first():
    found = ranked(
        [trial("clock", 500.0), trial("axes", 220.0, cause="good"), trial("axes", 900.0, cause="bad")], 1000.0, 200
    )
    assert [(cause.kind, cause.cause, cause.explains) for cause in found] == [
        ("axes", "good", True),
        ("clock", "clock", False),
    ]
    assert (found[0].chi2_before, found[0].chi2_after) == (1000.0, 220.0)


def test_each_number_that_is_added_costs_the_logarithm_of_the_readings():
    # 20 more numbers cost 20 ln 200 = 106.
    many, few = trial("motion", 200.0, added=21), trial("clock", 290.0)
    assert [cause.kind for cause in ranked([many, few], 1000.0, 200)] == ["clock", "motion"]
    assert [cause.kind for cause in ranked([many, trial("clock", 320.0)], 1000.0, 200)] == ["motion", "clock"]


def test_what_saves_no_more_than_chance_is_not_told():
    assert ranked([trial("axes", 990.0), trial("clock", 1100.0), trial("drift", np.inf)], 1000.0, 200) == ()


@pytest.mark.parametrize("vertex", [7.0, -13.0, 3.0])
def test_the_vertex_of_a_parabola_is_found(vertex):
    value, least = lowest(lambda x: 3.0 * (x - vertex) ** 2 + 5.0, (-20.0, -10.0, 10.0, 20.0), 3.0 * vertex**2 + 5.0)
    assert value == pytest.approx(vertex, abs=0.05) and least == pytest.approx(5.0, abs=0.01)


def test_what_promises_nothing_is_not_followed():
    tried = []

    def chi2(x: float) -> float:
        tried.append(x)
        return 100.0 + (x - 0.4) ** 2

    assert lowest(chi2, (-20.0, 20.0), 100.16) == (0.0, 100.16) and tried == [-20.0, 20.0]


def test_a_slope_ends_at_the_last_that_is_tried():
    assert lowest(lambda x: -x, (-1.0, 1.0, 2.0), 0.0) == (2.0, -2.0)


def test_orders_in_words():
    assert exchanged(FACES, (1, 0, 2, 3, 4, 5)) == "+X and -X exchanged"
    assert exchanged(FACES, (0, 1, 3, 2, 5, 4)) == "+Y and -Y, +Z and -Z exchanged"
    assert exchanged(FACES, (4, 5, 0, 1, 2, 3)).startswith("+Z for +X, -Z for -X, +X for +Y")
