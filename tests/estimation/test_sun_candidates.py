"""Directions that explain the currents: the truth is among them, nothing is missed, slopes, dead faces, noise."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.estimation.sun.candidates import sun_candidates
from jaxsat.math.scalars import elements, over_cases
from jaxsat.sensors.sun_sensor import PyramidSunSensor

SENSOR = PyramidSunSensor()
S, C = np.sin(np.radians(22.0)), np.cos(np.radians(22.0))
EDGE, HOOD = np.cos(np.radians(83.0)), np.cos(np.radians(74.0))
DISTANCE = np.sin(np.radians(96.0)) / np.sin(np.radians(16.0))
NORMALS = np.array([[S, 0, C], [S, 0, -C], [S, C, 0], [S, -C, 0]])
ALL = np.ones(4, bool)
BATCH = 4096
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})


@quick
@functools.partial(jax.vmap, in_axes=(0, 0, None, None, None, None))
def one_batch(currents, expected, alive, threshold, tolerance, brightest):
    sensor = PyramidSunSensor(max_current=brightest)
    return sun_candidates(sensor, currents, expected, alive=alive, threshold=threshold, tolerance=tolerance)


def candidates(i, expected, alive=ALL, threshold=0.0, tolerance=0.0, brightest=1.0):
    """Candidates of [cases, 4], in batches of one size: each other would be compiled anew."""
    fill = ((0, -len(i) % BATCH), (0, 0))
    i, expected, cases = np.pad(i, fill), np.pad(expected, fill), len(i)
    parts = [slice(k, k + BATCH) for k in range(0, len(i), BATCH)]
    found = [one_batch(i[part], expected[part], alive, threshold, tolerance, brightest) for part in parts]
    return jax.tree.map(lambda *x: np.concatenate(x)[:cases], *found)


def direction(angle_deg, azimuth_deg):
    """Directions at angles from the axis and azimuths from y toward z."""
    a, p = np.radians(angle_deg), np.radians(azimuth_deg)
    return np.stack(np.broadcast_arrays(np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)), axis=-1)


def share(x):
    shaded = DISTANCE * x / (S * x + C * np.sqrt(np.maximum(1 - x**2, 0)))
    return np.where(x < HOOD, shaded, 1.0)


def forward(sun, alive=ALL):
    """Relative currents, apart from the module: [..., 3] -> [..., 4]."""
    x, cosine = sun[..., :1], sun @ NORMALS.T
    return np.where((cosine > EDGE) & (x > 0) & alive, cosine * share(x), 0.0)


def random_suns(count, seed):
    """Evenly over the whole field of view."""
    rng = np.random.default_rng(seed)
    x, azimuth = rng.uniform(0.0, 1.0, count), rng.uniform(0.0, 360.0, count)
    return direction(np.degrees(np.arccos(x)), azimuth)


def apart_deg(a, b):
    return np.degrees(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def nearest_deg(found, sun):
    return np.min(np.where(found.possible, apart_deg(found.direction, sun[:, None]), np.inf), axis=1)


PATTERNS = [(1, 1, 1, 1), (0, 1, 1, 1), (1, 1, 1, 0), (0, 0, 1, 1), (0, 1, 0, 1), (1, 1, 0, 0), (0, 0, 0, 1)]


@pytest.mark.slow
@pytest.mark.parametrize("alive", PATTERNS)
def test_the_truth_is_always_among_them(alive):
    """To 1e-6 deg, with any faces dead; where only one is lit the component across it, or azimuth, is given."""
    alive = np.array(alive, bool)
    sun = random_suns(5 * BATCH, 4)
    i = forward(sun, alive)
    found = candidates(i, sun, alive)
    lit = np.count_nonzero(i, axis=1)
    np.testing.assert_array_equal(found.lit, lit)
    assert np.max(nearest_deg(found, sun)[lit > 0]) < 1e-6
    # Whatever is called possible explains the currents, as far as rounding at the fold of two solutions allows.
    explained = np.max(abs(forward(found.direction, alive) - i[:, None]), axis=2)
    assert np.max(np.where(found.possible, explained, 0.0)) < 1e-6 or not alive.all()
    assert np.all(found.possible.sum(axis=1)[lit >= 3] == 1)
    if alive.all():
        assert set(found.possible.sum(axis=1)) == {1, 2} and np.all(found.possible.sum(axis=1)[lit == 1] == 1)
    nothing = lit == 0
    assert not np.any(found.possible[nothing]) and np.all(found.direction[nothing] == [1.0, 0.0, 0.0])


def test_a_single_face_leaves_the_component_across_it_to_what_is_expected():
    """Unshaded the component itself, shaded the azimuth; from the axis the plane of the face; no farther than dark."""
    rng = np.random.default_rng(5)
    sun = direction(rng.uniform(71.1, 89.0, 300), 90.0 * rng.integers(0, 4, 300) + rng.uniform(-7.0, 7.0, 300))
    i = forward(sun)
    sun, i = sun[np.count_nonzero(i, axis=1) == 1], i[np.count_nonzero(i, axis=1) == 1]
    assert 100 < len(sun)
    across = 1 + (np.argmax(i, axis=1) >= 2)
    rows = np.arange(len(sun))
    for expected in (np.array([1.0, 0.0, 0.0]), direction(80.0, 93.0), direction(80.0, 45.0), direction(30.0, 181.0)):
        found = candidates(i, np.broadcast_to(expected, sun.shape))
        best = found.direction[rows, np.argmax(found.possible, axis=1)]
        # The face beside it at the very angle of total reflection, where rounding lights it or does not.
        np.testing.assert_allclose(np.where(i > 0, forward(best), 0.0), i, atol=2e-7)
        assert np.max(np.where(i > 0, 0.0, best @ NORMALS.T)) < EDGE + 1e-7
        wanted = expected[across]
        shaded = best[:, 0] < HOOD
        wanted = np.where(shaded, wanted / max(np.hypot(*expected[1:]), 1e-9) * np.sqrt(1 - best[:, 0] ** 2), wanted)
        # The face beside it lights up at this component.
        limit = (EDGE - best[:, 0] * S) / C
        np.testing.assert_allclose(best[rows, across], np.clip(wanted, -limit, limit), atol=1e-6)


def explanations(i, expected, alive):
    """All directions that explain the currents of one instant: those of a grid, refined, held against the model.

    Newton's method on numerical slopes for the lit currents, unit length and, with a single face, what is expected
    across it; with and without shade.
    """
    lit = np.flatnonzero(i > 0)
    across = 1 + (lit[0] >= 2)
    found = []
    for shaded in (False, True):

        def residual(v, shaded=shaded):
            x = v[:, :1]
            length = np.sqrt(np.sum(v[:, 1:] ** 2, axis=1, keepdims=True))
            part = DISTANCE * x / (S * x + C * length) if shaded else 1.0
            rows = [part * (v @ NORMALS[lit].T) - i[lit], np.sum(v**2, axis=1, keepdims=True) - 1]
            if lit.size == 1:
                sine = expected[across] / np.hypot(*expected[1:]) * length if shaded else expected[across]
                rows.append(v[:, across : across + 1] - sine)
            return np.concatenate(rows, axis=1)

        v = GRID[np.max(abs(residual(GRID)), axis=1) < 0.08]
        for _ in range(14):
            ends = [(residual(v + 1e-6 * e) - residual(v - 1e-6 * e)) / 2e-6 for e in np.eye(3)]
            step = np.einsum("nij,nj->ni", np.linalg.pinv(np.stack(ends, axis=-1)), residual(v))
            v = v - step * np.minimum(1.0, 0.1 / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9))
        found.append(v[(np.max(abs(residual(v)), axis=1) < 1e-10) & (v[:, 0] > 0)])
    v = np.concatenate(found)
    v = v[np.max(abs(forward(v, alive) - i), axis=1, initial=0) < 1e-9]
    kept = []
    for each in v:
        if all(apart_deg(each, other) > 1e-4 for other in kept):
            kept.append(each)
    return np.array(kept).reshape(-1, 3)


GRID = direction(np.arange(0.5, 90.0, 2.0)[:, None], np.arange(0.0, 360.0, 3.0)[None]).reshape(-1, 3)


@pytest.mark.parametrize(("alive", "count"), [((1, 1, 1, 1), 40), ((1, 1, 1, 0), 25), ((0, 0, 1, 1), 20)])
def test_nothing_is_missed(alive, count):
    alive = np.array(alive, bool)
    near_axes = direction(np.array([72.0, 73.5, 76.0, 84.0]), 90.0 * np.arange(4) + 2.0)
    sun = np.concatenate([random_suns(count, 6), near_axes])
    i = forward(sun, alive)
    sun, i = sun[np.any(i > 0, axis=1)], i[np.any(i > 0, axis=1)]
    found = candidates(i, sun, alive)
    several = 0
    for k, (currents, expected) in enumerate(zip(i, sun, strict=True)):
        searched = explanations(currents, expected, alive)
        given = found.direction[k][found.possible[k]]
        if np.count_nonzero(currents) == 1:
            # What is expected may lie where a neighbour would light up: then the end of the curve stands for it.
            cosine = np.where((currents > 0) | ~alive, 0.0, given @ NORMALS.T)
            given = given[np.max(cosine, axis=1) < EDGE - 1e-7]
        assert len(searched) == len(given), (expected, searched, given)
        for each in searched:
            # Where the curve of a single face turns across it rounding enters by its root.
            assert np.min(apart_deg(given, each)) < 1e-4
        several += len(searched) > 1
    assert several > count // 4


@pytest.mark.slow
def test_slopes():
    """The directions found turn with the Sun, whichever faces are lit; all is finite on edges, folds and in the dark.

    Where one face is lit the Sun's own component across it is handed on as expected.
    """
    angles = np.array([0.0, 8, 14, 18, 18, 40, 50, 58, 62, 65, 69, 72, 72.5, 75, 79, 83, 88, 72, 74 - 1e-7, 74 + 1e-7])
    azimuths = np.array([0.0, 0, 90, 93, 41, 45, 70, 200, 183, 250, 45, 135, 91, 92, 300, 181, 45, 90, 45, 45])
    exact = direction(angles, azimuths)
    edges = direction(
        np.array([15.0, 20.454791, 60.257244, 74, 71.014660, 90, 91]), np.array([90.0, 45, 45, 45, 0, 45, 9])
    )
    odd = np.array(
        [[1.0, 0, 0, 0], [2.0, 0, 0, 0], [1.0, 0, 1.0, 0], [0.5, 0.5, 0, 0], [2.0, 2.0, 0, 0], [1e-12, 0, 0, 0]]
    )

    def of(i, expected, alive):
        return sun_candidates(SENSOR, i, expected, alive=alive).direction

    i = np.concatenate([forward(exact), forward(edges), odd])
    expected = np.concatenate([exact, edges, np.eye(3)[[0, 2, 0, 0, 0, 1]]])
    slopes = quick(jax.vmap(jax.jacrev(of, argnums=(0, 1)), in_axes=(0, 0, None)))
    for alive in (ALL, np.array([True, True, False, True])):
        by_current, by_expected = map(np.asarray, slopes(i, expected, alive))
        assert np.all(np.isfinite(by_current)) and np.all(np.isfinite(by_expected))
        if not alive.all():
            break
        found = candidates(i, expected)
        chosen = np.argmin(apart_deg(found.direction, expected[:, None]), axis=1)[: len(exact)]
        rows = np.arange(len(exact))
        # The slope of the model itself: currents of lit faces by the Sun, the share's by a difference.
        h = 1e-6
        currents_slope = np.stack(
            [(smooth(exact + h * e, exact) - smooth(exact - h * e, exact)) / (2 * h) for e in np.eye(3)], axis=-1
        )
        total = by_current[rows, chosen] @ currents_slope + by_expected[rows, chosen]
        along = np.eye(3) - exact[:, :, None] * exact[:, None, :]
        np.testing.assert_allclose(along @ total @ along, along, atol=3e-8)


def smooth(sun, at):
    """The forward model with the faces lit, and the shade, as they are at `at`."""
    x = sun[:, :1]
    shaded = DISTANCE * x / (S * x + C * np.sqrt(np.maximum(1 - x**2, 0)))
    return np.where(forward(at) > 0, sun @ NORMALS.T * np.where(at[:, :1] < HOOD, shaded, 1.0), 0.0)


def test_noise_within_the_tolerance():
    """With the tolerance of the noise the truth is near a possible one; at the fold its error is the noise's root."""
    sun = random_suns(4 * BATCH, 7)
    i = forward(sun)
    noise = 0.002 * np.random.default_rng(8).uniform(-1.0, 1.0, i.shape)
    noisy = np.where(i > 0, i + noise, 0.0)
    found = candidates(noisy, sun, tolerance=0.004, threshold=0.004)
    # Fainter ones say little: of two of 0.02 the azimuth is off by a tenth of a radian.
    seen = np.count_nonzero(i > 0.05, axis=1) == np.count_nonzero(i, axis=1)
    off = nearest_deg(found, sun)[seen]
    # Three faces: the error of a component is twice the noise over cos 22 at the most, and 1 / sin 22 along the axis.
    assert np.max(off[found.lit[seen] >= 3]) < np.degrees(0.002 / S * 1.5)
    assert np.median(off) < 0.2 and np.max(off) < np.degrees(np.sqrt(8 * 0.004))
    # Without it noise makes one of two solutions the better, be it the wrong one.
    assert np.mean(nearest_deg(candidates(noisy, sun, threshold=0.004), sun)[seen] > 5.0) > 1e-3


