"""Where a search begins, and starts carried from there to the first sample."""

import json
from pathlib import Path

import numpy as np
import pytest

from fitting.measurements.abstract import RATE_UNIT
from fitting.parameters.names import parse_free
from fitting.parameters.nominal import nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import PriorSigma
from fitting.starts.multi_start import Starts
from fitting.starts.stretches import carried_to, longest_stretch
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SESSION = Path(__file__).parents[3] / "jaxsat" / "data" / "munin" / "a-nominal-exact.RAW_SUN"


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


@pytest.mark.slow
def test_the_true_motion_is_carried_back_to_its_start():
    """From the truth of another program at a sample after the shadow to that at the first one."""
    samples = prepare_session(read_telemetry(SESSION)).observations()
    truth = json.loads(SESSION.with_suffix(".truth.json").read_text())
    parameters = parametrization(nominal_model(read_satellite()), parse_free("rods"), PriorSigma())
    begin = 65
    x = np.zeros((2, 8))
    x[:, 3:6] = np.array(truth["w"][begin]) / RATE_UNIT
    x[1, 3] = np.nan
    starts = Starts(x, np.array([truth["q"][begin]] * 2), np.array([1.0, 2.0]))
    found = carried_to(starts, parameters, samples, begin, 8.0)
    # The second start is none any more, and is left behind.
    assert len(found.cost) == 1 and found.cost[0] == 1.0
    overlap = abs(float(found.reference[0] @ np.array(truth["q"][0])))
    assert np.degrees(2.0 * np.arccos(min(overlap, 1.0))) < 0.1
    np.testing.assert_allclose(found.x[0, 3:6] * RATE_UNIT, truth["w"][0], atol=2e-6)
    assert not found.x[0, :3].any() and not found.x[0, 6:].any()
