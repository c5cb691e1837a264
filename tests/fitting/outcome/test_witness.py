"""What a witness says of a motion: it confirms within what the fit promises, else the fit has not converged."""

import dataclasses

import numpy as np
import pytest

from fitting.outcome.result import CONVERGED, FITS, NOT_CONVERGED, WRONG_MODEL, ChannelFit, Holdout
from fitting.outcome.verdict import Evidence, Witness, judge


def channel(*, rms: float, outliers: int = 0, samples: int = 40, witness: bool = True) -> ChannelFit:
    """Two columns of a magnetometer that are promised to 1 uT."""
    used = np.arange(samples) >= outliers
    rows = np.zeros((samples, 2))
    return ChannelFit(
        name="mag",
        kind="Magnetometer",
        unit="uT",
        columns=("By", "Bz"),
        t_s=64.0 * np.arange(samples),
        measured=rows,
        modelled=rows,
        sigma=1.0,
        residual=rows,
        promised=rows + 1.0,
        fitted=np.full(samples, not witness),
        used=used,
        rms=None,
        chi2_per_reading=None,
        angle_deg=None,
        holdout=Holdout(2 * int(used.sum()), outliers, rms, 1.0, None) if used.any() else None,
        delay_s=None,
        delay_sigma_s=None,
        witness=witness,
    )


def verdict(found: ChannelFit) -> tuple:
    return judge(
        Evidence(
            cost=50.0,
            promise=0.0,
            ratio=1.0,
            hopeless=False,
            channels={found.name: found},
            alternatives=(),
            attitude_sigma_deg=0.3,
            notes={},
            held_out=False,
        )
    )


def test_a_witness_confirms():
    status, word, _, remarks = verdict(channel(rms=0.7))
    assert (status, word) == (CONVERGED, FITS)
    assert "the witness mag confirms the motion: its readings are 0.7 uT (RMS) off, 0.7 times" in remarks[0]


@pytest.mark.parametrize(
    "found",
    [channel(rms=2.1), channel(rms=0.9, outliers=11), channel(rms=0.9, outliers=40)],
    ids=["far", "some", "all"],
)
def test_a_witness_denies(found):
    status, word, reason, _ = verdict(found)
    assert (status, word) == (NOT_CONVERGED, WRONG_MODEL)
    assert reason.startswith("the witness mag denies the motion")


def test_few_wild_readings_deny_nothing():
    found = channel(rms=0.9, outliers=9)
    assert "9 of 40 are far off" in verdict(found)[3][0]


def test_only_witnesses_are_asked():
    assert Witness.of(channel(rms=5.0, witness=False)) is None
    assert verdict(channel(rms=5.0, witness=False))[0] == CONVERGED


def test_one_without_readings_is_silent():
    none = dataclasses.replace(channel(rms=1.0, samples=1), used=np.zeros(0, bool), holdout=None)
    assert Witness.of(none) is None
    assert verdict(none)[0] == CONVERGED
