"""Mirror albedo of whole polygons: fifty-digit mapping, counted rays, the small-panel limit, darkness, gradients."""

from decimal import Decimal, localcontext

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import mirrored_area, polygon_specular_albedo, specular_albedo
from jaxsat.environment.albedo.polygon import polygon_area

R = 6371.2e3
RATIO = 1.1975807
SUN = np.array([0.48, -0.6, 0.64])
LIMIT_DEG = 180 - np.degrees(np.arcsin(1 / RATIO))
both = jax.jit(lambda p, corners, s: (mirrored_area(p, corners, s, R), polygon_specular_albedo(p, corners, s, R)))
area_gradient = jax.jit(jax.grad(lambda position, corners, sun: mirrored_area(position, corners, sun, R), (0, 1, 2)))
smooth = jax.jit(lambda position, sun: specular_albedo(position, sun, R))


def area(position, corners, sun):
    return float(both(position, corners, sun)[0])


def factor(position, corners, sun):
    return float(both(position, corners, sun)[1])


def at(alpha_deg, ratio=RATIO, azimuth=0.4):
    """Position `alpha_deg` from the Sun."""
    a, across = np.radians(alpha_deg), np.cross(SUN, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    across = np.cos(azimuth) * across + np.sin(azimuth) * np.cross(SUN, across)
    return ratio * R * (np.cos(a) * SUN + np.sin(a) * across)


def square(normal, side, turn=0.3):
    """Corners of a square about the origin, counter-clockwise seen from where `normal` points."""
    first = np.cross(normal, [0.3, 0.5, 0.81])
    first /= np.linalg.norm(first)
    u = np.cos(turn) * first + np.sin(turn) * np.cross(normal, first)
    v = np.cross(normal, u)
    return 0.5 * side * np.array([u + v, v - u, -u - v, u - v])


def with_sides_split(corners, pieces):
    ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.concatenate([a + (b - a) * np.arange(pieces)[:, None] / pieces for a, b in ends])


def tilted(position, rng, tilt=0.4):
    """Normal somewhere about the direction to the reflection point."""
    normal = np.asarray(smooth(position, SUN)[0]) + tilt * rng.normal(size=3)
    return normal / np.linalg.norm(normal)


def mapped_exactly(position, corners, sun):
    """Area of the polygon mapped by eq. (1) of Penkov (2009), solved by halving in fifty digits."""
    with localcontext() as context:
        context.prec = 50
        s = [Decimal(float(x)) for x in sun]
        length = sum((x * x for x in s), Decimal(0)).sqrt()
        s = [x / length for x in s]
        feet = [
            _foot([Decimal(float(a)) + Decimal(float(b)) for a, b in zip(position, c, strict=True)], s) for c in corners
        ]
        doubled = Decimal(0)
        for a, b in zip(feet, feet[1:] + feet[:1], strict=True):
            cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            doubled -= sum(x * y for x, y in zip(cross, s, strict=True))
        return float(doubled / 2)


def _foot(point, s):
    """Reflection point projected on the plane across the Sun's rays, from b = sin Theta as the unknown."""
    z = sum((a * b for a, b in zip(point, s, strict=True)), Decimal(0))
    across = [a - z * b for a, b in zip(point, s, strict=True)]
    q = sum((a * a for a in across), Decimal(0)).sqrt()
    x, y = q / Decimal(R), z / Decimal(R)
    cosine = y / (x * x + y * y).sqrt()
    low, high = ((1 - cosine) / 2).sqrt(), (1 - cosine**2).sqrt() if y > 0 else Decimal(1)
    for _ in range(120):
        b = (low + high) / 2
        # (r/R) sin(2 Theta - alpha) - sin Theta with 2 Theta multiplied out; it grows through the wanted root.
        if 2 * b * (1 - b * b).sqrt() * y - (1 - 2 * b * b) * x - b < 0:
            low = b
        else:
            high = b
    return [a / q * low * Decimal(R) for a in across]


@pytest.mark.parametrize("side", [0.2, 100.0, 1e5])
def test_fifty_digits(side):
    rng = np.random.default_rng(3)
    for alpha in (4.0, 40.0, 75.0, 90.0, 115.0):
        position = at(alpha, ratio=rng.uniform(1.15, 2.0))
        corners = square(tilted(position, rng), side, rng.uniform(0, 6))
        expected = mapped_exactly(position, corners, SUN)
        # Positions of 7e6 m and offsets of 0.1 m go in separately, so the size of the panel costs no digits.
        assert area(position, corners, SUN) == pytest.approx(expected, rel=2e-14, abs=0)


@pytest.mark.parametrize("alpha, published", [(30, 0.487903), (60, 0.396329), (90, 0.223669), (120, 0.0223123)])
def test_published_factors(alpha, published):
    position = at(alpha)
    corners = square(np.asarray(smooth(position, SUN)[0]), 0.2)
    # The printed ratio has eight digits, the factors six.
    assert factor(position, corners, SUN) == pytest.approx(published, rel=3e-6)


def test_rays_counted():
    # Sunlight on a fine grid, mirrored by the sphere, passing through a tilted panel of 100 km.
    side, n = 1e5, 1000
    position = at(70.0, ratio=1.15)
    normal = tilted(position, np.random.default_rng(5))
    corners = square(normal, side)
    x_axis = np.cross(SUN, [1.0, 0.0, 0.0])
    x_axis /= np.linalg.norm(x_axis)
    y_axis = np.cross(SUN, x_axis)
    direction, _ = smooth(position, SUN)
    r, d = position, np.asarray(direction)
    foot = r + (-(r @ d) - np.sqrt((r @ d) ** 2 - r @ r + R**2)) * d
    step = side / n
    u = (np.arange(n) + 0.5) * step - 0.5 * side
    x, y = (c.ravel() for c in np.meshgrid(u + foot @ x_axis, u + foot @ y_axis))
    m = (x[:, None] * x_axis + y[:, None] * y_axis + np.sqrt(R**2 - x**2 - y**2)[:, None] * SUN) / R
    ray = 2 * (m @ SUN)[:, None] * m - SUN
    reach = ((position - R * m) @ normal) / (ray @ normal)
    hit = R * m + reach[:, None] * ray - position
    inside = (ray @ normal < 0) & (reach > 0)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= np.cross(b - a, hit - a) @ normal > 0
    counted = inside.sum() * step**2
    # Straight sides cost 6e-4 at this size, rays on the rim, in or out, 3e-4 of the 600 across.
    assert area(position, corners, SUN) == pytest.approx(counted, rel=1e-3)


def test_straight_sides():
    position = at(55.0, ratio=1 + 400e3 / R)
    corners = square(tilted(position, np.random.default_rng(2)), 1e3)
    fine = with_sides_split(corners, 16)
    # The docstring's 6e-8 of the area at 1 km; sixteen pieces a side leave a 256th of it.
    assert area(position, corners, SUN) == pytest.approx(mapped_exactly(position, fine, SUN), rel=6e-8, abs=0)


@pytest.mark.parametrize("alpha", [0.0, 1e-5, 20.0, 95.0, 120.0])
def test_small_panels_see_one_beam(alpha):
    position = at(alpha)
    normal = tilted(position, np.random.default_rng(7))
    direction, beam = smooth(position, SUN)
    expected = float(beam) * float(normal @ np.asarray(direction))
    # The beam's strength changes over a panel by the square of its size over the path of 1300 km and more: 6e-11.
    assert factor(position, square(normal, 10.0), SUN) == pytest.approx(expected, rel=1e-10, abs=0)


def test_area_of_any_flat_polygon():
    hexagon = 2.0 * np.stack([np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3), np.ones(6)], axis=1)
    assert float(polygon_area(jnp.asarray(hexagon))) == pytest.approx(6 * np.sqrt(3), rel=1e-14)


