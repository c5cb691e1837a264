"""Each rule of the adaptive weights alone, by hand, and the two corrections of the data."""

import numpy as np
import pytest

from fitting.solvers.adaptive import PanelLight, corrected, rule_weights
from fitting.solvers.rules import AdaptiveRules
from jaxsat.spacecraft import box_normals

OFF = AdaptiveRules(
    limiting_ratio=0.0,
    large_gain=0.0,
    small_factor=1.0,
    away_factor=1.0,
    specular_alpha=0.0,
    zero_in_shadow=False,
    zero_turned_away=False,
)
IMAX = 0.24
# Two samples: the second is limited to half of what the panels could give.
DIRECT = np.array([[0.2, 0.0, 0.1, 0.0, 0.0, 0.05], [0.12, 0.0, 0.0, 0.2, 0.0, 0.0]])
MEASURED = np.array([[0.2, 0.0, 0.11, 0.015, 0.0, 0.05], [0.06, 0.0, 0.0, 0.1, 0.0, 0.0]])
SPECULAR = np.array([[0.0, 0.1, 0.02, 0.03, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.06, 0.0]])
COS_SUN = np.where(DIRECT > 0, DIRECT / IMAX, -0.1)
COS_ZENITH = np.array([[0.9, -0.9, 0.3, -0.3, 0.1, -0.1], [0.59, -0.59, 0.61, -0.61, 0.0, 0.0]])
LIGHT = PanelLight(DIRECT, SPECULAR, COS_SUN, COS_ZENITH)
HORIZON = np.array([0.6, 0.6])
NORMALS = np.asarray(box_normals())


def weights(number=1, **changes):
    """Relative to those of a rule-free current, of which the mean-one normalisation is taken out by the last one."""
    found = rule_weights(OFF.changed(**changes), MEASURED, LIGHT, HORIZON, NORMALS, IMAX, number)
    assert found.mean() == pytest.approx(1.0) and np.all(found >= 0.0)
    return found


def test_without_rules_all_weights_are_one():
    np.testing.assert_array_equal(weights(), np.ones((2, 6)))


def test_limited_samples_are_doubted():
    """The first sample gives more than direct light can; the second half of it, of which 0.8 is expected."""
    found = weights(limiting_ratio=0.8, limiting_power=3.0)
    np.testing.assert_allclose(found[1] / found[0], (0.5 / 0.8) ** 3, rtol=1e-12)


def test_large_currents_gain_and_small_ones_lose():
    found = weights(large_gain=2.0)
    np.testing.assert_allclose(found / found[0, 1], 1.0 + 2.0 * (MEASURED / IMAX) ** 2, rtol=1e-12)
    found = weights(small_mA=20.0, small_factor=0.25)
    np.testing.assert_allclose(found / found[0, 0], np.where(MEASURED < 0.02, 0.25, 1.0), rtol=1e-12)


def test_panels_that_cannot_see_the_earth_gain():
    """Those whose normal is nearer to the radius vector than the angle of the horizon (figure 1 of the paper)."""
    found = weights(away_factor=3.0)
    np.testing.assert_allclose(found / found[0, 1], np.where(COS_ZENITH >= 0.6, 3.0, 1.0), rtol=1e-12)


def test_pairs_of_an_axis():
    found = weights(axis_factors=(1.0, 2.0, 5.0))
    np.testing.assert_allclose(found / found[0, 0], np.tile([1.0, 1.0, 2.0, 2.0, 5.0, 5.0], (2, 1)), rtol=1e-12)


@pytest.mark.parametrize("number", [1, 3])
def test_mirrored_light_by_the_formula_of_the_paper(number):
    """Ves := Ves / (1 + alpha I_alb / (I_sun + delta)), once more at each pass."""
    rules = {"specular_alpha": 2.0, "specular_delta_mA": 30.0, "specular_reflectivity": 0.5}
    found = weights(number, **rules)
    expected = 1.0 / (1.0 + 2.0 * 0.5 * SPECULAR / (DIRECT + 0.03)) ** number
    np.testing.assert_allclose(found / found[0, 0], expected, rtol=1e-12)


def test_corrections_of_the_data():
    sunlit = np.array([True, False])
    shadow = OFF.changed(zero_in_shadow=True)
    np.testing.assert_array_equal(corrected(shadow, MEASURED, sunlit, LIGHT), [MEASURED[0], np.zeros(6)])
    away = corrected(OFF.changed(zero_turned_away=True), MEASURED, sunlit, LIGHT)
    # +Y of the first sample stays, -Y with its 15 mA of albedo does not face the Sun.
    np.testing.assert_array_equal(away, np.where(COS_SUN > 0.0, MEASURED, 0.0))
    assert away[0, 3] == 0.0 and MEASURED[0, 3] > 0.0
    np.testing.assert_array_equal(corrected(OFF, MEASURED, sunlit, LIGHT), MEASURED)
