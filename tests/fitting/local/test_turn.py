"""Turning about an axis: the published matrix, the published zero of the angle, and panels as sinusoids."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.local.shares import explained, patterns
from fitting.local.turn import attitude_after, initial_attitude, panel_sinusoids, turned_sample
from jaxsat.environment import LightTable
from jaxsat.sensors import Albedo
from jaxsat.spacecraft import SolarPanels, box_normals, tilted

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
RNG = np.random.default_rng(8)


def units(*shape):
    v = RNG.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


PANELS = SolarPanels(
    tilted(box_normals(), jnp.asarray(RNG.normal(scale=0.05, size=(6, 2)))),
    jnp.asarray(0.24),
    jnp.asarray([1.0, 0.9, 1.1, 1.0, 1.05, 0.95]),
)
LIGHT = LightTable(
    *(jnp.asarray(v) for v in (units(), 0.8, units(), 0.4, units(5), RNG.uniform(0.02, 0.1, 5))),
)
EARTH = Albedo(jnp.asarray(0.5), jnp.asarray(0.3))
Q = jnp.asarray(Rotation.random(rng=RNG).as_quat(scalar_first=True))
turn_it, start = quick(attitude_after), quick(initial_attitude)


def published_matrix(p, angle):
    """Rotation matrix as printed in sec. 3.3."""
    across = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
    return (1 - np.cos(angle)) * np.outer(p, p) + np.sin(angle) * across + np.cos(angle) * np.eye(3)


def dcm(q):
    return Rotation.from_quat(np.asarray(q), scalar_first=True).as_matrix()


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0, np.pi])
def test_turned_is_the_published_rotation(angle):
    axis = units()
    found = dcm(turn_it(Q, jnp.asarray(axis), jnp.asarray(angle)))
    np.testing.assert_allclose(found, published_matrix(axis, angle) @ dcm(Q), atol=1e-14)


@pytest.mark.parametrize("axis", [[0.5, -0.6, 0.6], [0.1, 0.2, 0.95], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
def test_initial_position_of_x_along_the_axis(axis):
    axis = 3e-5 * np.array(axis)
    found = dcm(start(jnp.asarray(axis), jnp.array([1.0, 0.0, 0.0])))
    np.testing.assert_allclose(found[:, 0], axis / np.linalg.norm(axis), atol=1e-14)
    # y is parallel to OXY, or to OYZ near the pole.
    near_pole = abs(axis[2]) > 0.7 * np.linalg.norm(axis)
    assert found[0 if near_pole else 2, 1] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("own", [[0.0, 1.0, 0.0], [0.3, -0.9, 0.2], [-1.0, 0.0, 0.0]])
def test_any_body_direction_lies_along_the_axis(own):
    axis = units()
    found = dcm(start(jnp.asarray(axis), jnp.asarray(own)))
    np.testing.assert_allclose(found @ (own / np.linalg.norm(own)), axis, atol=1e-14)


@pytest.mark.parametrize("axis", [[0.5, -0.6, 0.6], [0.1, 0.2, 0.95], [-0.6, 0.3, -0.74]])
def test_y_is_in_its_plane_whatever_lies_along_the_axis(axis):
    axis = np.array(axis) / np.linalg.norm(axis)
    found = dcm(start(jnp.asarray(axis), jnp.array([0.5, 0.6, -0.62])))
    assert found[0 if abs(axis[2]) > 0.7 else 2, 1] == pytest.approx(0.0, abs=1e-14)


def test_panels_are_sinusoids_of_the_turn():
    own = units()
    axis = jnp.asarray(dcm(Q) @ own)
    angles, limit = jnp.linspace(-3.0, 3.0, 13), jnp.asarray(0.6)
    measured = jnp.asarray(RNG.uniform(0.0, 0.2, 6))

    @quick
    def both(angles):
        turn = panel_sinusoids(Q, jnp.asarray(own), PANELS, EARTH, LIGHT)
        attitudes = jax.vmap(lambda a: attitude_after(Q, axis, a))(angles)
        seen = jax.vmap(lambda q: patterns(q, PANELS, EARTH, LIGHT))(attitudes)
        whole = jax.vmap(lambda q: explained(q, measured, PANELS, EARTH, LIGHT, limit))(attitudes)
        squares = turn.squares(jnp.cos(angles), jnp.sin(angles), measured, limit)
        return (*jax.vmap(turn.patterns)(angles), squares), (*seen, 6.0 * whole.rms**2)

    (direct, albedo, squares), (direct_there, albedo_there, squares_there) = both(angles)
    np.testing.assert_allclose(direct, direct_there, atol=1e-15)
    np.testing.assert_allclose(albedo, albedo_there, atol=1e-15)
    np.testing.assert_allclose(squares, squares_there, rtol=1e-10)


@pytest.mark.slow
def test_a_turned_sample_keeps_its_axis_and_shows_the_field():
    field, sun_body = 3e-5 * units(), units()
    angles = jnp.radians(jnp.arange(0.0, 360.0, 45.0))
    measured = jnp.asarray(RNG.uniform(0.0, 0.2, 6))
    arguments = (LIGHT.sun_eci, jnp.asarray(sun_body), measured, jnp.asarray(field), PANELS, EARTH, LIGHT)
    found = quick(turned_sample)(angles, *arguments)
    for q, b in zip(found.fit.quaternion, found.field_body, strict=True):
        np.testing.assert_allclose(dcm(q) @ sun_body, LIGHT.sun_eci, atol=1e-14)
        np.testing.assert_allclose(dcm(q) @ b, field, atol=1e-18)
    # The Sun keeps its place in the body: only the Earth's light changes.
    lit = np.asarray(found.fit.direct) > 0.0
    share = np.asarray(found.direct)[lit] / np.asarray(found.fit.direct)[lit, None]
    np.testing.assert_allclose(share, np.broadcast_to(share[:1], share.shape), atol=1e-14)
    assert lit.any()


@pytest.mark.slow
def test_slopes_against_differences():
    along = RNG.normal(size=3)

    def total(h):
        axis = LIGHT.sun_eci + h * jnp.asarray(along)
        q = attitude_after(
            initial_attitude(axis, jnp.asarray([0.2, 0.3, 0.9]) + h), LIGHT.sun_eci, jnp.asarray(0.4) + h
        )
        return q @ jnp.array([0.3, -1.0, 0.7, 0.4])

    program = quick(jax.value_and_grad(total))
    slope = float(program(0.0)[1])
    assert slope == pytest.approx(float(program(1e-5)[0] - program(-1e-5)[0]) / 2e-5, rel=1e-7)
