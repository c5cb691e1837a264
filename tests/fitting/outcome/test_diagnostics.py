"""Residuals that are noise are left in peace, ones with a mean, a memory or the wrong size are found."""

import dataclasses
import json

import numpy as np
import pytest
from scipy import stats

from fitting.outcome.diagnostics import Diagnostics, diagnose
from fitting.outcome.result import FITS, ChannelFit, FitResult
from fitting.outcome.series import LAGS, PanelResiduals, panel_residuals, slots

SAMPLES = 70
PANELS = ("+x", "-x", "+y", "-y", "+z", "-z")


def result_with(
    residual_mA: np.ndarray,
    weight: np.ndarray | None = None,
    *,
    noise_mA: float = 2.0,
    t_s: np.ndarray | None = None,
    dof: int = 6 * SAMPLES,
) -> FitResult:
    """A fit of six panels whose residuals [time 6] are these; all else is made up."""
    n = len(residual_mA)
    weight = np.ones((n, 6)) if weight is None else weight
    t_s = 64.0 * np.arange(n) if t_s is None else t_s
    residual, counted, slot = residual_mA / noise_mA, weight > 0.0, slots(t_s)
    modelled, everywhere = np.full((n, 6), 100.0), np.ones(n, bool)
    cells = ChannelFit(
        name="cells",
        kind="Panels",
        unit="mA",
        columns=PANELS,
        t_s=t_s,
        measured=modelled + residual_mA,
        modelled=modelled,
        sigma=noise_mA,
        residual=residual,
        promised=np.ones((n, 6)),
        fitted=everywhere,
        used=everywhere,
        rms=noise_mA,
        chi2_per_reading=1.0,
        angle_deg=None,
        holdout=None,
        delay_s=None,
        delay_sigma_s=None,
        residuals=tuple(panel_residuals(residual[counted[:, k], k], slot[counted[:, k]]) for k in range(6)),
        weight=weight,
    )
    return FitResult(
        status="converged",
        message="",
        verdict=FITS,
        remarks=(),
        chi2=float(np.sum(weight * residual**2)),
        dof=dof,
        parameters=(),
        buys={},
        correlations={},
        t_s=t_s,
        quaternion_inertial_from_body=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        angular_velocity_rad_s=np.zeros((n, 3)),
        attitude_sigma_deg=np.zeros((n, 3)),
        illumination=None,
        fitted=everywhere,
        channels={"cells": cells},
        axes={},
    )


def noise(seed: int = 3) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=2.0, size=(SAMPLES, 6))


def diagnose_noise(**panels) -> Diagnostics:
    """White noise of 2 mA in all panels but those given."""
    residual = noise()
    for name, series in panels.items():
        residual[:, PANELS.index(name.replace("plus_", "+").replace("minus_", "-"))] = series
    return diagnose(result_with(residual))


def panels_of(found: Diagnostics) -> dict[str, PanelResiduals]:
    return found.channels["cells"].columns


def tails_of(found: Diagnostics) -> dict:
    return found.channels["cells"].tails


@pytest.mark.parametrize("gaps", [False, True])
def test_p_values_and_scores_of_white_noise_are_uniform_and_normal(gaps):
    """4000 series: a Kolmogorov-Smirnov distance of 0.03 is exceeded once in 700; skewness of Q takes part of it."""
    rng = np.random.default_rng(11)
    found = []
    for _ in range(4000):
        slot = np.arange(200)
        if gaps:
            slot = np.concatenate([slot[:60], slot[100:]])
            slot = slot[rng.random(len(slot)) > 0.2]
        found.append(panel_residuals(rng.normal(size=len(slot)), slot))
    p, lag1, mean, size = (np.array([getattr(f, n) for f in found]) for n in ("ljung_box_p", "lag1_z", "mean_z", "rms"))
    assert stats.kstest(p, "uniform").statistic < 0.03
    # The mean is taken from the series itself, which moves each correlation by -1/n.
    assert np.mean(lag1) == pytest.approx(0.0, abs=0.12) and np.std(lag1) == pytest.approx(1.0, abs=0.04)
    assert np.mean(mean) == pytest.approx(0.0, abs=0.06) and np.std(mean) == pytest.approx(1.0, abs=0.04)
    assert np.mean(size**2) == pytest.approx(1.0, abs=0.01)


def test_without_gaps_the_test_is_ljung_and_boxs():
    """Their formula as printed, Q = n (n + 2) sum r_k^2 / (n - k), with SciPy's chi-square."""
    z = np.random.default_rng(5).normal(loc=0.3, size=80)
    found = panel_residuals(z, np.arange(80))
    z = z - z.mean()
    r = np.array([np.sum(z[k:] * z[:-k]) for k in range(1, LAGS + 1)]) / np.sum(z**2)
    q = 80 * 82 * np.sum(r**2 / (80 - np.arange(1, LAGS + 1)))
    assert found.lags == LAGS
    assert found.ljung_box_p == pytest.approx(stats.chi2.sf(q, LAGS), rel=1e-12)
    assert found.lag1 == pytest.approx(r[0], rel=1e-12)


