"""Designs against textbook optima, the equivalence theorem, all choices one by one, and finite differences."""

from itertools import combinations

import equinox as eqx
import numpy as np
import pytest

from fitting.sensitivity.analysis import analysed
from fitting.sensitivity.design import (
    Aim,
    Candidates,
    aim_of,
    best_directions,
    best_weights,
    sigma_of_sensors,
    squared_sigma,
    whole_samples,
)
from fitting.sensitivity.plan import vantage_of_plan
from jaxsat.errors import InputError
from jaxsat.satellites.reading import read_satellite
from jaxsat.synthetic.twins import TwinSettings

SATELLITE = """
[body]
inertia_kg_m2 = [0.0020, 0.0017, 0.0014]
[motion]
kind = "orbital"
[orbit.elements]
a_km = 6900
e = 0.001
i_deg = 97
raan_deg = 20
argp_deg = 10
mean_anomaly_deg = 5
epoch = "2021-05-01T00:00:00Z"
[time]
column = "utc"
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "-x", "+y", "-y", "+z", "-z"]
gain = {value = 1.0, sigma = 0.03}
earthlight = false
[channels.sun]
columns = ["s1", "s2", "s3", "s4", "s5", "s6"]
unit = "1"
sigma = 0.01
"""


def polynomial(aim, points=41):
    """Readings of a quadratic polynomial on [-1, 1]."""
    x = np.linspace(-1.0, 1.0, points)
    basis = np.stack([np.ones_like(x), x, x**2], axis=1)
    return x, Candidates(np.einsum("ku,kv->kuv", basis, basis), np.zeros(3), aim)


@pytest.mark.parametrize(
    ("aim", "shares"),
    [(None, [1 / 3, 1 / 3, 1 / 3]), (Aim("all", "1", np.eye(3)), [0.25, 0.5, 0.25])],
    ids=["D-optimal", "A-optimal"],
)
def test_quadratic_polynomial(aim, shares):
    """Shares at -1, 0 and 1 of Fedorov (1972), and the equivalence theorem of Kiefer & Wolfowitz (1960)."""
    x, candidates = polynomial(aim)
    found = best_weights(candidates, 1.0, tolerance=1e-12)
    told = np.interp([-1.0, 0.0, 1.0], x, found.weights)
    np.testing.assert_allclose(told, shares, atol=1e-3)
    assert found.gap is not None and 0.0 <= found.gap < 1e-5 and found.bound is not None
    # Variance of the prediction (for D), or of its like, nowhere above that at the support; it touches there alone.
    level = -found.slopes / -(found.slopes @ found.weights)
    assert level.max() < 1.0 + 1e-5
    np.testing.assert_allclose(level[[0, 20, 40]], 1.0, atol=1e-4)
    assert np.all(level[5:15] < 0.95)
    if aim is None:
        # d(x) = 3 of three unknowns, at all points of the support.
        np.testing.assert_allclose(-found.slopes[[0, 20, 40]], 3.0, atol=1e-3)


def test_whole_samples_against_all_choices():
    """Four of twelve, each once: the best of all 495, and none of them below the bound."""
    aim = Aim("end", "1", np.outer([1.0, 1.5, 2.25], [1.0, 1.5, 2.25]))
    candidates = polynomial(aim, 12)[1]
    found = best_weights(candidates, 4.0)
    chosen = whole_samples(candidates, found.weights, 4)
    sigmas = {each: candidates.sigma(np.isin(np.arange(12), each).astype(float)) for each in combinations(range(12), 4)}
    best = min(sigmas, key=lambda each: sigmas[each])
    assert found.bound is not None and found.bound <= sigmas[best] * (1.0 + 1e-9)
    assert candidates.sigma(np.isin(np.arange(12), chosen).astype(float)) == pytest.approx(sigmas[best], rel=1e-9)
    with pytest.raises(ValueError, match="do not fit"):
        best_weights(candidates, 13.0)
    with pytest.raises(ValueError, match="do not tell"):
        best_weights(Candidates(0.0 * candidates.told, np.zeros(3), aim), 4.0)


def test_considered_numbers_against_least_squares():
    """sigma^2 by the formula and by the estimate itself: (J^T J)^-1 J^T (noise + J_c)."""
    rng = np.random.default_rng(0)
    J, by_considered = rng.normal(size=(9, 3)), rng.normal(size=(9, 2))
    both = np.hstack([J, by_considered])
    spread = rng.normal(size=(4, 5))
    estimate = np.linalg.pinv(J)
    error = spread @ np.vstack([estimate @ by_considered, -np.eye(2)])
    expected = np.trace(spread[:, :3] @ estimate @ estimate.T @ spread[:, :3].T) + (error**2).sum()
    assert float(squared_sigma(both.T @ both, spread.T @ spread, np.zeros(3))) == pytest.approx(expected, rel=1e-10)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    path = tmp_path_factory.mktemp("craft") / "cells.sat.toml"
    path.write_text(SATELLITE)
    plan = TwinSettings(duration_s=1200.0, every_s=100.0)
    return analysed(vantage_of_plan(read_satellite(path), plan), ["sun.gain"])


def put(model, normals):
    return eqx.tree_at(lambda m: m.sensors["sun"].normals, model, normals)


def test_directions_of_cells(place):
    """One cell's gain: its sigma in closed form, slopes against differences, and the best direction of all.

    A cell with normal n reads the Sun's directions s with the gain 1 and noise 0.01, so that the information on its
    gain is n^T (sum of s s^T) n / 0.01^2 + 1 / 0.03^2 as long as it sees the Sun: best along the first eigenvector.
    """
    cells = np.asarray(place.vantage.problem.measured["sun"])[np.asarray(place.vantage.problem.valid)]
    sun = cells[:, ::2] - cells[:, 1::2]
    second = sun.T @ sun
    along = np.linalg.eigh(second)[1][:, -1]
    along *= np.sign(sun[0] @ along)
    cell = int(np.argmax(cells.sum(axis=0)))
    name = place.quoted.rows[cell].name
    sigma = sigma_of_sensors([place], put, name)
    normals = np.array(place.vantage.model.sensors["sun"].normals)
    normals[cell] = along + 0.2 * np.random.default_rng(1).normal(size=3)
    normals[cell] /= np.linalg.norm(normals[cell])
    assert np.all(sun @ normals[cell] > 0.0) and np.all(sun @ along > 0.0)

    def closed(n):
        return (n @ second @ n / 0.01**2 + 1.0 / 0.03**2) ** -0.5

    value, slopes = sigma(normals)
    assert value == pytest.approx(closed(normals[cell]), rel=1e-9)
    assert closed(along) < 0.99 * value
    for k in range(3):
        change = np.zeros((6, 3))
        change[cell, k] = 1e-4
        difference = (sigma(normals + change)[0] - sigma(normals - change)[0]) / 2e-4
        # Differences are off by a sixth of the third derivative times the square of their step, 1e-8.
        assert slopes[cell, k] == pytest.approx(difference, rel=1e-6, abs=1e-7 * value)
    found, least = best_directions(sigma, [normals])
    assert least == pytest.approx(closed(along), rel=1e-6)
    np.testing.assert_allclose(found[cell], along, atol=2e-3)
    with pytest.raises(InputError, match="no number that is fitted"):
        aim_of(place, "mag.bias.x")
