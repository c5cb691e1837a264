"""The whole fit in one process, against the truth that an independent simulator wrote beside the bundled sessions."""

import json
from pathlib import Path

import numpy as np
import pytest

from fitting.fit import fit
from jaxsat.cli.config import load_config
from jaxsat.cli.inputs import fit_settings, nominal, observations
from jaxsat.cli.session import prepare_session

DATA = Path(__file__).parents[2] / "jaxsat" / "data" / "munin"
A = DATA / "a-nominal-exact.RAW_SUN"


def session(path, **settings):
    config = load_config(None, {f"fit.{name}": value for name, value in settings.items()})
    prepared = prepare_session(path, config)
    return observations(prepared.session, prepared.orbit_fit, config), nominal(config), fit_settings(config)


def truth(path):
    return {k: np.array(v) for k, v in json.loads(path.with_suffix(".truth.json").read_text()).items() if k != "cfg"}


@pytest.fixture(scope="module")
def fit_a():
    return fit(*session(A, free="state"))


def attitude_error_deg(result, true):
    rows = np.searchsorted(true["t"], result.t_s - 1.0)
    overlap = np.abs(np.einsum("sc,sc->s", result.quaternion_inertial_from_body, true["q"][rows]))
    return np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0)))


def test_state_alone(fit_a):
    true = truth(A)
    error = attitude_error_deg(fit_a, true)
    print(fit_a.status, fit_a.message, np.sqrt(np.mean(error**2)), np.abs(fit_a.field_angle_deg - true["theta"]).max(), fit_a.timing_s)
    assert fit_a.status == "converged"
