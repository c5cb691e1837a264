"""Sunlight on facets: plates and spheres in closed form, the pointing motion, slopes with the Sun on the horizon."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial.transform import Rotation

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import Facets, MagneticRods, SolarPanels, Spacecraft, box_facets, box_normals
from jaxsat.torques import BodyEnvironment, SolarPressureTorque, solar_pressure_forces, solar_pressure_torque

PRESSURE = 4.56e-6
RNG = np.random.default_rng(6)
forces, torque = jax.jit(solar_pressure_forces), jax.jit(solar_pressure_torque)


def facets_of(areas, centers, normals, specular=0.0, diffuse=0.0):
    n = len(areas)
    return Facets(
        np.asarray(areas), np.asarray(centers), np.asarray(normals), np.full(n, specular), np.full(n, diffuse)
    )


def plate(specular=0.0, diffuse=0.0, area=0.5, center=(0.0, 0.0, 0.0)):
    return facets_of([area], [center], [[0.0, 0.0, 1.0]], specular, diffuse)


def craft_with(facets, inertia=1.0):
    rods = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    return Spacecraft(inertia * jnp.eye(3), jnp.zeros(3), rods, panels, facets=facets)


def around(sun, pressure=PRESSURE):
    zero = jnp.zeros(3)
    return BodyEnvironment(
        zero, zero, zero, sun_body=jnp.asarray(sun), solar_pressure=jnp.asarray(float(pressure))
    )  # fmt: skip


def sun_at(degrees):
    angle = np.radians(degrees)
    return np.array([0.6 * np.sin(angle), 0.8 * np.sin(angle), np.cos(angle)])


@pytest.mark.parametrize("degrees", [0.0, 40.0, 75.0, 90.0, 91.0, 180.0])
def test_black_plate_is_pushed_along_the_light_and_a_mirror_along_its_normal(degrees):
    sun, normal, cosine = sun_at(degrees), np.array([0.0, 0, 1]), max(np.cos(np.radians(degrees)), 0.0)
    black = forces(plate(), jnp.asarray(sun), jnp.asarray(PRESSURE))
    mirror = forces(plate(specular=1.0), jnp.asarray(sun), jnp.asarray(PRESSURE))
    np.testing.assert_allclose(black, [-PRESSURE * 0.5 * cosine * sun], rtol=1e-13, atol=1e-21)
    # Twice the light's momentum along the normal, none along the plate.
    np.testing.assert_allclose(mirror, [-2 * PRESSURE * 0.5 * cosine**2 * normal], rtol=1e-13, atol=1e-21)


def test_white_plate_recoils_by_the_mean_direction_of_lambert_light():
    """Light scattered as cos(theta)/pi carries two thirds of its momentum along the normal."""
    recoil = dblquad(
        lambda theta, _: np.cos(theta) ** 2 * np.sin(theta) / np.pi, 0, 2 * np.pi, 0, np.pi / 2, epsabs=1e-12
    )[0]
    sun = sun_at(35.0)
    expected = -PRESSURE * 0.5 * np.cos(np.radians(35.0)) * (sun + recoil * np.array([0, 0, 1.0]))
    np.testing.assert_allclose(
        forces(plate(diffuse=1.0), jnp.asarray(sun), jnp.asarray(PRESSURE)), [expected], rtol=1e-12
    )
    # A mixed surface is the mean of its parts.
    mixed = forces(plate(0.2, 0.3), jnp.asarray(sun), jnp.asarray(PRESSURE))
    parts = [forces(plate(*x), jnp.asarray(sun), jnp.asarray(PRESSURE)) for x in ((0, 0), (1.0, 0), (0, 1.0))]
    np.testing.assert_allclose(mixed, 0.5 * parts[0] + 0.2 * parts[1] + 0.3 * parts[2], rtol=1e-13)


@pytest.mark.parametrize(("specular", "diffuse", "factor"), [(0, 0, 1), (1, 0, 1), (0, 1, 13 / 9)])
def test_sphere(specular, diffuse, factor):
    """Black and mirror spheres feel the pressure on their disk, a white one 4/9 more."""
    n, radius = 2000, 0.7
    k = np.arange(n) + 0.5
    z, angle = 1 - 2 * k / n, np.pi * (1 + np.sqrt(5)) * k
    normals = np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)
    ball = facets_of(np.full(n, 4 * np.pi * radius**2 / n), radius * normals, normals, float(specular), float(diffuse))
    sun = Rotation.random(rng=RNG).apply([1.0, 0, 0])
    disk = PRESSURE * np.pi * radius**2
    # Equal areas on a spiral: the sum misses the integral by about 1/n.
    found = np.sum(forces(ball, jnp.asarray(sun), jnp.asarray(PRESSURE)), axis=0)
    np.testing.assert_allclose(found, -factor * disk * sun, atol=1e-3 * disk)
    np.testing.assert_allclose(torque(ball, jnp.asarray(sun), jnp.asarray(PRESSURE)), 0.0, atol=1e-3 * disk * radius)


def test_torque_is_that_of_the_forces_and_ends_in_the_shadow():
    normals = Rotation.random(8, rng=RNG).apply([1.0, 0, 0])
    facets = Facets(
        RNG.random(8), RNG.normal(size=(8, 3)), normals, 0.5 * RNG.random(8), 0.5 * RNG.random(8)
    )  # fmt: skip
    suns = Rotation.random(5, rng=RNG).apply([1.0, 0, 0])
    pressures = PRESSURE * np.array([1.0, 0.97, 0.5, 0.1, 0.0])
    places = jax.vmap(lambda s, p: BodyEnvironment(s, s, s, sun_body=s, solar_pressure=p))(
        jnp.asarray(suns), jnp.asarray(pressures)
    )
    found = jax.jit(jax.vmap(SolarPressureTorque(), (None, 0)))(craft_with(facets), places)
    for k in range(4):
        parts = np.asarray(forces(facets, jnp.asarray(suns[k]), jnp.asarray(pressures[k])))
        expected = np.cross(np.asarray(facets.centers), parts).sum(axis=0)
        np.testing.assert_allclose(found[k], expected, atol=1e-13 * 8 * np.abs(parts).max())
    np.testing.assert_array_equal(found[4], 0.0)


def test_cube_about_its_middle_has_no_torque():
    cube = box_facets((0.2, 0.2, 0.2), specular=0.3, diffuse=0.4)
    for sun in Rotation.random(5, rng=RNG).apply([1.0, 0, 0]):
        np.testing.assert_allclose(
            torque(cube, jnp.asarray(sun), jnp.asarray(PRESSURE)), 0.0, atol=1e-17 * PRESSURE * 10
        )


def test_sail_behind_the_centre_of_mass_points_to_the_sun():
    """A black plate 2 m behind: a pendulum of frequency sqrt(P S L / J) about the Sun's direction."""
    arm, area, inertia, amplitude = 2.0, 10.0, 5.0, 0.02
    expected = np.sqrt(PRESSURE * area * arm / inertia)
    times = np.linspace(0.0, 4 * 2 * np.pi / expected, 41)
    grid = StepGrid.through(times[1:], start=0.0, max_step=times[-1] / 400)
    nodes = len(grid.node_times)

    def rows(vector):
        return jnp.asarray(np.tile(np.asarray(vector, float), (nodes, 1)))

    table = OrbitTable(
        rows([7e6, 0, 0]), rows([0, 0, 0]), sun_eci=rows([0, 0, 1]), solar_pressure=jnp.full(nodes, PRESSURE)
    )
    start = Rotation.from_rotvec([amplitude, 0.0, 0.0])
    initial = AttitudeState(jnp.asarray(start.as_quat(scalar_first=True)), jnp.zeros(3))
    craft = craft_with(plate(area=area, center=(0.0, 0.0, -arm)), inertia)
    motion = eqx.filter_jit(simulate_on_grid)(craft, initial, table, grid, torques=(SolarPressureTorque(),))
    along = Rotation.from_quat(np.asarray(motion.quaternion), scalar_first=True).apply([0.0, 0, 1])
    off = np.arcsin(along[:, 1])
    assert np.max(np.abs(off)) < amplitude * 1.0001
    cosine = off[1:-1] @ (off[2:] + off[:-2]) / (2 * off[1:-1] @ off[1:-1])
    # The torque goes as sin(x) cos(x): the frequency drops by (2 x 0.02)^2 / 16 = 1e-4.
    assert np.arccos(cosine) / (times[1] - times[0]) == pytest.approx(expected, rel=3e-4)


