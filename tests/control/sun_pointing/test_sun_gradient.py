"""What knobs do to means of Sun pointing: against finite differences of other smoothed means, and by what must be."""

import numpy as np
import pytest

from fitting.sensitivity.means import slopes_of_means
from jaxsat.sweep.scenarios import sun_pointing

SCENARIO = sun_pointing.make({"estimator": "published", "time_s": "900", "max_rate_deg_s": "1"})
NAMES = ("slew_rate", "inertia", "torque", "rate_gain")
METRICS = ("settling_time_s", "impulse_N_s", "final_error_deg")
COUNT = 256


@pytest.mark.slow
def test_slopes_are_the_differences_of_means():
    found = slopes_of_means(SCENARIO, NAMES, METRICS, cases=COUNT, seed=3)
    numbers, all_names = np.arange(COUNT), [knob.name for knob in SCENARIO.knobs]
    places = [all_names.index(name) for name in NAMES]
    # The same smooth mean at knobs a step apart: the spread stays, by other numbers.
    spread = np.zeros((COUNT, len(all_names)))
    spread[:, places] = 0.05 * np.random.default_rng(2).normal(size=(COUNT, len(NAMES)))

    def values(move):
        assert SCENARIO.run_moved is not None
        runs = SCENARIO.run_moved(3, numbers, spread + move)
        return {name: np.asarray(runs[name]) for name in METRICS}

    for k in (0, 1, 3):
        h = 0.1 * np.eye(len(all_names))[places[k]]
        up, down = values(h), values(-h)
        for name, one in found.metrics.items():
            slope = (up[name] - down[name]) / 0.2
            slope = np.where(np.isfinite(slope), slope, 0.0) if one.horizon_s is not None else slope
            error = np.hypot(one.slopes.sigma[k], slope.std(ddof=1) / np.sqrt(COUNT))
            assert one.slopes.slopes[k] == pytest.approx(slope.mean(), abs=4.0 * error), (name, NAMES[k])
    settling, spent, error = (found.metrics[name].slopes for name in METRICS)
    # Of cases that hold the Sun, within the dead band, and of the few that do not yet.
    assert 0.0 < error.mean < 5.0 and np.all(error.sigma > 0.0)
    # A faster slew is over sooner and costs more; a heavier body costs in proportion.
    assert settling.slopes[0] < -10.0 * settling.sigma[0] and spent.slopes[0] > 10.0 * spent.sigma[0]
    assert spent.slopes[1] == pytest.approx(spent.mean, rel=0.15)
    # Times know of torque over inertia alone: each pair of cases is the other's with the sides exchanged.
    assert settling.slopes[2] == pytest.approx(-settling.slopes[1], rel=1e-6)
