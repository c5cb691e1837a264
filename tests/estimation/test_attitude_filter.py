"""The attitude filter against closed forms, Van Loan's matrices, its own chi-squares, and differences."""

import dataclasses
import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from scipy.linalg import expm, solve_discrete_are
from scipy.spatial.transform import Rotation

from experiments.estimation.nees import Setting, filtered, judged, truth
from jaxsat.estimation import (
    AttitudeFilter,
    AttitudeReadings,
    GyroErrors,
    carried_errors,
    gyro_reading,
    quest,
    triad,
    triad_covariance,
)
from jaxsat.estimation.gate import passing

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
carried = quick(carried_errors)


def units(rng, *shape):
    v = rng.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@pytest.mark.parametrize("turn", [0.0, 1e-5, 0.3, 0.9999, 1.0001, 3.0])
def test_errors_are_carried_as_van_loan_has_them(turn):
    """A matrix exponential of twice the size gives both (Van Loan 1978)."""
    v, u, dt = 0.02, 0.07, 0.4
    rate = turn / dt * np.array([0.48, -0.6, 0.64])
    F = np.zeros((6, 6))
    # Column k of -[w x] is e_k x w.
    F[:3, :3], F[:3, 3:] = np.cross(np.eye(3), rate).T, -np.eye(3)
    whole = expm(dt * np.block([[-F, np.diag([v**2] * 3 + [u**2] * 3)], [np.zeros((6, 6)), F.T]]))
    transition, covariance = carried(GyroErrors(v, u), jnp.asarray(rate), dt)
    np.testing.assert_allclose(transition, whole[6:, 6:].T, atol=1e-13)
    np.testing.assert_allclose(covariance, whole[6:, 6:].T @ whole[:6, 6:], atol=1e-15)


def test_readings_have_the_noise_that_is_told():
    gyro, dt = GyroErrors(0.02, 0.07), 0.4
    draw = quick(jax.vmap(lambda key: gyro_reading(gyro, jnp.zeros(3), jnp.zeros(3), dt, key=key)))
    reading, after = draw(jax.random.split(jax.random.key(0), 20_000))
    # What an attitude carried by the reading is off by, at rest, and the bias.
    off = np.stack([-dt * np.asarray(reading)[:, 0], np.asarray(after)[:, 0]])
    _, covariance = carried(gyro, jnp.zeros(3), dt)
    ratio = np.linalg.solve(np.linalg.cholesky(np.asarray(covariance)[::3, ::3]), off)
    # 20000 samples tell a variance to one part in a hundred.
    np.testing.assert_allclose(np.cov(ratio), np.eye(2), atol=0.04)


def test_a_steady_state_is_that_of_farrenkopf():
    """His closed form (Markley & Reynolds 2000), and SciPy's solution of the Riccati equation."""
    v, u, n, dt = 2e-4, 3e-6, 1e-4, 5.0
    estimator = AttitudeFilter(GyroErrors(v, u))
    belief = estimator.start([1.0, 0.0, 0.0, 0.0], sigma_rad=1e-2, bias_sigma_rad_s=1e-3)
    tracked = AttitudeReadings(
        jnp.zeros(3),
        jnp.zeros((0, 3)),
        jnp.zeros((0, 3)),
        jnp.zeros(0),
        jnp.zeros(0, bool),
        jnp.array([1.0, 0, 0, 0]),
        n * jnp.ones(3),
    )

    @quick
    def steady(belief):
        after = jax.lax.scan(lambda b, _: (estimator.update(b, tracked, dt)[0], None), belief, None, length=600)[0]
        return after.covariance, estimator.predicted(after, jnp.zeros(3), dt).covariance

    after, before = (np.asarray(x) for x in steady(belief))
    a, b = v * math.sqrt(dt) / n, u * dt**1.5 / n
    gamma = math.sqrt(1.0 + a**2 / 4.0 + b**2 / 48.0)
    zeta = gamma + b / 4.0 + 0.5 * math.sqrt(2.0 * gamma * b + a**2 + b**2 / 3.0)
    assert before[0, 0] == pytest.approx(n**2 * (zeta**2 - 1.0), rel=1e-9)
    assert after[0, 0] == pytest.approx(n**2 * (1.0 - zeta**-2), rel=1e-9)

    phi = np.array([[1.0, -dt], [0.0, 1.0]])
    noise = np.array([[v**2 * dt + u**2 * dt**3 / 3.0, -(u**2) * dt**2 / 2.0], [-(u**2) * dt**2 / 2.0, u**2 * dt]])
    # Scaled, as SciPy looks at the sizes.
    scale = np.diag([1.0 / n, dt / n])
    inverse = np.linalg.inv(scale)
    expected = solve_discrete_are(
        (scale @ phi @ inverse).T, np.array([[1.0], [0.0]]), scale @ noise @ scale, np.array([[1.0]])
    )
    np.testing.assert_allclose(before[::3, ::3], inverse @ expected @ inverse, rtol=1e-8)
    np.testing.assert_allclose(before[1::3, 1::3], before[::3, ::3], rtol=1e-9)


