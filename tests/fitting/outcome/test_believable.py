"""Sigmas of a fit that is denied, or that does not predict."""

import numpy as np
import pytest
from test_fit_verdict import channel

from fitting.outcome.believable import factor_remark, sigma_factor, with_factor
from fitting.outcome.result import FittedParameter, Holdout

PARAMETER = FittedParameter("magnet.x", 0.3, 0.01, "A m2", True)


@pytest.mark.parametrize("word", ["predicts", "fits", "ambiguous", "undetermined"])
def test_those_of_a_minimum_are_those_of_the_covariance(word):
    assert sigma_factor(word, {"mag": channel()}, at_minimum=True) == 1.0
    assert with_factor((PARAMETER,), 1.0) == (PARAMETER,) and factor_remark(1.0) == ()


@pytest.mark.parametrize(("word", "at_minimum"), [("not this model", True), ("undetermined", False)])
def test_a_denied_fit_and_none_at_a_minimum_show_none(word, at_minimum):
    factor = sigma_factor(word, {"mag": channel()}, at_minimum=at_minimum)
    assert np.isinf(factor)
    assert with_factor((PARAMETER,), factor)[0].sigma is None and factor_remark(factor)[0].startswith("no sigmas")


def test_what_does_not_predict_has_them_as_far_off_as_it_predicts():
    mag = channel(holdout=Holdout(30, 0, 1.6, 0.32, 5.0))
    factor = sigma_factor("fits, does not predict", {"mag": mag}, at_minimum=True)
    assert factor == pytest.approx(5.0)
    assert with_factor((PARAMETER,), factor)[0].sigma == pytest.approx(0.05)
    assert factor_remark(factor)[0].startswith("sigmas are 5.0 times")
