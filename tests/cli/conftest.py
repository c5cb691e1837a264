"""A fit without a solver: made-up numbers with the shapes and the life of real ones."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_munin import write_munin

from fitting.outcome.result import FitResult, FittedParameter


def make_fit_result(samples: int = 12) -> FitResult:
    rng = np.random.default_rng(5)
    t = 64.0 * np.arange(samples)
    quaternion = rng.normal(size=(samples, 4))
    modelled = np.maximum(200.0 * np.sin(t[:, None] / 90.0 + np.arange(6)), 0.0)
    lit = np.arange(samples) < samples - 3
    modelled[~lit] = 0.0
    return FitResult(
        status="converged",
        message="best of 8 starts",
        chi2=101.5,
        dof=92,
        residual_rms_mA=2.05,
        parameters=(
            FittedParameter("magnet.x", 0.3049, 0.0012, "A m2", True),
            FittedParameter("imax", 251.4, float("nan"), "mA", True, "held by its prior"),
            FittedParameter("gains.+x", 1.0, 0.5, "1", False),
        ),
        gauge="|magnet| held",
        correlations={"magnet.x": {"imax": -0.95}, "attitude.x": {"rate.x": 0.1}},
        t_s=t,
        quaternion_inertial_from_body=quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        angular_velocity_rad_s=rng.normal(scale=0.01, size=(samples, 3)),
        attitude_sigma_deg=np.full((samples, 3), 0.2),
        field_angle_deg=10.0 + np.sin(t / 300.0),
        field_angle_sigma_deg=np.full(samples, 0.3),
        measured_mA=np.round(modelled + rng.normal(scale=2.0, size=modelled.shape) * (modelled > 0)),
        modelled_mA=modelled,
        modelled_direct_mA=0.8 * modelled,
        weight=(modelled > 0).astype(float),
        limited=np.arange(samples) == 4,
        lit=lit,
        alternatives=({"chi2": 160.0, "attitude_distance_deg": np.float64(20.0)},),
        timing_s={"compile": 1.0, "solve": 0.5},
    )


@pytest.fixture(scope="session")
def make_result():
    """The maker of such results, of any number of samples."""
    return make_fit_result


@pytest.fixture
def fit_result() -> FitResult:
    return make_fit_result()


@pytest.fixture
def fake_fit(monkeypatch):
    """Puts a stand-in in the place of the solver; returns a dict whose entries change the result it gives."""
    return put_fake_fit(monkeypatch)


@pytest.fixture(scope="session")
def fitted_run(tmp_path_factory):
    """The directory of a made-up fit of the bundled session, pictures and all; not to be changed."""
    out = tmp_path_factory.mktemp("fitted") / "run"
    write_munin(out, plots=True)
    return out


def put_fake_fit(monkeypatch) -> dict:
    """Does the work of `fake_fit`."""
    changes: dict = {}

    def fit(observations, nominal, settings, *, progress, at_minimum):
        progress("arc 1", 1, 2)
        if "error" in changes:
            raise changes["error"]
        return replace(make_fit_result(), **changes)

    monkeypatch.setattr("fitting.run.estimate", fit)

    # The cache of compiled programs belongs to the user, the settings of JAX to the test session.
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    return changes
