"""The example scenario against the pendulum, and its cases alike in every chunk and file."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from fitting.sensitivity.means import slopes_of_means
from jaxsat.cli.sweep.case import write_history
from jaxsat.errors import InputError
from jaxsat.sweep import drawn_inputs, run_cases
from jaxsat.sweep.scenarios import gravity_gradient
from jaxsat.sweep.scenarios.gravity_gradient import MOMENTS, RADIUS, Motion, make, outcome

MU = 3.986004418e14
N = math.sqrt(MU / RADIUS**3)
SCENARIO = make({})
CASES = np.arange(SCENARIO.chunk, dtype=np.int64)


@pytest.fixture(scope="module")
def motion() -> Motion:
    return gravity_gradient.motions(1, CASES, tilt=math.radians(15.0), rate=math.radians(0.04), orbits=1.0)


@pytest.mark.slow
def test_motion_is_that_of_independent_equations(motion):
    """Euler's equation in the frame of the orbit, by SciPy, from the same initial states."""
    J = np.diag(MOMENTS)

    def slope(t, y):
        to_inertial = Rotation.from_quat(y[:4], scalar_first=True)
        up = to_inertial.inv().apply(orbit.apply([math.cos(N * t), math.sin(N * t), 0.0]))
        w = y[4:]
        torque = 3.0 * N**2 * np.cross(up, J @ up)
        p, v = y[0], y[1:4]
        return np.concatenate(
            [[-0.5 * v @ w], 0.5 * (p * w + np.cross(v, w)), np.linalg.solve(J, torque - np.cross(w, J @ w))]
        )

    # Plane of the orbit: inclination 98 degrees, node and perigee at zero.
    orbit = Rotation.from_rotvec([math.radians(98.0), 0.0, 0.0])
    for case in (0, 25):
        attitude = Rotation.from_quat(motion.quaternion[case, 0], scalar_first=True)
        rate = motion.rate[case, 0] + attitude.inv().apply(orbit.apply([0.0, 0.0, N]))
        start = np.concatenate([motion.quaternion[case, 0], rate])
        found = solve_ivp(slope, (0.0, motion.t_s[-1]), start, "DOP853", motion.t_s, rtol=1e-11, atol=1e-12).y.T
        # Of RK4 1e-7, which the case that tumbles makes larger.
        np.testing.assert_allclose(motion.quaternion[case], found[:, :4], rtol=0, atol=2e-5)
        t = motion.t_s
        up = orbit.apply(np.stack([np.cos(N * t), np.sin(N * t), 0.0 * t], axis=1))
        axis = Rotation.from_quat(found[:, :4], scalar_first=True).apply([0.0, 0.0, 1.0])
        np.testing.assert_allclose(np.cos(motion.tilt[case]), np.sum(up * axis, axis=1), rtol=0, atol=2e-5)


@pytest.mark.slow
def test_outcomes_are_those_of_the_histories(motion):
    found = run_cases(SCENARIO, 1, CASES)
    np.testing.assert_array_equal(found["largest_tilt_deg"], np.degrees(motion.tilt).max(axis=1))
    tumbling = found["status"] == 1
    assert 0 < tumbling.sum() < 100
    np.testing.assert_array_equal(tumbling, found["largest_tilt_deg"] > 90.0)
    np.testing.assert_array_equal(tumbling, np.isfinite(found["upset_time_s"]))
    first = np.flatnonzero(tumbling)[0]
    index = np.searchsorted(motion.t_s, found["upset_time_s"][first])
    assert motion.tilt[first, index - 1] < 0.5 * math.pi < motion.tilt[first, index]


@pytest.mark.slow
def test_a_motion_that_is_not_finite_has_diverged(motion):
    tilt = motion.tilt.copy()
    tilt[3, 7] = np.nan
    found = outcome(Motion(motion.t_s, motion.quaternion, motion.rate, tilt))
    assert found["status"][3] == 2 and np.isnan(found["largest_tilt_deg"][3])


