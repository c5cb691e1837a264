"""The whole fit in one process, against the truth that an independent simulator wrote beside the bundled sessions."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from fitting.estimate import estimate
from fitting.parameters.nominal import nominal_model
from fitting.session import prepare_session
from fitting.settings import FitSettings
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

DATA = Path(__file__).parents[2] / "jaxsat" / "data" / "munin"
EVERYTHING = "state,magnet,rods,imax,inertia,albedo"
BUNDLED = {path.stem[0]: path for path in DATA.glob("*.RAW_SUN")}


class Case:
    """A bundled session ready to be fitted, with its truth."""

    def __init__(self, name: str, free: str, **settings):
        self.observations = prepare_session(read_telemetry(BUNDLED[name])).observations()
        self.nominal, self.settings = nominal_model(read_satellite()), FitSettings(free=free).changed(**settings)
        self.truth = json.loads(BUNDLED[name].with_suffix(".truth.json").read_text())

    def fit(self, progress=lambda *_: None, currents=None, **settings):
        data = self.observations
        if currents is not None:
            data = dataclasses.replace(data, currents=currents)
        return estimate(data, self.nominal, self.settings.changed(**settings), progress=progress)

    def at(self, result, name: str) -> np.ndarray:
        """True values at the samples of a result."""
        rows = [int(np.argmin(np.abs(np.array(self.truth["t"]) - t))) for t in result.t_s]
        return np.array(self.truth[name])[rows]

    def attitude_rms_deg(self, result) -> float:
        overlap = np.abs(np.sum(result.quaternion_inertial_from_body * self.at(result, "q"), axis=1))
        return float(np.degrees(np.sqrt(np.mean((2.0 * np.arccos(np.minimum(overlap, 1.0))) ** 2))))


@pytest.fixture(scope="module")
def exact():
    return Case("a", "state", starts=64)


@pytest.fixture(scope="module")
def exact_fit(exact):
    stages = []
    return exact.fit(lambda *stage: stages.append(stage)), stages


def test_exact_session_gives_the_true_motion(exact, exact_fit):
    result, _ = exact_fit
    assert result.status == "converged"
    assert exact.attitude_rms_deg(result) <= 0.3
    assert np.abs(result.field_angle_deg - exact.at(result, "theta")).max() <= 0.5
    # 1e-4 rad/s is a tenth of a degree in the 17 s of the largest difference of the times: the rounding of 1 mA.
    np.testing.assert_allclose(result.angular_velocity_rad_s, exact.at(result, "w"), atol=1e-4)
    assert np.array_equal(result.lit, exact.at(result, "lit"))
    assert not result.limited.any() and result.alternatives == () and result.gauge is None
    np.testing.assert_allclose(np.linalg.norm(result.quaternion_inertial_from_body, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(result.modelled_mA[result.lit], exact.at(result, "currents_clean")[result.lit], atol=2.0)


def test_progress_tells_every_stage_in_order(exact_fit):
    _, stages = exact_fit
    names = list(dict.fromkeys(name for name, _, _ in stages))
    assert names == ["preparing", "compiling", "growing arcs", "refining"]
    assert all(0 <= done <= total for _, done, total in stages)
    assert stages[-1][1] == stages[-1][2]


def test_fixed_parameters_are_reported_as_they_are(exact_fit):
    result, _ = exact_fit
    assert len(result.parameters) == 20 and not any(p.free or p.sigma is not None for p in result.parameters)
    table = {p.name: (p.value, p.unit) for p in result.parameters}
    assert table["imax"] == (pytest.approx(240.0), "mA") and table["magnet.x"] == (pytest.approx(0.3), "A m2")
    assert set(result.timing_s) == {"prepare", "compile", "solve"}


def test_same_seed_gives_the_same_bits(exact, exact_fit):
    again = exact.fit()
    for field in dataclasses.fields(again):
        if field.name != "timing_s":
            np.testing.assert_array_equal(getattr(again, field.name), getattr(exact_fit[0], field.name))


def test_another_seed_finds_the_same_minimum(exact, exact_fit):
    other, result = exact.fit(seed=1), exact_fit[0]
    assert other.status == "converged" and other.chi2 == pytest.approx(result.chi2, abs=1e-3)
    overlap = np.abs(np.sum(other.quaternion_inertial_from_body * result.quaternion_inertial_from_body, axis=1))
    # A hundredth of the 1-sigma of an attitude, which is about 0.2 deg.
    assert np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0))).max() < 2e-3


def test_currents_in_the_wrong_order_are_not_called_converged(exact):
    currents = exact.observations.currents.copy()
    lit = np.flatnonzero(currents.max(axis=1) > 0.01)
    currents[lit] = currents[np.random.default_rng(8).permutation(lit)]
    result = exact.fit(currents=currents)
    assert result.status == "not_converged" and result.chi2 > 100 * result.dof


def test_dark_session_is_bad_input(exact):
    with pytest.raises(InputError, match="only 0 samples .* at least 7"):
        exact.fit(currents=np.zeros_like(exact.observations.currents))
    few = exact.observations.currents.copy()
    few[6:] = 0.0
    with pytest.raises(InputError, match="only 6 samples"):
        exact.fit(currents=few)


def test_dark_start_is_left_out(exact):
    """The state is that at the first lit sample: without light nothing is known of what was before."""
    currents = exact.observations.currents.copy()
    currents[:3] = 0.0
    result = exact.fit(currents=currents)
    assert result.status == "converged" and result.t_s[0] == exact.observations.t[3]
    assert exact.attitude_rms_deg(result) <= 0.3


def test_light_inside_the_computed_shadow_does_not_start_the_arc(exact):
    """A reading in the shadow, before the Sun comes: the arc starts with the Sun, and the message counts oddities."""
    lit = np.array(exact.truth["lit"])
    dark = int(np.flatnonzero(~lit)[0])
    currents = exact.observations.currents.copy()
    currents[:dark], currents[dark, 0] = 0.0, 0.05
    sunrise = dark + int(np.flatnonzero(lit[dark:])[0])
    result = exact.fit(currents=currents)
    assert result.status == "converged" and result.t_s[0] == exact.observations.t[sunrise]
    assert exact.attitude_rms_deg(result) <= 0.5
    currents[sunrise + 2 : sunrise + 3] = 0.0
    result = exact.fit(currents=currents)
    assert "1 samples left out where currents and computed shadow disagree" in result.message


@pytest.fixture(scope="module")
def limited():
    case = Case("c", EVERYTHING)
    return case, case.fit()


def test_limited_currents_are_found_with_everything_free(limited):
    case, result = limited
    assert result.status == "converged"
    begin, end = case.truth["cfg"]["clip"][:2]
    inside = (result.t_s >= begin) & (result.t_s <= end) & result.lit
    assert result.limited.sum() == 8 and np.array_equal(result.limited, inside)
    assert "8 samples left out" in result.message and not result.weight[result.limited].any()
    assert case.attitude_rms_deg(result) <= 1.5


def test_parameters_are_within_their_sigmas_of_the_truth(limited):
    case, result = limited
    true, inertia = case.truth["cfg"], np.array(case.truth["cfg"]["inertia"])
    # The gauge: the fit holds |magnet| at its nominal 0.3, so the true model is compared at that scale.
    scale = 0.3 / np.linalg.norm(true["magnet"])
    expected = {f"magnet.{c}": scale * true["magnet"][k] for k, c in enumerate("xyz")}
    expected |= {f"rods.{c}": scale * true["rods"][k] for k, c in enumerate("yz")}
    expected |= {
        f"inertia.{a}{b}": scale * inertia["xyz".index(a), "xyz".index(b)]
        for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")
    }
    expected |= {"imax": true["imax"], "albedo.specular": true["albedo_specular"]}
    table = {p.name: p for p in result.parameters}
    assert result.gauge is not None and "|magnet| = 0.3" in result.gauge
    for name, value in expected.items():
        p = table[name]
        assert p.free and p.sigma is not None and 0 < p.sigma < np.inf
        assert abs(p.value - value) <= 3.5 * p.sigma, name
    # Diffuse albedo is truly absent: at its bound, or within its sigma of it.
    diffuse = table["albedo.diffuse"]
    assert 0.0 <= diffuse.value <= 3.5 * (diffuse.sigma or 0.1)
    assert not table["gains.+x"].free


def test_tumbling_session_is_found_blind():
    case = Case("e", EVERYTHING)
    result = case.fit()
    assert result.status == "converged" and case.attitude_rms_deg(result) <= 1.5
    # There is no specular light in this session: the factor stands at its bound, where it has no sigma.
    specular = next(p for p in result.parameters if p.name == "albedo.specular")
    assert specular.value == 0.0 and specular.sigma is None and specular.note == "at its bound"