VECTORS = 3
estimator = AttitudeFilter(GyroErrors(1e-3, 1e-4), looks=2)


@quick
def corrected_from(q, body, eci, sigma, known):
    """Correction of a belief that knows nearly nothing."""
    belief = estimator.start(q, sigma_rad=1e3, bias_sigma_rad_s=1.0)
    return estimator.corrected(belief, AttitudeReadings(jnp.zeros(3), body, eci, sigma, known))


def seen(rng, sigma):
    """An attitude, directions inside with errors of a size, and outside."""
    true, eci = Rotation.random(rng=rng), units(rng, VECTORS)
    return true, Rotation.from_rotvec(sigma * rng.normal(size=(VECTORS, 3))).apply(true.inv().apply(eci)), eci


def test_without_a_past_it_is_davenport():
    rng = np.random.default_rng(1)
    sigma = np.array([1e-4, 3e-4, 2e-4])
    true, body, eci = seen(rng, 1e-4)
    belief, estimate = corrected_from(
        true.as_quat(scalar_first=True), jnp.asarray(body), jnp.asarray(eci), jnp.asarray(sigma), jnp.ones(3, bool)
    )
    weight = 1.0 / sigma**2
    best = Rotation.from_quat(quest(jnp.asarray(body), jnp.asarray(eci), jnp.asarray(weight)), scalar_first=True)
    other = Rotation.align_vectors(eci, body, weights=weight)[0]
    found = Rotation.from_quat(np.asarray(belief.quaternion), scalar_first=True)
    # Second order in errors of 1e-4.
    assert max((found.inv() * each).magnitude() for each in (best, other)) < 1e-7
    b = other.inv().apply(eci)
    expected = np.linalg.inv(np.einsum("k,kij->ij", weight, np.eye(3) - b[:, :, None] * b[:, None, :]))
    np.testing.assert_allclose(belief.covariance[:3, :3], expected, rtol=1e-3, atol=1e-3 * np.max(expected))
    # Six numbers with three unknowns leave three.
    assert estimate.freedom == 6.0 and 0.0 < estimate.surprise < stats.chi2.ppf(1.0 - 1e-6, 3)


def test_errors_of_triad_are_those_of_shuster_and_oh():
    rng = np.random.default_rng(5)
    eci, sigma = units(rng, 2), np.array([0.002, 0.01])
    true = Rotation.random(rng=rng)
    turned = Rotation.from_rotvec(np.repeat(sigma, 10_000)[:, None] * rng.normal(size=(20_000, 3)))
    body = turned.apply(np.repeat(true.inv().apply(eci), 10_000, axis=0)).reshape(2, -1, 3)
    found = quick(jax.vmap(triad, in_axes=(0, 0, None, None)))(*map(jnp.asarray, (*body, *eci)))
    off = (true.inv() * Rotation.from_quat(np.asarray(found), scalar_first=True)).as_rotvec()
    expected = np.asarray(quick(triad_covariance)(jnp.asarray(true.inv().apply(eci)), jnp.asarray(sigma)))
    ratio = np.linalg.solve(np.linalg.cholesky(expected), off.T)
    np.testing.assert_allclose(np.cov(ratio), np.eye(3), atol=0.06)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 0.0])
