"""What a satellite meets along its orbit, tabulated once for all checks of a session."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.environment import AbstractOrbit, ConeShadow, apparent_sun, igrf_field, magnetic_field_eci
from jaxsat.time import Epoch, greenwich_angle

_STEP_S, _MOST = 10.0, 20_000


@dataclass(frozen=True)
class Around:
    """Position, field and light at uniform times, true equator and equinox of date."""

    t_s: Float[np.ndarray, "n"]
    position_m: Float[np.ndarray, "n 3"]
    field_T: Float[np.ndarray, "n 3"]
    sun: Float[np.ndarray, "n 3"]
    illumination: Float[np.ndarray, "n"]
    """Visible share of the Sun."""

    def field_at(self, t_s: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m 3"]:
        """Field [T]; cubics over ten seconds err by less than a nanotesla."""
        return CubicSpline(self.t_s, self.field_T)(t_s)

    def sun_at(self, t_s: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m 3"]:
        """Unit vectors to the Sun."""
        return CubicSpline(self.t_s, self.sun)(t_s)

    def nadir_at(self, t_s: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m 3"]:
        """Unit vectors to the Earth's centre."""
        down = -CubicSpline(self.t_s, self.position_m)(t_s)
        return down / np.linalg.norm(down, axis=1, keepdims=True)

    def light_at(self, t_s: Float[np.ndarray, "m"]) -> Float[np.ndarray, "m"]:
        """One in sunlight, zero in the shadow, NaN within ten seconds of a change."""
        after = np.clip(np.searchsorted(self.t_s, t_s), 1, self.t_s.size - 1)
        low, high = self.illumination[after - 1], self.illumination[after]
        return np.where((low == high) & ((low == 0.0) | (low == 1.0)), low, np.nan)


def tabulated(orbit: AbstractOrbit, epoch: Epoch, *, start: float, stop: float) -> Around:
    """Returns what an orbit meets from `start` to `stop` [s] every ten seconds, IGRF-14 and a cone of shadow."""
    count = min(max(int(np.ceil((stop - start) / _STEP_S)), 4), _MOST)
    times = np.linspace(start, stop, count + 1)
    sun, _ = apparent_sun(epoch, times)
    field = igrf_field(epoch.decimal_year())
    found = _along(orbit, field, greenwich_angle(epoch), jnp.asarray(times), jnp.asarray(sun))
    position, b_field, light = (np.asarray(each) for each in found)
    return Around(times, position, b_field, sun, light)


@eqx.filter_jit
def _along(orbit, field, angle_0, times, sun):
    def at(t, sun_eci):
        position, _ = orbit(t)
        angle = angle_0 + EARTH_ROTATION_RATE * t
        return position, magnetic_field_eci(field, position, angle), ConeShadow()(position, sun_eci)

    return jax.vmap(at)(times, sun)
