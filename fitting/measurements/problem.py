"""The data of one fit of any satellite: what its sensors measured, on the union of their times."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.measurements.abstract import RATE_UNIT, AbstractProblem, Prediction, Visit, small_turns
from fitting.measurements.groups import Groups
from fitting.measurements.sky import Sky
from fitting.measurements.variational import Equations, Tangent, motion_and_columns
from fitting.parameters.names import STATE
from fitting.parameters.tree import FreeLeaves
from fitting.stored import part_of
from jaxsat.dynamics import AttitudeState, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.math import quaternion
from jaxsat.satellites.model import Model, with_values
from jaxsat.sensors.view import View
from jaxsat.simulate import simulate_on_grid
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques.hysteresis import lag_from_induction


class Motion(eqx.Module):
    """Attitude motion at the samples."""

    quaternion: Float[Array | np.ndarray, "*samples 4"]
    angular_velocity: Float[Array | np.ndarray, "*samples 3"]
    acceleration: Float[Array | np.ndarray, "*samples 3"]
    """Angular, body axes [rad/s^2]."""


class Problem(AbstractProblem):
    """Everything about a session that does not change while it is fitted."""

    grid: StepGrid
    orbit: OrbitTable
    """At the grid's nodes."""
    sky: Sky
    """At the samples."""
    measured: Mapping[str, Float[Array | np.ndarray, "samples readings"]]
    """Of each sensor, SI; zero where not measured."""
    known: Bool[Array | np.ndarray, "samples channels"]
    """Whether there is a measurement, for each column of residuals."""
    sigma: Float[Array | np.ndarray, " channels"]
    """1-sigma of each, SI."""
    valid: Bool[Array | np.ndarray, " samples"]
    floor: Float[Array | np.ndarray, "samples channels"]
    bright: Bool[Array | np.ndarray, "samples groups"]
    """Whether a sensor of light sees some."""
    model: Model
    """The nominal one, with the conventions of axes that are tried."""
    motion: Motion | None
    """Where it is given and not integrated."""
    of_sensors: Groups = eqx.field(static=True)
    delayed: tuple[str, ...] = eqx.field(static=True)
    """Channels whose stamps may be late."""

    @property
    def groups(self) -> Groups:
        return self.of_sensors

    def telling(self) -> np.ndarray:
        return np.asarray(self.bright)

    def views(
        self,
        model: Model,
        sky: Sky,
        attitude: Float[Array, "4"],
        rate: Float[Array, "3"],
        acceleration: Float[Array, "3"],
    ) -> dict[str, View]:
        """What every sensor saw at one sample, late stamps minded."""
        found = {}
        for group in self.of_sensors:
            late = jnp.asarray(model.delays[group.name]) if group.name in self.delayed else None
            found[group.name] = sky.view(attitude, rate, acceleration, model.albedo, late)
        return found

    def predict_blocks(
        self,
        parameters: FreeLeaves,
        x: Float[Array, " unknowns"],
        reference: Float[Array, "4"],
        blocks: Int[Array | np.ndarray, ""],
        *,
        visit: Visit,
        carry: Any,
        exact: bool = False,
    ) -> tuple[Prediction, Any]:
        moving, seeing = jnp.split(x, [len(STATE) + parameters.moving])

        def moved(x, reference, blocks):
            linear = linear_about(parameters, x[len(STATE) :])
            return linear, *motion_of(self, linear, moving, reference, blocks, exact=exact)

        linear, motion, slopes = part_of(moved)(x, reference, blocks)
        inputs = (motion, slopes, self.sky, self.measured, self.known)
        whitened = jax.vmap(lambda *sample: whitened_sample(self, linear, seeing, *sample))
        residual, carry = self.over_arc(whitened, inputs, blocks, visit, carry)
        turns = slopes[:, 0]
        padding = jnp.zeros((*turns.shape[:2], seeing.shape[0]), dtype=x.dtype)
        return Prediction(
            residual=residual,
            quaternion=jnp.asarray(motion.quaternion),
            angular_velocity=jnp.asarray(motion.angular_velocity),
            rotation_jacobian=jnp.concatenate([turns, padding], axis=-1),
        ), carry


class Linear(eqx.Module):
    """The leaves to first order about one `x`, which is all that a Jacobian asks."""

    parameters: FreeLeaves
    values: Float[Array, " leaves"]
    slopes: Float[Array, "leaves unknowns"]

    def moved(self, model: Model, shift: Float[Array, " moving"]) -> Model:
        """The model whose satellite has its own unknowns changed."""
        return self._with(model, self.values + self.slopes[:, : self.parameters.moving] @ shift, moves=True)

    def seen(self, model: Model, shift: Float[Array, " seeing"]) -> Model:
        """The model whose sensors have theirs changed."""
        return self._with(model, self.values + self.slopes[:, self.parameters.moving :] @ shift, moves=False)

    def _with(self, model, values, *, moves):
        spots = self.parameters.spots
        index = np.array([k for k, spot in enumerate(spots) if spot[0].startswith("spacecraft.") == moves], dtype=int)
        return with_values(model, [spots[k] for k in index], values[index])


def linear_about(parameters: FreeLeaves, x_model: Float[Array, " unknowns"]) -> Linear:
    return Linear(parameters, parameters.values(x_model), jax.jacfwd(parameters.values)(x_model))


def initial_state(
    spacecraft: Spacecraft, q: Float[Array, "4"], w: Float[Array, "3"], start: OrbitTable
) -> AttitudeState:
    """The state at one entry of an orbit's table; hysteresis rods begin with their own induction."""
    rods = spacecraft.hysteresis_rods
    if rods is None:
        return AttitudeState(q, w)
    return AttitudeState(
        q, w, lag_from_induction(rods, rods.induction, quaternion.rotate_inverse(q, start.b_field_eci))
    )


