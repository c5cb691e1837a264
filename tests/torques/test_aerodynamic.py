"""Drag on facets: plates and spheres in closed form, the weathervane's motion, slopes at facets edge-on to the flow."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import Facets, MagneticRods, SolarPanels, Spacecraft, box_facets, box_normals
from jaxsat.torques import AerodynamicTorque, BodyEnvironment, aerodynamic_forces, aerodynamic_torque

DENSITY, SPEED, DRAG = 6.967e-13, 7613.0, 2.2
RNG = np.random.default_rng(4)
forces, torque = jax.jit(aerodynamic_forces), jax.jit(aerodynamic_torque)


def facets_of(areas, centers, normals, drag_coefficient=DRAG):
    zero = np.zeros(len(areas))
    return Facets(np.asarray(areas), np.asarray(centers), np.asarray(normals), zero, zero, drag_coefficient)


def plate(area=0.02, center=(0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0)):
    return facets_of([area], [center], [normal])


def craft_with(facets, inertia=1.0):
    rods = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    return Spacecraft(inertia * jnp.eye(3), jnp.zeros(3), rods, panels, facets=facets)


def around(velocity, density=DENSITY):
    zero = jnp.zeros(3)
    return BodyEnvironment(
        zero, zero, zero, air_velocity_body=jnp.asarray(velocity), air_density=jnp.asarray(float(density))
    )


def sphere(radius, n):
    """Equal areas about a spiral of Fibonacci points."""
    k = np.arange(n) + 0.5
    z, angle = 1 - 2 * k / n, np.pi * (1 + np.sqrt(5)) * k
    normals = np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)
    return facets_of(np.full(n, 4 * np.pi * radius**2 / n), radius * normals, normals)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 89.0, 90.0, 91.0, 150.0, 180.0])
def test_plate_at_an_angle(degrees):
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    velocity = SPEED * np.array([cosine, 0.6 * sine, 0.8 * sine])
    expected = -0.5 * DENSITY * DRAG * 0.02 * SPEED * velocity * max(cosine, 0.0)
    # The largest force is 9e-7 N; at 90 deg the cosine is 6e-17, not zero.
    np.testing.assert_allclose(
        forces(plate(), jnp.asarray(velocity), jnp.asarray(DENSITY)), [expected], rtol=1e-13, atol=1e-22
    )
    center = np.array([0.1, -0.2, 0.3])
    found = torque(plate(center=center), jnp.asarray(velocity), jnp.asarray(DENSITY))
    np.testing.assert_allclose(found, np.cross(center, expected), atol=1e-13 * 3e-7)


def test_torque_is_that_of_the_forces():
    facets = facets_of(RNG.random(9), RNG.normal(size=(9, 3)), Rotation.random(9, rng=RNG).apply([1.0, 0, 0]))
    velocities = SPEED * RNG.normal(size=(6, 3))
    found = jax.jit(jax.vmap(AerodynamicTorque(), (None, 0)))(
        craft_with(facets), jax.vmap(around, (0, None))(jnp.asarray(velocities), DENSITY)
    )
    for k, velocity in enumerate(velocities):
        parts = np.asarray(forces(facets, jnp.asarray(velocity), jnp.asarray(DENSITY)))
        assert np.count_nonzero(np.any(parts != 0, axis=1)) < 9
        expected = np.cross(np.asarray(facets.centers), parts).sum(axis=0)
        np.testing.assert_allclose(found[k], expected, atol=1e-13 * np.abs(parts).max() * 9)


def test_sphere_has_the_drag_of_its_disk_and_no_torque():
    ball = sphere(0.4, 2000)
    velocity = SPEED * Rotation.random(rng=RNG).apply([1.0, 0, 0])
    expected = -0.5 * DENSITY * DRAG * np.pi * 0.4**2 * SPEED * velocity
    size = float(np.linalg.norm(expected))
    # Equal areas on a spiral: the sum misses the integral by about 1/n.
    found = forces(ball, jnp.asarray(velocity), jnp.asarray(DENSITY))
    np.testing.assert_allclose(np.sum(found, axis=0), expected, atol=1e-3 * size)
    np.testing.assert_allclose(torque(ball, jnp.asarray(velocity), jnp.asarray(DENSITY)), 0.0, atol=1e-3 * 0.4 * size)


def test_box_has_the_drag_of_its_shadow_and_the_torque_of_its_windward_faces():
    size, shift = np.array([0.1, 0.2, 0.3]), np.array([0.01, -0.02, 0.03])
    for direction in [*Rotation.random(4, rng=RNG).apply([1.0, 0, 0]), np.array([0.0, 1.0, 0.0])]:
        velocity = jnp.asarray(SPEED * direction)
        drag = 0.5 * DENSITY * DRAG * SPEED**2 * np.abs(direction) @ (np.prod(size) / size)
        centred = box_facets(tuple(size))
        np.testing.assert_allclose(
            np.sum(forces(centred, velocity, jnp.asarray(DENSITY)), axis=0), -drag * direction, rtol=1e-13, atol=1e-20
        )
        # Three windward faces; about the middle their torques cancel only for a cube.
        windward = [0.5 * size[i] * np.sign(direction[i]) * np.eye(3)[i] for i in range(3)]
        load = 0.5 * DENSITY * DRAG * SPEED**2 * np.abs(direction) * (np.prod(size) / size)
        about_middle = sum(np.cross(c, -f * direction) for c, f in zip(windward, load, strict=True))
        np.testing.assert_allclose(torque(centred, velocity, jnp.asarray(DENSITY)), about_middle, atol=1e-13 * drag)
        moved = torque(box_facets(tuple(size), center_of_mass=tuple(shift)), velocity, jnp.asarray(DENSITY))
        np.testing.assert_allclose(moved, about_middle + np.cross(-shift, -drag * direction), atol=1e-13 * drag)


def test_cube_about_its_middle_has_no_torque():
    cube = box_facets((0.2, 0.2, 0.2))
    for direction in Rotation.random(5, rng=RNG).apply([1.0, 0, 0]):
        found = torque(cube, jnp.asarray(SPEED * direction), jnp.asarray(DENSITY))
        np.testing.assert_allclose(found, 0.0, atol=1e-16 * DENSITY * SPEED**2)


def test_tail_swings_behind_like_a_weathervane():
    """A plate 0.5 m behind the centre of mass: a pendulum of frequency sqrt(C_D rho S v^2 L / (2 J))."""
    arm, area, inertia, amplitude = 0.5, 0.1, 0.05, 0.02
    expected = np.sqrt(0.5 * DENSITY * DRAG * area * SPEED**2 * arm / inertia)
    times = np.linspace(0.0, 4 * 2 * np.pi / expected, 41)
    grid = StepGrid.through(times[1:], start=0.0, max_step=times[-1] / 400)
    nodes = len(grid.node_times)
    flight = np.array([0.6, 0.8, 0.0])

    def rows(vector):
        return jnp.asarray(np.tile(vector, (nodes, 1)))

    table = OrbitTable(
        rows([7e6, 0.0, 0.0]), rows(np.zeros(3)), air_velocity_eci=rows(SPEED * flight),
        air_density=jnp.full(nodes, DENSITY),
    )  # fmt: skip
    forward = Rotation.from_rotvec([0.0, 0.0, np.arctan2(0.8, 0.6)])
    start = forward * Rotation.from_rotvec([0.0, 0.0, amplitude])
    initial = AttitudeState(jnp.asarray(start.as_quat(scalar_first=True)), jnp.zeros(3))
    craft = craft_with(plate(area, (-arm, 0.0, 0.0)), inertia)
    motion = eqx.filter_jit(simulate_on_grid)(craft, initial, table, grid, torques=(AerodynamicTorque(),))
    attitudes = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True)
    off = np.arcsin(np.cross(flight, attitudes.apply([1.0, 0.0, 0.0]))[:, 2])
    assert np.max(np.abs(off)) < amplitude * 1.0001
    cosine = off[1:-1] @ (off[2:] + off[:-2]) / (2 * off[1:-1] @ off[1:-1])
    # The torque goes as sin(x) cos(x): the frequency drops by (2 x 0.02)^2 / 16 = 1e-4.
    assert np.arccos(cosine) / (times[1] - times[0]) == pytest.approx(expected, rel=3e-4)


def changed(x, direction):
    """Torque on a box with six of its inputs moved."""
    facets = box_facets(
        jnp.asarray([0.1, 0.2, 0.3]) * (1 + x[0]),
        center_of_mass=jnp.asarray([0.01, 0.02, -0.01]) + x[1] * jnp.asarray([0.1, 0, 0.1]),
        drag_coefficient=DRAG * (1 + x[2]),
    )
    velocity = SPEED * (direction + x[3] * jnp.eye(3)[1] + x[4] * jnp.eye(3)[2])
    return aerodynamic_torque(facets, velocity, DENSITY * (1 + x[5]))


slopes = jax.jit(lambda x, direction: (jax.jacfwd(changed)(x, direction), jax.jacrev(changed)(x, direction)))
values = jax.jit(jax.vmap(changed, (0, None)))


# The last two have faces of the box exactly edge-on.
@pytest.mark.slow
@pytest.mark.parametrize("direction", [(0.5, -0.7, 0.4), (0.6, 0.8, 0.0), (0.0, 0.0, -1.0)])
def test_slopes_against_differences(direction):
    """Edge-on the force has a corner: there the slope is half of the windward one, as that of a central difference."""
    direction, h = jnp.asarray(direction), 1e-5
    forward, reverse = slopes(jnp.zeros(6), direction)
    moved = np.asarray(values(jnp.asarray(h * np.concatenate([np.eye(6), -np.eye(6)])), direction))
    difference = ((moved[:6] - moved[6:]) / (2 * h)).T
    # Next to a corner a step's own half square is left: 1e-5 of the slope.
    np.testing.assert_allclose(forward, difference, atol=2e-5 * np.abs(difference).max())
    np.testing.assert_allclose(reverse, forward, atol=1e-13 * np.abs(difference).max())
    assert np.all(np.any(difference != 0, axis=0))


def test_absent_entries_are_named():
    craft, place = craft_with(plate()), around([SPEED, 0, 0])
    with pytest.raises(ValueError, match=r"AerodynamicTorque needs Spacecraft\.facets, .*box_facets"):
        AerodynamicTorque()(craft_with(None), place)
    missing = eqx.tree_at(lambda a: a.air_density, place, None)
    with pytest.raises(ValueError, match=r"AerodynamicTorque needs OrbitTable\.air_density, .*atmosphere="):
        AerodynamicTorque()(craft, missing)
    missing = eqx.tree_at(lambda a: a.air_velocity_body, place, None)
    with pytest.raises(ValueError, match=r"AerodynamicTorque needs OrbitTable\.air_velocity_eci, .*atmosphere="):
        AerodynamicTorque()(craft, missing)


def test_single_precision_stays_single():
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), (craft_with(plate()), around([SPEED, 0.0, 0.0])))
    assert AerodynamicTorque()(*single).dtype == jnp.float32
