"""Each way of writing an attitude is told from the others by a direction, or said not to be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.estimation import quaternion_conventions

RNG = np.random.default_rng(5)
TURNS = Rotation.from_quat(RNG.normal(size=(40, 4)))
"""Inertial from body."""
KNOWN = RNG.normal(size=(40, 3))
SEEN = 3e-5 * TURNS.inv().apply(KNOWN) + 1e-7 * RNG.normal(size=(40, 3))


@pytest.mark.parametrize("scalar", ["first", "last"])
@pytest.mark.parametrize("sense", ["inertial_from_body", "body_from_inertial"])
def test_the_way_in_which_a_table_has_them_stands_first(scalar, sense):
    written = (TURNS if sense == "inertial_from_body" else TURNS.inv()).as_quat(scalar_first=scalar == "first")
    # Either sign is the same attitude.
    written[::3] *= -1.0
    best, *others = quaternion_conventions(written, SEEN, KNOWN)
    assert (best.scalar, best.sense) == (scalar, sense)
    assert best.angle_deg < 1.0 and min(each.angle_deg for each in others) > 30.0


def test_rows_with_gaps_are_passed_over_and_what_cannot_be_is_refused():
    q = TURNS.as_quat(scalar_first=True)
    gaps = SEEN.copy()
    gaps[::2, 1] = np.nan
    assert quaternion_conventions(q, gaps, KNOWN)[0].angle_deg < 1.0
    gaps[4:] = np.nan
    with pytest.raises(ValueError, match="expected 3 rows or more without a gap, got 2"):
        quaternion_conventions(q, gaps, KNOWN)
    q[7] = 0.0
    with pytest.raises(ValueError, match="quaternions: row 7 is zero"):
        quaternion_conventions(q, SEEN, KNOWN)


def test_turns_about_the_direction_itself_tell_no_sense():
    """A conjugate about the known axis leaves it where it is: both ways stand alike, and the caller sees it."""
    about = Rotation.from_rotvec(np.outer(RNG.uniform(-2.0, 2.0, 10), [0.0, 0.0, 1.0]))
    pole = np.tile([0.0, 0.0, 1.0], (10, 1))
    first, second, *_ = quaternion_conventions(about.as_quat(scalar_first=True), pole, pole)
    assert {first.sense, second.sense} == {"inertial_from_body", "body_from_inertial"}
    assert first.scalar == second.scalar == "first" and second.angle_deg < 1e-6