def motion_of(
    problem: Problem,
    linear: Linear,
    moving: Float[Array, " moving"],
    reference: Float[Array, "4"],
    blocks: Int[Array | np.ndarray, ""],
    *,
    exact: bool = True,
) -> tuple[Motion, Float[Array, "samples kinds 3 moving"]]:
    """The motion, and what a unit of each unknown of motion does to it at each sample.

    Turn [rad], change of rate [rad/s] and, where stamps may be late, of acceleration [rad/s^2]; `exact` as in
    `predict_blocks`.
    """
    samples, unknowns, late = problem.valid.shape[0], moving.shape[0], bool(problem.delayed)
    if problem.motion is not None:
        return problem.motion, jnp.zeros((samples, 3 if late else 2, 3, unknowns), dtype=moving.dtype)
    spacecraft = linear.moved(problem.model, jnp.zeros_like(moving[len(STATE) :])).spacecraft
    if exact or spacecraft.hysteresis_rods is not None:
        # Where a rod turns back, slopes jump.
        return _motion_by_tangents(problem, linear, moving, reference, blocks)

    def attitude(turn):
        return quaternion.multiply(reference, quaternion.from_rotation_vector(turn))

    def body(shift):
        return rigid_body(linear.moved(problem.model, shift).spacecraft)

    q, none = attitude(moving[:3]), jnp.zeros_like(moving[len(STATE) :])
    turns = small_turns(q[None], jax.jacfwd(attitude)(moving[:3])[None])[0]
    columns = (
        jnp.pad(turns, ((0, 0), (0, unknowns - 3))),
        jnp.pad(RATE_UNIT * jnp.eye(3, dtype=moving.dtype), ((0, 0), (3, unknowns - 6))),
    )
    equations, initial = Equations.of(body, none, len(STATE)), AttitudeState(q, moving[3:6] * RATE_UNIT)
    states, columns = motion_and_columns(equations, initial, columns, problem.orbit, problem.grid, blocks)
    acceleration = jnp.zeros_like(states.angular_velocity)
    if late:
        at_samples = jax.tree.map(lambda leaf: jnp.asarray(leaf)[problem.grid.sample_node], problem.orbit)
        acceleration, tangents = jax.vmap(equations.at)(states, at_samples)
        columns = (*columns, jax.vmap(Tangent.accelerations)(tangents, *columns))
    return Motion(states.quaternion, states.angular_velocity, acceleration), jnp.stack(columns, axis=1)


def _motion_by_tangents(problem, linear, moving, reference, blocks):
    """`motion_of` by derivatives of each step, whatever it is made of."""
    late, start = bool(problem.delayed), jax.tree.map(lambda leaf: jnp.asarray(leaf)[0], problem.orbit)
    at_samples = jax.tree.map(lambda leaf: jnp.asarray(leaf)[problem.grid.sample_node], problem.orbit)

    def motion(unknowns):
        spacecraft = linear.moved(problem.model, unknowns[len(STATE) :] - moving[len(STATE) :]).spacecraft
        q0 = quaternion.multiply(reference, quaternion.from_rotation_vector(unknowns[:3]))
        initial = initial_state(spacecraft, q0, unknowns[3:6] * RATE_UNIT, start)
        found = simulate_on_grid(spacecraft, initial, problem.orbit, problem.grid, blocks=blocks)
        acceleration = jnp.zeros_like(found.angular_velocity)
        if late:
            body = rigid_body(spacecraft)
            states = AttitudeState(found.quaternion, found.angular_velocity, found.rod_lag)
            acceleration = jax.vmap(lambda state, point: derivative(state, point, body).angular_velocity)(
                states, at_samples
            )
        found = Motion(found.quaternion, found.angular_velocity, acceleration)
        return found, found

    slopes, found = jax.jacfwd(motion, has_aux=True)(moving)
    turns = small_turns(jnp.asarray(found.quaternion), slopes.quaternion)
    kinds = [turns, slopes.angular_velocity, slopes.acceleration]
    return found, jnp.stack(kinds if late else kinds[:2], axis=1)


def whitened_sample(
    problem: Problem,
    linear: Linear,
    seeing: Float[Array, " seeing"],
    motion: Motion,
    slopes: Float[Array, "kinds 3 moving"],
    sky: Sky,
    measured: Mapping[str, Float[Array, " readings"]],
    known: Bool[Array, " channels"],
) -> tuple[Float[Array, " channels"], Float[Array, "channels unknowns"]]:
    """Residuals of one sample over their noise, and their Jacobian by the chain rule."""

    def differences(changes, unknowns):
        turn, spin, *more = changes
        model = linear.seen(problem.model, unknowns - seeing)
        attitude = quaternion.multiply(jnp.asarray(motion.quaternion), quaternion.from_rotation_vector(turn))
        acceleration = jnp.asarray(motion.acceleration)
        acceleration = acceleration + more[0] if more else acceleration
        views = problem.views(model, sky, attitude, motion.angular_velocity + spin, acceleration)
        found = []
        for name, view in views.items():
            sensor = model.sensors[name]
            found.append(sensor.difference(sensor(view), measured[name]) * sensor.sharpness(view))
        residual = jnp.where(known, jnp.concatenate(found) / problem.sigma, 0.0)
        return residual, residual

    none = jnp.zeros((slopes.shape[0], 3), dtype=seeing.dtype)
    (by_motion, by_seeing), residual = jax.jacfwd(differences, argnums=(0, 1), has_aux=True)(none, seeing)
    return residual, jnp.concatenate([jnp.einsum("ckj,kju->cu", by_motion, slopes), by_seeing], axis=-1)
