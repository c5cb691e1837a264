"""Other ways through a fit of Munin: the dipole by its angles, adaptive weights; and a Sun that is not there."""

import dataclasses
import json

import numpy as np
import pytest

import fitting
from fitting.settings import FitSettings
from jaxsat.bundled import BUNDLED
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

OTHERS = ("rods", "imax", "inertia", "albedo")
ANGLES = ("magnet.modulus", "magnet.azimuth", "magnet.elevation")


def fit(*free: str, session=None, changed=None, **settings):
    satellite = read_satellite(changed=changed)
    session = session or read_telemetry(BUNDLED, satellite)
    return fitting.fit(satellite, session, settings=FitSettings(free=free, **settings), causes=False).result


@pytest.fixture(scope="module")
def by_angles():
    return fit(*ANGLES, *OTHERS)


@pytest.fixture(scope="module")
def by_vector():
    return fit("magnet", *OTHERS)


def test_a_dipole_of_the_other_sign_is_found_and_told(by_vector):
    """Its size is held, so that the way from the one sign to the other leads through no direction."""
    found = fit("magnet", *OTHERS, changed={"spacecraft.magnet_A_m2": [-0.3, 0.0, 0.0]})
    assert (found.status, found.dof) == ("converged", by_vector.dof)
    assert found.chi2 == pytest.approx(by_vector.chi2, abs=1e-2)
    assert any("the dipole points against that of the satellite file" in remark for remark in found.remarks)
    assert not any("the dipole points" in remark for remark in by_vector.remarks)
    ours, theirs = ({p.name: p for p in each.parameters} for each in (found, by_vector))
    for name in ("magnet.y", "magnet.z", "inertia.xx", "rods.y"):
        sigma = theirs[name].sigma or np.nan
        assert ours[name].value == pytest.approx(theirs[name].value, abs=0.05 * sigma), name
        assert ours[name].sigma == pytest.approx(sigma, rel=0.02), name


def test_a_dipole_by_its_angles_is_the_same_satellite(by_angles, by_vector):
    assert by_angles.status == by_vector.status == "converged"
    assert by_angles.chi2 == pytest.approx(by_vector.chi2, abs=1e-2) and by_angles.dof == by_vector.dof
    assert by_angles.gauge == by_vector.gauge == "common scale of inertia, magnet and rods fixed by |magnet| = 0.3 A m²"
    ours, theirs = ({p.name: p for p in each.parameters} for each in (by_angles, by_vector))
    assert set(ours) - set(theirs) == set(ANGLES)
    for name, there in theirs.items():
        here = ours[name]
        assert here.free == there.free and here.note == there.note, name
        if there.sigma is not None:
            assert here.value == pytest.approx(there.value, abs=0.02 * there.sigma), name
            assert here.sigma == pytest.approx(there.sigma, rel=0.01), name


def test_the_angles_are_the_true_ones(by_angles):
    x, y, z = json.loads(BUNDLED.with_suffix(".truth.json").read_text())["cfg"]["magnet"]
    found = {p.name: p for p in by_angles.parameters}
    true = {"magnet.azimuth": np.arctan2(y, x), "magnet.elevation": np.arctan2(z, np.hypot(x, y))}
    for name, angle in true.items():
        assert found[name].unit == "deg" and 0.0 < found[name].sigma < 1.0
        assert abs(found[name].value - np.degrees(angle)) < 4.0 * found[name].sigma
    # Held by definition, and no correlation is told of it.
    modulus = found["magnet.modulus"]
    assert modulus.free and modulus.sigma is None and modulus.note == ""
    assert modulus.value == pytest.approx(0.3, rel=1e-12)
    assert "magnet.azimuth" in by_angles.correlations and "magnet.x" not in by_angles.correlations


def test_adaptive_weights_of_a_model_without_albedo():
    """Half of the Earth's light is mirrored and the model has none: they leave plain squares for the truth's sake."""
    true = json.loads(BUNDLED.with_suffix(".truth.json").read_text())
    free = ("magnet", "rods", "imax", "inertia")
    weighed, plain = (fit(*free, adaptive={"on": on}, likelihood="normal") for on in (True, False))
    assert weighed.status == plain.status == "not_converged"
    assert weighed.chi2 > 1.005 * plain.chi2
    errors = []
    for result in (weighed, plain):
        q = np.array(true["q"])[[int(np.argmin(np.abs(np.array(true["t"]) - t))) for t in result.t_s]]
        overlap = np.abs(np.sum(q * result.quaternion_inertial_from_body, axis=1))
        errors.append(np.degrees(np.sqrt(np.mean((2.0 * np.arccos(np.minimum(overlap, 1.0))) ** 2))))
    assert errors[0] < errors[1] < 2.0, errors


def test_a_wrong_date_is_denied_by_the_shadow():
    """A quarter of a year later the Sun is elsewhere, and light falls where there should be none."""
    session = read_telemetry(BUNDLED, read_satellite())
    later = dataclasses.replace(session, epoch=session.epoch.shifted(90.0 * 86400.0))
    result = fit("magnet", "imax", session=later)
    assert result.status == "not_converged"
    assert "the computed shadow contradicts" in result.message and "check epoch, orbit and Sun" in result.message
