"""Every direction of the Sun that explains the currents of a `PyramidSunSensor`, the hood's shade included.

Where the published algorithm takes one root of a quadratic equation, all roots are kept here, and those that the shade
adds; each is then held against the whole model of the sensor. Which one is true is for the next instants to say
(`jaxsat.estimation.sun.tracker`).
"""

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from jaxsat.estimation.sun.faces import by_three, by_x, cosines_by_two, mirrored
from jaxsat.sensors.sun_sensor import PyramidSunSensor, lit_fraction, safe_sqrt

CANDIDATES = 3
STEPS = 4
"""Newton steps for the shaded solution: the first guess is good to a tenth and each step doubles the digits."""
SPREAD = 4.0
"""How much farther a direction may be off than the currents it was found from."""
ROUNDING = 1e-7
"""Relative currents that differ by less are equal, at the least."""


class Candidates(eqx.Module):
    """What one instant leaves possible."""

    direction: Float[Array, "3 3"]
    """[candidate axis] unit vectors in instrument axes."""
    possible: Bool[Array, "3"]
    """Whether a candidate explains all currents; the best one always does where a face is lit."""
    lit: Int[Array, ""]
    """Faces with a current."""


def sun_candidates(
    sensor: PyramidSunSensor,
    currents: Float[Array, "4"],
    expected: Float[Array, "3"],
    *,
    alive: Bool[Array, "4"] | None = None,
    threshold: float | Float[Array, ""] = 0.0,
    tolerance: float | Float[Array, ""] = 0.0,
) -> Candidates:
    """Directions that explain the currents [A] within `tolerance` [A]; those up to `threshold` [A] count as none.

    One lit face leaves a curve of directions: of it those with the component of the `expected` direction across the
    face, or the nearest to it; in the shade with its azimuth, as there each leaves a single direction. Faces that are
    not `alive` say nothing by being dark.
    """
    alive = jnp.ones(4, bool) if alive is None else alive
    s, c = jnp.sin(sensor.face_angle), jnp.cos(sensor.face_angle)
    i = jnp.where((currents > threshold) & alive, currents / sensor.max_current, 0.0)
    # Here and below: what is used many times is computed once.
    i, faces = lax.optimization_barrier((i, mirrored(i)))
    near, lit, both = faces.near, faces.lit, faces.both()

    three = by_three(sensor, faces)
    # Two opposite faces: the component across them by its size alone.
    z_pair = near[0] > 0.0
    along = jnp.where(z_pair, three[2], three[1])
    side = safe_sqrt(1.0 - three[0] ** 2 - along**2)
    beside = jnp.where(z_pair, jnp.array([0.0, 1.0, 0.0]), jnp.array([0.0, 0.0, 1.0])) * side
    flat = jnp.where(z_pair, jnp.array([1.0, 0.0, 1.0]), jnp.array([1.0, 1.0, 0.0])) * three
    opposite = (flat + beside, flat - beside, flat - beside)

    only = jnp.where(z_pair, near[0], near[1])
    wanted = jnp.where(z_pair, expected[1], expected[2])
    wanted_sine = wanted / jnp.maximum(safe_sqrt(expected[1] ** 2 + expected[2] ** 2), 1e-9)
    free = jnp.where(z_pair, ~alive[2:], ~alive[:2])
    only, wanted_sine = lax.optimization_barrier((only, wanted_sine))
    inner_x, outer_x, _ = cosines_by_two(sensor, near[0], near[1])
    shaded_x, shaded_share = _shaded(sensor, jnp.where(both, near[0], only), near[1], ~both, wanted_sine, free)
    inner_x, outer_x, shaded_x, shaded_share = lax.optimization_barrier((inner_x, outer_x, shaded_x, shaded_share))

    two = (
        by_x(sensor, near, inner_x),
        by_x(sensor, near, outer_x),
        by_x(sensor, near / shaded_share, shaded_x),
    )

    def of_one(x, toward, across):
        return jnp.where(z_pair, jnp.stack([x, across, toward]), jnp.stack([x, toward, across]))

    # The curve ends where the next face would light up.
    edge = jnp.cos(sensor.cutoff_angle)
    one = []
    for way, x in zip((1.0, -1.0), cosines_by_two(sensor, only, edge)[:2], strict=True):
        across = _within((edge - x * s) / c, wanted, free)
        reach = safe_sqrt(1.0 - only**2)
        across = jnp.clip(across, -reach, reach)
        from_normal = way * safe_sqrt(1.0 - only**2 - across**2)
        one.append(of_one(only * s + c * from_normal, only * c - s * from_normal, across))
    across = _within((edge - shaded_x * s) / c, wanted_sine * jnp.sqrt(1.0 - shaded_x**2), free)
    one.append(of_one(shaded_x, (only / shaded_share - shaded_x * s) / c, across))

    # Of a dark pair the sign is positive: the component across a single face keeps that of what was expected.
    signs = faces.signs()
    found, misfit = [], []
    for a, b, d in zip(one, two, opposite, strict=True):
        v = jnp.where(lit >= 3, three, jnp.where(lit == 1, a, jnp.where(both, b, d)))
        v = jnp.where(lit > 0, v * signs, jnp.array([1.0, 0.0, 0.0]))
        # Not zero; one division in place of three.
        v = lax.optimization_barrier(v * (1.0 / jnp.sqrt(jnp.sum(v**2))))
        found.append(v)
        misfit.append(lax.optimization_barrier(_misfit(sensor, v, i, alive)))
    limit = jnp.maximum(tolerance / sensor.max_current, ROUNDING)
    best = jnp.minimum(jnp.minimum(misfit[0], misfit[1]), misfit[2])
    # Of equal ones the first.
    repeated = [False, lit >= 3, (lit >= 3) | ((lit == 2) & ~both)]
    possible = [
        (m <= jnp.maximum(limit, best)) & ~jnp.asarray(again) & (lit > 0)
        for m, again in zip(misfit, repeated, strict=True)
    ]
    return Candidates(jnp.stack(found), jnp.stack(possible), lit)


