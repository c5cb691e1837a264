"""The data of one fit: tables, measurements and weights, padded so that like files share a compiled program."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from fitting.measurements.abstract import RATE_UNIT, AbstractProblem, Prediction, Visit, small_turns
from fitting.measurements.groups import Group, Groups
from fitting.measurements.limb import LimbAngles, limb_residuals
from fitting.parameters.names import DYNAMIC, STATE, TILTS
from fitting.parameters.parametrization import Parametrization, build_model
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import LightTable, OrbitTable
from jaxsat.integrators import StepGrid
from jaxsat.math import quaternion
from jaxsat.sensors.solar_panels import Albedo, panel_currents
from jaxsat.simulate import Trajectory, simulate_on_grid
from jaxsat.spacecraft import SolarPanels, Spacecraft

CURRENTS = Group("currents", 6)
LIMB = Group("limb", 2, together=False)


class Problem(AbstractProblem):
    """A session of six panel currents, and of limb angles where they are fitted too."""

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
    floor: Float[Array | np.ndarray, "samples channels"]
    limb: LimbAngles | None = None
    """Limb angles at the samples; None where none are to be fitted."""

    @property
    def groups(self) -> Groups:
        return (CURRENTS,) if self.limb is None else (CURRENTS, LIMB)

    def telling(self) -> np.ndarray:
        bright = np.asarray(self.measured).max(axis=1) > 0
        return np.stack([bright] if self.limb is None else [bright, np.zeros_like(bright)], axis=1)

    def bright(self) -> np.ndarray:
        """[samples] whether some current stands three sigmas out of the noise, on the host."""
        return np.asarray(self.measured).max(axis=1) > 3.0 * float(self.noise)

    def sunlit(self) -> np.ndarray:
        """[samples] whether the sample is outside the computed shadow, on the host."""
        return np.asarray(self.light.illumination) > 0.5

    def predict_blocks(
        self,
        parameters: Parametrization,
        x: Float[Array, " unknowns"],
        reference: Float[Array, "4"],
        blocks: Int[Array | np.ndarray, ""],
        *,
        visit: Visit,
        carry: Any,
    ) -> tuple[Prediction, Any]:
        """As in `AbstractProblem`.

        Only the state and the dynamic parameters are carried through the integration in forward mode; the sensor's own
        parameters and the attitude at each sample enter by the chain rule.
        """
        model = _linear(parameters, x[len(STATE) :])
        moving, fixed = jnp.split(x, [len(STATE) + model.moving])
        trajectory, rotation = _motion(self, model, moving, reference, blocks)
        q, limb = trajectory.quaternion, self.limb
        sighted = None if limb is None else (self.orbit.position_eci[jnp.asarray(self.grid.sample_node)], limb.measured)
        inputs = (q, self.light, self.measured, rotation, sighted)
        residual, carry = self.over_arc(
            lambda *part: _whitened(self, model, fixed, *part), inputs, blocks, visit, carry
        )
        padding = jnp.zeros((*rotation.shape[:2], fixed.shape[0]), dtype=rotation.dtype)
        prediction = Prediction(
            residual=residual,
            quaternion=q,
            angular_velocity=trajectory.angular_velocity,
            rotation_jacobian=jnp.concatenate([rotation, padding], axis=-1),
        )
        return prediction, carry


class _Linear(eqx.Module):
    """The model to first order about one `x`, which is all that a Jacobian asks: once, and not in each of the loops."""

    spacecraft: Spacecraft
    panels: SolarPanels
    values: tuple
    """What moves the satellite, and what its panels report: currents, albedo and, where they may tilt, normals."""
    slopes: tuple
    """Of the values by the model's unknowns, those that move the satellite in front."""
    moving: int = eqx.field(static=True)
    """How many of them do."""

    def moved(self, shift: Float[Array, " moving"]) -> Spacecraft:
        """The satellite with its own unknowns changed."""
        return eqx.tree_at(_mechanical, self.spacecraft, _shifted(self.values[0], self.slopes[0], shift, 0))

    def seen(self, shift: Float[Array, " fixed"]) -> tuple[SolarPanels, Albedo]:
        """Panels and albedo with the sensor's unknowns changed."""
        values = _shifted(self.values[1], self.slopes[1], shift, self.moving)
        max_current, gains, albedo, *normals = values
        return SolarPanels(normals[0] if normals else self.panels.normals, max_current, gains), albedo


