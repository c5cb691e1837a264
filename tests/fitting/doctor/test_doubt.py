"""A fit that nothing denied and whose chi2 is doubtful, from a result that no solver has made."""

import dataclasses
from types import SimpleNamespace

import numpy as np
from scipy.stats import chi2

from fitting.doctor import examine
from fitting.doctor.bench import Bench
from fitting.doctor.trial import Trial
from fitting.measurements.assembly import Samples
from fitting.outcome.believable import NO_SIGMAS
from fitting.outcome.result import FitResult, FittedParameter
from fitting.settings import FitSettings
from jaxsat.time import Epoch

RESULT = FitResult(
    status="converged",
    message="one motion explains the data",
    verdict="fits",
    remarks=("odd",),
    chi2=float(chi2.isf(1e-4, 200)),
    dof=200,
    parameters=(FittedParameter("magnet.x", 0.3, 0.01, "A m2", True),),
    buys={},
    correlations={},
    t_s=np.zeros(3),
    quaternion_inertial_from_body=np.zeros((3, 4)),
    angular_velocity_rad_s=np.zeros((3, 3)),
    attitude_sigma_deg=np.ones((3, 3)),
    illumination=None,
    fitted=np.ones(3, bool),
    channels={},
    axes={},
)


def reconsidered(monkeypatch, after: float) -> FitResult:
    """What becomes of it beside a fit with a chi2 of 300 for 200 readings."""
    late = Trial("positions", "positions are late", "compare clocks", after, 1)
    monkeypatch.setattr(examine, "_nearby", lambda bench: [lambda: iter([late])])
    bench = object.__new__(Bench)
    found = SimpleNamespace(samples=Samples(np.zeros(3), {}, {}, Epoch.from_iso("2024-03-01T12:00:00"), {}))
    bench.__dict__.update(found=found, settings=FitSettings(), chi2=300.0, readings=200)
    return examine.reconsidered(bench, RESULT, lambda *_: None)


def test_only_a_fit_without_a_test_and_with_an_unlikely_chi2_is_doubtful():
    assert examine.doubtful(RESULT)
    assert not examine.doubtful(dataclasses.replace(RESULT, chi2=float(chi2.isf(1e-2, 200))))
    assert not examine.doubtful(dataclasses.replace(RESULT, verdict="predicts"))
    assert not examine.doubtful(dataclasses.replace(RESULT, verdict="not this model"))


def test_what_explains_the_doubt_denies_the_fit(monkeypatch):
    found = reconsidered(monkeypatch, 210.0)
    assert (found.status, found.verdict) == ("not_converged", "not this model")
    assert "positions are late (chi2 falls from 300 to 210)" in found.message and found.causes[0].kind == "positions"
    assert found.parameters[0].sigma is None and np.isinf(found.attitude_sigma_deg).all()
    assert found.remarks == ("odd", NO_SIGMAS)


def test_what_explains_little_denies_nothing(monkeypatch):
    assert reconsidered(monkeypatch, 265.0) is RESULT
