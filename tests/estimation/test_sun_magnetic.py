"""Sun-magnetic angles: behaviour, round trip, singular points and gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.estimation.sun_magnetic import attitude_from_sun_magnetic, sun_magnetic_angles, sun_magnetic_axes

B = jnp.array([1.2e-5, -2.0e-5, 0.7e-5])
SUN = jnp.array([0.3, 0.5, -0.81])
angles_of = jax.jit(jax.vmap(sun_magnetic_angles, (0, None, None)))
attitude_of = jax.jit(jax.vmap(attitude_from_sun_magnetic, (0, None, None)))
# One small program each: dispatched operation by operation they take a second apiece.
angles_at, attitude_at = jax.jit(sun_magnetic_angles), jax.jit(attitude_from_sun_magnetic)
SLOPES = {
    f: jax.jit(jax.jacfwd(f), compiler_options={"xla_backend_optimization_level": 0})
    for f in (sun_magnetic_angles, attitude_from_sun_magnetic)
}


def rotation(q):
    return Rotation.from_quat(np.asarray(q), scalar_first=True)


def test_the_axes_hold_field_and_sun():
    axes = rotation(sun_magnetic_axes(B, SUN)).inv()
    field, sun = axes.apply(np.array(B)), axes.apply(np.array(SUN))
    np.testing.assert_allclose(field, [float(np.linalg.norm(B)), 0.0, 0.0], atol=1e-20)
    assert sun[1] > 0.0 and abs(sun[2]) < 1e-15


@pytest.mark.slow
def test_the_angles_say_where_the_axes_point():
    rng = np.random.default_rng(0)
    angles = np.column_stack([rng.uniform(0, np.pi, 200), rng.uniform(-np.pi, np.pi, (200, 2))])
    q = attitude_of(jnp.asarray(angles), B, SUN)
    x_body = rotation(q).apply([1.0, 0.0, 0.0])
    field = np.asarray(B / jnp.linalg.norm(B))
    np.testing.assert_allclose(np.arccos(x_body @ field), angles[:, 0], atol=1e-7)
    # On the Sun's side of the field for azimuths below a right angle, towards field x Sun for positive ones.
    assert np.all((x_body @ np.asarray(SUN) - (x_body @ field) * (SUN @ field) > 0) == (np.cos(angles[:, 1]) > 0))
    assert np.all((x_body @ np.cross(B, SUN) > 0) == (np.sin(angles[:, 1]) > 0))
    np.testing.assert_allclose(angles_of(q, B, SUN), angles, atol=1e-12)
    np.testing.assert_allclose(angles_of(-q, B, SUN), angles, atol=1e-12)


def test_a_turn_about_body_x_is_roll_alone():
    base = attitude_at(jnp.array([0.2, 1.0, -0.4]), B, SUN)
    turned = rotation(base) * Rotation.from_rotvec([0.7, 0, 0])
    q = jnp.asarray(turned.as_quat(scalar_first=True))
    np.testing.assert_allclose(angles_at(q, B, SUN), [0.2, 1.0, 0.3], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("sun", [SUN, 3.0 * B, -B])
@pytest.mark.parametrize(("deviation", "kept"), [(0.0, 2), (np.pi, 1)])
def test_singular_points_are_finite(deviation, kept, sun):
    """Without deviation the roll is there still, against the field the azimuth; only the other one is undefined."""
    angles = jnp.array([deviation, 0.5, 0.25])
    q = attitude_at(angles, B, sun)
    found = angles_at(q, B, sun)
    assert found[0] == pytest.approx(deviation, abs=1e-7)
    if kept == 2:
        assert found[2] == pytest.approx(0.25, abs=1e-9)
    assert np.all(np.isfinite(found))
    for function, argument in ((sun_magnetic_angles, q), (attitude_from_sun_magnetic, angles)):
        assert np.all(np.isfinite(SLOPES[function](argument, B, sun)))


def test_gradients_agree_with_differences():
    q = attitude_at(jnp.array([0.02, 2.0, -1.0]), B, SUN)
    jacobian = np.asarray(SLOPES[sun_magnetic_angles](q, B, SUN))
    step = 1e-6
    for k in range(4):
        ahead, behind = (np.asarray(angles_at(q.at[k].add(s), B, SUN)) for s in (step, -step))
        # The azimuth's third derivative grows as the deviation's inverse cube.
        np.testing.assert_allclose(jacobian[:, k], (ahead - behind) / (2 * step), rtol=1e-5, atol=1e-6)
