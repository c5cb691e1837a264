"""All that belongs to an orbit in one object: its table is that of `tabulate_orbit` called by hand, slopes included."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import (
    AbstractOrbit,
    ConeShadow,
    CylinderShadow,
    ExponentialAtmosphere,
    KeplerOrbit,
    Sun,
    Surroundings,
    apparent_sun,
    igrf_dipole,
    tabulate_orbit,
)
from jaxsat.integrators import RK4, StepGrid
from jaxsat.simulate import simulate, simulate_on_grid
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.time import Epoch
from jaxsat.torques import PermanentMagnet

EPOCH = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
ELEMENTS = (7630.026457e3, 0.072661, 1.6657226, 1.1313013, 0.2910495, -3.0602300)
ORBIT, FIELD, GREENWICH = KeplerOrbit(*ELEMENTS), igrf_dipole(2001.05), 3.3376
# The Earth's shadow covers 2746 to 4009 s.
TIMES = np.linspace(0.0, 4500.0, 11)
SUN = Sun(EPOCH.tt_centuries())
TO_SUN = np.asarray(jax.jit(jax.vmap(SUN))(jnp.asarray(TIMES))[0])
DISTANCE = np.linalg.norm(TO_SUN, axis=1)
LIGHT = {"sun_eci": TO_SUN / DISTANCE[:, None], "sun_distance": DISTANCE}

by_hand = eqx.filter_jit(tabulate_orbit)
table_of = eqx.filter_jit(lambda surroundings, times: surroundings(times))

AIR, NEARBY, SHARP = ExponentialAtmosphere(scale=2.0), ConeShadow(sun_distance=1.0e11), CylinderShadow()
OPTIONS = {
    "nothing": ({}, {}),
    "rate and sharp shadow": (
        {"field_rate": True, "sun": SUN, "shadow": SHARP},
        {"field_rate": True, **LIGHT, "shadow": SHARP},
    ),
    "air and Sun nearby": (
        {"atmosphere": AIR, "sun": SUN, "shadow": NEARBY},
        {"atmosphere": AIR, **LIGHT, "shadow": NEARBY},
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OPTIONS)
def test_table_is_that_made_by_hand(name):
    options, arguments = OPTIONS[name]
    found = table_of(Surroundings(ORBIT, FIELD, GREENWICH, **options), jnp.asarray(TIMES))
    expected = by_hand(ORBIT, jnp.asarray(TIMES), FIELD, GREENWICH, **arguments)
    for entry in expected.__dataclass_fields__:
        one, other = getattr(found, entry), getattr(expected, entry)
        assert (one is None) == (other is None), entry
        if one is not None:
            # Two programs: rounding, of Kepler's equation and of the Sun's series most of all.
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * np.abs(other).max(), err_msg=entry)
    assert found.position_eci.shape == (11, 3)


def test_sun_stands_where_the_almanac_has_it():
    direction, distance = apparent_sun(EPOCH, TIMES)
    table = table_of(Surroundings(ORBIT, FIELD, GREENWICH, sun=SUN), jnp.asarray(TIMES))
    # The series is good to 0.005 deg; the pressure in full light to the square of its distance, 2e-5.
    np.testing.assert_allclose(table.sun_eci, direction, rtol=0, atol=np.radians(0.005))
    pressure = np.asarray(table.solar_pressure)
    lit = (TIMES < 2700) | (TIMES > 4040)
    np.testing.assert_allclose(pressure[lit], 4.56e-6 * (149597870700.0 / distance[lit]) ** 2, rtol=1e-4)
    np.testing.assert_array_equal(pressure[(TIMES > 2770) & (TIMES < 3985)], 0.0)


class Hovering(AbstractOrbit):
    """A place that does not move."""

    def __call__(self, t):
        return jnp.asarray([5e6, -4e6, 3e6]) + 0.0 * t, jnp.zeros(3)

    def check_span(self, times):
        """Always there."""


def test_earth_turns_at_the_given_rate():
    """Below a place that hovers, twice as fast for a time is as fast for twice the time; one turn is no turn."""
    fast = table_of(Surroundings(Hovering(), FIELD, GREENWICH, 2.0 * EARTH_ROTATION_RATE), jnp.asarray(TIMES))
    day = 2.0 * np.pi / EARTH_ROTATION_RATE
    plain = Surroundings(Hovering(), FIELD, GREENWICH)
    field = np.asarray(table_of(plain, jnp.asarray(2.0 * TIMES)).b_field_eci)
    np.testing.assert_allclose(fast.b_field_eci, field, atol=1e-13 * np.abs(field).max())
    np.testing.assert_allclose(
        table_of(plain, jnp.asarray(2.0 * TIMES + day)).b_field_eci, field, atol=1e-13 * np.abs(field).max()
    )
    assert np.abs(field[-1] - field[0]).max() > 1e-7


def test_shadow_without_the_sun_is_refused():
    with pytest.raises(ValueError, match="shadow is given without sun_eci"):
        Surroundings(ORBIT, FIELD, GREENWICH, shadow=ConeShadow())(jnp.asarray(TIMES))


def test_times_from_numpy_will_do():
    """The integrators lay their grids on the host."""
    surroundings = Surroundings(ORBIT, FIELD, GREENWICH)
    np.testing.assert_array_equal(
        table_of(surroundings, TIMES).b_field_eci, table_of(surroundings, jnp.asarray(TIMES)).b_field_eci
    )


CRAFT = Spacecraft(
    jnp.diag(jnp.asarray([0.05, 0.055, 0.06])),
    jnp.asarray([0.3, 0.004, -0.01]),
    MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3.0e-5)),
    SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6)),
)
START = AttitudeState(jnp.asarray([0.5, 0.5, -0.5, 0.5]), jnp.asarray([0.01, -0.02, 0.005]))
GRID = StepGrid.through(np.array([100.0, 300.0]), start=0.0, max_step=5.0)
MAGNET = (PermanentMagnet(),)


@pytest.mark.slow
def test_slopes_flow_from_the_elements_to_the_attitude():
    """Every number is a leaf: six elements, the dipole and the Earth's turn, by reverse mode through the table."""
    surroundings = Surroundings(ORBIT, FIELD, GREENWICH)
    nodes = jnp.asarray(GRID.node_times)

    def end(surroundings):
        motion = simulate_on_grid(CRAFT, START, surroundings(nodes), GRID, torques=MAGNET)
        return jnp.sum(motion.quaternion[1] * jnp.asarray([1.0, 2.0, -1.0, 0.5]))

    value, slopes = jax.jit(jax.value_and_grad(end))(surroundings)
    assert len(jax.tree.leaves(slopes)) == len(jax.tree.leaves(surroundings)) >= 9
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(slopes))
    run = jax.jit(end)
    assert run(surroundings) == pytest.approx(float(value), rel=1e-13)
    steps = {"semi_major_axis": 100.0, "eccentricity": 1e-5, "inclination": 1e-5, "raan": 1e-5}
    names = [name for name in ORBIT.__dataclass_fields__ if np.ndim(getattr(ORBIT, name)) == 0][:6]
    for name in names:
        h = steps.get(name, 1e-5)
        ends = []
        for sign in (1.0, -1.0):
            moved = eqx.tree_at(lambda s, n=name: getattr(s.orbit, n), surroundings, getattr(ORBIT, name) + sign * h)
            ends.append(float(run(moved)))
        slope = float(getattr(slopes.orbit, name))
        assert abs(slope) * h > 1e-8, name
        # Truncation (1e-5)^2, rounding 1e-16 of the sum over the change of it.
        assert slope == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6), name


@pytest.mark.slow
def test_motion_within_a_tolerance_through_an_object():
    """What is simulated at once is what is tabulated first."""
    surroundings = Surroundings(ORBIT, FIELD, GREENWICH)
    motion = simulate(CRAFT, START, surroundings, np.array([100.0, 300.0]), torques=MAGNET, tableau=RK4)
    table = table_of(surroundings, jnp.asarray(GRID.node_times))
    on_grid = eqx.filter_jit(simulate_on_grid)(CRAFT, START, table, GRID, torques=MAGNET)
    # The grid's steps of 5 s at 0.025 rad/s: (0.0125)^5 5^4 300 / 60 = 1e-6.
    assert motion.error is not None and motion.error <= 1e-6
    np.testing.assert_allclose(motion.quaternion, on_grid.quaternion, atol=2e-6)
