"""The slow turning of the true equator and equinox of date, as an acceleration of whatever is described in them."""

import erfa
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline

from jaxsat.environment.orbit.accelerations import AbstractAcceleration
from jaxsat.environment.orbit.sampled import WINDOW, check_sampled, interpolated
from jaxsat.math import cross
from jaxsat.time import SECONDS_PER_DAY, Epoch

_STEP_S = 10800.0


class FrameMotion(AbstractAcceleration):
    """Inertial acceleration of the true axes of date: - 2 w x v - dw/dt x r - w x (w x r), w their angular velocity.

    Precession (7.7e-12 rad/s) and nutation (as fast, in days and weeks) make 1e-7 m/s^2 of it in a low orbit: described
    in these axes without it, the satellite would be wrong by 300 m after ten days.
    """

    start: Float[Array, ""]
    """Time of the first sample [s]."""
    step: Float[Array, ""]
    """Time between samples [s]."""
    angular_velocity: Float[Array, "samples 3"]
    """Angular velocity of the axes against the stars, in the axes themselves [rad/s]."""
    angular_acceleration: Float[Array, "samples 3"]
    """Its derivative [rad/s^2]."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> tuple[Float[Array, "stages 3"], Float[Array, "stages 3"]]:
        """Return angular velocity and acceleration of the axes; NaN outside the span of the samples."""
        return self.turning(times)

    def turning(self, times: Float[Array, "n"]) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Return angular velocity [rad/s] and acceleration [rad/s^2] of the axes, in the axes themselves."""

        def at(t):
            return interpolated(t, self.start, self.step, self.angular_velocity, self.angular_acceleration)

        return jax.vmap(at)(times)

    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless the motion is tabulated at all `times` [s]."""
        check_sampled(times, self.start, self.step, self.angular_velocity.shape[0])

    def __call__(
        self,
        given: tuple[Float[Array, "3"], Float[Array, "3"]],
        position_eci: Float[Array, "3"],
        velocity_eci: Float[Array, "3"],
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        w, w_rate = given
        return -cross(w, 2.0 * velocity_eci + cross(w, position_eci)) - cross(w_rate, position_eci)


def frame_motion(epoch: Epoch, *, start: int | float, stop: int | float) -> FrameMotion:
    """Return the motion of the true axes of date from `start` to `stop` [s after `epoch`] (ERFA pnm06a).

    IAU 2006/2000A, sampled every three hours or less, which follows the fastest terms of nutation (5 days)
    to 1e-5 of their rate.
    """
    if not stop > start:
        raise ValueError(f"stop must be later than start = {start}, got {stop}")
    # One step beyond either end: a spline is worst at its ends.
    intervals = max(int(np.ceil((stop - start) / _STEP_S)), WINDOW - 1) + 2
    step = (stop - start) / (intervals - 2)
    grid = start + step * np.arange(-1, intervals)
    tt1, tt2 = epoch.tt()
    dcm_true_from_gcrs = erfa.pnm06a(tt1, tt2 + grid / SECONDS_PER_DAY)
    rate = CubicSpline(grid, dcm_true_from_gcrs)(grid, 1)
    # d/dt C = -[w x] C for axes that turn at w.
    skew = -np.einsum("nij,nkj->nik", rate, dcm_true_from_gcrs)
    w = 0.5 * np.stack([skew[:, 2, 1] - skew[:, 1, 2], skew[:, 0, 2] - skew[:, 2, 0], skew[:, 1, 0] - skew[:, 0, 1]], 1)
    samples = (start - step, step, w, CubicSpline(grid, w)(grid, 1))
    return FrameMotion(*(jnp.asarray(np.asarray(x)) for x in samples))