def test_a_reading_that_is_lost_says_nothing(bad):
    rng = np.random.default_rng(2)
    true, body, eci = seen(rng, 1e-2)
    q, sigma = jnp.asarray(true.as_quat(scalar_first=True)), jnp.full(VECTORS, 1e-2)
    told = jnp.array([True, True, False])
    expected = corrected_from(q, jnp.asarray(body), jnp.asarray(eci), sigma, told)
    spoilt = body.copy()
    spoilt[2] = bad
    # Whether or not it is said to be known.
    for known in (told, jnp.ones(VECTORS, bool)):
        for left, right in zip(
            jax.tree.leaves(corrected_from(q, jnp.asarray(spoilt), jnp.asarray(eci), sigma, known)),
            jax.tree.leaves(expected),
            strict=True,
        ):
            np.testing.assert_array_equal(left, right)


def test_slopes_are_those_of_differences_with_readings_lost():
    rng = np.random.default_rng(3)
    true, body, eci = seen(rng, 1e-2)
    body[2] = np.nan
    q = true.as_quat(scalar_first=True)
    mix = jnp.asarray(rng.normal(size=4))

    def end(numbers):
        """A number of the belief after an update, by noise of the gyro and of the sensors and by the rate."""
        walk, sigma, rate = numbers[0], numbers[1], numbers[2:5]
        own = AttitudeFilter(GyroErrors(walk, 1e-4), looks=2)
        belief = own.start(q, sigma_rad=0.05, bias_sigma_rad_s=0.01)
        star = (jnp.full(4, jnp.nan), jnp.full(3, 1e-3))
        readings = AttitudeReadings(
            rate, jnp.asarray(body), jnp.asarray(eci), sigma * jnp.ones(3), jnp.ones(3, bool), *star
        )
        belief, _ = own.update(belief, readings, 0.5)
        return mix @ belief.quaternion + jnp.sum(belief.bias) + 1e3 * jnp.trace(belief.covariance)

    at = jnp.array([1e-2, 2e-2, 0.3, -0.2, 0.1])
    both = quick(jax.value_and_grad(end))
    slope = np.asarray(both(at)[1])
    for k in range(5):
        h = 1e-5 * jnp.eye(5)[k]
        assert (both(at + h)[0] - both(at - h)[0]) / 2e-5 == pytest.approx(slope[k], rel=1e-5)


def test_what_it_says_of_its_errors_is_true():
    """NEES and NIS of 300 cases over 20 minutes with an eclipse, in the bands of 1 in 2000 for all looks together.

    The gate lets right readings pass; beside them 200 cases with 1 % of readings that are off by 20 sigmas.
    """
    # From 30 deg off: linear equations alone would be off by hundreds.
    setting = Setting(dt_s=4.0, orbit_s=1200.0, looks=5, steps=60, shadow=(0.45, 0.85), first_deg=30.0, gate=0.9999)
    flown, gross = truth(setting, 300, 4), truth(dataclasses.replace(setting, outliers=0.01), 300, 4)
    places = {"first": 0, "first_bias": 0, "rate": 1, "body": 1, "attitude": 1, "bias": 1}
    both = {
        name: np.concatenate([flown[name], gross[name].take(range(200), axis)], axis) for name, axis in places.items()
    }
    whole = filtered(setting, flown | both)
    found = {name: value[:, :300] for name, value in whole.items()}
    share = 1.0 - 1.0 / 2000.0 / setting.looks
    for k, row in enumerate(judged(flown, found)):
        low, high = stats.chi2.ppf([0.5 * (1.0 - share), 0.5 * (1.0 + share)], 1800.0) / 1800.0
        assert low < row["nees"] < high, (k, row)
        freedom = float(np.sum(found["freedom"][k]))
        low, high = stats.chi2.ppf([0.5 * (1.0 - share), 0.5 * (1.0 + share)], freedom) / freedom
        assert low < row["nis"] < high, (k, row)
    # In the dark the field alone leaves more open: an eclipse there is.
    sizes = [row["attitude_deg"]["told"] for row in judged(flown, found)]
    assert max(sizes[2:4]) > 1.5 * sizes[1]
    # The same cases with and without; of the first updates a few take an outlier, refuse what is right, begin anew.
    clean, spoilt = (np.sqrt(np.mean(whole["made"][:, part] ** 2, axis=1)) for part in (slice(200), slice(300, 500)))
    assert np.all(spoilt < 1.2 * clean)


