"""Local method of `OptLoc` (Penkov et al. 2009, sec. 3.4): attitude and two factors of light from one sample.

Three angles and the factors of direct sunlight and albedo, both >= 0, for the least squares of six currents. The
factors are solved for inside, so the search is over the angles alone (variable projection, Golub & Pereyra 1973).

Six currents need not hold five unknowns: with four panels lit there are four equations, and the attitudes that explain
them exactly form a curve. The search then ends at its point near the start; `information` tells, by an eigenvalue of
zero, about which axis the satellite may be turned.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.local.shares import Limit, LocalFit, bounded_factors, patterns
from jaxsat.environment import LightTable
from jaxsat.estimation.vectors import two_vector_attitude
from jaxsat.math import inverse_3x3, quaternion, unit
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import SolarPanels

ITERATIONS = 5
"""Most starts have arrived by then; the others go on from where they are, see `local.session`."""
MIN_PANELS, MIN_CURRENT_MA = 4, 2.0
"""A sample takes part where so many panels show so much: albedo is certain only there (sec. 3.4)."""


class FiveParameterFit(eqx.Module):
    """Where the search ended from one start."""

    fit: LocalFit
    information: Float[Array, "*found 3 3"]
    """J'J of the currents by a rotation about the body axes, the factors following [A^2/rad^2]; of lit panels only."""
    slope: Float[Array, "*found"]
    """Length of the gradient of half the squares over their curvature along it [rad]: what is left to go."""


def compromise_start(
    sun_body: Float[Array, "3"], axis_body: Float[Array, "3"], sun_eci: Float[Array, "3"], toward_eci: Float[Array, "3"]
) -> Float[Array, "4"]:
    """Attitude between two claims that contradict each other: the Sun where the currents put it, an axis on the field.

    Both count alike, as in the published overdetermined system. `toward_eci` is the field, or its opposite.
    """
    body = jnp.stack([sun_body, axis_body])
    return two_vector_attitude(body, jnp.stack([sun_eci, unit(toward_eci)]), jnp.ones(2, sun_body.dtype))


def fit_five_parameters(
    start: Float[Array, "4"],
    measured: Float[Array, "6"],
    panels: SolarPanels,
    earth: Albedo,
    light: LightTable,
    *,
    sunny: Float[Array, "6"] | None = None,
    max_albedo: Limit = None,
    direct_weight: Float[Array, ""] | None = None,
) -> FiveParameterFit:
    """Levenberg-Marquardt over the attitude from one start; `max_albedo` None leaves both factors free, as published.

    `sunny` is 0 for panels whose current is said to be the Earth's alone, else 1: which one of a pair is the Sun's.
    `direct_weight` [A] adds the equation direct_weight (direct - 1) = 0: noise over the relative sigma of the largest
    current, where that is known. It is the fifth equation of samples with four panels lit.
    """

    def model(q):
        direct, albedo = patterns(q, panels, earth, light)
        direct = direct if sunny is None else sunny * direct
        target = measured
        if direct_weight is not None:
            direct = jnp.append(direct, direct_weight)
            albedo, target = jnp.append(albedo, 0.0), jnp.append(measured, direct_weight)
        a, b = bounded_factors(direct, albedo, target, max_albedo)
        return a * direct + b * albedo - target, (a, b)

    def linearised(q):
        def residual(turn):
            return model(quaternion.multiply(q, quaternion.from_rotation_vector(turn)))

        def column(axis):
            return jax.jvp(residual, (jnp.zeros(3, q.dtype),), (axis,), has_aux=True)

        left, slope, factors = jax.vmap(column, out_axes=(None, 1, None))(jnp.eye(3, dtype=q.dtype))
        return left, slope, factors

    def step(state, _):
        q, damping, left, slope = state
        normal = slope.T @ slope
        # The trace as the scale: along a direction that nothing sees, the step then stays zero.
        scale = jnp.trace(normal) + 1e-12 * (measured @ measured) + 1e-30
        turn = -inverse_3x3(normal + damping * scale * jnp.eye(3, dtype=q.dtype)) @ (slope.T @ left)
        # No further than where the linear model can hold: panels meet at 90 deg.
        turn = turn * jnp.minimum(1.0, 0.5 / jnp.maximum(jnp.sqrt(turn @ turn), 0.5))
        trial = quaternion.normalize(quaternion.multiply(q, quaternion.from_rotation_vector(turn)))
        new_left, new_slope, _ = linearised(trial)
        better = new_left @ new_left < left @ left
        damping = jnp.where(better, 0.1 * damping, 8.0 * damping)
        chosen = (trial, new_left, new_slope), (q, left, slope)
        q, left, slope = jax.tree.map(lambda a, b: jnp.where(better, a, b), *chosen)
        return (q, jnp.clip(damping, 1e-9, 1e6), left, slope), None

    left, slope, _ = linearised(start)
    state = (start, jnp.asarray(1e-2, start.dtype), left, slope)
    (q, _, _, _), _ = jax.lax.scan(step, state, None, length=ITERATIONS)
    left, slope, (a, b) = linearised(q)
    gradient = slope.T @ left
    length = jnp.sqrt(gradient @ gradient)
    curvature = jnp.sum((slope @ gradient) ** 2)
    to_go = jnp.where(curvature > 0.0, length**3 / jnp.where(curvature > 0.0, curvature, 1.0), 0.0)
    rms = jnp.sqrt(jnp.mean(left[: measured.shape[0]] ** 2))
    # A dark panel bounds the attitude from one side: where the search ends at its edge, its slope holds on the other.
    dark = jnp.append(measured < 1e-3 * MIN_CURRENT_MA, jnp.zeros(left.shape[0] - measured.shape[0], bool))
    told = jnp.where(dark[:, None], 0.0, slope)
    return FiveParameterFit(LocalFit(q, rms, a, b), told.T @ told, to_go)
