"""Pointing from a satellite file: cases settle, are alike in every chunk, and say what is wrong with their options."""

import numpy as np
import pytest

from jaxsat.bundled import CUBESAT
from jaxsat.errors import InputError
from jaxsat.sweep import run_cases
from jaxsat.sweep.scenarios.point import make

OPTIONS = {"orbits": "0.09", "period_s": "2", "pressure": "off", "limit_deg": "5", "rate_deg_s": "0.1"}
SCENARIO = make(OPTIONS)
CASES = np.arange(SCENARIO.chunk, dtype=np.int64)


@pytest.fixture(scope="module")
def whole():
    return run_cases(SCENARIO, 2, CASES)


def test_cases_settle_by_a_filter_of_gyro_sun_and_field(whole):
    """In the light, within what the magnetometer is off by."""
    good = whole["status"] == 0
    assert np.mean(good) > 0.9
    assert np.all(whole["largest_error_deg"][good] < 5.0)
    np.testing.assert_array_equal(good, np.isfinite(whole["settling_time_s"]))
    assert np.all((whole["wheel_share"] > 0.0) & (whole["wheel_share"] < 1.0))


def test_a_case_does_not_depend_on_the_others_of_its_chunk(whole):
    """The last bits too, where its place in the chunk is its own."""
    others = CASES + 7 * SCENARIO.chunk
    others[100] = 100
    mixed = run_cases(SCENARIO, 2, others)
    for name, values in whole.items():
        assert mixed[name][100].tobytes() == values[100].tobytes()


def test_options_are_checked(tmp_path):
    file = tmp_path / "sat.toml"
    text = CUBESAT.read_text("utf-8").replace('axis = "+z"\ninertia', 'axis = "+y"\ninertia')
    file.write_text(text.replace('axis = "+z"\ntorque', 'axis = "+y"\ntorque'))
    for given, told in (
        ({"second": "-z"}, "second: expected another direction"),
        ({"axis": "up"}, "axis: expected one of"),
        ({"target": "moon"}, "target: expected one of sun, nadir, inertial"),
        ({"attitude": "star_tracker"}, 'has no sensor of kind "star_tracker"'),
        ({"satellite": str(file)}, r"has no three \[\[wheels\]\]"),
        ({"satellite": str(file), "actuators": "thrusters"}, r"has no three \[\[thrusters\]\] about axes"),
        ({"gate": "2"}, "gate: expected off or a number from 0.5"),
    ):
        with pytest.raises(InputError, match=told):
            make(given)
