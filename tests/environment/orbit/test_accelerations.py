"""Accelerations: closed forms in extended precision, signs by behaviour, gradients finite and right."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import AU
from jaxsat.environment import (
    AbstractOrbit,
    CentralGravity,
    ConeShadow,
    CylinderShadow,
    Drag,
    ExponentialAtmosphere,
    HarmonicGravity,
    SolarPressure,
    ThirdBody,
)
from jaxsat.environment.gravity import egm2008
from jaxsat.environment.orbit.accelerations import SUN_MU, third_body_acceleration

POSITION, VELOCITY = jnp.asarray([5.2e6, -3.1e6, 3.3e6]), jnp.asarray([2.1e3, 6.4e3, 3.2e3])


class Still(AbstractOrbit):
    """A body at rest in the sky: its place, and the times until which it is known."""

    place: jax.Array
    until: float = eqx.field(static=True, default=math.inf)

    def __call__(self, t):
        return self.place, jnp.zeros_like(self.place)

    def check_span(self, times):
        if np.any(times > self.until):
            raise ValueError("too late for the still body")


SUN = Still(jnp.asarray(AU * np.array([0.54, 0.77, 0.34]) / np.linalg.norm([0.54, 0.77, 0.34])))

ACCELERATIONS = {
    "central": CentralGravity(),
    "harmonics": HarmonicGravity(egm2008(4), 1.2),
    "sun": ThirdBody(SUN_MU, SUN),
    "drag": Drag(0.02),
    "light": SolarPressure(0.02, SUN),
}


def value(acceleration, t, position, velocity):
    """The acceleration at an instant: a step of no length."""
    given = acceleration.given(jnp.reshape(t, (1,)), position, velocity)
    return acceleration(jax.tree.map(lambda x: x[0], given), position, velocity)


at = eqx.filter_jit(value)


@pytest.mark.parametrize("body", [np.array([2.1e8, -2.9e8, 1.3e8]), np.array([-0.4e11, 1.3e11, 0.6e11])])
def test_third_body_in_extended_precision(body):
    r, s = np.asarray(POSITION, np.longdouble), body.astype(np.longdouble)
    expected = (s - r) / np.sqrt(np.sum((s - r) ** 2)) ** 3 - s / np.sqrt(np.sum(s**2)) ** 3
    found = np.asarray(jax.jit(third_body_acceleration)(POSITION, jnp.asarray(body), 1.0))
    # The plain difference would lose a factor of s/r, 60 or 23 000.
    np.testing.assert_allclose(found, expected.astype(float), rtol=2e-15 * 5)


def test_harmonics_turn_with_the_earth():
    gravity, t = HarmonicGravity(egm2008(4), 1.2), jnp.asarray(4000.0)
    angle = 1.2 + 7.292115855e-5 * 4000.0
    c, s = np.cos(angle), np.sin(angle)
    ecef_from_eci = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    expected = ecef_from_eci.T @ np.asarray(
        eqx.filter_jit(egm2008(4))(jnp.asarray(ecef_from_eci @ np.asarray(POSITION)))
    )
    # The rate is given to ten digits.
    np.testing.assert_allclose(at(gravity, t, POSITION, VELOCITY), expected, rtol=0, atol=1e-12)


def test_drag_opposes_the_motion_against_the_turning_air():
    density = 3e-12
    drag = Drag(0.02, lambda position: jnp.asarray(density))
    found = np.asarray(at(drag, jnp.zeros(()), POSITION, VELOCITY))
    air = np.asarray(VELOCITY) - np.cross([0, 0, 7.292115855e-5], np.asarray(POSITION))
    np.testing.assert_allclose(found, -0.5 * 0.02 * density * np.linalg.norm(air) * air, rtol=1e-9)
    assert found @ np.asarray(VELOCITY) < 0
    # A satellite carried by the air feels none, and the gradient there is finite.
    carried = jnp.cross(jnp.asarray([0.0, 0.0, 7.292115855e-5]), POSITION)
    np.testing.assert_allclose(at(drag, jnp.zeros(()), POSITION, carried), 0.0, atol=1e-25)
    slope = jax.jit(jax.jacrev(lambda v: value(drag, jnp.zeros(()), POSITION, v)))(carried)
    assert np.all(np.abs(slope) < 1e-14)


@pytest.mark.parametrize("shadow", [CylinderShadow(), ConeShadow()])
def test_sunlight_pushes_away_from_the_sun_and_not_in_the_shadow(shadow):
    light = SolarPressure(0.02, SUN, shadow)
    sun = np.asarray(SUN.place)
    direction = sun / np.linalg.norm(sun)
    for place, lit in ((7e6 * direction, 1.0), (-7e6 * direction, 0.0)):
        found = np.asarray(at(light, jnp.zeros(()), jnp.asarray(place), VELOCITY))
        away = place - sun
        expected = lit * 0.02 * 4.56e-6 * (AU / np.linalg.norm(away)) ** 2 * away / np.linalg.norm(away)
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-25)
        assert found @ direction <= 0


def test_sunlight_of_a_step_across_the_edge_is_its_mean():
    # Abreast of the Earth 30 km outside the cylinder of the shadow, moving into it at 500 m/s and falling by 9.8 t^2/2.
    sun = np.asarray(SUN.place)
    direction = sun / np.linalg.norm(sun)
    across = np.cross(direction, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    place, velocity = (6371.2e3 + 30e3) * across - 1e3 * direction, -500.0 * across
    given = eqx.filter_jit(SolarPressure(0.02, SUN, CylinderShadow()).given)
    places, lit = given(jnp.linspace(0.0, 100.0, 7), jnp.asarray(place), jnp.asarray(velocity))
    edge = (-500.0 + np.sqrt(500.0**2 + 2 * 9.73 * 30e3)) / 9.73
    # One instant of sixteen is the resolution.
    np.testing.assert_allclose(lit, edge / 100.0, atol=1 / 32)
    assert places.shape == (7, 3) and lit.shape == (7,) and 0.3 < edge / 100.0 < 0.5


@pytest.fixture(scope="module")
def derivatives():
    """Jacobians by state, and values at the state and a step to either side along each axis."""
    # 20 m on a scale height of 60 km leave 2e-8 of the third derivative.
    steps = np.array([20.0, 20.0, 20.0, 0.1, 0.1, 0.1])
    state = np.concatenate([POSITION, VELOCITY])
    states = np.concatenate([state[None], state + np.diag(steps), state - np.diag(steps)])

    @eqx.filter_jit
    def evaluate(accelerations, states):
        def one(acceleration):
            def total(state):
                return value(acceleration, jnp.asarray(700.0), state[:3], state[3:])

            return jax.jacfwd(total)(states[0]), jax.vmap(total)(states)

        return {name: one(acceleration) for name, acceleration in accelerations.items()}

    return steps, evaluate(ACCELERATIONS, jnp.asarray(states))


@pytest.mark.slow
@pytest.mark.parametrize("name", ACCELERATIONS)
def test_gradients_against_differences(name, derivatives):
    steps, found = derivatives
    jacobian, values = (np.asarray(x) for x in found[name])
    difference = ((values[1:7] - values[7:]) / (2.0 * steps[:, None])).T
    for half in (slice(0, 3), slice(3, 6)):
        size = np.max(np.abs(jacobian[:, half]))
        rounding = 1e-15 * np.max(np.abs(values)) / steps[half][0]
        np.testing.assert_allclose(jacobian[:, half], difference[:, half], rtol=0, atol=1e-7 * size + rounding)


@pytest.mark.slow
def test_single_precision_stays_single():
    @eqx.filter_jit
    def values(accelerations, t, position, velocity):
        return {name: value(a, t, position, velocity) for name, a in accelerations.items()}

    arguments = (ACCELERATIONS, jnp.asarray(700.0), POSITION, VELOCITY)
    expected = values(*arguments)
    for name, found in values(*jax.tree.map(lambda x: x.astype(jnp.float32), arguments)).items():
        assert found.dtype == jnp.float32
        size = float(np.max(np.abs(expected[name])))
        np.testing.assert_allclose(found, expected[name], rtol=0, atol=2e-5 * size, err_msg=name)


def test_parameters_are_leaves():
    slopes = jax.jit(jax.grad(lambda a: jnp.sum(value(a, jnp.zeros(()), POSITION, VELOCITY))))
    drag = slopes(Drag(0.02, ExponentialAtmosphere()))
    field = slopes(HarmonicGravity(egm2008(4), 1.2))
    assert float(drag.area_to_mass) != 0.0 and float(drag.atmosphere.scale) != 0.0
    assert float(field.field.cosine[2, 0]) != 0.0 and float(field.greenwich_angle_0) != 0.0
