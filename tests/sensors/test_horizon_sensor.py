"""Horizon sensor: closed harmonics against SciPy's quadrature of the scan, the numbers of the paper, awkward points."""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from jaxsat.sensors.horizon_sensor import (
    HorizonSensor,
    band_harmonics,
    chord_of_disk,
    chord_on_scan,
    halved_harmonics,
    normalised_output,
    present,
    ramp_harmonics,
    scan_harmonics,
    step_harmonics,
)

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
THETA = math.radians(12.0)
OFFSETS = np.radians([-11.99, -9.0, -3.0, 0.0, 0.5, 4.0, 8.0, 11.9])


def integrated(signal, breaks):
    """Both harmonics of a signal of the scan angle by adaptive quadrature over a swing, given where it breaks."""
    points = [-0.5 * math.pi, *sorted(math.asin(b / THETA) for b in breaks if abs(b) < THETA), 0.5 * math.pi]

    def over(weight):
        pairs = zip(points[:-1], points[1:], strict=True)
        parts = (quad(lambda a: signal(THETA * math.sin(a)) * weight(a), *ab, epsabs=1e-13) for ab in pairs)
        return 2.0 / math.pi * sum(part[0] for part in parts)

    return over(math.sin), over(lambda a: math.cos(2.0 * a))


def test_a_step_horizon_has_the_published_harmonics():
    first, second = quick(lambda x: step_harmonics(x, THETA, 3.0))(jnp.asarray(OFFSETS))
    root = np.sqrt(1.0 - (OFFSETS / THETA) ** 2)
    np.testing.assert_allclose(first, 2.0 / math.pi * 3.0 * root, atol=1e-12)
    np.testing.assert_allclose(second, -2.0 / math.pi * 3.0 * OFFSETS / THETA * root, atol=1e-12)
    np.testing.assert_allclose(quick(normalised_output)(first, second), -OFFSETS / THETA, atol=1e-12)
    expected = [integrated(lambda s, x=x: 3.0 * (s > x), [x]) for x in OFFSETS]
    np.testing.assert_allclose(np.stack([first, second], axis=1), expected, atol=1e-9)


def test_a_band():
    begin, end = np.array([-1.0, -1.0, -0.7, 0.3, 0.5, 0.4]), np.array([1.0, 0.4, 0.2, 1.0, 0.5001, 0.4])
    found = quick(lambda b, e: band_harmonics(b, e, 2.0))(jnp.asarray(begin), jnp.asarray(end))
    for k, (b, e) in enumerate(zip(begin * THETA, end * THETA, strict=True)):
        expected = integrated(lambda s, b=b, e=e: 2.0 * (b < s < e), [b, e])
        assert (float(found[0][k]), float(found[1][k])) == pytest.approx(expected, abs=1e-9)


def test_a_soft_limb():
    outer, inner = np.radians([[-2.0, 5.0, 11.5, -13.0, -20.0], [2.0, 6.0, 12.5, -11.0, 20.0]])
    found = quick(lambda o, i: ramp_harmonics(o, i, THETA))(jnp.asarray(outer), jnp.asarray(inner))
    for k, (o, i) in enumerate(zip(outer, inner, strict=True)):
        expected = integrated(lambda s, o=o, i=i: min(max((s - o) / (i - o), 0.0), 1.0), [o, i])
        assert (float(found[0][k]), float(found[1][k])) == pytest.approx(expected, abs=1e-9)


