"""Settling from a satellite file: what counts as settled, and what the file must have."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxsat.bundled import CUBESAT, PASSIVE
from jaxsat.errors import InputError
from jaxsat.sweep import drawn_inputs
from jaxsat.sweep.scenarios.settle import make, outcome

OPTIONS = {"hours": "0.25", "pressure": "off"}


def test_settled_is_who_stays_within_the_limit_over_the_last_orbit():
    times = 60.0 * np.arange(6)
    program = SimpleNamespace(times=times, last=times >= 120.0, limit=0.2)
    angle = np.array(
        [[1.0, 0.3, 0.1, 0.1, 0.1, 0.0], [0.1] * 6, [1.0, 0.1, 0.1, 0.1, 0.3, 0.1], [0.1, np.nan, 0.1, 0.1, 0.1, 0.1]]
    )
    rate = np.full((4, 6, 3), 0.01)
    heat = np.ones((4, 6, 2))
    found = outcome(program, angle, rate, heat, np.zeros(4))
    np.testing.assert_array_equal(found["status"], [0, 0, 1, 2])
    np.testing.assert_array_equal(found["settling_time_s"], [120.0, 0.0, np.nan, np.nan])
    np.testing.assert_allclose(found["largest_angle_deg"][:3], np.degrees([0.1, 0.1, 0.3]))
    np.testing.assert_allclose(found["mean_angle_deg"][0], np.degrees(0.075))
    np.testing.assert_allclose(found["rod_heat_uJ"][:3], 2e6)
    np.testing.assert_allclose(found["final_rate_deg_s"][:3], np.degrees(0.01 * np.sqrt(3.0)))


def test_cases_are_drawn_as_the_file_says():
    scenario = make(OPTIONS)
    cases = np.arange(scenario.chunk)
    drawn = drawn_inputs(scenario, 1, cases)
    for name, middle, sigma in (("in_magnet_x_A_m2", 0.06, 0.001), ("in_rods_0_Hc_A_m", 8.0, 1.0)):
        assert abs(drawn[name].mean() - middle) < 5.0 * sigma / np.sqrt(len(cases))
        np.testing.assert_allclose(drawn[name].std(), sigma, rtol=0.25)
    own = drawn_inputs(scenario, 1, cases[7:8])
    # In another company the last digits may differ.
    assert all(own[name][0] == pytest.approx(drawn[name][7], rel=1e-12, abs=1e-15) for name in drawn)
    assert "in_magnet_x_A_m2" not in make(OPTIONS | {"spread": "0"}).input_columns


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (CUBESAT.read_text("utf-8"), r"has no \[\[rods\]\] with hysteresis"),
        (PASSIVE.read_text("utf-8").replace("[0.06, 0.0, 0.0]", "[0.0, 0.0, 0.0]"), r"has no \[magnet\]"),
    ],
    ids=["rods", "magnet"],
)
def test_what_a_satellite_file_lacks_is_told_in_a_line(text, told, tmp_path):
    file = tmp_path / "sat.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=told):
        make({"satellite": str(file)})
