"""A session read otherwise: each change against what its words mean, on a table of a few rows."""

import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.files.as_if import AsIf
from jaxsat.telemetry.table.as_if import swaps_text, taken_as
from jaxsat.telemetry.table.reading import read_tables

GYRO = """
[sensors.gyro]
kind = "gyro"
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.1
"""
DIODES = """
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "-x"]
[channels.sun]
columns = ["s1", "s2"]
unit = "1"
sigma = 0.02
"""
TEXT = (
    "utc,bx,by,bz,gx,gy,gz\n"
    "2021-05-01T00:00:00Z,100,200,300,1,2,3\n"
    "2021-05-01T00:00:10Z,110,210,310,1,2,3\n"
    "2021-05-01T00:00:20Z,120,220,320,1,2,3\n"
)


@pytest.fixture
def told(table, satellite):
    """The session under changes, with the satellite."""
    craft = satellite(more=GYRO)
    return lambda *texts: taken_as(texts, craft, read_tables(table(TEXT), craft))


def rows(session, name="mag"):
    return session.channels[name].values * session.channels[name].to_unit


def test_columns_are_exchanged_and_left_out(told):
    _, session = told("swapped:bx,bz")
    np.testing.assert_allclose(rows(session)[0], [300, 200, 100])
    _, session = told("swapped:bx,by,bz")
    # bx is read in the column by, by in bz, and bz in bx.
    np.testing.assert_allclose(rows(session)[0], [200, 300, 100])
    _, session = told("without:by")
    np.testing.assert_allclose(rows(session)[0], [100, np.nan, 300])


def test_the_swaps_of_an_order_make_it(told):
    labels = ("bx", "by", "bz")
    for order in ([1, 0, 2], [1, 2, 0], [2, 0, 1], [0, 1, 2]):
        _, session = told(*swaps_text(labels, order))
        np.testing.assert_allclose(rows(session)[0], np.array([100.0, 200.0, 300.0])[order])


def test_readings_are_scaled_and_shifted_and_their_noise_is_another(told):
    _, session = told("scaled:gyro:57.5", "offset:mag:-50", "noise:mag:7")
    np.testing.assert_allclose(rows(session, "gyro")[0], [57.5, 115.0, 172.5])
    np.testing.assert_allclose(rows(session)[0], [150, 250, 350])
    assert session.channels["mag"].sigma == pytest.approx(7e-9)
    _, session = told("drifting:mag:-0.5")
    np.testing.assert_allclose(rows(session)[:, 0], [100, 110 / 0.75, 240])


def test_light_less_a_constant_is_no_less_than_none(table, satellite):
    """As the trial of that cause has it: dark stays dark, and of what was cut off at zero nobody knows the light."""
    craft = satellite(more=DIODES)
    session = read_tables(
        table("utc,bx,by,bz,s1,s2\n2021-05-01T00:00:00Z,1,2,3,0.5,0\n2021-05-01T00:00:10Z,1,2,3,0,0\n"), craft
    )
    lower = taken_as(["offset:sun:0.1"], craft, session)[1].channels["sun"]
    np.testing.assert_allclose(lower.values, [[0.4, 0.0], [0.0, 0.0]])
    higher = taken_as(["offset:sun:-0.1"], craft, session)[1].channels["sun"]
    np.testing.assert_allclose(higher.values, [[0.6, np.nan]])
    assert higher.t_s.tolist() == [0.0]


def test_stamps_are_moved(told):
    assert told("late:mag:3")[1].channels["mag"].t_s.tolist() == [-3.0, 7.0, 17.0]
    assert told("late:mag:3")[1].channels["gyro"].t_s.tolist() == [0.0, 10.0, 20.0]
    assert told("jump:10:4")[1].channels["gyro"].t_s.tolist() == [0.0, 10.0, 16.0]
    np.testing.assert_allclose(told("pace:0.25")[1].channels["mag"].t_s, [0.0, 8.0, 16.0])
    assert told("dated:2020-02-03T04:05:06")[1].epoch.iso(0) == "2020-02-03T04:05:06"


def test_axes_are_those_of_the_text(told):
    craft, _ = told("axes:mag:-y+x+z")
    np.testing.assert_array_equal(craft.model.sensors["mag"].axes, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("swapped:bx,nix", "no channel has bx and nix"),
        ("without:nix", "no channel has nix"),
        ("scaled:nix:2", "no channel 'nix'; there are mag, gyro"),
        ("axes:mag:+x+y", "expected 3 directions"),
        ("late:positions:3", "the table has no positions"),
        ("frame:ecef", "the table has no positions"),
        ("dated:yesterday", "yesterday"),
    ],
)
def test_what_the_session_has_not_is_said(told, text, said):
    with pytest.raises(InputError, match=said):
        told(text)


@pytest.mark.parametrize(
    "text",
    ["nix", "swapped", "swapped:bx", "swapped:bx,bx", "axes:mag:+q", "scaled:mag", "scaled:mag:-1", "late:mag:nan",
     "pace:-1", "drifting:mag:-2", "frame:gcrf", "jump:1", "without:"],
)  # fmt: skip
def test_what_is_no_change_is_refused_with_its_form(text):
    with pytest.raises(ValueError, match="expected"):
        AsIf.of(text)