def test_the_sum_over_samples_is_the_closed_form():
    # A smooth signal, for which sums over a period are exact: U = v gives A1 = 1; U = v^2 gives A2 = -1/2.
    v = jnp.asarray(np.sin(2.0 * np.pi * np.arange(64) / 64))
    first, second = quick(scan_harmonics)(jnp.stack([v, v * v]))
    np.testing.assert_allclose(first, [1.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(second, [0.0, -0.5], atol=1e-14)


@pytest.mark.parametrize("disk_deg", [54.0, 62.7, 70.2])
def test_the_chord_of_the_disk_is_where_the_line_of_sight_meets_it(disk_deg):
    """Against the angle between the line of sight and the nadir, for any nadir."""
    rho = math.radians(disk_deg)
    nadirs = np.random.default_rng(0).normal(size=(500, 3))
    nadirs /= np.linalg.norm(nadirs, axis=1)[:, None]
    begin, end = quick(chord_of_disk)(jnp.asarray(nadirs[:, 0]), jnp.asarray(nadirs[:, 1]), math.cos(rho))
    met = np.asarray(end > begin)
    assert 0.5 < met.mean() < 1.0
    for edge in (np.asarray(begin)[met], np.asarray(end)[met]):
        sight = np.stack([np.cos(edge), np.sin(edge), np.zeros_like(edge)], axis=1)
        np.testing.assert_allclose(np.sum(sight * nadirs[met], axis=1), math.cos(rho), atol=1e-12)
    # And that nothing in between is out of it, nor anything in it where no chord is found.
    angles = np.linspace(-math.pi, math.pi, 721)
    cosine = np.cos(angles)[:, None] * nadirs[:, 0] + np.sin(angles)[:, None] * nadirs[:, 1]
    assert not np.any(cosine[:, ~met] > math.cos(rho))
    np.testing.assert_allclose(
        np.mean(cosine[:, met] > math.cos(rho), axis=0) * 2 * math.pi, (end - begin)[met], atol=0.02
    )


@pytest.mark.parametrize("disk_deg", [54.0, 62.7, 77.0])
def test_the_short_way_to_the_chord_is_the_exact_one(disk_deg):
    rho = math.radians(disk_deg)
    nadirs = np.random.default_rng(1).normal(size=(3, 4000))
    nadirs /= np.linalg.norm(nadirs, axis=0)
    along = jnp.asarray(nadirs[0]), jnp.asarray(nadirs[1])
    exact = [np.clip(edge / THETA, -1.0, 1.0) for edge in quick(chord_of_disk)(*along, math.cos(rho))]
    found = [np.asarray(edge) for edge in quick(chord_on_scan)(*along, math.cos(rho), THETA)]
    met = exact[1] > exact[0]
    assert 300 < met.sum() < 3000 and np.sum((exact[0] > -1.0) & met) > 100
    np.testing.assert_array_equal(found[1] > found[0], met)
    np.testing.assert_allclose(np.stack(found)[:, met], np.stack(exact)[:, met], atol=1e-9)


def test_two_halves_are_two_bands():
    low, middle, high = jnp.asarray(np.sort(np.random.default_rng(2).uniform(-1.0, 1.0, (3, 50)), axis=0))
    outer, inner = jnp.linspace(25.0, 60.0, 50), jnp.linspace(60.0, 40.0, 50)
    band, halved = quick(band_harmonics), quick(halved_harmonics)
    bands = np.stack(band(low, middle, outer)) + np.stack(band(middle, high, inner))
    np.testing.assert_allclose(np.stack(halved(low, middle, high, outer, inner)), bands, atol=1e-12)


def test_presence_is_signalled_to_the_published_offsets():
    """|x| < 11.30 deg by the printed threshold, 11.13 deg by the corrected one, at the least brightness."""
    dimmest = 25.0
    look = quick(lambda sensor, x: present(sensor, step_harmonics(x, THETA, dimmest)[0]))
    for ratio, limit_deg in ((0.336188, 11.30), (0.374319, 11.13)):
        sensor = HorizonSensor(math.radians(62.68), THETA, ratio * 2.0 / math.pi * dimmest)
        x = jnp.radians(jnp.array([limit_deg - 0.01, limit_deg + 0.01, -limit_deg + 0.01, -limit_deg - 0.01]))
        assert look(sensor, x).tolist() == [True, False, True, False]


@pytest.mark.slow
def test_slopes_are_those_of_finite_differences():
    def both(x, width):
        step = jnp.stack(step_harmonics(x, THETA, 2.0))
        soft = jnp.stack(ramp_harmonics(x, x + width, THETA))
        band = jnp.stack(band_harmonics(jnp.clip(x / THETA, -1.0, 0.9), jnp.asarray(0.95), 2.0 + x))
        chord = jnp.stack(chord_of_disk(jnp.cos(5.0 * x), jnp.sin(5.0 * x) * (1.0 - width), 0.45))
        short = jnp.stack(chord_on_scan(jnp.cos(1.1 + x), jnp.sin(1.1 + x) * (1.0 - width), 0.45, 0.25))
        halves = jnp.stack(halved_harmonics(jnp.asarray(-0.9), x, jnp.asarray(0.8), 2.0 + x, 3.0 - width))
        return jnp.concatenate([step, soft, band, chord, short, halves])

    x, width, h = jnp.radians(jnp.array([-13.0, -5.0, 0.0, 3.0, 11.99, 14.0])), jnp.full(6, 0.01), 1e-6
    value = quick(jax.vmap(both))
    slopes = quick(jax.vmap(jax.jacfwd(both, argnums=(0, 1))))(x, width)
    differences = (
        (value(x + h, width) - value(x - h, width)) / (2 * h),
        (value(x, width + h) - value(x, width - h)) / (2 * h),
    )
    for slope, difference in zip(slopes, differences, strict=True):
        np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-5)


def test_awkward_points_are_finite():
    def slopes(one, half, zero):
        return (
            jax.grad(lambda x: step_harmonics(x, THETA)[0])(THETA * one),
            *jax.grad(lambda b, e: sum(band_harmonics(b, e, e)), argnums=(0, 1))(one, one),
            *jax.grad(lambda c, s: sum(chord_of_disk(c, s, 0.5)), argnums=(0, 1))(half, zero),
            *jax.grad(lambda c, s: sum(chord_of_disk(c, s, 0.5)), argnums=(0, 1))(zero, zero),
            *jax.grad(lambda c, s: sum(chord_on_scan(c, s, 0.5, THETA)), argnums=(0, 1))(half, zero),
            *jax.grad(lambda c, s: sum(chord_on_scan(c, s, 0.5, THETA)), argnums=(0, 1))(zero, zero),
            *jax.grad(lambda b, e: sum(halved_harmonics(-b, zero, b, e, e)), argnums=(0, 1))(one, one),
            jax.grad(lambda a: normalised_output(a, a))(zero),
        )

    assert np.all(np.isfinite(quick(slopes)(jnp.asarray(1.0), jnp.asarray(0.5), jnp.asarray(0.0))))
