"""The chain of numbers of Melnikov et al. 2022 against the corrected values, and what the curvature costs."""

import importlib.util
from pathlib import Path

import pytest

FILE = Path(__file__).parents[2] / "experiments" / "earth_search" / "chain.py"
EXPECTED = {
    "horizon_deg": (62.677811, 5e-7),
    "span_rad": (0.219746, 5e-7),
    "theta_deg": (12.253948, 5e-7),
    "moon_over_dimmest": (0.4368, 1e-12),
    "earth_first": (0.636620, 5e-7),
    "moon_first": (0.181852, 5e-7),
    "moon_first_at_15_deg": (0.163, 5e-4),
    "threshold_over_dimmest": (0.238299, 5e-7),
    "threshold_over_earth_first": (0.374319, 5e-7),
    "threshold_printed_over_dimmest": (0.215160, 5e-7),
    "threshold_printed_over_earth_first": (0.336188, 6e-7),
    "earth_over_threshold": (2.7, 0.05),
    "along_horizon_over_threshold": (1.26, 0.005),
    "presence_printed_deg": (11.30, 0.005),
    "presence_deg": (11.13, 0.005),
    "disk_deg": (125.356, 5e-4),
    "full_turn_s": (1440.0, 1e-9),
}


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("earth_chain", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_corrected_numbers(script):
    found = script.chain()
    for name, (value, tolerance) in EXPECTED.items():
        assert found[name] == pytest.approx(value, abs=tolerance), name


@pytest.mark.slow
def test_curvature_costs_one_sensor_what_two_opposite_ones_give_back(script):
    found = script.pointing_errors(800.0, 5.0, draws=2)
    # The disk's edge falls away by y^2 / (2 tan rho) at y across: 6.8' at 5 deg.
    assert found["curved_one"] == pytest.approx(-6.76, rel=0.02)
    assert abs(found["curved"]) < 1e-6 and abs(found["soft"]) < 0.2