def test_alternating_residuals_with_a_gap():
    """+1 -1 +1 -1, nothing, +1 -1 +1 -1: six pairs at lag 1, so r = -6/8, and Var r = 6 / (8 10)."""
    found = panel_residuals(np.array([1.0, -1, 1, -1, 1, -1, 1, -1]), np.array([0, 1, 2, 3, 5, 6, 7, 8]))
    assert (found.count, found.lags) == (8, 1)
    assert found.rms == pytest.approx(1.0) and found.rms_z == pytest.approx(0.0) and found.mean == pytest.approx(0.0)
    assert found.lag1 == pytest.approx(-0.75) and found.lag1_z == pytest.approx(-0.75 / np.sqrt(6 / 80))
    assert found.ljung_box_p == pytest.approx(2.0 * stats.norm.sf(0.75 / np.sqrt(6 / 80)))


def test_noise_is_not_remarked_on():
    found = diagnose_noise()
    assert found.remarks() == []
    assert found.chi2_per_dof == pytest.approx(np.sum(noise() ** 2) / 4.0 / 420)
    assert found.chi2_p == pytest.approx(stats.chi2.sf(np.sum(noise() ** 2) / 4.0, 420))
    assert list(panels_of(found)) == list(PANELS)
    assert {limit: t["expected"] for limit, t in tails_of(found).items()} == {
        "2": 19.11,
        "3": 1.13,
        "4": 0.03,
    }
    assert tails_of(found)["2"]["found"] == np.sum(np.abs(noise()) > 4.0)


def test_a_bias_is_found_in_its_panel_only():
    biased = diagnose_noise(minus_y=noise()[:, 3] + 1.4)
    (line,) = biased.remarks()
    assert "-y have a mean of +0." in line
    panel = panels_of(biased)["-y"]
    assert panel.mean is not None and panel.mean == pytest.approx((noise()[:, 3].mean() + 1.4) / 2.0)
    assert panel.mean_z == pytest.approx(panel.mean * np.sqrt(SAMPLES))
    # The mean is no memory: the correlation is about it.
    assert panel.lag1 == pytest.approx(panels_of(diagnose_noise())["-y"].lag1)


def test_a_memory_is_found_in_its_panel_only():
    rng = np.random.default_rng(6)
    series = [rng.normal()]
    for _ in range(SAMPLES - 1):
        series.append(0.6 * series[-1] + 0.8 * rng.normal())
    found = diagnose_noise(plus_z=2.0 * np.array(series))
    (line,) = found.remarks()
    assert "neighbouring residuals of cells +z" in line
    lag1 = panels_of(found)["+z"].lag1
    # Of 70 samples of an AR(1) with 0.6: sigma sqrt((1 - 0.36) / 70) = 0.1.
    assert lag1 == pytest.approx(0.6, abs=0.25)


def test_noise_twice_as_large_as_stated_is_found():
    found = diagnose_noise(plus_x=2.0 * noise()[:, 0])
    (line,) = found.remarks()
    assert "+x are" in line and "times the stated noise" in line
    assert tails_of(found)["4"]["found"] >= 1


def test_residuals_left_out_do_not_count():
    residual, weight = noise(), np.ones((SAMPLES, 6))
    residual[10:20, 2], weight[10:20, 2] = 1e6, 0.0
    weight[:, 5] = 0.0
    found = diagnose(result_with(residual, weight))
    assert [panel.count for panel in panels_of(found).values()] == [70, 70, 60, 70, 70, 0]
    assert found.remarks() == [] and panels_of(found)["-z"].rms is None


def test_samples_on_either_side_of_a_gap_in_time_are_no_neighbours():
    """Two blocks of five an hour apart: eight pairs, not nine."""
    residual = np.random.default_rng(2).normal(size=(10, 6))
    t = np.concatenate([64.0 * np.arange(5), 3600.0 + 64.0 * np.arange(5)])
    found = panels_of(diagnose(result_with(residual, t_s=t, noise_mA=1.0)))["+x"]
    z = residual[:, 0] - residual[:, 0].mean()
    expected = (z[:4] @ z[1:5] + z[5:9] @ z[6:]) / (z @ z)
    assert found.lag1 == pytest.approx(expected) and found.lag1_z == pytest.approx(expected * np.sqrt(10 * 12 / 8))


@pytest.mark.parametrize("samples", [1, 2, 4])
def test_few_residuals_have_no_memory(samples):
    found = diagnose(result_with(noise()[:samples], dof=0))
    assert found.chi2_per_dof is None and found.chi2_p is None
    assert all(p.lag1 is None and p.ljung_box_p is None and p.rms is not None for p in panels_of(found).values())
    assert panel_residuals(np.ones(20), np.arange(20)).ljung_box_p is None


def test_document_is_strict_json():
    document = diagnose_noise().as_dict()
    again = json.loads(json.dumps(document, allow_nan=False))
    assert again == document and list(again) == ["chi2_per_dof", "chi2_p", "channels"]
    assert list(again["channels"]["cells"]["columns"]["+x"]) == [
        field.name for field in dataclasses.fields(panels_of(diagnose_noise())["+x"])
    ]
