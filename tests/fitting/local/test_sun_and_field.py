"""Sun and magnetometers: exact data, a missing axis, and every case that has no answer."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.local import sun_and_field as module
from fitting.local.sun_and_field import sun_and_field_attitude

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})


def _total(sun, field_body, *rest):
    found = sun_and_field_attitude(sun, field_body, *rest)
    return found.quaternion[0] @ jnp.array([0.3, -1.0, 0.7, 0.4]), found


_program = quick(jax.value_and_grad(_total, argnums=(0, 1), has_aux=True))


def solve(*arguments):
    # From NumPy, so that no argument is of another type than the last: one program serves all.
    return _program(*map(np.asarray, arguments))[0][1]


SIGMAS = jnp.radians(1.0), jnp.asarray(2e-7)
TRUE = Rotation.from_rotvec([0.4, -1.0, 0.7])
Q = TRUE.as_quat(scalar_first=True)
SUN = np.array([0.48, -0.6, 0.64])
FIELD = 3e-5 * np.array([0.2, 0.9, 0.3])


def measured(sun=SUN, field=FIELD, missing=()):
    body = TRUE.inv().apply(np.array([sun, field]))
    body[1, list(missing)] = np.nan
    return jnp.asarray(body[0]), jnp.asarray(body[1]), jnp.asarray(sun), jnp.asarray(field), *SIGMAS


def off(q):
    return (Rotation.from_quat(np.asarray(q), scalar_first=True).inv() * TRUE).magnitude()


@pytest.mark.slow
@pytest.mark.parametrize("missing", [(), (0,), (1,), (2,)])
def test_exact_data_give_the_attitude(missing):
    found = solve(*measured(missing=missing))
    assert module.STATUSES[int(found.status)] == "solved"
    assert off(found.quaternion[0]) < 1e-12
    assert abs(float(found.mismatch[0])) < 1e-12
    np.testing.assert_allclose(found.field_body[0], TRUE.inv().apply(FIELD), atol=1e-18)
    # The other sign of the axis is off, unless nothing is missing.
    assert (off(found.quaternion[1]) > 0.1) == bool(missing)


@pytest.mark.slow
def test_a_sun_across_the_missing_axis_leaves_both_signs():
    x_eci = TRUE.apply([1.0, 0.0, 0.0])
    sun = np.cross(x_eci, FIELD)
    found = solve(*measured(sun=sun / np.linalg.norm(sun), missing=(0,)))
    assert int(found.status) == module.TWO_SIGNS
    assert min(off(q) for q in found.quaternion) < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"sun": FIELD / np.linalg.norm(FIELD)}, module.ALONG),
        ({"sun": -FIELD / np.linalg.norm(FIELD)}, module.ALONG),
        ({"missing": (0, 2)}, module.NO_FIELD),
        ({"missing": (0, 1, 2)}, module.NO_FIELD),
    ],
)
def test_cases_without_an_answer_are_named_and_finite(change, status):
    found = solve(*measured(**change))
    assert int(found.status) == status
    assert np.all(np.isfinite(found.quaternion)) and np.all(np.isfinite(found.mismatch))


@pytest.mark.slow
@pytest.mark.parametrize("sun_body", [jnp.zeros(3), jnp.full(3, jnp.nan)])
def test_no_sun(sun_body):
    _, *rest = measured()
    found = solve(sun_body, *rest)
    assert int(found.status) == module.NO_SUN and np.all(np.isfinite(found.quaternion))


@pytest.mark.slow
def test_two_axes_above_the_whole_field():
    sun, field_body, *rest = measured(missing=(0,))
    assert int(solve(sun, 3.0 * field_body, *rest).status) == module.TOO_STRONG


@pytest.mark.parametrize("missing", [(), (0,)])
def test_slopes_against_differences(missing):
    sun, field_body, *rest = measured(missing=missing)
    along = np.random.default_rng(1).normal(size=(2, 3))

    along[1] *= 3e-5

    def value(h):
        arguments = map(np.asarray, (sun + h * along[0], field_body + h * along[1], *rest))
        (total, _), gradients = _program(*arguments)
        return float(total), gradients

    # An axis that is not measured must not carry its NaN into the others.
    slope = sum(float(np.sum(gradient * part)) for gradient, part in zip(value(0.0)[1], along, strict=True))
    assert slope == pytest.approx((value(1e-6)[0] - value(-1e-6)[0]) / 2e-6, rel=1e-6)
