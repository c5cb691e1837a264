"""Attitude and gyro bias from a gyro and directions, one control period after the other.

A multiplicative extended Kalman filter (Lefferts, Markley & Shuster 1982; Markley & Crassidis 2014, sec. 6.2): the
quaternion is a reference that turns with the gyro, and what is estimated are the rotation vector from it to the truth,
in body axes, and the error of the bias. Written for one satellite: `jax.vmap` outside, `jax.lax.scan` around.
Readings that are too far off to be noise may be refused (`AttitudeFilter.gate`).
"""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxsat.estimation.attitude_readings import AttitudeReadings, attitude, directions
from jaxsat.estimation.gate import passing
from jaxsat.estimation.gyro_errors import GyroErrors, carried_errors, mean_turn
from jaxsat.estimation.vectors import rotation_covariance, weighted_attitude
from jaxsat.math import cross, float_array, inverse_3x3, is_known, quaternion

ANEW_RAD, ANEW_BIAS = 1.0, 10.0
"""1-sigma of the attitude about each axis [rad], and factor of that of the bias, where a filter begins anew."""


class AttitudeBelief(eqx.Module):
    """State of the filter."""

    quaternion: Float[Array, "4"]
    """Attitude, scalar first, turns body vectors into inertial ones."""
    bias: Float[Array, "3"]
    """Of the gyro, body axes [rad/s]."""
    covariance: Float[Array, "6 6"]
    """Of the rotation vector from this attitude to the true one, body axes [rad], and of the bias less this one."""
    refusals: Float[Array, ""] = eqx.field(default_factory=lambda: jnp.zeros(()))
    """Updates in a row, up to now, that refused a reading; those without readings count for nothing."""


class AttitudeEstimate(eqx.Module):
    """What an update found."""

    quaternion: Float[Array, "4"]
    angular_velocity: Float[Array, "3"]
    """The reading less the bias, body axes [rad/s]."""
    bias: Float[Array, "3"]
    sigma: Float[Array, "3"]
    """1-sigma of the attitude about each body axis [rad]."""
    surprise: Float[Array, ""]
    """Squared innovations over their covariance: chi-square of `freedom` degrees where the filter is right (NIS)."""
    freedom: Float[Array, ""]
    """Numbers that were measured and taken: two a direction, three an attitude."""
    refused: Float[Array, ""]
    """Readings that the gate did not let pass."""


