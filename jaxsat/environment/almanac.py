"""The Sun and Greenwich from one year of an almanac: the Fourier series of the programs `god94` and `God_ads`."""

import dataclasses
import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.environment.sun import apparent_sun
from jaxsat.math import float_array
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angle

TROPICAL_YEAR_DAYS = 365.24219
"""Mean tropical year at J2000 (Meeus 1998, appendix; Urban & Seidelmann 2013)."""
SIDEREAL_DAY_S = 86164.09054
"""Mean sidereal day in seconds of Universal Time (Aoki et al. 1982: 86400 / 1.002737909350795)."""
_YEAR_RATE = 2.0 * math.pi / (TROPICAL_YEAR_DAYS * SECONDS_PER_DAY)
_SIDEREAL_RATE = 2.0 * math.pi / SIDEREAL_DAY_S


class AlmanacSeries(eqx.Module):
    """Right ascension and declination of the Sun as Fourier series over the tropical year, and the Greenwich angle.

    a = p + A0 + sum A2k-1 cos kp + A2k sin kp with the phase p = p0 + 2 pi t / year, d likewise without the growth p,
    Greenwich g0 + 2 pi t / sidereal day: constant year, day and equinox (Penkov et al. 2009, section 3.6).
    `t` counts seconds of Universal Time, 86400 to a day, from the first instant of the year or, after `since`, another.
    """

    phase_0: Float[Array, ""] = eqx.field(converter=float_array)
    """Phase of the year at t = 0 [rad]."""
    right_ascension: Float[Array, "a"] = eqx.field(converter=float_array)
    """Mean, then cosine and sine of each harmonic of the right ascension less the phase [rad]."""
    declination: Float[Array, "d"] = eqx.field(converter=float_array)
    """The same of the declination [rad]."""
    greenwich_angle_0: Float[Array, ""] = eqx.field(converter=float_array)
    """Greenwich apparent sidereal time at t = 0 [rad]."""
    year: int = eqx.field(static=True)
    """Year of the almanac."""

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
        """Return right ascension and declination of the Sun and the Greenwich angle [rad], not wrapped, at `t` [s]."""
        phase = self.phase_0 + _YEAR_RATE * t
        right_ascension = phase + fourier_sum(self.right_ascension, phase)
        return right_ascension, fourier_sum(self.declination, phase), self.greenwich_angle_0 + _SIDEREAL_RATE * t

    def sun_direction(self, t: Float[Array, ""]) -> Float[Array, "3"]:
        """Return the unit vector to the Sun, true equator and equinox of date, at `t` [s]."""
        right_ascension, declination, _ = self(t)
        c = jnp.cos(declination)
        return jnp.stack([c * jnp.cos(right_ascension), c * jnp.sin(right_ascension), jnp.sin(declination)])

    def since(self, epoch: Epoch) -> "AlmanacSeries":
        """Return the same series with t = 0 at another instant; leap seconds between the two are not counted."""
        start = Epoch.from_utc(self.year, 1, 1)
        seconds = ((epoch.utc1 - start.utc1) + (epoch.utc2 - start.utc2)) * SECONDS_PER_DAY
        return dataclasses.replace(
            self,
            phase_0=math.remainder(_YEAR_RATE * seconds, 2.0 * math.pi),
            greenwich_angle_0=(greenwich_angle(start) + _SIDEREAL_RATE * seconds) % (2.0 * math.pi),
        )


def fourier_sum(coefficients: Float[Array, "n"], phase: Float[Array, ""]) -> Float[Array, ""]:
    """Return c0 + sum over k of c[2k-1] cos(k phase) + c[2k] sin(k phase)."""
    multiples = jnp.asarray(np.arange(1, (coefficients.shape[0] + 1) // 2), phase.dtype) * phase
    cosine, sine = coefficients[1::2], coefficients[2::2]
    return coefficients[0] + jnp.sum(cosine * jnp.cos(multiples) + sine * jnp.sin(multiples))


def fit_almanac(year: int, *, harmonics: int | tuple[int, int] = 6) -> AlmanacSeries:
    """Return the series of a year, fitted by least squares to the apparent Sun of ERFA at 0h UTC of each day.

    `harmonics` of both coordinates, or of right ascension and declination apart. Largest errors in 1994 with 2, 3, 4
    and 6: right ascension 0.14, 0.06, 0.006 and 0.003 deg, declination 0.18, 0.012, 0.004 and 0.0007 deg. Within 16
    years nutation and the motion of the perihelion add up to 0.02 and 0.006 deg. Raises ValueError on harmonics below 1
    or above 20.
    """
    ascension_count, declination_count = (harmonics, harmonics) if isinstance(harmonics, int) else harmonics
    for count in (ascension_count, declination_count):
        if not 1 <= count <= 20:
            raise ValueError(f"harmonics must be in 1..20, got {harmonics}")
    epoch = Epoch.from_utc(year, 1, 1)
    following = Epoch.from_utc(year + 1, 1, 1)
    days = np.arange(round((following.utc1 - epoch.utc1) + (following.utc2 - epoch.utc2)))
    sun_eci, _ = apparent_sun(epoch, days * SECONDS_PER_DAY)
    phase = 2.0 * math.pi * days / TROPICAL_YEAR_DAYS
    away = np.unwrap(np.arctan2(sun_eci[:, 1], sun_eci[:, 0])) - phase
    return AlmanacSeries(
        phase_0=0.0,
        right_ascension=_least_squares(phase, away, ascension_count),
        declination=_least_squares(phase, np.arcsin(sun_eci[:, 2]), declination_count),
        greenwich_angle_0=greenwich_angle(epoch),
        year=year,
    )


def _least_squares(phase: np.ndarray, values: np.ndarray, harmonics: int) -> np.ndarray:
    """Mean, then cosine and sine coefficients of each harmonic."""
    k = np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(np.outer(phase, k)), np.sin(np.outer(phase, k))], axis=-1).reshape(len(phase), -1)
    return np.linalg.lstsq(np.column_stack([np.ones_like(phase), waves]), values, rcond=None)[0]