def _mechanical(spacecraft):
    return spacecraft.inertia, spacecraft.magnet, spacecraft.rods.moments


def _shifted(values, slopes, shift, first):
    """Values after a change of those unknowns of which number `first` is the first."""
    columns = slice(first, first + shift.shape[0])
    return jax.tree.map(lambda value, slope: value + slope[..., columns] @ shift, values, slopes)


def _linear(parameters: Parametrization, x_model: Float[Array, " free"]) -> _Linear:
    def model(x_model):
        craft, panels, albedo = build_model(parameters.values(x_model), jnp.asarray(parameters.reference_field))
        tilted = [panels.normals] if set(TILTS) & set(parameters.free) else []
        return (_mechanical(craft), (panels.max_current, panels.gains, albedo, *tilted)), (craft, panels)

    values, (craft, panels) = model(x_model)
    slopes = jax.jacfwd(lambda x_model: model(x_model)[0])(x_model)
    return _Linear(craft, panels, values, slopes, sum(name in DYNAMIC for name in parameters.free))


def _motion(
    problem: Problem,
    model: _Linear,
    moving: Float[Array, " moving"],
    reference: Float[Array, "4"],
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[Trajectory, Float[Array, "samples 3 moving"]]:
    """Motion by the state and the dynamic parameters, carried through the integration in forward mode.

    With it the small rotation in body axes [rad] for a unit change of each of them.
    """

    def motion(unknowns):
        spacecraft = model.moved(unknowns[len(STATE) :] - moving[len(STATE) :])
        q0 = quaternion.multiply(reference, quaternion.from_rotation_vector(unknowns[:3]))
        initial = AttitudeState(q0, unknowns[3:6] * RATE_UNIT)
        trajectory = simulate_on_grid(spacecraft, initial, problem.orbit, problem.grid, blocks=blocks)
        return trajectory.quaternion, trajectory

    tangents, trajectory = jax.jacfwd(motion, has_aux=True)(moving)
    return trajectory, small_turns(trajectory.quaternion, tangents)


def _currents(
    model: _Linear, fixed: Float[Array, " fixed"], q: Float[Array, "4"], light: LightTable
) -> tuple[Float[Array, "6"], Float[Array, "6 3"], Float[Array, "6 fixed"]]:
    """Currents at one sample [A], and their slopes by a small rotation in body axes and by the sensor's unknowns."""

    def currents(turn, unknowns):
        panels, albedo = model.seen(unknowns - fixed)
        modelled = panel_currents(quaternion.multiply(q, quaternion.from_rotation_vector(turn)), panels, albedo, light)
        return modelled, modelled

    slopes, modelled = jax.jacfwd(currents, argnums=(0, 1), has_aux=True)(jnp.zeros(3, dtype=q.dtype), fixed)
    return modelled, *slopes


def _whitened(
    problem: Problem,
    model: _Linear,
    fixed: Float[Array, " fixed"],
    q: Float[Array, "block 4"],
    light: LightTable,
    measured: Float[Array, "block 6"],
    rotation: Float[Array, "block 3 moving"],
    sighted: tuple[Array, Array] | None,
) -> tuple[Float[Array, "block channels"], Float[Array, "block channels unknowns"]]:
    """Residuals of a block of samples over their noise, and their Jacobian by the chain rule."""
    modelled, by_turn, by_sensor = jax.vmap(lambda q, light: _currents(model, fixed, q, light))(q, light)
    new = (modelled - measured, jnp.concatenate([by_turn @ rotation, by_sensor], axis=-1))
    new = jax.tree.map(lambda block: block / problem.noise, new)
    if problem.limb is None or sighted is None:
        return new
    off, by_turn = limb_residuals(problem.limb, q, *sighted)
    more = (off, jnp.pad(by_turn @ rotation, ((0, 0), (0, 0), (0, fixed.shape[0]))))
    return jax.tree.map(lambda currents, angles: jnp.concatenate([currents, angles], axis=1), new, more)
