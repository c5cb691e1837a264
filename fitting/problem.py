"""The data of one fit: tables, measurements and weights, padded so that like files share a compiled program."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.limb import LimbAngles, limb_residuals
from fitting.names import DYNAMIC, STATE
from fitting.parameters import Parametrization, build_model
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import LightTable, OrbitTable
from jaxsat.integrators import BLOCK, StepGrid
from jaxsat.math import quaternion
from jaxsat.sensors.solar_panels import panel_currents
from jaxsat.simulate import simulate_on_grid

PAD_SAMPLES = 16
PAD_STEPS = 64
"""Samples and steps of a problem are padded to multiples of these."""

CURRENTS = 6
"""Channels of a sample that are panel currents; those of limb angles, where there are any, come after them."""

RATE_UNIT = 1.0 / 60.0
"""Unit of the rate unknowns [rad/s]: a radian, the attitude's own unit, in a minute."""


class Problem(eqx.Module):
    """Everything about a session that does not change while it is fitted."""

    grid: StepGrid
    orbit: OrbitTable
    """At the grid's nodes."""
    light: LightTable
    """At the samples."""
    measured: Float[Array | np.ndarray, "samples 6"]
    """Panel currents [A]."""
    valid: Bool[Array | np.ndarray, " samples"]
    """False for padding."""
    noise: Float[Array | np.ndarray, ""]
    """1-sigma of one current, quantisation included [A]."""
    limb: LimbAngles | None = None
    """Limb angles at the samples; None where none are to be fitted."""

    @property
    def channels(self) -> int:
        """Measurements of a sample: six currents and, with limb angles, distance and turn."""
        return CURRENTS + (0 if self.limb is None else 2)

    def bright(self) -> np.ndarray:
        """[samples] whether some current stands three sigmas out of the noise, on the host."""
        return np.asarray(self.measured).max(axis=1) > 3.0 * float(self.noise)

    def sunlit(self) -> np.ndarray:
        """[samples] whether the sample is outside the computed shadow, on the host."""
        return np.asarray(self.light.illumination) > 0.5


class Prediction(eqx.Module):
    """Whitened residuals of one trajectory and the attitude behind them."""

    residual: Float[Array, "samples channels"]
    """(modelled - measured) / sigma."""
    quaternion: Float[Array, "samples 4"]
    angular_velocity: Float[Array, "samples 3"]
    rotation_jacobian: Float[Array, "samples 3 unknowns"]
    """Small rotation in body axes [rad] for a unit change of each unknown."""


def predict(
    problem: Problem,
    parameters: Parametrization,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[Prediction, Float[Array, "samples channels unknowns"]]:
    """Residuals of one start about the attitude `reference` at the grid's start, and their exact Jacobian.

    Only the state and the dynamic parameters are carried through the integration in forward mode; the sensor's own
    parameters and the attitude at each sample enter by the chain rule.
    """
    free_dynamic = [name for name in parameters.free if name in DYNAMIC]
    n_moving = len(STATE) + len(free_dynamic)
    moving, fixed = x[:n_moving], x[n_moving:]

    def motion(moving):
        values = parameters.values(jnp.concatenate([moving[6:], fixed]))
        spacecraft, _ = build_model(values, jnp.asarray(parameters.reference_field))
        q0 = quaternion.multiply(reference, quaternion.from_rotation_vector(moving[:3]))
        initial = AttitudeState(q0, moving[3:6] * RATE_UNIT)
        trajectory = simulate_on_grid(spacecraft, initial, problem.orbit, problem.grid, blocks=blocks)
        return trajectory.quaternion, trajectory

    tangents, trajectory = jax.jacfwd(motion, has_aux=True)(moving)
    q = trajectory.quaternion
    # q' = q (0, r/2): the rotation r in body axes that each unit tangent of q stands for.
    product = jax.vmap(lambda p: quaternion.multiply(quaternion.conjugate(q), p), in_axes=-1, out_axes=-1)
    rotation = 2.0 * product(tangents)[:, 1:]

    def currents(turn, fixed, q, light):
        values = parameters.values(jnp.concatenate([moving[6:], fixed]))
        spacecraft, albedo = build_model(values, jnp.asarray(parameters.reference_field))
        turned = quaternion.multiply(q, quaternion.from_rotation_vector(turn))
        modelled = panel_currents(turned, spacecraft.panels, albedo, light)
        return modelled, modelled

    def at_sample(q, light):
        (by_turn, by_sensor), modelled = jax.jacfwd(currents, argnums=(0, 1), has_aux=True)(
            jnp.zeros(3, dtype=q.dtype), fixed, q, light
        )
        return modelled, by_turn, by_sensor

    # Only the arc's samples: on the first, short arcs the sensor would cost more than the motion.
    limb = problem.limb
    sighted = (
        None if limb is None else (problem.orbit.position_eci[jnp.asarray(problem.grid.sample_node)], limb.measured)
    )
    inputs = (q, problem.light, problem.measured, rotation, sighted)
    shape = (len(problem.measured), problem.channels)
    blank = (jnp.zeros(shape, dtype=x.dtype), jnp.zeros((*shape, x.shape[0]), dtype=x.dtype))

    def sample_block(number, carry):
        begin = number * PAD_SAMPLES
        part = jax.tree.map(lambda leaf: jax.lax.dynamic_slice_in_dim(jnp.asarray(leaf), begin, PAD_SAMPLES), inputs)
        q, light, measured, rotation, sighted = part
        modelled, by_turn, by_sensor = jax.vmap(at_sample)(q, light)
        new = (modelled - measured, jnp.concatenate([by_turn @ rotation, by_sensor], axis=-1))
        new = jax.tree.map(lambda block: block / problem.noise, new)
        if limb is not None:
            off, by_turn = limb_residuals(limb, q, *sighted)
            more = (off, jnp.pad(by_turn @ rotation, ((0, 0), (0, 0), (0, fixed.shape[0]))))
            new = jax.tree.map(lambda currents, angles: jnp.concatenate([currents, angles], axis=1), new, more)
        return jax.tree.map(
            lambda old, block: jax.lax.dynamic_update_slice_in_dim(old, block, begin, axis=0), carry, new
        )

    samples = jnp.sum(jnp.asarray(problem.grid.sample_index) <= blocks * BLOCK)
    residual, jacobian = jax.lax.fori_loop(0, (samples + PAD_SAMPLES - 1) // PAD_SAMPLES, sample_block, blank)
    padding = jnp.zeros((*rotation.shape[:2], fixed.shape[0]), dtype=rotation.dtype)
    prediction = Prediction(
        residual=residual,
        quaternion=q,
        angular_velocity=trajectory.angular_velocity,
        rotation_jacobian=jnp.concatenate([rotation, padding], axis=-1),
    )
    return prediction, jacobian