class AttitudeFilter(eqx.Module):
    """Settings of the filter: what the gyro does. How good the other sensors are stands in their readings."""

    gyro: GyroErrors
    looks: int = eqx.field(static=True, default=3)
    """How often an update looks at the same readings, each time from where the look before has led: one is the extended
    Kalman filter, more the iterated one, which errors of many degrees at the beginning need."""
    gate: float | None = eqx.field(static=True, default=None)
    """Probability with which a right reading passes, as 0.9999; None for a filter that takes all. A direction or an
    attitude is refused where its squared innovation, over the covariance that is expected of it, is beyond the
    chi-square of this probability (Bar-Shalom, Li & Kirubarajan 2001, sec. 5.4)."""
    patience: int = eqx.field(static=True, default=10)
    """With so many updates in a row that refuse a reading, which chance does not bring, the belief is taken to be
    wrong, and the filter begins anew: it takes all, its attitude open by `ANEW_RAD` and its bias by `ANEW_BIAS` times
    what it was. A sensor that stays wrong opens it again and again, and is not to be `known`."""

    def __check_init__(self):
        if self.gate is not None and not 0.0 < self.gate < 1.0:
            raise ValueError(f"AttitudeFilter: gate must be a probability between 0 and 1, or None, got {self.gate}")
        if self.patience < 1:
            raise ValueError(f"AttitudeFilter: patience must be at least 1, got {self.patience}")
        if self.looks < 1:
            raise ValueError(f"AttitudeFilter: looks must be at least 1, got {self.looks}")

    def start(
        self,
        q_inertial_from_body: Float[ArrayLike, "4"] | Sequence[float],
        *,
        sigma_rad: float | Float[ArrayLike, ""] | Float[ArrayLike, "3"] | Float[ArrayLike, "3 3"],
        bias_sigma_rad_s: float | Float[ArrayLike, ""] | Float[ArrayLike, "3"],
        bias: Float[ArrayLike, "3"] | Sequence[float] = (0.0, 0.0, 0.0),
    ) -> AttitudeBelief:
        """What is believed at the beginning: an attitude with its 1-sigma about each body axis, or their covariance.

        ValueError for a sigma that is not positive, or a quaternion of length zero.
        """
        q, attitude_sigma, bias_sigma = map(float_array, (q_inertial_from_body, sigma_rad, bias_sigma_rad_s))
        _check(q, attitude_sigma, bias_sigma)
        if attitude_sigma.ndim < 2:
            attitude_sigma = jnp.diag(jnp.broadcast_to(attitude_sigma**2, (3,)))
        zero = jnp.zeros((3, 3))
        of_bias = jnp.diag(jnp.broadcast_to(bias_sigma**2, (3,)))
        covariance = jnp.block([[attitude_sigma, zero], [zero, of_bias]])
        return AttitudeBelief(quaternion.normalize(q), float_array(bias), covariance)

    def start_from(
        self, readings: AttitudeReadings, *, bias_sigma_rad_s: float | Float[ArrayLike, ""] | Float[ArrayLike, "3"]
    ) -> AttitudeBelief:
        """The beginning by the directions alone (Davenport's q-method), with the covariance of Shuster & Oh (1981).

        At least two that are not parallel must be known: otherwise attitude and covariance are without meaning.
        """
        body, eci, weight = directions(readings)
        q = weighted_attitude(body, eci, weight)
        # One that is not known counts as a million times worse than the best.
        sigma = jnp.where(weight > 0.0, 1.0, 1e6) / jnp.sqrt(jnp.where(weight > 0.0, weight, jnp.max(weight)))
        seen = rotation_covariance(quaternion.rotate_inverse(q, eci), sigma)
        return self.start(q, sigma_rad=seen, bias_sigma_rad_s=bias_sigma_rad_s)

    def update(
        self, belief: AttitudeBelief, readings: AttitudeReadings, dt: float | Float[Array, ""]
    ) -> tuple[AttitudeBelief, AttitudeEstimate]:
        """The belief `dt` [s] later, with the readings of then, and the estimate for a control law.

        Equal to `predicted` and then `corrected`.
        """
        return self.corrected(self.predicted(belief, readings.rate, dt), readings)

    def predicted(
        self, belief: AttitudeBelief, rate: Float[Array, "3"], dt: float | Float[Array, ""]
    ) -> AttitudeBelief:
        """The belief `dt` [s] later, by the gyro's reading [rad/s] alone."""
        turning = rate - belief.bias
        transition, added = carried_errors(self.gyro, turning, dt)
        q = _turned(belief.quaternion, dt * turning)
        covariance = transition @ belief.covariance @ transition.T + added
        return AttitudeBelief(q, belief.bias, _symmetric(covariance), belief.refusals)

    def corrected(self, belief: AttitudeBelief, readings: AttitudeReadings) -> tuple[AttitudeBelief, AttitudeEstimate]:
        """The belief with what the readings say of the attitude, all of them at once.

        Each tells of the rotation vector d alone: with b a measured direction and p the believed one, b x p is the
        gradient and 1 - p p^T the information, over sigma^2 (QUEST's model of errors, Shuster & Oh 1981). Summed to
        h and L they enter as one reading of d, so that any number of sensors takes one matrix of three by three, with
        Joseph's form of the covariance. Further looks are Gauss-Newton's steps to the most probable d (Bell & Cathey
        1993). Then the reference turns by d, and with it the axes of the errors (Mueller, Hehn & D'Andrea 2017).
        """
        refused = jnp.zeros(())
        if self.gate is not None:
            belief, readings, refused = self._gated(belief, readings, self.gate)
        gain, gradient, information, square, freedom, change = _looked(belief, readings, None)
        for _ in range(self.looks - 1):
            gain, gradient, information, square, freedom, change = _looked(belief, readings, change[:3])
        P = belief.covariance
        eye = jnp.eye(3, dtype=P.dtype)
        # What the innovations are less what the update explains of them.
        surprise = square - gradient @ change[:3]
        kept = jnp.eye(6, dtype=P.dtype) - gain @ jnp.concatenate([information, jnp.zeros_like(eye)], axis=1)
        after = kept @ P @ kept.T + gain @ information @ gain.T
        axes = mean_turn(change[:3])
        turned = jnp.block([[axes, jnp.zeros_like(eye)], [jnp.zeros_like(eye), eye]])
        after = _symmetric(turned @ after @ turned.T)
        q = _turned(belief.quaternion, change[:3])
        found = AttitudeBelief(q, belief.bias + change[3:], after, belief.refusals)
        sigma = jnp.sqrt(jnp.diagonal(after)[:3])
        return found, AttitudeEstimate(q, readings.rate - found.bias, found.bias, sigma, surprise, freedom, refused)

    def _gated(self, belief, readings, gate):
        """The belief, the readings that pass, and how many do not; after too many refusals all pass to begin anew."""
        there, passed = passing(belief.quaternion, belief.covariance[:3, :3], readings, gate)
        some = jnp.any(there & ~passed)
        refusals = jnp.where(jnp.any(there), jnp.where(some, belief.refusals + 1.0, 0.0), belief.refusals)
        anew = refusals >= self.patience
        passed = passed | (anew & there)
        eye = jnp.eye(3, dtype=belief.covariance.dtype)
        zero = jnp.zeros_like(eye)
        wide = jnp.block([[ANEW_RAD**2 * eye, zero], [zero, ANEW_BIAS**2 * belief.covariance[3:, 3:]]])
        covariance, refusals = jnp.where(anew, wide, belief.covariance), jnp.where(anew, 0.0, refusals)
        known = None if readings.attitude is None else passed[-1]
        taken = dataclasses.replace(readings, known=passed[: len(readings.known)], attitude_known=known)
        refused = jnp.sum(jnp.where(there & ~passed, 1.0, 0.0))
        return AttitudeBelief(belief.quaternion, belief.bias, covariance, refusals), taken, refused


