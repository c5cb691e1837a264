"""The verdict on evidence that is made by hand: each word, and what the data deny is never converged."""

import dataclasses

import numpy as np
import pytest

from fitting.outcome.result import Break, ChannelFit, Holdout
from fitting.outcome.series import PanelResiduals
from fitting.outcome.verdict import Background, Evidence, judge

N = 40


def channel(**changed):
    """A magnetometer whose residuals are its noise, a quarter of its samples held out and predicted as promised."""
    fitted = np.arange(N) < 30
    blank = np.zeros((N, 3))
    usual = ChannelFit(
        name="mag",
        kind="Magnetometer",
        unit="uT",
        columns=("bx", "by", "bz"),
        t_s=np.arange(N, dtype=float),
        measured=blank,
        modelled=blank,
        sigma=0.3,
        residual=blank,
        promised=np.ones((N, 3)),
        fitted=fitted,
        used=np.ones(N, bool),
        rms=0.3,
        chi2_per_reading=1.0,
        angle_deg=0.4,
        holdout=Holdout(30, 0, 0.33, 0.32, 0.5),
        delay_s=None,
        delay_sigma_s=None,
    )
    return dataclasses.replace(usual, **changed)


def verdict(mag=None, **changed):
    usual = {
        "cost": 100.0,
        "promise": 1e-4,
        "ratio": 1.0,
        "hopeless": False,
        "channels": {"mag": mag or channel()},
        "alternatives": (),
        "attitude_sigma_deg": 0.5,
        "notes": {},
        "held_out": True,
    }
    return judge(Evidence(**{**usual, **changed}))


def test_what_fits_and_predicts():
    assert verdict()[:2] == ("converged", "predicts") and verdict()[3] == ()
    assert verdict(channel(fitted=np.ones(N, bool), holdout=None), held_out=False)[:2] == ("converged", "fits")


@pytest.mark.parametrize(
    ("mag", "words"),
    [
        (channel(holdout=Holdout(30, 0, 1.0, 0.32, 5.0)), "mag 3.1 times"),
        (channel(used=np.arange(N) < 33), "70 % of it far off"),
    ],
)
def test_what_fits_and_does_not_predict_is_not_converged(mag, words):
    status, word, message, _ = verdict(mag)
    assert (status, word) == ("not_converged", "fits, does not predict") and words in message


@pytest.mark.parametrize(("ratio", "directions", "predicts"), [(2.4, 2.0, True), (2.4, 60.0, False), (3.5, 1.0, False)])
def test_one_drift_may_be_farther_off_than_many_errors(ratio, directions, predicts):
    held = channel(holdout=Holdout(30, 0, 0.32 * ratio, 0.32, 5.0, directions))
    assert verdict(held)[1] == ("predicts" if predicts else "fits, does not predict")


@pytest.mark.parametrize(
    ("mag", "changed", "words"),
    [
        (channel(chi2_per_reading=9.0), {}, "3.0 times the stated noise"),
        (channel(used=np.arange(N) >= 12), {}, "40 % of the readings of mag"),
        (
            channel(bright=20, contradicted=5),
            {},
            "the computed shadow contradicts 5 samples of mag, which has 20 bright ones: check",
        ),
        (None, {"hopeless": True}, "does not explain"),
        (None, {"ratio": 5.0}, "does not explain"),
    ],
)
def test_what_the_residuals_deny_is_not_this_model(mag, changed, words):
    status, word, message, _ = verdict(mag, **changed)
    assert (status, word) == ("not_converged", "not this model") and words in message


def test_a_large_chi2_denies_where_nothing_was_held_out():
    all_fitted = channel(fitted=np.ones(N, bool), holdout=None)
    status, word, message, _ = verdict(all_fitted, held_out=False, ratio=3.1, chi2_p=3e-6)
    assert (status, word) == ("not_converged", "not this model") and message.startswith("chi2 denies the fit: 3.1 per")
    assert verdict(all_fitted, held_out=False, ratio=3.1, chi2_p=1e-3)[0] == "converged"
    assert verdict(ratio=3.1, chi2_p=3e-6)[0] == "converged"
    # Within that limit, but for a channel of which a part had to go.
    thinned = dataclasses.replace(all_fitted, used=np.arange(N) % 6 > 0, chi2_per_reading=1.7)
    status, word, message, _ = verdict(thinned, held_out=False, ratio=1.6, chi2_p=1e-7)
    assert (status, word) == ("not_converged", "not this model")
    assert "18 % of the readings of mag are left out" in message
    assert verdict(thinned, held_out=False, ratio=1.6, chi2_p=1e-3)[0] == "converged"