def changed(x, sun):
    """Torque on a box with six of its inputs moved."""
    facets = box_facets(
        jnp.asarray([0.1, 0.2, 0.3]) * (1 + x[0]),
        center_of_mass=jnp.asarray([0.01, 0.02, -0.01]) + x[1] * jnp.asarray([0.1, 0, 0.1]),
        specular=0.2 + x[2],
        diffuse=0.3 + x[3],
    )
    return solar_pressure_torque(facets, sun + x[4] * jnp.asarray([0.0, 0.6, 0.8]), PRESSURE * (1 + x[5]))


slopes = jax.jit(lambda x, sun: (jax.jacfwd(changed)(x, sun), jax.jacrev(changed)(x, sun)))
values = jax.jit(jax.vmap(changed, (0, None)))


# The last two have the Sun exactly on the horizon of faces of the box.
@pytest.mark.slow
@pytest.mark.parametrize("sun", [(0.5, -0.7, 0.4), (0.6, 0.8, 0.0), (0.0, 0.0, -1.0)])
def test_slopes_against_differences(sun):
    """On the horizon the force has a corner: there the slope is half of the lit one, as that of a difference."""
    sun, h = jnp.asarray(sun), 1e-5
    forward, reverse = slopes(jnp.zeros(6), sun)
    moved = np.asarray(values(jnp.asarray(h * np.concatenate([np.eye(6), -np.eye(6)])), sun))
    difference = ((moved[:6] - moved[6:]) / (2 * h)).T
    # Next to a corner a step's own half square is left: 1e-5 of the slope.
    np.testing.assert_allclose(forward, difference, atol=2e-5 * np.abs(difference).max())
    np.testing.assert_allclose(reverse, forward, atol=1e-13 * np.abs(difference).max())
    assert np.all(np.any(difference != 0, axis=0))


def test_absent_entries_are_named():
    place = around([0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match=r"SolarPressureTorque needs Spacecraft\.facets, .*box_facets"):
        SolarPressureTorque()(craft_with(None), place)
    for entry, name in (("sun_body", "sun_eci"), ("solar_pressure", "solar_pressure")):
        missing = eqx.tree_at(lambda a, e=entry: getattr(a, e), place, None)
        with pytest.raises(
            ValueError, match=rf"SolarPressureTorque needs OrbitTable\.{name}, .*tabulate_orbit.*sun_eci"
        ):
            SolarPressureTorque()(craft_with(plate()), missing)


def test_single_precision_stays_single():
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), (craft_with(plate()), around([0.0, 0.6, 0.8])))
    assert SolarPressureTorque()(*single).dtype == jnp.float32
