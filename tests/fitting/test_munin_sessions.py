"""Fits of Munin's RAW_SUN sessions, against the truth that an independent simulator wrote beside them."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import fitting
from fitting.settings import FitSettings
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

pytestmark = pytest.mark.slow

DATA = Path(__file__).parents[2] / "jaxsat" / "data" / "munin"
EVERYTHING = ("magnet", "rods", "imax", "inertia", "albedo")
BUNDLED = {path.stem[0]: path for path in DATA.glob("*.RAW_SUN")}


class Case:
    """A bundled session ready to be fitted, with its truth."""

    def __init__(self, name: str, *free: str, **settings):
        self.satellite = read_satellite()
        self.session = read_telemetry(BUNDLED[name], self.satellite)
        self.settings = FitSettings(free=free or ("state",), **settings)
        self.truth = json.loads(BUNDLED[name].with_suffix(".truth.json").read_text())

    @property
    def currents(self) -> np.ndarray:
        return self.session.channels["cells"].values.copy()

    def with_values(self, **values: np.ndarray) -> TableSession:
        """The session with other readings, SI."""
        changed = {name: dataclasses.replace(self.session.channels[name], values=each) for name, each in values.items()}
        return dataclasses.replace(self.session, channels={**self.session.channels, **changed})

    def fit(self, session: TableSession | None = None, **how):
        how = {"settings": self.settings, **how}
        return fitting.fit(self.satellite, session or self.session, causes=False, **how).result

    def at(self, result, name: str) -> np.ndarray:
        """True values at the samples of a result."""
        rows = [int(np.argmin(np.abs(np.array(self.truth["t"]) - t))) for t in result.t_s]
        return np.array(self.truth[name])[rows]

    def attitude_rms_deg(self, result) -> float:
        overlap = np.abs(np.sum(result.quaternion_inertial_from_body * self.at(result, "q"), axis=1))
        return float(np.degrees(np.sqrt(np.mean((2.0 * np.arccos(np.minimum(overlap, 1.0))) ** 2))))


@pytest.fixture(scope="module")
def exact():
    return Case("a", starts=64)


@pytest.fixture(scope="module")
def exact_fit(exact):
    stages = []
    return exact.fit(progress=lambda *stage: stages.append(stage)), stages


def test_exact_session_gives_the_true_motion(exact, exact_fit):
    result, _ = exact_fit
    assert result.status == "converged"
    assert exact.attitude_rms_deg(result) <= 0.3
    assert np.abs(result.field_angle_deg - exact.at(result, "theta")).max() <= 0.5
    # 1e-4 rad/s is a tenth of a degree in the 17 s of the largest difference of the times: the rounding of 1 mA.
    np.testing.assert_allclose(result.angular_velocity_rad_s, exact.at(result, "w"), atol=1e-4)
    lit = result.illumination > 0.5
    assert np.array_equal(lit, exact.at(result, "lit"))
    cells = result.channels["cells"]
    assert cells.used.all() and result.alternatives == () and result.gauge is None
    np.testing.assert_allclose(np.linalg.norm(result.quaternion_inertial_from_body, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(cells.modelled[lit], exact.at(result, "currents_clean")[lit], atol=2.0)
    # No albedo in this session's model: all light is direct.
    np.testing.assert_allclose(cells.direct, cells.modelled, atol=1e-9)
    # The only error is the rounding to 1 mA.
    assert 0.2 < result.residual_rms_mA < 0.4


def test_progress_tells_every_stage_in_order(exact_fit):
    _, stages = exact_fit
    names = list(dict.fromkeys(name for name, _, _ in stages))
    assert names == ["preparing", "compiling", "growing arcs", "refining"]
    assert all(0 <= done <= total for _, done, total in stages)
    assert stages[-1][1] == stages[-1][2]


def test_fixed_parameters_are_reported_as_they_are(exact_fit):
    result, _ = exact_fit
    assert not any(p.free or p.sigma is not None for p in result.parameters)
    table = {p.name: (p.value, p.unit) for p in result.parameters}
    assert table["imax"] == (pytest.approx(240.0), "mA") and table["magnet.x"] == (pytest.approx(0.3), "A m2")
    assert table["rods.z"] == (pytest.approx(0.03), "A m2") and table["gains.-y"] == (pytest.approx(1.0), "1")


def test_same_seed_gives_the_same_bits(exact, exact_fit):
    again, before = exact.fit(), exact_fit[0]
    for name in ("quaternion_inertial_from_body", "angular_velocity_rad_s", "attitude_sigma_deg"):
        np.testing.assert_array_equal(getattr(again, name), getattr(before, name))
    assert (again.chi2, again.message, again.parameters) == (before.chi2, before.message, before.parameters)


def test_another_seed_finds_the_same_minimum(exact, exact_fit):
    other, result = exact.fit(settings=exact.settings.changed(seed=1)), exact_fit[0]
    assert other.status == "converged" and other.chi2 == pytest.approx(result.chi2, abs=1e-3)
    overlap = np.abs(np.sum(other.quaternion_inertial_from_body * result.quaternion_inertial_from_body, axis=1))
    # A hundredth of the 1-sigma of an attitude, which is about 0.2 deg.
    assert np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0))).max() < 2e-3


def test_currents_in_the_wrong_order_are_not_called_converged(exact):
    currents = exact.currents
    lit = np.flatnonzero(currents.max(axis=1) > 0.01)
    currents[lit] = currents[np.random.default_rng(8).permutation(lit)]
    result = exact.fit(exact.with_values(cells=currents))
    assert (result.status, result.verdict) == ("not_converged", "not this model")


def test_dark_session_is_bad_input(exact):
    with pytest.raises(InputError, match="all 71 samples are in shadow: no current exceeds 2 mA"):
        exact.fit(exact.with_values(cells=np.zeros_like(exact.currents)))
    few = exact.currents
    few[6:] = 0.0
    with pytest.raises(InputError, match="only 6 samples .* at least 7"):
        exact.fit(exact.with_values(cells=few))
    one_axis = exact.currents
    one_axis[:, 2:] = 0.0
    with pytest.raises(InputError, match=r"currents: only the panels \+X and -X ever exceed\(s\) 2 mA; the attitude"):
        exact.fit(exact.with_values(cells=one_axis))


def test_the_motion_is_told_before_the_first_light(exact):
    """Panels that see nothing in sunlight contradict the computed shadow: they are left out, and said."""
    currents = exact.currents
    currents[:3] = 0.0
    result = exact.fit(exact.with_values(cells=currents))
    assert result.status == "converged" and result.t_s[0] == 0.0
    assert exact.attitude_rms_deg(result) <= 0.3
    assert not result.channels["cells"].used[:3].any() and result.channels["cells"].used[3:].all()
    assert "3 of 71 samples of cells left out where light and computed shadow disagree" in result.remarks


def test_light_inside_the_computed_shadow_is_left_out(exact):
    dark = int(np.flatnonzero(~np.array(exact.truth["lit"]))[0])
    currents = exact.currents
    currents[dark, 0] = 0.05
    result = exact.fit(exact.with_values(cells=currents))
    assert result.status == "converged" and not result.channels["cells"].used[dark]
    assert "1 of 71 samples of cells left out where light and computed shadow disagree" in result.remarks


@pytest.fixture(scope="module")
def limited():
    case = Case("c", *EVERYTHING)
    return case, case.fit()


def test_limited_currents_are_found_with_everything_free(limited):
    case, result = limited
    assert result.status == "converged"
    begin, end = case.truth["cfg"]["clip"][:2]
    inside = (result.t_s >= begin) & (result.t_s <= end) & (result.illumination > 0.5)
    assert inside.sum() == 8 and np.array_equal(~result.channels["cells"].used, inside)
    np.testing.assert_array_equal(result.limited, inside)
    assert any(remark.startswith("8 of 71 samples of cells left out") for remark in result.remarks)
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
    case = Case("e", *EVERYTHING)
    result = case.fit()
    assert result.status == "converged" and case.attitude_rms_deg(result) <= 1.5
    # There is no specular light in this session: the factor stands at its bound, where it has no sigma.
    specular = next(p for p in result.parameters if p.name == "albedo.specular")
    assert specular.value == 0.0 and specular.sigma is None and specular.note == "at its bound"


def test_the_magnetometer_is_a_witness(limited):
    _, result = limited
    mag = result.channels["mag"]
    assert mag.witness and not mag.fitted.any()
    assert mag.holdout is not None and mag.holdout.rms < 0.5
    assert any("the witness mag confirms the motion" in remark for remark in result.remarks)
    assert not any(p.free for p in result.parameters if p.name.startswith("mag."))


def test_a_magnetometer_that_contradicts_is_heard(exact):
    result = exact.fit(exact.with_values(mag=-exact.session.channels["mag"].values))
    assert result.status == "not_converged"
    assert result.message.startswith("the witness mag denies the motion")