def test_positions_of_no_orbit_deny_and_an_old_element_set_is_told():
    status, word, message, _ = verdict(background=Background(369e3, None))
    assert (status, word) == ("not_converged", "not this model") and "they miss it by 369 km" in message
    found = verdict(background=Background(40e3, -8730.2))
    assert found[0] == "converged"
    assert found[3][0] == "positions miss their orbit by 40 km (RMS of a coordinate)"
    assert found[3][1].startswith("the first row is 8730 days before the epoch of the table's own element set")
    assert verdict(background=Background(12e3, 37.0))[3] == ()


def test_what_nothing_tells():
    assert verdict(attitude_sigma_deg=70.0)[:2] == ("not_converged", "undetermined")
    assert verdict(attitude_sigma_deg=np.inf)[:2] == ("not_converged", "undetermined")
    assert verdict(promise=3.0)[:2] == ("not_converged", "undetermined")
    assert verdict(cost=np.nan)[:2] == ("not_converged", "undetermined")


@pytest.mark.parametrize(("above", "word"), [(12.0, "ambiguous"), (25.0, "predicts")])
def test_other_axes_within_ten_of_the_cost_are_told(above, word):
    other = {"chi2_above_best": above, "attitude_distance_deg": 90.0, "axes": {"mag": ["+y", "-x", "+z"]}}
    status, found, message, _ = verdict(alternatives=(other,))
    assert found == word and (status == "ambiguous") == (word == "ambiguous")
    assert word != "ambiguous" or message.startswith("2 conventions of axes")


def test_what_is_odd_is_said():
    mag = channel(
        used=np.arange(N) != 3,
        chi2_per_reading=2.0,
        delay_s=1.2,
        delay_sigma_s=0.1,
        breaks=(Break(12.0, 9.5, 0.4, 500.0),),
    )
    remarks = "\n".join(verdict(mag, notes={"inertia.yy": "held by its prior", "sun.gain.+x": "at its bound"})[3])
    for words in (
        "1 of 30 samples",
        "1.41 times",
        "1.2 s late",
        "9.5 deg",
        "inertia.yy",
        "sun.gain.+x is at its bound",
    ):
        assert words in remarks


def test_what_a_shadow_leaves_out_is_told_apart_from_outliers():
    mag = channel(kind="SunVector", used=np.arange(N) >= 5, bright=30, contradicted=3)
    assert verdict(mag)[3] == (
        "3 of 30 samples of mag left out where light and computed shadow disagree",
        "2 of 30 samples of mag left out as outliers or in doubtful light",
    )


def test_larger_residuals_that_agree_with_their_neighbours_deny_where_nothing_was_held_out():
    def told(lag: float, ratio: float, p: float, **how):
        one = PanelResiduals(100, 1.3, 5.0, 0.0, 0.0, lag, 4.0, 1e-6, 4)
        mag = channel(fitted=np.ones(N, bool), holdout=None, chi2_per_reading=ratio, residuals=(one,))
        return verdict(mag, held_out=False, ratio=1.4, chi2_p=p, **how)

    status, word, message, _ = told(0.4, 1.8, 1e-20)
    assert (status, word) == ("not_converged", "not this model") and "1.34 times its noise and agree" in message
    # Noise of another size has no memory; chance may have either.
    assert told(0.05, 1.8, 1e-20)[0] == told(0.4, 1.1, 1e-20)[0] == told(0.4, 1.8, 1e-6)[0] == "converged"


def test_an_inertia_with_its_axes_in_another_order_is_ambiguous():
    status, word, reason, _ = verdict(renamed="y, z, x")
    assert (status, word) == ("ambiguous", "ambiguous") and "are the axes y, z, x of [body]" in reason


def test_readings_that_go_wrong_at_one_instant_are_told_from_when_on():
    used = np.ones(N, bool)
    used[34:] = False
    assert "from 34 s on while the others are as promised" in verdict(channel(used=used))[2]
    used[34:] = np.arange(N - 34) % 2 == 0
    used[30:34] = False
    assert "while the others" not in verdict(channel(used=used))[2]