def _within(limit, wanted, free):
    """The wanted component across a single lit face, up to `limit` on the sides where the next face is not `free`."""
    return jnp.clip(wanted, jnp.where(free[1], -1.0, -limit), jnp.where(free[0], 1.0, limit))


def _shaded(sensor, z_current, y_current, single, wanted_sine, free):
    """Cosine from the axis at which the hood shades the lit faces as far as their currents say, and the lit share.

    By Newton's method in u, the tangent of the angle: the share is h / (s + c u), so that with R = sqrt(1 + u^2) the
    components of the Sun over the sine of its angle are (i R (s + c u) / h - s) / (c u). The squares of those of y and
    z sum up to one; that of y is the `wanted_sine` of azimuth, as far as it goes, where z is the `single` lit face.
    All are all but linear in u.
    """
    s, c, h = jnp.sin(sensor.face_angle), jnp.cos(sensor.face_angle), sensor.hood_distance()
    edge, least, unshaded = jnp.cos(sensor.cutoff_angle), jnp.tan(sensor.hood_angle), 1.0 / (h * c)

    def stepped(u):
        R, inverse = jnp.sqrt(1.0 + u**2), 1.0 / u
        # i A - tilt with A = R (s + c u) / (h c u), and u times its derivative, i B less itself.
        A, tilt = R * (s + c * u) * inverse * unshaded, s / c * inverse
        B = ((1.0 + 2.0 * u**2) * c + s * u) * unshaded / R
        z, y = z_current * A - tilt, y_current * A - tilt
        dz, dy = z_current * B - z, y_current * B - y
        across = _within(edge / c * R * inverse - tilt, wanted_sine, free)
        value = jnp.where(single, z - safe_sqrt(1.0 - across**2), 0.5 * (z**2 + y**2 - 1.0))
        rise = jnp.where(single, dz, z * dz + y * dy)
        return jnp.clip(u - u * value / jnp.where(rise > 0.0, rise, 1.0), least / 1.2, 1e9)

    # What the faces' tilt takes away is the most at the hood's edge, and there the roots are those of a square.
    tilt = s / (c * least)
    across = _within(edge / jnp.sin(sensor.hood_angle) / c - tilt, wanted_sine, free)
    p, q = jnp.maximum(z_current**2 + y_current**2, 1e-18), tilt * (z_current + y_current)
    u = h * (q + safe_sqrt(q**2 + p * (1.0 - tilt**2 - jnp.where(single, across, tilt) ** 2))) / p - s / c
    u = jnp.maximum(u, least)
    for _ in range(STEPS - 1):
        u = lax.optimization_barrier(stepped(u))
    # The derivative of the solution is that of the last step alone.
    u = stepped(lax.stop_gradient(u))
    return 1.0 / jnp.sqrt(1.0 + u**2), h / (s + c * u)


def _misfit(sensor, v, i, alive):
    """How far a direction is from explaining the relative currents `i`.

    By the current of a lit face; by the cosine, over `SPREAD`, that an unlit one has beyond the angle of total
    reflection, or a lit one short of it.
    """
    cosine, edge = sensor.normals() @ v, jnp.cos(sensor.cutoff_angle)
    share = lit_fraction(sensor, v[0])
    beyond = share * (cosine - edge) / SPREAD
    lit = jnp.maximum(jnp.abs(share * cosine - i), -beyond)
    dark = jnp.where(alive, beyond, 0.0)
    off = jnp.maximum(jnp.where(i > 0.0, lit, dark), 0.0)
    most = jnp.maximum(jnp.maximum(off[0], off[1]), jnp.maximum(off[2], off[3]))
    return jnp.maximum(most, -v[0])
