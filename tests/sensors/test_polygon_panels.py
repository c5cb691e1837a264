"""Mirror light on panels of any outline: against the smooth beam, published numbers, other places and shapes."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.environment import specular_albedo
from jaxsat.sensors import PolygonPanels, mirror_currents, polygon_panels

R, RATIO = 6371.2e3, 1.1975807
SUN = np.array([0.48, -0.6, 0.64])
TURN = Rotation.from_rotvec([0.4, -0.7, 1.1])
Q = jnp.asarray(TURN.as_quat(scalar_first=True))
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
currents = quick(mirror_currents, static_argnames=("radius",))
beam_at = quick(specular_albedo, static_argnums=2)
TRIANGLE = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1], [0.0, 0.2, 0.1]])
HEXAGON = 0.1 * np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.zeros(6)], axis=1)


def at(alpha_deg):
    across = np.cross(SUN, [0.0, 0.0, 1.0])
    a = np.radians(alpha_deg)
    return RATIO * R * (np.cos(a) * SUN + np.sin(a) * across / np.linalg.norm(across))


def facing(direction_eci, outline):
    """A flat outline of the xy plane, turned so that its normal is an inertial direction, in body axes."""
    turn = Rotation.align_vectors(direction_eci[None], [[0.0, 0.0, 1.0]])[0]
    return TURN.inv().apply(turn.apply(outline - outline.mean(axis=0)))


@pytest.mark.parametrize("alpha, published", [(30, 0.487903), (60, 0.396329), (90, 0.223669), (120, 0.0223123)])
@pytest.mark.parametrize("outline", [TRIANGLE, HEXAGON], ids=["triangle", "hexagon"])
def test_a_panel_that_faces_the_reflection_has_the_published_factor(outline, alpha, published):
    position = at(alpha)
    direction, _ = beam_at(jnp.asarray(position), jnp.asarray(SUN), R)
    panels = polygon_panels([facing(np.asarray(direction), outline)], 2.5)
    area = {3: 0.03, 6: 1.5 * np.sqrt(3) * 0.01}[len(outline)]
    found = float(currents(Q, panels, jnp.asarray(position), jnp.asarray(SUN), R)[0])
    # The ratio is printed with eight digits, the factors with six.
    assert found == pytest.approx(2.5 * area * published, rel=3e-6)


def test_any_tilt_and_place_as_one_beam():
    rng = np.random.default_rng(4)
    position = at(70.0)
    direction, beam = (np.asarray(x) for x in beam_at(jnp.asarray(position), jnp.asarray(SUN), R))
    outlines, expected = [], []
    for _ in range(12):
        turn, shift = Rotation.random(rng=rng), rng.uniform(-1, 1, 3)
        outline = TRIANGLE if rng.uniform() < 0.5 else HEXAGON
        outlines.append(turn.apply(outline) + shift)
        area = 0.03 if outline is TRIANGLE else 1.5 * np.sqrt(3) * 0.01
        cosine = TURN.apply(turn.apply([0.0, 0.0, 1.0])) @ direction
        expected.append(0.5 * np.array([1.0, 2.0])[len(outlines) % 2] * area * float(beam) * max(cosine, 0.0))
    density = [np.array([1.0, 2.0])[(k + 1) % 2] for k in range(12)]
    panels = polygon_panels(outlines, density)
    found = np.asarray(currents(Q, panels, jnp.asarray(position), jnp.asarray(SUN), R, 0.5))
    # A metre moves the beam by 1 m over the 1300 km path: 1e-6 of the strength and of the angle.
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)
    assert np.count_nonzero(found) == np.count_nonzero(expected) and 0 < np.count_nonzero(found) < 12


def test_areas_normals_and_the_flat_equivalent():
    panels = polygon_panels([TRIANGLE, HEXAGON[::-1]], [2.0, 1.0])
    areas, normals = panels.areas_and_normals()
    np.testing.assert_allclose(areas, [0.03, 1.5 * np.sqrt(3) * 0.01], rtol=1e-14)
    np.testing.assert_allclose(normals, [[0, 0, 1], [0, 0, -1]], atol=1e-15)
    flat = panels.flat()
    np.testing.assert_allclose(flat.max_current * flat.gains, [0.06, 1.5 * np.sqrt(3) * 0.01], rtol=1e-14)


def test_place_counts_as_the_position_does():
    offset = np.array([0.0, 300.0, -500.0])
    position = at(80.0)
    near = polygon_panels([HEXAGON[::-1], HEXAGON], 1.0)
    far = PolygonPanels(near.corners + jnp.asarray(offset)[None, None], near.current_density)
    moved = position + TURN.apply(offset)
    expected = currents(Q, near, jnp.asarray(moved), jnp.asarray(SUN), R)
    np.testing.assert_allclose(currents(Q, far, jnp.asarray(position), jnp.asarray(SUN), R), expected, rtol=1e-9)


THREE = polygon_panels([TRIANGLE, TRIANGLE[::-1], HEXAGON], 1.0)


@quick
@functools.partial(jax.value_and_grad, argnums=(0, 1, 2))
def total(q, position, sun):
    return jnp.sum(mirror_currents(q, THREE, position, sun, R) * jnp.array([1.0, 2.0, 3.0]))


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [40.0, 100.0])
def test_gradients_against_differences(alpha):
    position = jnp.asarray(at(alpha))
    value, gradients = total(Q, position, jnp.asarray(SUN))
    assert float(value) > 0.0
    rng = np.random.default_rng(0)
    for k, (arguments, step) in enumerate(((Q, 1e-5), (position, 100.0), (jnp.asarray(SUN), 1e-5))):
        along = jnp.asarray(rng.normal(size=arguments.shape))
        inputs = [Q, position, jnp.asarray(SUN)]
        ends = []
        for h in (step, -step):
            inputs[k] = arguments + h * along
            ends.append(float(total(*inputs)[0]))
        # Roundings of 1e-16 over a step of 1e-5, curvature of 1e-10: seven digits.
        assert float(jnp.sum(gradients[k] * along)) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=3e-6)


@pytest.mark.slow
def test_dark_sides_and_the_terminator_are_exact_zeros_with_finite_gradients():
    for alpha in (0.0, 123.5, 180.0):
        value, gradients = total(Q, jnp.asarray(at(alpha)), jnp.asarray(SUN))
        assert np.isfinite(value) and all(np.all(np.isfinite(g)) for g in gradients)
    value, gradients = total(Q, jnp.asarray(at(150.0)), jnp.asarray(SUN))
    assert float(value) == 0.0 and not any(np.any(g) for g in gradients)


@pytest.mark.parametrize(
    ("outline", "expected"),
    [
        (TRIANGLE[:2], "three or more corners"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), "on a line"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]]), "not flat"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [0.1, 0.1, 0], [0, 1, 0]]), "not convex"),
        (np.array([[np.nan, 0, 0], [1, 0, 0], [0, 1, 0]]), "finite"),
        (HEXAGON[[0, 2, 4, 0, 2, 4]], "crosses itself"),
    ],
)
def test_refuses_what_is_no_panel(outline, expected):
    with pytest.raises(ValueError, match=expected):
        polygon_panels([TRIANGLE, outline], 1.0)
