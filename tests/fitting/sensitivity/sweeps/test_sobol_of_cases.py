"""Indices from random cases alone: against closed forms of functions whose indices are known, and their own errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.sensitivity.sweeps import OutputIndices, dependences, sobol_indices

SEEDS = range(3)
CASES = 2000


def ishigami(x: np.ndarray) -> np.ndarray:
    """Ishigami & Homma 1990 with a = 7, b = 0.1, of columns that are uniform over -1 to 1."""
    x = np.pi * x
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_exact() -> tuple[np.ndarray, np.ndarray]:
    """First-order and total indices of three inputs, and of two that do nothing."""
    a, b, pi4 = 7.0, 0.1, np.pi**4
    first = np.array([0.5 * (1.0 + b * pi4 / 5.0) ** 2, a**2 / 8.0, 0.0])
    joint = b**2 * pi4**2 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = first.sum() + joint
    total = first + joint * np.array([1.0, 0.0, 1.0])
    return np.append(first, [0.0, 0.0]) / variance, np.append(total, [0.0, 0.0]) / variance


A = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0, 99.0, 99.0])


def g_function(x: np.ndarray) -> np.ndarray:
    """Saltelli & Sobol 1995, of columns that are uniform over -1 to 1."""
    return np.prod((np.abs(2.0 * x) + A) / (1.0 + A), axis=1)


def g_exact() -> tuple[np.ndarray, np.ndarray]:
    own = 1.0 / (3.0 * (1.0 + A) ** 2)
    variance = np.prod(1.0 + own) - 1.0
    return own / variance, own * np.prod(1.0 + own) / (1.0 + own) / variance


def indices(function, columns: int, seed: int, cases: int = CASES) -> OutputIndices:
    x = np.random.default_rng(seed).uniform(-1.0, 1.0, (cases, columns))
    return sobol_indices({f"x{k}": x[:, k] for k in range(columns)}, function(x))


@pytest.mark.parametrize(("function", "exact"), [(ishigami, ishigami_exact), (g_function, g_exact)])
def test_closed_forms_are_within_the_intervals(function, exact):
    first, total = exact()
    inside, near = [], []
    for seed in SEEDS:
        found = indices(function, len(first), seed).inputs
        for k, one in enumerate(found.values()):
            for estimate, truth in ((one.first, first[k]), (one.total, total[k])):
                inside.append(estimate.low <= truth <= estimate.high)
                half = 0.5 * (estimate.high - estimate.low)
                near.append(estimate.low - half <= truth <= estimate.high + half)
                # An interval that holds everything would be none.
                assert half < 0.1
    # Of 95 %; beyond twice the interval is one in ten thousand.
    assert np.mean(inside) >= 0.88 and all(near)


def test_errors_are_as_large_as_they_are_said_to_be():
    first, _ = ishigami_exact()
    miss = []
    for seed in range(16):
        found = indices(ishigami, 4, 100 + seed, cases=500).inputs
        estimates = [one.first for one in found.values()]
        miss.append([(e.value - truth) / (e.high - e.low) for e, truth in zip(estimates, first[:4], strict=True)])
    # Of a normal miss and an interval of 3.92 sigma; the mean square of 64 is known to 18 %.
    assert 0.6 < np.mean(np.square(miss)) * 3.92**2 < 1.5


def test_an_input_that_does_nothing():
    for seed in SEEDS:
        found = indices(ishigami, 5, seed)
        nothing = found.inputs["x4"]
        assert nothing.first.low < 0.0 < nothing.first.high
        assert nothing.total.low == 0.0 and nothing.total.value < 0.005 and nothing.total.high < 0.03
        assert found.unresolved < 0.02 < 0.95 < found.foretold


def test_a_vector_is_one_input():
    """An attitude uniform over all, of which n is where it puts an axis: n_z is uniform from -1 to 1, as x is."""
    rng = np.random.default_rng(1)
    attitude = Rotation.random(CASES, rng=rng)
    x, n_z = rng.uniform(-1.0, 1.0, CASES), attitude.as_matrix()[:, 2, 2]
    q = attitude.as_quat(canonical=True, scalar_first=True)
    both = {"attitude": q, "x": x}
    added = sobol_indices(both, n_z + x, names={"attitude": ("q_w", "q_x", "q_y", "q_z")}).inputs
    for one in added.values():
        for estimate in (one.first, one.total):
            assert estimate.low - 0.01 < 0.5 < estimate.high + 0.01
    assert list(added["attitude"].slopes) == ["q_w", "q_x", "q_y", "q_z"] and list(added["x"].slopes) == ["x"]
    # Nothing alone, everything together.
    for one in sobol_indices(both, n_z * x).inputs.values():
        assert one.first.low < 0.0 < one.first.high and one.total.value > 0.95 and one.total.high == 1.0


def test_a_vector_whose_neighbours_are_far_says_so():
    """A sign that changes quickly along a vector of six numbers, of variance 1 as x has: neighbours are no help."""
    rng = np.random.default_rng(6)
    v, x = rng.normal(size=(CASES, 6)), rng.normal(size=CASES)
    found = sobol_indices({"v": v, "x": x}, np.sign(np.sin(3.0 * v[:, 0] + 2.0 * v[:, 1] * v[:, 2])) + x)
    assert found.unresolved > 0.3 and found.inputs["v"].first.value < 0.3
    for one in found.inputs.values():
        assert one.first.low < 0.5 < one.first.high and one.total.low < 0.5 < one.total.high
        assert np.isnan(one.total.value)
    # One number has near neighbours whatever the others.
    assert found.inputs["x"].first.high < 0.6


def test_noise_that_no_input_says_is_unresolved():
    rng = np.random.default_rng(2)
    x, other, noise = rng.normal(size=(3, CASES))
    found = sobol_indices({"x": x, "other": other}, np.sqrt(3.0) * x + noise)
    # A quarter of the variance.
    assert found.unresolved == pytest.approx(0.25, abs=0.03) and found.foretold == pytest.approx(0.75, abs=0.03)
    assert found.inputs["x"].first.low < 0.75 < found.inputs["x"].first.high
    assert found.inputs["x"].total.low < 0.75 < found.inputs["x"].total.high
    assert found.inputs["other"].total.low == 0.0 < 0.25 < found.inputs["other"].total.high
    # The mean derivative of a normal input, and no slope at all (Stein 1981).
    slope, sigma = found.inputs["x"].slopes["x"]
    assert slope == pytest.approx(np.sqrt(3.0), abs=4.0 * sigma) and 0.01 < sigma < 0.03
    slope, sigma = found.inputs["other"].slopes["other"]
    assert slope == pytest.approx(0.0, abs=4.0 * sigma)


def test_steepness_bounds_the_total_index():
    """f = u + v^2 of uniform u, v over 0 to 1: mean squares of its slopes are 1 and 4/3, its variance 1/12 + 4/45."""
    u, v = np.random.default_rng(3).uniform(size=(2, CASES))
    found = sobol_indices({"u": u, "v": v}, u + v**2).inputs
    variance = 1.0 / 12.0 + 4.0 / 45.0
    assert found["u"].steepness["u"] == pytest.approx(1.0, rel=0.03)
    assert found["v"].steepness["v"] == pytest.approx(np.sqrt(4.0 / 3.0), rel=0.03)
    for name, part in (("u", 1.0 / 12.0), ("v", 4.0 / 45.0)):
        bound = found[name].bound
        assert bound is not None and part / variance < bound < 1.5 * part / variance


def test_what_has_no_index_says_why():
    rng = np.random.default_rng(4)
    x = {"x": rng.normal(size=CASES), "still": np.ones(CASES)}
    found = sobol_indices(x, np.full(CASES, 3.25))
    assert found.inputs == {} and found.remarks == ("constant: 3.25 in all cases",)
    missing = np.where(np.arange(CASES) < 100, x["x"], np.nan)
    found = sobol_indices(x, missing)
    assert found.inputs == {} and found.remarks == ("100 of 2000 cases have it; 200 are needed",)
    found = sobol_indices(x, np.where(np.arange(CASES) < 4, 0.0, 1.0))
    assert found.inputs == {} and found.remarks == ("all but 4 cases alike; 30 are needed",)
    assert sobol_indices(x, np.full(CASES, np.nan)).remarks == ("0 of 2000 cases have it; 200 are needed",)

    wild = x["x"].copy()
    wild[7] = 1e3
    found = sobol_indices(x, wild)
    assert list(found.inputs) == ["x"] and found.remarks[0] == "still does not vary"
    assert "one case makes 100% of the variance" in found.remarks[1]
    half = sobol_indices(x, np.where(x["x"] > 0.0, x["x"], np.nan))
    assert half.cases == np.sum(x["x"] > 0.0) and half.inputs["x"].first.value > 0.99
    with pytest.raises(ValueError, match="input x has 2000 cases, the output 3"):
        sobol_indices(x, np.zeros(3))
    with pytest.raises(ValueError, match="input x has values that are not finite"):
        sobol_indices({"x": missing}, x["x"])


def test_inputs_of_few_values():
    """The one of four sensors that failed: half of the variance by which, half by how much else."""
    rng = np.random.default_rng(5)
    which, x = rng.integers(0, 4, CASES).astype(float), rng.normal(size=CASES)
    level = np.array([1.0, -1.0, -1.0, 1.0])[which.astype(int)]
    for one in sobol_indices({"which": which, "x": x}, level + x).inputs.values():
        assert one.first.low < 0.5 < one.first.high and one.total.low < 0.5 < one.total.high + 0.01


def test_dependent_inputs_are_found_and_independent_ones_are_not():
    for seed in range(20):
        x = np.random.default_rng(seed).normal(size=(CASES, 6))
        inputs = {"a": x[:, :2], "b": x[:, 2], "c": x[:, 3:]}
        assert dependences(inputs) == []
    (found,) = dependences({**inputs, "b": x[:, 2] + 0.2 * x[:, 1]})
    assert found.inputs == ("a", "b")
    # Spearman's of normal numbers: 6/pi asin(r/2); scatter 1/sqrt(2000).
    r = 0.2 / np.hypot(1.0, 0.2)
    assert found.correlation == pytest.approx(6.0 / np.pi * np.arcsin(0.5 * r), abs=0.07)
    assert dependences({"a": x[:, 0], "still": np.ones(CASES)}) == []