def _turned(q, angle):
    return quaternion.normalize(quaternion.multiply(q, quaternion.from_rotation_vector(angle)))


def _looked(belief, readings, turn):
    """What the readings say of the rotation vector as seen from `turn`, where a look before has led, and what follows.

    Gain [6 3], gradient, information, squared innovations, their number, and the change [6].
    """
    P = belief.covariance
    q = belief.quaternion if turn is None else _turned(belief.quaternion, turn)
    gradient, information, square, freedom = _said(q, readings)
    if turn is not None:
        # Told of turns from where it is now; asked for is the rotation vector from the belief.
        axes = mean_turn(turn)
        gradient, information = axes.T @ gradient, axes.T @ information @ axes
        shift = information @ turn
        square = square + (2.0 * gradient + shift) @ turn
        gradient = gradient + shift
    gain = P[:, :3] @ inverse_3x3(jnp.eye(3, dtype=P.dtype) + information @ P[:3, :3])
    # Or XLA would compute each look anew for every number of the next.
    return jax.lax.optimization_barrier((gain, gradient, information, square, freedom, gain @ gradient))


def _said(q, readings):
    """Gradient [3] and information [3 3] about the rotation vector, and innovations squared with their number."""
    body, eci, weight = directions(readings)
    believed = quaternion.rotate_inverse(q, eci)
    apart = cross(body, believed)
    gradient = weight @ apart
    square = weight @ jnp.sum(apart * apart, axis=1)
    across = jnp.eye(3, dtype=q.dtype)[None] - believed[:, :, None] * believed[:, None, :]
    information = jnp.sum(weight[:, None, None] * across, axis=0)
    freedom = 2.0 * jnp.sum(jnp.where(weight > 0.0, 1.0, 0.0))
    seen = attitude(readings)
    if seen is not None:
        measured, weights, known = seen
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(q), measured))
        gradient, square = gradient + weights * off, square + weights @ (off * off)
        information, freedom = information + jnp.diag(weights), freedom + jnp.where(known, 3.0, 0.0)
    return gradient, information, square, freedom


def _symmetric(matrix):
    return 0.5 * (matrix + matrix.T)


def _check(q, attitude_sigma, bias_sigma):
    if is_known(q) and not (np.all(np.isfinite(q)) and np.any(np.asarray(q) != 0.0)):
        raise ValueError(f"AttitudeFilter: expected a quaternion that is not zero, got {q}")
    for name, sigma in (("sigma_rad", attitude_sigma), ("bias_sigma_rad_s", bias_sigma)):
        if is_known(sigma):
            values = np.asarray(sigma)
            values = np.linalg.eigvalsh(values) if values.ndim == 2 else values
            if not np.all(np.isfinite(values) & (values > 0.0)):
                raise ValueError(f"AttitudeFilter: {name} must be above zero, got {sigma}")
