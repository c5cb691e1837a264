"""Each rule of the adaptive weights alone, by hand, the two corrections of the data, and the passes over a session."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.measurements.abstract import RATE_UNIT
from fitting.solvers.adaptive import PanelLight, corrected, panel_light, panels_of, refine_adaptively, rule_weights
from fitting.solvers.refine import refine
from fitting.solvers.rules import AdaptiveRules
from fitting.starts.multi_start import Starts
from jaxsat.errors import InputError
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


def test_a_panel_between_two_axes_has_its_shares_of_both():
    normals = np.array([[0.0, 0.6, 0.8]] * 6)
    found = rule_weights(OFF.changed(axis_factors=(3.0, 1.0, 2.0)), MEASURED, LIGHT, HORIZON, normals, IMAX, 1)
    np.testing.assert_allclose(found, 1.0, rtol=1e-12)
    mixed = np.where(np.arange(6)[:, None] == 0, [[1.0, 0.0, 0.0]], normals)
    found = rule_weights(OFF.changed(axis_factors=(3.0, 1.0, 2.0)), MEASURED, LIGHT, HORIZON, mixed, IMAX, 1)
    np.testing.assert_allclose(found[:, 0] / found[:, 1], 3.0 / (0.36 * 1.0 + 0.64 * 2.0), rtol=1e-12)


def test_the_rules_are_about_one_sensor_of_panels(munin_case):
    model = munin_case("a-nominal-exact", ["state"], samples=16, only=["albedo.specular"]).problem.model
    assert panels_of(model) == "cells"
    cells, mag = model.sensors["cells"], model.sensors["mag"]
    for sensors, said in (({"mag": mag}, "has none"), ({"a": cells, "mag": mag, "b": cells}, "has a, b")):
        with pytest.raises(InputError, match=f"one sensor of panels, and this one {said}"):
            panels_of(dataclasses.replace(model, sensors=sensors))


class Exact:
    """The session without albedo, all else free, from its true motion; the magnetometer is fitted too."""

    def __init__(self, case):
        self.case, self.problem, self.parameters = case, case.problem, case.parameters
        self.weight = np.array(case.weight)
        self.weight[: len(case.samples.t), 6:] = 1.0
        x = np.zeros((1, len(case.parameters.everything)))
        x[0, 3:6] = case.truth.w[0] / RATE_UNIT
        self.starts = Starts(x, case.truth.q[:1], np.zeros(1))

    def refine(self, rules):
        radius = float(np.asarray(self.case.around.earth_radius))
        problem, parameters = self.problem, self.parameters
        return refine_adaptively(problem, parameters, self.starts, self.weight, rules, radius, lambda *_: None)


@pytest.fixture(scope="module")
def exact(munin_case):
    return Exact(munin_case("a-nominal-exact", ["magnet", "rods", "imax", "inertia"]))


@pytest.mark.slow
def test_without_rules_the_minimum_is_the_plain_one(exact):
    found = exact.refine(OFF.changed(on=True, passes=2))
    how = {"likelihood": "normal", "progress": lambda *_: None}
    plain = refine(exact.problem, exact.parameters, exact.starts, exact.weight, **how)
    np.testing.assert_array_equal(found.points.weight[0], exact.weight)
    sigma = np.sqrt(np.diagonal(np.linalg.inv(plain.points.hessian[0])))
    assert np.all(np.abs(found.points.x[0] - plain.points.x[0])[3:] < 0.02 * sigma[3:])
    assert found.score[0] == pytest.approx(plain.points.cost[0], abs=1e-3)


@pytest.mark.slow
def test_rules_weigh_the_currents_and_nothing_else(exact):
    found = exact.refine(AdaptiveRules(on=True, passes=2))
    weight = found.points.weight[0]
    np.testing.assert_array_equal(weight[:, 6:], exact.weight[:, 6:])
    assert np.ptp(weight[:, :6]) > 1.0 and not weight[exact.weight[:, 0] == 0.0, :6].any()
    q = found.points.prediction.quaternion[0, : len(exact.case.truth.q)]
    turn = 2.0 * np.arccos(np.minimum(np.abs(np.sum(q * exact.case.truth.q, axis=1)), 1.0))
    assert np.degrees(np.sqrt(np.mean(turn**2))) < 1.0
    # Residuals are those of the currents that were measured, whatever was taken for zero.
    dark = np.asarray(exact.problem.measured["cells"]) > 0.0
    modelled = found.points.prediction.residual[0, :, :6] * 1e3 * np.asarray(exact.problem.sigma)[0]
    modelled = modelled + 1e3 * np.asarray(exact.problem.measured["cells"])
    assert modelled[dark].min() > -1e-6


@pytest.mark.slow
def test_light_of_the_panels(exact):
    """Against the vectors themselves, at the true attitudes."""
    light, sky = exact.problem.sky.light, exact.problem.sky
    count = len(exact.case.truth.q)
    q = np.pad(exact.case.truth.q, ((0, len(exact.problem.valid) - count), (0, 0)), mode="edge")
    found = panel_light(exact.problem, "cells", exact.parameters.tree, exact.starts.x[0], q)
    direct, specular, cos_sun, cos_zenith, distance, most = (np.asarray(each) for each in found)
    body = Rotation.from_quat(q, scalar_first=True).inv()
    position = np.array(sky.position_eci)
    np.testing.assert_allclose(distance, np.linalg.norm(position, axis=1), rtol=1e-14)
    for cosine, vectors in ((cos_sun, np.array(light.sun_eci)), (cos_zenith, position / distance[:, None])):
        np.testing.assert_allclose(cosine, body.apply(vectors) @ NORMALS.T, atol=1e-12)
    share = np.array(light.illumination)[:, None]
    np.testing.assert_allclose(direct, 0.24 * share * np.maximum(cos_sun, 0.0), atol=1e-13)
    mirrored = np.maximum(body.apply(np.array(light.specular_direction_eci)) @ NORMALS.T, 0.0)
    np.testing.assert_allclose(specular, 0.24 * np.array(light.specular_factor)[:, None] * mirrored, atol=1e-13)
    assert float(most) == pytest.approx(0.24)
