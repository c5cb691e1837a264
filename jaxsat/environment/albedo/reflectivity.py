"""What share of the light each place of the Earth returns: everywhere the same, or zonal with the seasons."""

import abc
import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.math import float_array
from jaxsat.time import SECONDS_PER_DAY, Epoch

_YEAR_S = 365.25 * SECONDS_PER_DAY


def zonal_reflectivity(
    sin_latitude: Float[Array, "k"],
    a0: float | Float[Array, ""],
    a1: float | Float[Array, ""],
    a2: float | Float[Array, ""],
) -> Float[Array, "k"]:
    """Return a0 + a1 P1(sin latitude) + a2 P2(sin latitude), whose mean over the sphere is a0.

    Legendre polynomials of geocentric latitude (Knocke, Ries & Tapley 1988, AIAA 88-4292).
    """
    return a0 + a1 * sin_latitude + a2 * (1.5 * sin_latitude**2 - 0.5)


class AbstractReflectivity(eqx.Module):
    """Share of the light scattered at places of the Earth."""

    @abc.abstractmethod
    def __call__(self, ground_eci: Float[Array, "k 3"], t: float | Float[Array, ""]) -> Float[Array, "k"]:
        """Return the reflectivity at unit vectors from the Earth's centre, at the time `t` [s]."""


class UniformReflectivity(AbstractReflectivity):
    """One everywhere."""

    def __call__(self, ground_eci: Float[Array, "k 3"], t: float | Float[Array, ""]) -> Float[Array, "k"]:
        """Return ones."""
        return jnp.ones_like(ground_eci[:, 0])


class ZonalReflectivity(AbstractReflectivity):
    """Zonal to degree two, the difference of the hemispheres with a yearly wave (Knocke, Ries & Tapley 1988).

    a1 = c0 + c1 cos(season) + c2 sin(season), where the season grows by 2 pi in 365.25 days.
    """

    a0: Float[Array, ""] = eqx.field(converter=float_array)
    """Mean over the sphere."""
    c0: Float[Array, ""] = eqx.field(converter=float_array)
    """Mean of the first degree, the north above the equator."""
    c1: Float[Array, ""] = eqx.field(converter=float_array)
    """Yearly wave of the first degree, largest where the season is zero."""
    c2: Float[Array, ""] = eqx.field(converter=float_array)
    """Yearly wave of the first degree, largest a quarter of a year later."""
    a2: Float[Array, ""] = eqx.field(converter=float_array)
    """Second degree, the poles above the equator."""
    season: Float[Array, ""] = eqx.field(converter=float_array)
    """Phase of the yearly wave at t = 0 [rad]."""

    def __call__(self, ground_eci: Float[Array, "k 3"], t: float | Float[Array, ""]) -> Float[Array, "k"]:
        """Return the reflectivity at the places' latitudes."""
        season = self.season + 2.0 * math.pi / _YEAR_S * t
        a1 = self.c0 + self.c1 * jnp.cos(season) + self.c2 * jnp.sin(season)
        return zonal_reflectivity(ground_eci[:, 2], self.a0, a1, self.a2)


def knocke_albedo(epoch: Epoch) -> ZonalReflectivity:
    """Return the reflectivity of the Earth in sunlight, t = 0 at `epoch` (Knocke, Ries & Tapley 1988).

    The brighter pole is the one in winter; 0.189 to 0.73 over all latitudes and seasons.
    """
    return ZonalReflectivity(a0=0.34, c0=0.0, c1=0.10, c2=0.0, a2=0.29, season=_season(epoch))


def knocke_emissivity(epoch: Epoch) -> ZonalReflectivity:
    """Return the Earth's infrared exitance over a quarter of the solar constant, t = 0 at `epoch` (same source)."""
    return ZonalReflectivity(a0=0.68, c0=0.0, c1=-0.07, c2=0.0, a2=-0.18, season=_season(epoch))


def _season(epoch: Epoch) -> float:
    """Phase of the yearly wave [rad]: zero at 1981-12-22, 0h UTC."""
    return 2.0 * math.pi * (epoch.seconds_since(Epoch.from_utc(1981, 12, 22)) / _YEAR_S % 1.0)
