"""A sensor that is found turned by a right angle: the axes that read the same."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.outcome.possible import wrong_axes
from jaxsat.sensors import Magnetometer


def remarks(turn):
    return wrong_axes({"mag": Magnetometer(bias=np.zeros(3), turn=np.asarray(turn))})


@pytest.mark.parametrize("turn", [[0.0, 0.0, 1.5], [1.2, 1.2, 1.2], [0.0, 3.1, 0.0]])
def test_the_axes_read_what_the_turned_sensor_reads(turn):
    (said,) = remarks(turn)
    told = said.split("--as axes:mag:")[1].rstrip(")")
    rows = [{"x": 0, "y": 1, "z": 2}[letter] for letter in told[1::2]]
    signs = [1.0 if sign == "+" else -1.0 for sign in told[::2]]
    vector = np.array([3.0, 5.0, 7.0])
    exact = Rotation.from_rotvec(np.asarray(turn)).as_matrix().round()
    np.testing.assert_array_equal(signs * vector[rows], exact.T @ vector)
    assert f"the turn of mag is {np.degrees(np.linalg.norm(turn)):.0f} deg" in said


def test_a_small_turn_is_none_of_axes():
    assert remarks([0.3, 0.2, -0.4]) == ()
