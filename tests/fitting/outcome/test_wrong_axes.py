"""A sensor that is found turned by a right angle: the axes that read the same."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.outcome.possible import other_names, wrong_axes
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


def test_each_axis_is_named_once():
    # A turn of 61 deg about an axis of no direction: the largest entries of two rows stand in one column.
    for turn in np.random.default_rng(0).normal(size=(200, 3)):
        (said,) = remarks(np.radians(61.0) * turn / np.linalg.norm(turn))
        assert sorted(said.split("--as axes:mag:")[1].rstrip(")")[1::2]) == ["x", "y", "z"]


SLENDER = np.array([0.0400, 0.0430, 0.0075, 0.0, 0.0, 0.0])


def test_a_slender_body_on_its_side_has_its_axes_named_otherwise():
    # Columns x, y, z read the file's y, z, x: the long axis z stands second. Three times the size: no scale is known.
    found = 3.0 * np.array([0.0430, 0.0075, 0.0400, 1e-4, -2e-4, 3e-4])
    order, off = other_names(SLENDER, found, np.full(6, 0.0043))
    assert order == "yzx" and off is not None and off < 1e-6


@pytest.mark.parametrize(
    "found",
    [
        [0.0430, 0.0400, 0.0075, 0.0, 0.0, 0.0],  # near enough: moments that differ by less than their sigma
        [0.0800, 0.0860, 0.0150, 0.0, 0.0, 0.0],  # a coil of half the area
        [0.0400, 0.0800, 0.0400, 0.0, 0.0, 0.0],  # no order of the file's
    ],
)
def test_other_inertias_are_no_matter_of_names(found):
    assert other_names(SLENDER, np.asarray(found), np.full(6, 0.0043)) == ("xyz", None)
