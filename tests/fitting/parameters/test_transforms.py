"""Maps between unlimited shifts and what a body can have, against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.parameters import transforms
from fitting.parameters.transforms import inertia_shift, second_moment_root, thinnest

dipole_from_polar, polar_from_dipole = jax.jit(transforms.dipole_from_polar), jax.jit(transforms.polar_from_dipole)
physical_inertia = jax.jit(transforms.physical_inertia)


def body(points: np.ndarray) -> np.ndarray:
    """Inertia of point masses of one unit each, xx yy zz xy xz yz of the tensor."""
    x, y, z = points.T
    return np.array([sum(y * y + z * z), sum(x * x + z * z), sum(x * x + y * y), -x @ y, -x @ z, -y @ z])


def test_second_moment_is_that_of_the_mass():
    points = np.random.default_rng(7).normal(size=(9, 3))
    root = second_moment_root(body(points))
    np.testing.assert_allclose(root @ root.T, points.T @ points, rtol=1e-12, atol=1e-12)
    assert np.all(np.triu(root, 1) == 0.0)


def test_thinnest_tells_a_sphere_from_a_plate_and_from_nothing():
    rng = np.random.default_rng(8)
    assert thinnest(np.array([2.0, 2.0, 2.0, 0.0, 0.0, 0.0])) == pytest.approx(1.0)
    flat = rng.normal(size=(9, 3)) * np.array([1.0, 1.0, 0.0])
    assert abs(thinnest(body(flat))) < 1e-12
    assert thinnest(np.array([1.0, 1.0, 2.5, 0.0, 0.0, 0.0])) < 0.0
    with pytest.raises(np.linalg.LinAlgError):
        second_moment_root(np.array([1.0, 1.0, 2.5, 0.0, 0.0, 0.0]))


def test_any_body_is_reached_from_any_other():
    rng = np.random.default_rng(9)
    for _ in range(20):
        one, other = body(rng.normal(size=(5, 3))), body(rng.normal(size=(5, 3)) * np.array([3.0, 1.0, 0.1]))
        root = second_moment_root(one)
        shift = jnp.asarray(inertia_shift(root, other))
        reached = physical_inertia(jnp.asarray(root), jnp.asarray(np.linalg.inv(root)), shift)
        np.testing.assert_allclose(reached, other, rtol=1e-8, atol=1e-9 * other.max())


def test_no_shift_is_no_change_and_a_small_one_is_itself():
    inertia = body(np.random.default_rng(10).normal(size=(5, 3)))
    root = second_moment_root(inertia)
    arrays = jnp.asarray(root), jnp.asarray(np.linalg.inv(root))
    np.testing.assert_allclose(physical_inertia(*arrays, jnp.zeros(6)), inertia, rtol=1e-13, atol=1e-13)
    slope = jax.jit(jax.jacfwd(transforms.physical_inertia, argnums=2))(*arrays, jnp.zeros(6))
    np.testing.assert_allclose(slope, np.eye(6), atol=1e-11)


@pytest.mark.parametrize("dipole", [[0.3, 0.0, 0.0], [-0.1, 0.2, -0.2], [1e-9, 0.0, 0.3], [0.0, -0.2, 0.0]])
def test_a_dipole_survives_its_angles(dipole):
    polar = polar_from_dipole(jnp.array(dipole))
    assert float(polar[0]) == pytest.approx(np.linalg.norm(dipole))
    np.testing.assert_allclose(dipole_from_polar(polar), dipole, atol=1e-15)
    # Elevation is counted from the xy plane, azimuth from x towards y.
    assert float(polar[1]) == pytest.approx(np.arctan2(dipole[1], dipole[0]))


@pytest.mark.parametrize(("dipole", "expected"), [([0.0, 0.0, 0.0], [0, 0, 0]), ([0.0, 0.0, -2.0], [2, 0, -np.pi / 2])])
def test_angles_where_they_have_no_slope(dipole, expected):
    np.testing.assert_allclose(polar_from_dipole(jnp.array(dipole)), expected, atol=1e-15)
    for mode in (jax.jacfwd, jax.jacrev):
        assert np.all(np.isfinite(jax.jit(mode(transforms.polar_from_dipole))(jnp.array(dipole))))
