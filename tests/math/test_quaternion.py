"""Quaternions: group axioms, agreement with scipy's rotations, and slopes at the identity and at half turns."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.math import quaternion

EPS = np.finfo(float).eps
RNG = np.random.default_rng(3)
ATTITUDES = Rotation.random(60, rng=RNG)
Q = ATTITUDES.as_quat(scalar_first=True)
P = Rotation.random(60, rng=RNG).as_quat(scalar_first=True)
VECTORS = RNG.normal(size=(60, 3))
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
AXES = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.6, 0, -0.8], [-2 / 3, 1 / 3, 2 / 3], list(np.full(3, 3**-0.5))]
ANGLES = [0.0, 1e-12, 1e-9, 0.99e-4, 1.01e-4, 1e-2, 1.0, 2 * np.pi / 3, 3.0, np.pi - 1e-6, np.pi]

conjugate, normalize, to_dcm = map(jax.jit, (quaternion.conjugate, quaternion.normalize, quaternion.to_dcm))
times_vector = jax.jit(quaternion.times_vector)
rotate_all = jax.jit(quaternion.rotate)
rotate = jax.jit(jax.vmap(quaternion.rotate))
rotate_inverse = jax.jit(jax.vmap(quaternion.rotate_inverse))
multiply = jax.jit(quaternion.multiply)
from_dcm = jax.jit(quaternion.from_dcm)
to_vector = jax.jit(quaternion.to_rotation_vector)
from_vector = jax.jit(quaternion.from_rotation_vector)
from_vector_jacobian = jax.jit(jax.jacfwd(quaternion.from_rotation_vector))
to_vector_jacobian = jax.jit(jax.jacrev(quaternion.to_rotation_vector))
angle_between = jax.jit(quaternion.angle_between)
angle_gradient = jax.jit(jax.grad(quaternion.angle_between, argnums=(0, 1)))


def central(f, x, h):
    """Central differences of a NumPy function, last axis over the components of x."""
    steps = h * np.eye(len(x))
    return np.stack([(f(x + s) - f(x - s)) / (2 * h) for s in steps], axis=-1)


def scipy_quaternion(rotation_vector):
    return Rotation.from_rotvec(rotation_vector).as_quat(scalar_first=True)


def test_group_axioms():
    p, q, r = jnp.asarray(P), jnp.asarray(Q), jnp.asarray(P[::-1])
    np.testing.assert_allclose(multiply(multiply(p, q), r), multiply(p, multiply(q, r)), atol=8 * EPS)
    one = jnp.broadcast_to(jnp.asarray(IDENTITY), q.shape)
    np.testing.assert_array_equal(multiply(one, q), Q)
    np.testing.assert_array_equal(multiply(q, one), Q)
    np.testing.assert_allclose(multiply(q, conjugate(q)), np.tile(IDENTITY, (60, 1)), atol=4 * EPS)
    np.testing.assert_allclose(np.linalg.norm(multiply(p, q), axis=1), 1.0, rtol=4 * EPS)
    np.testing.assert_allclose(normalize(-3.7 * q), -Q, atol=2 * EPS)


def test_product_composes_from_right_to_left_as_scipy_does():
    product = Rotation.from_quat(P, scalar_first=True) * ATTITUDES
    found = Rotation.from_quat(np.asarray(multiply(jnp.asarray(P), jnp.asarray(Q))), scalar_first=True)
    np.testing.assert_allclose(found.as_matrix(), product.as_matrix(), atol=10 * EPS)


def test_rotation_turns_body_vectors_into_inertial_ones():
    # A quarter turn about z carries the body's x axis to inertial y: the convention, in numbers.
    quarter = jnp.asarray([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])
    np.testing.assert_allclose(rotate_all(quarter, jnp.asarray([1.0, 0.0, 0.0])), [0, 1, 0], atol=2 * EPS)
    np.testing.assert_allclose(rotate_inverse(quarter[None], jnp.asarray([[0, 1.0, 0]]))[0], [1, 0, 0], atol=2 * EPS)


def test_rotation_and_matrix_agree_with_scipy():
    q, v = jnp.asarray(Q), jnp.asarray(VECTORS)
    size = np.abs(VECTORS).max()
    np.testing.assert_allclose(rotate(q, v), ATTITUDES.apply(VECTORS), atol=10 * EPS * size)
    np.testing.assert_allclose(rotate_inverse(q, v), ATTITUDES.inv().apply(VECTORS), atol=10 * EPS * size)
    np.testing.assert_allclose(to_dcm(q), ATTITUDES.as_matrix(), atol=10 * EPS)
    # One attitude, many vectors.
    np.testing.assert_allclose(rotate_all(q[0], v), ATTITUDES[0].apply(VECTORS), atol=10 * EPS * size)


@pytest.mark.parametrize("axis", AXES)
def test_matrix_to_quaternion_at_all_angles(axis):
    for angle in ANGLES:
        rotation = Rotation.from_rotvec(angle * np.array(axis))
        q = np.asarray(from_dcm(jnp.asarray(rotation.as_matrix())))
        expected = rotation.as_quat(scalar_first=True)
        assert q[0] >= 0.0 and np.linalg.norm(q) == pytest.approx(1.0, abs=4 * EPS)
        # At a half turn q and -q are equally good.
        np.testing.assert_allclose(q * np.sign(q @ expected), expected, atol=8 * EPS)


def test_matrix_to_quaternion_is_the_inverse_on_random_attitudes():
    found = np.asarray(jax.jit(jax.vmap(quaternion.from_dcm))(jnp.asarray(ATTITUDES.as_matrix())))
    np.testing.assert_allclose(found, Q * np.sign(Q[:, :1]), atol=8 * EPS)
    largest = set(np.argmax(np.abs(Q), axis=1))
    assert largest == {0, 1, 2, 3}, "the sample takes every branch"


@pytest.mark.parametrize("axis", AXES)
def test_rotation_vectors_agree_with_scipy(axis):
    for angle in ANGLES:
        vector = angle * np.array(axis)
        expected = scipy_quaternion(vector)
        np.testing.assert_allclose(from_vector(jnp.asarray(vector)), expected, atol=4 * EPS)
        # A tiny turn keeps its relative precision, not only an absolute one.
        np.testing.assert_allclose(from_vector(jnp.asarray(vector))[1:], expected[1:], rtol=8 * EPS, atol=0.1 * EPS)
        back = np.asarray(to_vector(jnp.asarray(expected)))
        np.testing.assert_allclose(back, vector, rtol=1e-14, atol=8 * EPS)
        # -q is the same attitude; at a half turn the opposite vector is as good.
        back = np.asarray(to_vector(jnp.asarray(-expected)))
        sign = np.sign(back @ vector) if angle == np.pi else 1.0
        np.testing.assert_allclose(sign * back, vector, rtol=1e-14, atol=8 * EPS)


def test_rotation_vectors_of_a_batch():
    vectors = ATTITUDES.as_rotvec()
    np.testing.assert_allclose(to_vector(jnp.asarray(Q)), vectors, atol=40 * EPS)
    found = from_vector(jnp.asarray(vectors))
    np.testing.assert_allclose(found, Q * np.sign(Q[:, :1]), atol=8 * EPS)
    one_by_one = jax.jit(jax.vmap(quaternion.from_rotation_vector))(jnp.asarray(vectors))
    np.testing.assert_allclose(one_by_one, found, atol=2 * EPS)


def test_more_than_half_a_turn_comes_back_the_short_way():
    axis = np.array([0.6, 0.0, -0.8])
    back = to_vector(from_vector(jnp.asarray(4.0 * axis)))
    np.testing.assert_allclose(back, (4.0 - 2 * np.pi) * axis, atol=8 * EPS)


def test_times_vector_is_the_product_with_a_pure_quaternion():
    for q, v in zip(Q[:5], VECTORS[:5], strict=True):
        expected = multiply(jnp.asarray(q), jnp.asarray([0.0, *v]))
        np.testing.assert_allclose(times_vector(jnp.asarray(q), jnp.asarray(v)), expected, atol=8 * EPS)
        # Twice the derivative of an attitude that turns at the body rate v, by differences of scipy's rotations.
        h = 1e-5
        turned = [
            (Rotation.from_quat(q, scalar_first=True) * Rotation.from_rotvec(s * h * v)).as_quat(scalar_first=True)
            for s in (-1, 1)
        ]
        turned = [x * np.sign(x @ q) for x in turned]
        # Truncation v^3 h^2 / 24 and rounding eps / h, for |v| < 4.
        np.testing.assert_allclose(expected, (turned[1] - turned[0]) / h, atol=1e-9)


@pytest.mark.parametrize("size", [0.0, 1e-10, 0.99e-4, 1.01e-4, 0.3, 3.0, np.pi])
def test_slope_of_quaternion_by_rotation_vector(size):
    vector = size * np.array([-2 / 3, 1 / 3, 2 / 3])

    def smooth(x):
        # Through a half turn scipy changes the sign; the quaternion nearer to the one in the middle is the smooth one.
        q, middle = scipy_quaternion(x), np.concatenate([[np.cos(size / 2)], np.sinc(size / 2 / np.pi) * vector / 2])
        return q if q @ middle > 0 else -q

    # Truncation h^2 / 48 and rounding eps / h.
    np.testing.assert_allclose(from_vector_jacobian(jnp.asarray(vector)), central(smooth, vector, 1e-5), atol=1e-10)


@pytest.mark.parametrize("size", [0.0, 1e-10, 1e-8, 1e-3, 1.0, 3.0, np.pi - 1e-4])
def test_slope_of_rotation_vector_by_attitude(size):
    # Perturb the attitude by a small turn d in the body: vector(q exp(d)).
    vector = size * np.array([-2 / 3, 1 / 3, 2 / 3])
    q = Rotation.from_rotvec(vector)

    def turned(d):
        return (q * Rotation.from_rotvec(d)).as_rotvec()

    chart = np.stack(
        [np.asarray(times_vector(jnp.asarray(scipy_quaternion(vector)), v)) / 2 for v in jnp.eye(3)], axis=-1
    )
    slope = np.asarray(to_vector_jacobian(jnp.asarray(scipy_quaternion(vector)))) @ chart
    # The step stays short of the half turn, where the vector jumps.
    np.testing.assert_allclose(slope, central(turned, np.zeros(3), 1e-5), rtol=2e-8, atol=1e-9)


def test_slope_of_rotation_vector_at_a_half_turn_is_finite_and_one_sided():
    q = jnp.asarray([0.0, 0.6, 0.0, -0.8])
    slope = np.asarray(to_vector_jacobian(q))
    assert np.all(np.isfinite(slope))
    # On the side w > 0 the angle is pi - 2 w.
    np.testing.assert_allclose(slope[:, 0], [-2 * 0.6, 0.0, 2 * 0.8], atol=8 * EPS)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("angle", [0.0, 1.0, 2.0, np.pi - 1e-3, np.pi])
def test_slope_of_matrix_to_quaternion(axis, angle, dyad_jacobian):
    """The dyad q q^T has no sign, so it is smooth through every branch and through the half turn."""
    rotation = Rotation.from_rotvec(angle * np.array(axis))

    def dyad(d):
        q = (rotation * Rotation.from_rotvec(d)).as_quat()
        return np.outer(q, q)

    found = dyad_jacobian(jnp.asarray(rotation.as_matrix()))
    # scipy stands the scalar last.
    found = np.roll(np.asarray(found), -1, axis=(0, 1))
    np.testing.assert_allclose(found, central(dyad, np.zeros(3), 1e-5), atol=1e-10)


@pytest.fixture(scope="module")
def dyad_jacobian():
    def dyad(d, dcm):
        x, y, z = d[0], d[1], d[2]
        zero = jnp.zeros_like(x)
        # A small turn to first order; only its slope at zero is used.
        turn = jnp.eye(3) + jnp.stack([zero, -z, y, z, zero, -x, -y, x, zero]).reshape(3, 3)
        q = quaternion.from_dcm(dcm @ turn)
        return q[:, None] * q[None, :]

    slope = jax.jit(jax.jacfwd(dyad))
    return lambda dcm: slope(jnp.zeros(3), dcm)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, 3.0, np.pi])
def test_angle_between_attitudes(angle):
    turned = ATTITUDES * Rotation.from_rotvec(angle * np.array([0.6, 0.0, -0.8]))
    found = angle_between(jnp.asarray(Q), jnp.asarray(turned.as_quat(scalar_first=True)))
    # Products of quaternions round at eps, and the angle is twice the sine.
    np.testing.assert_allclose(found, angle, atol=8 * EPS)
    np.testing.assert_allclose(angle_between(jnp.asarray(Q), jnp.asarray(-Q)), 0.0, atol=8 * EPS)


def test_slope_of_the_angle_between_attitudes():
    p, axis = jnp.asarray(Q[0]), np.array([0.6, 0.0, -0.8])
    q = jnp.asarray((ATTITUDES[0] * Rotation.from_rotvec(1.1 * axis)).as_quat(scalar_first=True))
    gradient = angle_gradient(p, q)[1]
    by_turn = [float(gradient @ times_vector(q, v)) / 2 for v in jnp.eye(3)]
    # Turning further about the same axis is the only way to increase the angle.
    np.testing.assert_allclose(by_turn, axis, atol=1e-14)
    for same in (p, -p):
        assert all(np.all(np.isfinite(g)) for g in angle_gradient(p, same))


def test_slope_of_the_angle_is_finite_at_exactly_half_a_turn():
    half = jnp.asarray([0.0, 0.0, 1.0, 0.0])
    assert float(angle_between(jnp.asarray(IDENTITY), half)) == np.pi
    assert all(np.all(np.isfinite(g)) for g in angle_gradient(jnp.asarray(IDENTITY), half))