@quick
def directions_passing(covariance, body, eci, sigma):
    readings = AttitudeReadings(jnp.zeros(3), body, eci, sigma, jnp.ones(len(body), bool))
    return passing(jnp.array([1.0, 0.0, 0.0, 0.0]), covariance, readings, 0.99)


def test_the_gate_is_an_ellipse_across_the_direction():
    """Against two by two matrices of NumPy, for errors about the edge; what is opposite does not pass."""
    rng = np.random.default_rng(6)
    count, root = 2000, 0.02 * rng.normal(size=(3, 3))
    covariance, sigma, eci = root @ root.T, rng.uniform(0.01, 0.05, 2000), units(rng, 2000)
    turned = Rotation.from_rotvec(rng.multivariate_normal(np.zeros(3), 9.0 * covariance + 0.005 * np.eye(3), count))
    body = turned.apply(eci)
    expected = []
    for b, p, s in zip(body, eci, sigma, strict=True):
        across = np.linalg.svd(p[None])[2][1:]
        apart = across @ np.cross(b, p)
        apart *= np.linalg.norm(b - p) / np.linalg.norm(apart)
        within = across @ (covariance + (s**2 + 0.75 * np.trace(covariance) ** 2) * np.eye(3)) @ across.T
        expected.append(apart @ np.linalg.solve(within, apart))
    edge = stats.chi2.ppf(0.99, 2)
    assert 0.2 < np.mean(np.array(expected) < edge) < 0.8
    there, passed = directions_passing(*map(jnp.asarray, (covariance, body, eci, sigma)))
    np.testing.assert_array_equal(passed, np.array(expected) < edge)
    _, opposite = directions_passing(*map(jnp.asarray, (covariance, -eci, eci, sigma)))
    assert np.all(there) and not np.any(opposite)


def test_a_filter_that_refuses_everything_begins_anew():
    """120 deg away from what is believed to 0.1 deg: two readings are refused, and with the third all is open."""
    own = AttitudeFilter(GyroErrors(1e-4), gate=0.9999, patience=3)
    belief = own.start([1.0, 0.0, 0.0, 0.0], sigma_rad=2e-3, bias_sigma_rad_s=1e-4)
    far = jnp.array([0.5, 0.5, 0.5, 0.5])
    none = (jnp.zeros(3), jnp.zeros((0, 3)), jnp.zeros((0, 3)), jnp.zeros(0), jnp.zeros(0, bool))

    @quick
    def run(belief):
        return jax.lax.scan(
            lambda b, _: own.update(b, AttitudeReadings(*none, far, 1e-3 * jnp.ones(3)), 1.0), belief, None, 12
        )

    after, seen = run(belief)
    np.testing.assert_array_equal(seen.refused[:4], [1.0, 1.0, 0.0, 0.0])
    np.testing.assert_array_equal(seen.freedom[:4], [0.0, 0.0, 3.0, 3.0])
    np.testing.assert_allclose(after.quaternion, far, atol=1e-3)
    assert float(after.refusals) == 0.0
    with pytest.raises(ValueError, match="gate must be a probability"):
        AttitudeFilter(GyroErrors(1e-4), gate=1.0)


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"sigma_rad": 0.0, "bias_sigma_rad_s": 1.0}, "sigma_rad must be above zero"),
        ({"sigma_rad": 1.0, "bias_sigma_rad_s": -1.0}, "bias_sigma_rad_s must be above zero"),
    ],
)
def test_what_makes_no_sense_is_said(settings, expected):
    with pytest.raises(ValueError, match=expected):
        estimator.start([1.0, 0.0, 0.0, 0.0], **settings)
    with pytest.raises(ValueError, match="angle_random_walk must be a number of at least zero"):
        GyroErrors(-1.0)
