"""Reconstruction of Zhukov 2019: the published error maxima, its checks and fallbacks, its quadratic equations."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.estimation.sun.published import published_direction
from jaxsat.math.scalars import elements, over_cases
from jaxsat.sensors.sun_sensor import PyramidSunSensor

SENSOR = PyramidSunSensor()
S, C = np.sin(np.radians(22.0)), np.cos(np.radians(22.0))
EDGE, HOOD = np.cos(np.radians(83.0)), np.cos(np.radians(74.0))
DISTANCE = np.sin(np.radians(96.0)) / np.sin(np.radians(16.0))
NORMALS = np.array([[S, 0, C], [S, 0, -C], [S, C, 0], [S, -C, 0]])
NEAREST = np.radians(20.454791)
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
BATCH = 4096


@quick
@jax.vmap
def one_batch(currents):
    return published_direction(SENSOR, currents)


def reading(i):
    """Readings of [cases, 4], in batches of one size: each other would be compiled anew."""
    padded = np.concatenate([i, np.zeros((-len(i) % BATCH, 4))])
    found = [one_batch(padded[k : k + BATCH]) for k in range(0, len(padded), BATCH)]
    return jax.tree.map(lambda *x: np.concatenate(x)[: len(i)], *found)


def direction(angle_deg, azimuth_deg):
    """Directions at angles from the axis and azimuths from y toward z, eq. 8."""
    a, p = np.radians(angle_deg), np.radians(azimuth_deg)
    return np.stack(np.broadcast_arrays(np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)), axis=-1)


def forward(sun):
    """Relative currents, apart from the module: [..., 3] -> [..., 4]."""
    x = sun[..., :1]
    cosine = sun @ NORMALS.T
    shaded = DISTANCE * x / (S * x + C * np.sqrt(np.maximum(1 - x**2, 0)))
    return np.where((cosine > EDGE) & (x > 0), cosine * np.where(x < HOOD, shaded, 1.0), 0.0)


def errors_deg(angle_deg, azimuth_deg):
    """True less found angle from the axis, and the size of the error in azimuth."""
    found = reading(forward(direction(angle_deg, azimuth_deg).reshape(-1, 3))).direction
    angle, azimuth = (np.broadcast_to(x, np.broadcast(angle_deg, azimuth_deg).shape) for x in (angle_deg, azimuth_deg))
    found = found.reshape(*angle.shape, 3)
    angle_error = angle - np.degrees(np.arctan2(np.hypot(found[..., 1], found[..., 2]), found[..., 0]))
    turn = azimuth - np.degrees(np.arctan2(found[..., 2], found[..., 1]))
    return angle_error, abs((turn + 180.0) % 360.0 - 180.0)


AROUND = np.arange(0.0, 360.0, 0.025)


@pytest.mark.parametrize(
    ("angle", "largest"),
    [
        (61.0, 1.485512),
        (66.0, 11.485512),
        (71.0, 21.485512),
        (74.0, 27.485512),
        (79.0, 11.0),
        (84.0, 6.0),
        (89.0, 1.0),
    ],
)
def test_largest_error_of_the_viewing_angle(angle, largest):
    error, _ = errors_deg(angle, AROUND)
    assert np.max(abs(error)) == pytest.approx(largest, abs=5e-7)
    # Up to 71 deg the angle found is too small where it is wrong; past 78.2 deg it is 90 deg all around.
    if angle <= 71.0:
        assert np.min(error) > -1e-9
    if angle > 78.2:
        np.testing.assert_allclose(error, -largest, atol=1e-9)


def test_largest_error_of_all():
    """The plus is taken as long as it gives more than 20.455 deg: at 78.1477 deg that ends, last near 25.404 deg."""
    azimuth = np.arange(25.3, 25.5, 1e-4)
    below, above = (np.max(abs(errors_deg(78.147661 + more, azimuth)[0])) for more in (0.0, 3e-5))
    assert below == pytest.approx(57.69287, abs=5e-6)
    assert above == pytest.approx(90.0 - 78.147691, abs=1e-9)
    angles = np.linspace(60.0, 90.0, 301)[:-1]
    largest = np.max(abs(errors_deg(angles[:, None], AROUND[::20][None])[0]), axis=1)
    assert np.max(largest) < 57.69290 and angles[np.argmax(largest)] == pytest.approx(78.05, abs=0.06)


def test_largest_error_of_the_azimuth():
    assert np.max(errors_deg(71.0, np.arange(0.0, 90.0, 1e-3))[1]) == pytest.approx(4.220953, abs=1e-6)
    assert np.max(errors_deg(78.1476, np.arange(25.3, 25.5, 1e-4))[1]) == pytest.approx(25.40, abs=0.005)
    beyond = np.max(errors_deg(np.arange(79.0, 89.99, 0.25)[:, None], AROUND[None, ::4])[1], axis=1)
    assert np.all(beyond < 7.55) and beyond[-4] > 7.0


def test_exact_within_the_first_three_ranges():
    angles = np.concatenate([np.linspace(0.0, 60.25, 400), [14.999, 15.0, 20.45, 20.46]])
    sun = direction(angles[:, None], AROUND[::30][None]).reshape(-1, 3)
    found = reading(forward(sun)).direction
    # Near 60.26 deg between two faces both solutions meet, where rounding enters by its root.
    np.testing.assert_allclose(found, sun, atol=1e-12)


def test_half_widths_of_the_exact_zones():
    """About the four azimuths across the faces; by bisection, all at once."""
    angles = np.array([61.0, 66.0, 71.0])[:, None, None] * np.ones((3, 4, 2))
    middle = np.array([0.0, 90.0, 180.0, 270.0])[None, :, None] * np.ones((3, 4, 2))
    # Where both solutions meet the error grows evenly from zero, with rounding's root below: seen from two sizes of it.
    size = np.array([1e-4, 2e-4])
    for side in (-1.0, 1.0):
        inside, outside = np.zeros((3, 4, 2)), np.full((3, 4, 2), 45.0)
        for _ in range(34):
            half = 0.5 * (inside + outside)
            exact = abs(errors_deg(angles, middle + side * half)[0]) < size
            inside, outside = np.where(exact, half, inside), np.where(exact, outside, half)
        expected = np.array([30.959464, 6.188955, 2.743534])[:, None] * np.ones(4)
        found = 2 * inside[..., 0] - inside[..., 1]
        np.testing.assert_allclose(found, expected, atol=1.5e-5)
        # Closer: both meet where cos(azimuth - 45 deg) = cot 22 / (sqrt 2 tan angle). At 71 deg it is the minus' end.
        meeting = 45.0 - np.degrees(np.arccos(C / S / np.sqrt(2) / np.tan(np.radians(angles[:2, :, 0]))))
        np.testing.assert_allclose(found[:2], meeting, atol=1e-6)


def test_quadratic_equations_as_corrected():
    """Eqs. 14 and 20 by companion matrices: i1^2 + i3^2 - cos^2 22 is the free term, the root of 20 that of Z."""
    rng = np.random.default_rng(2)
    for angle, azimuth in zip(rng.uniform(21.0, 60.0, 20), rng.uniform(20.0, 70.0, 20), strict=True):
        i1, _, i3, _ = i = forward(direction(angle, azimuth))
        if np.count_nonzero(i) != 2:
            continue
        roots = np.roots([1 + S**2, -2 * (i1 + i3) * S, i1**2 + i3**2 - C**2])
        np.testing.assert_allclose(reading(i[None]).direction[0, 0], roots.max(), atol=1e-12)
    for i1 in (0.99, 0.96, C + 1e-6):
        found = reading(np.array([[i1, 0, 0, 0]])).direction[0]
        z = np.roots([1.0, -2 * i1 * C, i1**2 - S**2]).max()
        assert z == pytest.approx(i1 * C + S * np.sqrt(1 - i1**2), abs=1e-12)
        np.testing.assert_allclose(found, [(i1 - z * C) / S, 0.0, z], atol=1e-9)


def test_fallbacks_of_two_currents():
    """Minus where plus leaves the quarter; the plane of the base, of unit length, where minus does too."""
    sun = direction(71.0, 2.0)
    found = reading(forward(sun)[None]).direction[0]
    np.testing.assert_allclose(found, sun, atol=1e-12)
    i = forward(direction(84.0, 30.0))
    found = reading(i[None]).direction[0]
    np.testing.assert_allclose(found, [0.0, i[2] / np.hypot(i[0], i[2]), i[0] / np.hypot(i[0], i[2])], atol=1e-12)


def test_one_none_and_opposite_currents():
    found = reading(np.array([[0.5, 0, 0, 0], [0, 0, 0, 0.97], [0, 0, 0, 0], [0.4, 0.5, 0, 0], [0, 0, 0.3, 0.2]]))
    np.testing.assert_array_equal(found.lit, [1, 1, 0, 2, 2])
    # Shaded, its X would be negative: it is zero.
    np.testing.assert_allclose(found.direction[0], [0.0, 0.0, 1.0], atol=1e-15)
    assert found.direction[1, 1] < 0.0 and found.direction[1, 2] == 0.0
    np.testing.assert_array_equal(found.direction[2], [1.0, 0.0, 0.0])
    opposite = np.array([[0.9 / (2 * S), 0.0, -0.1 / (2 * C)], [0.5 / (2 * S), 0.1 / (2 * C), 0.0]])
    np.testing.assert_allclose(found.direction[3:], opposite / np.linalg.norm(opposite, axis=1)[:, None], atol=1e-15)


@pytest.mark.parametrize("off", [1.0, -1.0])
def test_of_four_currents_the_faintest_is_left_out(off):
    """What is wrong with it, as long as it stays the faintest, does not matter."""
    sun = direction(11.0, 70.0)
    i = forward(sun)
    i[np.argmin(i)] += 0.03 * off
    np.testing.assert_allclose(reading(i[None]).direction[0], sun, atol=1e-14)


def test_threshold_takes_faint_currents_for_none():
    i = jnp.asarray(forward(direction(40.0, 60.0)) + 0.004) * 0.02
    sensor = PyramidSunSensor(max_current=0.02)
    found = quick(lambda threshold: published_direction(sensor, i, threshold=threshold))
    assert int(found(0.0).lit) == 4 and int(found(0.01 * 0.02).lit) == 2


def by_search(i):
    """What the paper's words ask for, found on a grid of directions of a sensor without hood and then refined."""
    lit = np.flatnonzero(i > 0)
    if lit.size == 1:
        angle = np.radians(np.linspace(68.0, 90.0, 22001))
        plane = np.cos(angle)[:, None] * [1.0, 0, 0] + np.sin(angle)[:, None] * NORMALS[lit[0]] * [0, 1 / C, 1 / C]
        return plane[np.argmin(abs(plane @ NORMALS[lit[0]] - i[lit[0]]))]
    grid = GRID[np.max(abs(GRID @ NORMALS[lit].T - i[lit]), axis=1) < 0.04]
    for _ in range(60):
        # Newton's steps for the lit currents and unit length; where both solutions meet they only halve the error.
        value = np.concatenate([grid @ NORMALS[lit].T - i[lit], np.sum(grid**2, axis=1, keepdims=True) - 1], axis=1)
        slope = np.concatenate([np.broadcast_to(NORMALS[lit], (len(grid), lit.size, 3)), 2 * grid[:, None]], axis=1)
        grid = grid - np.einsum("nij,nj->ni", np.linalg.pinv(slope), value)
    exact = np.max(abs(grid @ NORMALS[lit].T - i[lit]), axis=1, initial=0) + abs(np.linalg.norm(grid, axis=1) - 1)
    grid = grid[exact < 1e-9]
    if lit.size == 2:
        toward = np.sign(NORMALS[lit, 1:].sum(axis=0))
        grid = grid[(grid[:, 0] >= 0) & (grid[:, 0] < np.cos(NEAREST)) & np.all(grid[:, 1:] * toward > 0, axis=1)]
        if not len(grid):
            base = np.concatenate([[0.0], toward * [i[2:].sum(), i[:2].sum()]])
            return base / np.linalg.norm(base)
    return grid[np.argmax(grid[:, 0])]