@pytest.mark.slow
def test_motion_begins_as_it_was_drawn(motion):
    drawn = drawn_inputs(SCENARIO, 1, CASES)
    turn, rate = (
        np.stack([drawn[f"in_{name}_{c}_{unit}"] for c in "xyz"], axis=1)
        for name, unit in (("turn", "deg"), ("rate", "deg_s"))
    )
    np.testing.assert_allclose(rate, np.degrees(motion.rate[:, 0]), atol=1e-12)
    upright = Rotation.from_rotvec(turn, degrees=True).as_matrix()[:, 2, 2]
    np.testing.assert_allclose(upright, np.cos(motion.tilt[:, 0]), atol=1e-12)


def test_a_case_does_not_depend_on_the_others_of_its_chunk():
    """The last bits too, where its place in the chunk is its own."""
    whole = run_cases(SCENARIO, 2, CASES)
    others = CASES + 7 * SCENARIO.chunk
    others[100] = 100
    mixed = run_cases(SCENARIO, 2, others)
    for name, values in whole.items():
        assert mixed[name][100].tobytes() == values[100].tobytes()
    assert mixed["largest_tilt_deg"][0] != whole["largest_tilt_deg"][0]


def test_replay_writes_the_history_of_the_case(tmp_path: Path, motion):
    assert SCENARIO.history is not None
    write_history(tmp_path, SCENARIO.history(1, 25), SCENARIO, seed=1, case=25)
    rows = np.genfromtxt(tmp_path / "history.csv", delimiter=",", names=True)
    np.testing.assert_allclose(rows["tilt_deg"], np.degrees(motion.tilt[25]), rtol=1e-9)
    assert (tmp_path / "history.png").read_bytes()[:4] == b"\x89PNG"


def test_options_reach_the_motion(motion, monkeypatch):
    given = {}

    def record(seed, cases, **settings):
        given.update(settings)
        return motion

    monkeypatch.setattr(gravity_gradient, "motions", record)
    own = {"moments_kg_m2": "1,1.1,0.2", "altitude_km": "550"}
    run_cases(make({"tilt_deg": "180", "orbits": "2.5", **own}), 1, CASES)
    body = {"moments": (1.0, 1.1, 0.2), "radius": 6.928e6}
    assert given == {"tilt": math.pi, "rate": math.radians(0.04), "orbits": 2.5, **body}
    with pytest.raises(InputError, match="rate_deg_s: expected a number from 0 to 1, found '2'"):
        make({"rate_deg_s": "2"})


def test_moved_by_nothing_cases_stay_and_means_of_derivatives_are_those_of_differences():
    """Of the libration, which is smooth: exact, by differences of the same cases, and by the slope of the mean."""
    scenario = make({"orbits": "0.3", "tilt_deg": "5", "rate_deg_s": "0.01"})
    cases, names = np.arange(64), [knob.name for knob in scenario.knobs]
    assert scenario.run_moved is not None
    still = scenario.run_moved(1, cases, np.zeros((64, len(names))))
    found = slopes_of_means(scenario, ["moment_x", "rate"], cases=64, seed=1, width=0.005, exact=True)
    assert found.ended == {"succeeded": 64}
    for name in ("largest_tilt_deg", "final_rate_deg_s"):
        one = found.metrics[name]
        assert one.exact is not None and one.mean == pytest.approx(np.asarray(still[name]).mean(), rel=1e-12)
        for k, knob in enumerate(("moment_x", "rate")):
            step = 1e-5 * np.eye(len(names))[names.index(knob)]
            up, down = (np.asarray(scenario.run_moved(1, cases, np.tile(s * step, (64, 1)))[name]) for s in (1, -1))
            # In a step another of the samples may become the one of the largest tilt.
            rel = 1e-6 if name == "final_rate_deg_s" else 1e-3
            size = np.abs(up - down).mean() / 2e-5
            assert one.exact.slopes[k] == pytest.approx(np.mean(up - down) / 2e-5, abs=rel * size)
            assert abs(one.exact.apart[k]) < 4.0 * one.exact.apart_sigma[k]
            assert one.exact.slopes[k] == pytest.approx(one.slopes.slopes[k], abs=4.0 * one.slopes.sigma[k])
    np.testing.assert_allclose(np.asarray(still["largest_tilt_deg"]), run_cases(scenario, 1, cases)["largest_tilt_deg"])
