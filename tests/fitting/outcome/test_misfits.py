"""Samples of panels that a fit left out: dimmed by a limited current, or signs of a wrong model."""

import numpy as np
import pytest

from fitting.outcome.result import misfit_share

MODELLED = np.tile([100.0, 0.0, 50.0], (20, 1))
LEFT_OUT = np.arange(20) < 4


def test_samples_with_all_their_light_are_misfits():
    turned = np.where(LEFT_OUT[:, None], MODELLED[:, ::-1], MODELLED)
    assert misfit_share(LEFT_OUT, turned, MODELLED, 2.0) == pytest.approx(0.2)


def test_dimmed_ones_are_none():
    dimmed = np.where(LEFT_OUT[:, None], 0.7 * MODELLED, MODELLED)
    assert misfit_share(LEFT_OUT, dimmed, MODELLED, 2.0) == 0.0


def test_dark_samples_and_missing_readings_do_not_count():
    measured = MODELLED.copy()
    measured[10:] = 0.0
    measured[:4, 0] = np.nan
    assert misfit_share(LEFT_OUT, measured, np.where(measured == 0.0, 0.0, MODELLED), 2.0) == pytest.approx(0.4)
