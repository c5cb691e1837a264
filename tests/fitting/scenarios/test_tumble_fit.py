"""The study of sessions that are made and fitted: what it draws is what is made, and how it judges a fit."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fitting.run
from fitting.scenarios import tumble_fit
from jaxsat.errors import InputError
from jaxsat.sweep.scenario import drawn_inputs, run_cases

SHORT = {"duration_s": "6", "every_s": "2", "rate_deg_s": "1.5"}
OFF_DEG = np.array([0.6, 0.0, 0.8])


def off_by(stated_deg, status="converged", seen=None):
    """A fit that is one degree off and says how much it thinks it is."""

    def fit(satellite, session, *, settings, causes):
        found = {} if seen is None else seen
        t = np.unique(np.concatenate([channel.t_s for channel in session.channels.values()]))
        found["epoch"] = session.epoch
        truth = Rotation.from_quat(found["q"], scalar_first=True)
        off = truth * Rotation.from_rotvec(np.radians(OFF_DEG))
        result = SimpleNamespace(
            t_s=t,
            quaternion_inertial_from_body=np.tile(off.as_quat(scalar_first=True), (len(t), 1)),
            attitude_sigma_deg=None if stated_deg is None else np.full((len(t), 3), stated_deg),
            chi2=10.0,
            dof=5,
            status=status,
            parameters=(),
        )
        return SimpleNamespace(result=result, session=session)

    return fit


@pytest.mark.parametrize(
    ("stated_deg", "status", "word"),
    [(1.0, "converged", "found"), (0.1, "converged", "wrong"), (None, "not_converged", "denied")],
)
def test_a_fit_is_judged_by_its_own_sigmas(monkeypatch, stated_deg, status, word):
    scenario = tumble_fit.make({**SHORT, "rate_deg_s": "0"})
    q = scenario.draw(3, np.array([5]))  # type: ignore[misc]
    # In six seconds torques turn it by some hundredths of a degree.
    monkeypatch.setattr(fitting.run, "fit", off_by(stated_deg, status, {"q": q.attitude[0]}))
    found = run_cases(scenario, 3, np.array([5]))
    assert scenario.statuses[int(found["status"][0])] == word
    np.testing.assert_allclose(found["attitude_error_deg"], 1.0, atol=0.02)
    assert np.isnan(found["attitude_sigma_deg"][0]) == (stated_deg is None)
    np.testing.assert_allclose(found["chi2_over_dof"], 2.0)


def test_what_is_drawn_is_what_the_session_is_made_of(monkeypatch):
    scenario = tumble_fit.make(SHORT)
    cases = np.array([0, 7])
    drawn = scenario.draw(1, cases)  # type: ignore[misc]
    columns = drawn_inputs(scenario, 1, cases)
    seen = {"q": drawn.attitude[1]}
    monkeypatch.setattr(fitting.run, "fit", off_by(1.0, seen=seen))
    study = tumble_fit._study(tuple(tumble_fit.make.filled(SHORT).items()))
    twin, _ = study.fitted(drawn, 1)
    np.testing.assert_allclose(np.degrees(twin.motion.angular_velocity[0]), drawn.rate_deg_s[1], atol=1e-12)
    overlap = abs(float(twin.motion.quaternion[0] @ drawn.attitude[1]))
    np.testing.assert_allclose(overlap, 1.0, atol=1e-12)
    np.testing.assert_allclose(columns["in_inertia_xx_kg_m2"][1], np.asarray(twin.model.spacecraft.inertia)[0, 0])
    np.testing.assert_allclose(columns["in_rate_z_deg_s"], drawn.rate_deg_s[:, 2])
    # Another number, another satellite; the same one again, whatever stands beside it.
    assert columns["in_inertia_xx_kg_m2"][0] != columns["in_inertia_xx_kg_m2"][1]
    again = drawn_inputs(scenario, 1, cases[1:])
    assert all(again[name][0] == values[1] for name, values in columns.items())
    assert np.linalg.norm(drawn.rate_deg_s, axis=1).max() <= 1.5
    assert abs(seen["epoch"].seconds_since(twin.epoch)) < 60.0


@pytest.mark.parametrize(("name", "text"), [("duration_s", "-1"), ("every_s", "900"), ("nominal", "maybe")])
def test_options_are_checked_before_anything_runs(name, text):
    with pytest.raises(InputError, match=name):
        tumble_fit.make({**SHORT, name: text})
