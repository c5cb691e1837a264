"""What a witness says of a motion: it confirms within what the fit promises, else the fit has not converged."""

import dataclasses

import numpy as np
import pytest

from fitting.outcome.result import CONVERGED, FITS, NOT_CONVERGED, WRONG_MODEL, ChannelFit, Holdout, Wish
from fitting.outcome.verdict import Evidence, judge
from fitting.outcome.witness import Witness, wish_of


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


SLOPE = np.random.default_rng(5).normal(size=(120, 6))
SPREAD = np.diag(np.linspace(0.1, 0.6, 6))
COLUMN = np.repeat(np.eye(2), 60, axis=0)
"""Two columns of 60 readings, each with a bias."""


def wish(move: np.ndarray, *, bias: float = 0.0, noise: float = 0.05, chi2_p: float = 0.5) -> Wish:
    """What readings say of a fit that is `move` of its own sigmas off."""
    found = SLOPE @ SPREAD @ move + COLUMN @ np.full(2, bias) + noise * np.random.default_rng(9).normal(size=120)
    told = wish_of(found, SLOPE, SPREAD @ SPREAD, COLUMN, noise=1e-3, chi2_p=chi2_p)
    assert told is not None
    return told


@pytest.mark.parametrize("bias", [0.0, 3.0], ids=["calibrated", "biased"])
def test_a_right_fit_is_moved_as_far_as_its_sigmas_say(bias):
    moves = np.random.default_rng(2).normal(size=(200, 6))
    found = [wish(move, bias=bias) for move in moves]
    strength = np.array([each.strength for each in found])
    # Chi-square of 6 degrees of freedom: mean 6 and variance 12, of 200 draws.
    assert abs(strength.mean() - 6.0) < 4.0 * np.sqrt(12.0 / 200.0)
    assert all(each.directions == 6 and not each.denies for each in found)


def test_a_fit_that_is_five_sigmas_off_is_denied_within_the_stated_noise():
    found = wish(np.full(6, 5.0), bias=3.0)
    assert found.denies and found.sigmas == pytest.approx(5.0, rel=0.1)
    status, word, reason, _ = verdict(dataclasses.replace(channel(rms=0.5), wish=found))
    assert (status, word) == (NOT_CONVERGED, WRONG_MODEL)
    assert reason.startswith("the witness mag denies the motion") and "times as far as its sigmas allow" in reason


def test_what_the_wish_does_not_explain_is_believed_where_chi2_is_doubtful_alone():
    calm, doubtful = (wish(np.full(6, 5.0), noise=4.0, chi2_p=p) for p in (0.5, 1e-4))
    assert calm.explained < 0.9
    assert not calm.denies and doubtful.denies


@pytest.mark.parametrize("count", [0, 1, 14])
def test_few_readings_have_no_wish(count):
    few = slice(count)
    assert wish_of(np.ones(count), SLOPE[few], SPREAD, COLUMN[few], noise=1e-3, chi2_p=0.5) is None