def test_threshold_takes_faint_currents_for_none():
    sun = direction(np.array([40.0, 30.0]), np.array([60.0, 20.0]))
    i = forward(sun)
    found = candidates(i + 0.004, sun, threshold=0.01, tolerance=0.01)
    np.testing.assert_array_equal(found.lit, np.count_nonzero(i, axis=1))
    assert np.max(nearest_deg(found, sun)) < 1.0
    np.testing.assert_array_equal(candidates(i + 0.004, sun).lit, 4)


def test_currents_in_amperes():
    sun = random_suns(BATCH, 9)
    noisy = forward(sun) + 0.003
    found = candidates(0.02 * noisy, sun, threshold=0.02 * 0.004, tolerance=0.02 * 0.01, brightest=0.02)
    expected = candidates(noisy, sun, threshold=0.004, tolerance=0.01)
    np.testing.assert_array_equal(found.possible, expected.possible)
    np.testing.assert_allclose(found.direction, expected.direction, atol=1e-7)


@pytest.mark.slow
def test_replayed_over_cases():
    sun = random_suns(200, 10)
    i, alive = jnp.asarray(forward(sun)), jnp.asarray([True, True, False, True])

    def of(i, expected):
        return sun_candidates(SENSOR, i, expected, alive=alive, tolerance=1e-3)

    replayed = over_cases(of, *(jax.ShapeDtypeStruct((n,), float) for n in (4, 3)))

    def by_elements(i, v):
        found = replayed(elements(i.T, element_rank=1), elements(v.T, element_rank=1))
        together = lambda x: jnp.stack([jnp.stack(list(row), axis=-1) for row in x], axis=1)  # noqa: E731
        return together(found.direction), jnp.stack(list(found.possible), axis=-1), found.lit[()]

    directions, possible, lit = quick(by_elements)(i, jnp.asarray(sun))
    expected = candidates(forward(sun), sun, np.asarray(alive), tolerance=1e-3)
    np.testing.assert_array_equal(lit, expected.lit)
    np.testing.assert_array_equal(possible, expected.possible)
    # Roots near a fold of two solutions spread rounding.
    np.testing.assert_allclose(directions, expected.direction, atol=1e-12)