def test_refuses_a_line():
    with pytest.raises(ValueError, match="three corners"):
        mirrored_area(jnp.ones(3), jnp.ones((2, 3)), jnp.ones(3), 1.0)


def test_no_light_from_behind():
    position = at(50.0)
    normal = np.asarray(smooth(position, SUN)[0])
    assert area(position, square(normal, 0.2), SUN) > 0.0
    assert area(position, square(normal, 0.2)[::-1], SUN) == 0.0


def test_exactly_dark_beyond_the_terminator():
    for beyond, dark in ((-1e-3, False), (1e-6, True), (20.0, True), (180.0 - LIMIT_DEG, True)):
        position = at(LIMIT_DEG + beyond)
        corners = square(np.asarray(smooth(position, SUN)[0]), 0.2)
        assert (area(position, corners, SUN) == 0.0) is dark


def test_no_current_within_33_degrees_of_the_zenith():
    ratio = 7630.026457 / 6371.2
    tilt = np.arccos(1 / ratio)
    assert np.degrees(tilt) == pytest.approx(33.382416, abs=1e-6)
    found = {}
    for margin in (-0.01, 0.3):
        light = []
        for alpha in (1.0, 60.0, 110.0, 120.0):
            position = at(alpha, ratio)
            zenith = position / np.linalg.norm(position)
            east = np.cross(SUN, zenith)
            east /= np.linalg.norm(east)
            for azimuth in np.arange(0.0, 6.2, 0.7):
                across = np.cos(azimuth) * east + np.sin(azimuth) * np.cross(zenith, east)
                normal = np.cos(tilt + margin) * zenith + np.sin(tilt + margin) * across
                light.append(area(position, square(normal, 0.2), SUN))
        found[margin] = max(light)
    assert found[-0.01] == 0.0
    assert found[0.3] > 0.0


