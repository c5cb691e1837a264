"""Numerical propagation: Kepler's closed form with its derivatives, integrals of motion, perturbations by behaviour."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import AU, EARTH_MU, EARTH_ROTATION_RATE
from jaxsat.environment import (
    SUN_MU,
    AbstractOrbit,
    CentralGravity,
    Drag,
    ExponentialAtmosphere,
    HarmonicGravity,
    SolarPressure,
    ThirdBody,
    elements_from_state,
    frame_motion,
    orbit_from_elements_km_deg,
    propagate_orbit,
)
from jaxsat.environment.gravity import egm2008
from jaxsat.time import Epoch

DAY = 86400.0
EPOCH = Epoch.from_utc(2022, 1, 28)


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


def start(a_km: float = 7000.0, e: float = 0.01, i_deg: float = 51.6, argp_deg: float = 30.0):
    orbit = orbit_from_elements_km_deg(
        a_km=a_km, e=e, i_deg=i_deg, raan_deg=20.0, argp_deg=argp_deg, mean_anomaly_deg=10.0
    )
    return _state_at_start(orbit)


@eqx.filter_jit
def _state_at_start(orbit):
    return jnp.concatenate(orbit(jnp.zeros(())))


def run(state, accelerations, stop, step=60.0, **options):
    return propagate_orbit(state[:3], state[3:], accelerations, stop=stop, step=step, **options)


def states(orbit):
    return np.asarray(orbit.position_eci), np.asarray(orbit.velocity_eci)


@jax.jit
def elements(orbit):
    return jax.vmap(elements_from_state)(orbit.position_eci, orbit.velocity_eci).elements


@pytest.mark.slow
def test_kepler_orbit_and_its_derivatives():
    state, stop = start(e=0.1), 6000.0

    def numerical(state):
        return jnp.concatenate(run(state, (CentralGravity(),), stop)(jnp.asarray(5432.1)))

    def closed(state):
        return jnp.concatenate(elements_from_state(state[:3], state[3:])(jnp.asarray(5432.1)))

    found, value = jax.jit(jax.jacrev(lambda state: (numerical(state),) * 2, has_aux=True))(state)
    expected, exact = jax.jit(jax.jacfwd(lambda state: (closed(state),) * 2, has_aux=True))(state)
    # Rounding of the elements, 1e-16 of the phase of a revolution, is the larger part.
    np.testing.assert_allclose(value, exact, rtol=0, atol=2e-6)
    scale = np.max(np.abs(expected), axis=(0,), keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-9)


def test_energy_and_momentum_of_a_central_field():
    r, v = states(run(start(e=0.1), (CentralGravity(),), DAY))
    energy = 0.5 * np.sum(v**2, axis=1) - EARTH_MU / np.linalg.norm(r, axis=1)
    momentum = np.cross(r, v)
    # Rounding of 1440 steps; the method's own drift at 60 s is below it.
    assert np.max(np.abs(energy / energy[0] - 1.0)) < 3e-14
    assert np.max(np.linalg.norm(momentum - momentum[0], axis=1)) < 3e-14 * np.linalg.norm(momentum[0])


def test_jacobi_integral_of_a_turning_field():
    field, angle = egm2008(8), 1.2
    orbit = run(start(), (HarmonicGravity(field, angle),), DAY)
    r, v = states(orbit)
    theta = angle + EARTH_ROTATION_RATE * 60.0 * np.arange(len(r))
    c, s = np.cos(theta), np.sin(theta)
    fixed = np.stack([c * r[:, 0] + s * r[:, 1], -s * r[:, 0] + c * r[:, 1], r[:, 2]], axis=1)
    potential = np.asarray(eqx.filter_jit(lambda f, x: jax.vmap(f.potential)(x))(field, jnp.asarray(fixed)))
    turning = EARTH_ROTATION_RATE * (r[:, 0] * v[:, 1] - r[:, 1] * v[:, 0])
    integral = 0.5 * np.sum(v**2, axis=1) - potential - turning
    revolutions = DAY / 5828.5
    # Drift found: 2e-16 of it a revolution at 60 s; 2e-14 at 120 s. Rounding scatters by 1e-14.
    assert abs(integral[-1] / integral[0] - 1.0) / revolutions < 2e-15
    assert np.max(np.abs(integral / integral[0] - 1.0)) < 3e-14
    # Neither the energy nor the momentum about the pole is kept on its own.
    assert np.ptp(0.5 * np.sum(v**2, axis=1) - potential) > 1e-8 * abs(integral[0])


@pytest.mark.slow
def test_error_of_the_step():
    forces = (HarmonicGravity(egm2008(8), 1.2),)
    fine = run(start(), forces, DAY, step=15.0).position_eci[-1]
    errors = {h: np.linalg.norm(run(start(), forces, DAY, step=h).position_eci[-1] - fine) for h in (60.0, 120.0)}
    # As the docstring says; order eight makes it 256 times as much for twice the step.
    assert errors[60.0] < 1e-3 and errors[120.0] < 1e-2
    assert errors[120.0] > 50 * errors[60.0]


@pytest.mark.slow
def test_there_and_back():
    forces = (HarmonicGravity(egm2008(4), 1.2), Drag(0.02))
    there = run(start(), forces, 20000.0)
    end = jnp.concatenate([there.position_eci[-1], there.velocity_eci[-1]])
    back = run(end, forces, 0.0, start=20000.0)
    assert float(back.start) == 0.0 and float(back.end) == pytest.approx(20000.0)
    np.testing.assert_allclose(back.position_eci, there.position_eci, rtol=0, atol=1e-4)
    np.testing.assert_allclose(back(jnp.asarray(777.0))[1], there(jnp.asarray(777.0))[1], rtol=0, atol=1e-7)


def test_steps_fill_the_span():
    orbit = run(start(), (CentralGravity(),), 250.0, start=10.0)
    assert orbit.position_eci.shape == (5, 3) and float(orbit.step) == 60.0 and float(orbit.start) == 10.0
    assert run(start(), (CentralGravity(),), 250.0).position_eci.shape == (6, 3)
    # One polynomial needs four samples.
    assert run(start(), (CentralGravity(),), 1.0).position_eci.shape == (4, 3)
    for bad in ({"stop": 0.0}, {"stop": 100.0, "step": 0.0}, {"stop": np.nan}):
        with pytest.raises(ValueError, match="^stop must differ"):
            run(start(), (CentralGravity(),), **bad)


def test_tables_that_end_early_are_announced():
    sun = Still(SUN.place, 5000.0)
    for force in (ThirdBody(SUN_MU, sun), SolarPressure(0.02, sun), frame_motion(EPOCH, start=0.0, stop=5000.0)):
        with pytest.raises(ValueError, match="too late|times must lie in"):
            run(start(), (CentralGravity(), force), 9000.0)


def test_drag_brings_a_satellite_down():
    # Circular at 400 km: da/dt = -(C_D A/m) rho sqrt(mu a) (King-Hele 1987), the air taken as still within 8 %.
    state = start(a_km=6778.137, e=0.0, i_deg=0.0)
    found = elements(run(state, (CentralGravity(), Drag(0.01, ExponentialAtmosphere(flattening=0.0))), DAY))
    a = np.asarray(found.semi_major_axis)
    assert np.all(np.diff(a) < 0.0)
    still = -0.01 * 3.725e-12 * np.sqrt(EARTH_MU * a[0]) * DAY
    wind = (1.0 - EARTH_ROTATION_RATE * np.sqrt(a[0] ** 3 / EARTH_MU)) ** 2
    # The density grows by 2 % over the loss of a kilometre.
    assert a[-1] - a[0] == pytest.approx(still * wind, rel=0.03)


def test_sunlight_pushes_away():
    state, forces = start(a_km=42164, e=0.0, i_deg=0.0), (CentralGravity(), SolarPressure(10.0, SUN))
    pushed, free = run(state, forces, 3000.0), run(state, (CentralGravity(), SolarPressure(0.0, SUN)), 3000.0)
    shift = np.asarray(pushed.position_eci[-1] - free.position_eci[-1])
    sun = np.asarray(SUN.place) / AU
    # Over a tenth of a radian of the orbit, a t^2/2 with a = 4.56e-6 x 10.
    assert -sun @ shift == pytest.approx(0.5 * 4.56e-5 * 3000.0**2, rel=0.02)


@pytest.mark.parametrize("i_deg, sign", [(40.0, -1), (140.0, 1)])
def test_oblateness_turns_the_node_against_the_motion(i_deg, sign):
    found = elements(run(start(i_deg=i_deg), (HarmonicGravity(egm2008(2, 0), 0.0),), DAY))
    node = np.unwrap(np.asarray(found.raan))
    j2 = 4.84165143790815e-4 * np.sqrt(5)
    expected = 1.5 * np.sqrt(EARTH_MU / 7e6**3) * j2 * (6378136.3 / 7e6) ** 2 * np.cos(np.radians(40.0)) * DAY
    assert node[-1] - node[0] == pytest.approx(sign * expected, rel=0.02)


@pytest.mark.parametrize("i_deg, factor", [(63.4349488, 0.0), (30.0, 2.75), (80.0, -0.849)])
def test_apsides_rest_at_the_critical_inclination(i_deg, factor):
    state = start(a_km=12000, e=0.4, i_deg=i_deg, argp_deg=45)
    orbit = run(state, (HarmonicGravity(egm2008(2, 0), 0.0),), 5 * DAY)
    found = elements(orbit)
    perigee = np.unwrap(np.asarray(found.argument_of_perigee, dtype=np.float64))
    j2 = 4.84165143790815e-4 * np.sqrt(5)
    p = 12e6 * (1 - 0.16)
    # 3/4 n J2 (R/p)^2 (4 - 5 sin^2 i), Vallado 2013 eq. 9-39.
    unit_rate = 0.75 * np.sqrt(EARTH_MU / 12e6**3) * j2 * (6378136.3 / p) ** 2
    rate = np.polyfit(60.0 * np.arange(len(perigee)), perigee, 1)[0]
    # Second order in J2, and the short periods of five days.
    assert rate / unit_rate == pytest.approx(factor, abs=0.02)


@pytest.mark.slow
def test_gradients_against_differences():
    stop = 7000.0

    def end(parameters):
        change, area, c20, scale = parameters
        field = egm2008(2)
        field = eqx.tree_at(lambda f: f.cosine, field, field.cosine.at[2, 0].add(c20))
        forces = (HarmonicGravity(field, 1.0), Drag(area, ExponentialAtmosphere(scale)))
        orbit = run(start_400 + change * unit, forces, stop, step=100.0)
        return jnp.concatenate([orbit.position_eci[-1], 1e3 * orbit.velocity_eci[-1]])

    start_400 = start(a_km=6800, e=0.005)
    # A metre of position or a millimetre of velocity along each axis.
    unit = jnp.asarray([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
    at = (jnp.zeros(6), jnp.asarray(0.02), jnp.asarray(0.0), jnp.asarray(1.3))
    forward_too = jax.jit(jax.jacfwd(lambda parameters: (end(parameters),) * 2, has_aux=True))
    jacobian, _ = forward_too(at)
    forward = np.concatenate([np.asarray(x).reshape(6, -1) for x in jacobian], axis=1)
    weights = jnp.asarray([1.0, -2.0, 0.5, 1.5, 1.0, -0.7])
    backward = jax.jit(jax.grad(lambda parameters: weights @ end(parameters)))(at)
    np.testing.assert_allclose(np.concatenate([x.ravel() for x in backward]), weights @ forward, rtol=1e-8)
    for k in range(9):
        # 5 m, 5 mm/s, then the parameters.
        step = (5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 2e-3, 1e-8, 0.1)[k]
        move = (jnp.asarray(step * np.eye(9)[k, :6]), *(jnp.asarray(step * x) for x in np.eye(9)[k, 6:]))
        ends = [forward_too(jax.tree.map(lambda x, d, s=s: x + s * d, at, move))[1] for s in (1.0, -1.0)]
        difference = np.asarray(ends[0] - ends[1]) / (2.0 * step)
        # Curvature of the flow: the third derivative over these steps, 1e-6 of the slope.
        np.testing.assert_allclose(forward[:, k], difference, rtol=0, atol=3e-6 * np.max(np.abs(difference)) + 1e-6)


def test_a_batch_under_one_trace():
    forces = (HarmonicGravity(egm2008(8), 1.2),)
    many = jnp.stack([start(a_km=a) for a in (6800.0, 7000.0, 7500.0)])
    batch = jax.jit(jax.vmap(lambda state: run(state, forces, DAY).position_eci[-1]))(many)
    for state, found in zip(many, batch, strict=True):
        np.testing.assert_allclose(found, run(state, forces, DAY).position_eci[-1], rtol=0, atol=1e-4)


@pytest.mark.slow
def test_single_precision_stays_single():
    single = jax.tree.map(lambda x: x.astype(jnp.float32), (HarmonicGravity(egm2008(2), 1.0), Drag(0.02)))
    state = start()
    orbit = run(state.astype(jnp.float32), single, 3000.0)
    assert orbit.position_eci.dtype == jnp.float32
    expected = run(state, (HarmonicGravity(egm2008(2), 1.0), Drag(0.02)), 3000.0).position_eci[-1]
    # Fifty additions to 7e6 m, each rounded by half a metre, and their growth along the track.
    np.testing.assert_allclose(orbit.position_eci[-1], expected, rtol=0, atol=100.0)