GRID = direction(np.arange(0.0, 100.0, 1.0)[:, None], np.arange(0.0, 360.0, 2.0)[None]).reshape(-1, 3)


def test_against_a_search_over_all_directions():
    rng = np.random.default_rng(3)
    angle, azimuth = np.degrees(np.arccos(rng.uniform(0.0, 1.0, 60))), rng.uniform(0, 360, 60)
    along = direction(np.array([72.0, 73.0, 76.0]), 90.0 * np.arange(3) + 1.0)
    i = forward(np.concatenate([direction(angle, azimuth), along, [[1.0, 0, 0]]]))
    found = reading(i).direction
    expected = np.array([by_search(each) for each in i])
    # The line of a single face is searched in steps of 0.001 deg.
    tolerance = np.where(np.count_nonzero(i, axis=1) == 1, 2e-5, 1e-8)
    assert np.all(np.max(abs(found - expected), axis=1) < tolerance)
    assert np.bincount(np.count_nonzero(i, axis=1), minlength=5)[1:].min() >= 1


@pytest.mark.slow
def test_slopes():
    """Where it is exact the Sun's own direction comes back; elsewhere differences agree; on edges all is finite."""
    exact = direction(
        np.array([0.0, 10, 18, 18, 40, 50, 55, 10, 17, 30]), np.array([0.0, 93, 183, 3, 3, 93, 40, 0, 90, 180])
    )
    wrong = direction(np.array([64.0, 69.0, 76.0, 85.0, 73.0, 81.0]), np.array([40.0, 44, 30, 50, 91, 180]))
    edges = direction(np.array([15.0, 20.454791, 60.257244, 74, 78.147661, 90]), 45.0)
    odd = np.array([[1.0, 0, 0, 0], [2.0, 0, 0, 0], [1.0, 0, 1.0, 0], [0.5, 0.5, 0, 0], [0.0, 0, 0, 0]])
    i = np.concatenate([forward(exact), forward(wrong), forward(edges), odd])
    slope = np.asarray(quick(jax.vmap(jax.jacrev(lambda i: published_direction(SENSOR, i).direction)))(i))
    assert np.all(np.isfinite(slope))
    slope = slope * (i > 0)[:, None, :]
    along = np.eye(3) - exact[:, :, None] * exact[:, None, :]
    np.testing.assert_allclose(slope[: len(exact)] @ NORMALS @ along, along, atol=1e-9)
    i, h = forward(wrong), 1e-7
    steps = h * np.eye(4) * (i > 0)[:, None, :]
    ends = [[reading(i + side * steps[:, k]).direction for side in (1, -1)] for k in range(4)]
    difference = np.stack([(plus - minus) / (2 * h) for plus, minus in ends], axis=-1)
    np.testing.assert_allclose(slope[len(exact) : len(exact) + len(wrong)], difference, atol=1e-6)


def test_replayed_over_cases():
    i = forward(direction(np.linspace(0.0, 91.0, 50), 37.0 * np.arange(50)))
    replayed = over_cases(lambda x: published_direction(SENSOR, x), jax.ShapeDtypeStruct((4,), float))

    def by_elements(x):
        found = replayed(elements(x.T, element_rank=1))
        return jnp.stack(list(found.direction), axis=-1), found.lit[()]

    found, lit = quick(by_elements)(jnp.asarray(i))
    expected = reading(i)
    np.testing.assert_array_equal(lit, expected.lit)
    np.testing.assert_allclose(found, expected.direction, atol=1e-14)