@pytest.mark.slow
def test_gradient_against_differences_in_fifty_digits():
    position = at(85.0)
    corners = square(tilted(position, np.random.default_rng(1)), 0.2)
    d_position, d_corners, d_sun = (np.asarray(g) for g in area_gradient(position, corners, SUN))

    def slope(function, h):
        return (function(h) - function(-h)) / (2 * h)

    for k in range(3):
        step = np.eye(3)[k]
        along = slope(lambda h, e=step: mapped_exactly(position + h * e, corners, SUN), 100.0)
        assert d_position[k] == pytest.approx(along, abs=1e-7 * float(np.linalg.norm(d_position)))
        corner = np.outer(np.arange(4) == 2, step)
        along = slope(lambda h, e=corner: mapped_exactly(position, corners + h * e, SUN), 1e-3)
        # The area is linear in one corner but for parts in 1e8: the central difference is exact.
        assert d_corners[2, k] == pytest.approx(along, abs=1e-7 * np.abs(d_corners).max())
    turn = np.cross(SUN, [0.0, 0.0, 1.0])
    along = slope(lambda h: mapped_exactly(position, corners, SUN + h * turn), 1e-5)
    assert d_sun @ turn == pytest.approx(along, rel=1e-7, abs=0)


@pytest.mark.parametrize("alpha", [0.0, 1e-9, LIMIT_DEG - 1e-9, LIMIT_DEG, LIMIT_DEG + 1e-9, 180.0])
def test_value_and_gradient_are_finite(alpha):
    position = RATIO * R * SUN if alpha == 0.0 else at(alpha)
    corners = square(-position / np.linalg.norm(position), 0.2)
    leaves = jax.tree.leaves((both(position, corners, SUN), area_gradient(position, corners, SUN)))
    assert all(np.all(np.isfinite(x)) for x in leaves)


@pytest.mark.slow
def test_batches_and_forward_mode():
    positions = np.stack([at(a) for a in (30.0, 80.0, 150.0)])
    corners = square(-positions[0] / np.linalg.norm(positions[0]), 0.2)
    panel, sun = jnp.asarray(corners), jnp.asarray(SUN)
    jacobian = jax.jit(jax.vmap(jax.jacfwd(lambda p: mirrored_area(p, panel, sun, R))))(positions)
    for position, row in zip(positions, jacobian, strict=True):
        reverse = area_gradient(position, corners, SUN)[0]
        np.testing.assert_allclose(row, reverse, rtol=1e-11, atol=1e-20)


def test_single_precision():
    position, corners = at(65.0), square(tilted(at(65.0), np.random.default_rng(4)), 0.2)
    found, ratio = both(*(jnp.asarray(x, jnp.float32) for x in (position, corners, SUN)))
    assert found.dtype == ratio.dtype == jnp.float32
    # A few roundings of 6e-8 in the position and the angles, none magnified by the panel's smallness.
    assert float(found) == pytest.approx(area(position, corners, SUN), rel=3e-6)
