"""Samples that are of no motion are named where they lie scattered and all others are explained, else not."""

import dataclasses

import numpy as np
import pytest

from fitting.doctor.bench import Bench
from fitting.doctor.causes.outliers import outlying_readings
from tests.cli.made_up_munin import make_munin_result

N = 60


def named(out: np.ndarray, chi2_per_reading: float = 1.0) -> list[str]:
    """Causes of a fit that leaves these of 60 samples out."""
    usual = make_munin_result()
    cells = dataclasses.replace(
        usual.channels["cells"],
        fitted=np.ones(N, bool),
        used=~np.isin(np.arange(N), out),
        misfits=len(out) / N,
        chi2_per_reading=chi2_per_reading,
        residuals=(),
    )
    result = dataclasses.replace(usual, chi2=200.0, dof=200, channels={**usual.channels, "cells": cells})
    bench = object.__new__(Bench)
    bench.__dict__.update(readings=240, of_witnesses=5.0)
    return [f"{trial.cause} {trial.chi2:.0f}" for trial in outlying_readings(bench, result)]


@pytest.mark.parametrize(
    ("out", "ratio", "found"),
    [
        (np.arange(0, 60, 7), 1.0, True),
        (np.arange(30, 39), 1.0, False),
        (np.arange(0, 60, 7), 2.0, False),
        (np.array([3, 40]), 1.0, False),
        (np.arange(0, 60, 2), 1.0, False),
    ],
    ids=["scattered", "a stretch", "others off", "few", "half"],
)
def test_what_is_named(out, ratio, found):
    told = ["9 of 60 samples of cells are of no motion, one here and one there; all others are explained 245"]
    assert named(out, ratio) == (told if found else [])
