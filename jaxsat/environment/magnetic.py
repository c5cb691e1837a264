"""The Earth's main magnetic field: IGRF-14, any internal field in Schmidt coefficients, or a centred dipole."""

import datetime
import functools
import math
from abc import abstractmethod
from importlib import resources

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.frames import dcm_eci_from_ecef
from jaxsat.math import float_array, gradient_coefficients, harmonic_sums, is_known, put

TESLA_PER_NANOTESLA = 1e-9

MU0_OVER_4PI = 1e-7
"""Magnetic constant over 4 pi [T m/A]; the SI of 2019 differs by 6e-10 of it (CODATA 2018: Tiesinga et al. 2021)."""


def igrf_coefficients(decimal_year: int | float) -> tuple[Float[np.ndarray, "14 14"], Float[np.ndarray, "14 14"]]:
    """Return the IGRF-14 coefficients (g, h) [T], indexed [degree, order], Schmidt semi-normalised.

    Linear between the model's epochs, 1900.0 to 2030.0 (the last five years by the predicted secular variation), in
    elapsed days: a year of 366 days takes its longer share, at most 0.06 nT from linear in the calendar year.
    ValueError outside. Source: IAGA Division V-MOD (2024), doi:10.5281/zenodo.14012302.
    """
    years, g, h = _igrf_table()
    if not years[0] <= decimal_year <= years[-1]:
        raise ValueError(f"decimal_year must be in {years[0]}..{years[-1]} (range of IGRF-14), got {decimal_year}")
    k = min(int(np.searchsorted(years, decimal_year, side="right")) - 1, len(years) - 2)
    start, end = _days(years[k]), _days(years[k + 1])
    s = (_days(decimal_year) - start) / (end - start)
    return (1.0 - s) * g[k] + s * g[k + 1], (1.0 - s) * h[k] + s * h[k + 1]


def _days(decimal_year: int | float) -> float:
    """Days since the year 0."""
    year = int(decimal_year)
    start, end = (float(datetime.date(y, 1, 1).toordinal()) for y in (year, year + 1))
    return start + (decimal_year - year) * (end - start)


@functools.cache
def _igrf_table() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    text = resources.files("jaxsat.environment").joinpath("igrf14.shc").read_text(encoding="ascii")
    header, years, *rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    degree = int(header[1])
    g, h = np.zeros((2, len(years), degree + 1, degree + 1))
    for n, m, *values in rows:
        table = g if int(m) >= 0 else h
        table[:, int(n), abs(int(m))] = np.array(values, float) * TESLA_PER_NANOTESLA
    return np.array(years, float), g, h


def internal_field(
    position_ecef: Float[Array, "3"], g: Float[Array, "n n"], h: Float[Array, "n n"], radius: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Return the field [T] of an internal source, Earth-fixed Cartesian components, outside the reference sphere.

    B = -grad R sum (R/r)^(n+1) P_nm (g_nm cos m lambda + h_nm sin m lambda) (Alken et al. 2021, eq. 1). At the centre
    there is none: ValueError, or NaN from a traced position.
    """
    _check_off_centre(position_ecef)
    return harmonic_sums(position_ecef, -gradient_coefficients(jnp.stack([g, h])), radius)


def dipole_field(position: Inexact[Array, "3"], moment: Inexact[Array, "3"]) -> Inexact[Array, "3"]:
    """Return mu0/(4 pi r^3) (3 (m . e) e - m) [T], the field of a dipole [A m^2] at the origin.

    Source: Jackson 1999, eq. 5.56. Both may be complex, for derivatives by complex step. At the origin there is none:
    ValueError, or NaN from a traced position.
    """
    _check_off_centre(position)
    r2 = jnp.sum(position * position)
    r = jnp.sqrt(r2)
    direction = position / r
    return MU0_OVER_4PI / (r2 * r) * (3.0 * jnp.sum(moment * direction) * direction - moment)


def _check_off_centre(position: Inexact[Array, "3"]) -> None:
    if is_known(position) and not np.asarray(position).any():
        raise ValueError("the field has no value at the centre of its source, and position is zero")


class AbstractMagneticField(eqx.Module):
    """A magnetic field that turns with the Earth."""

    @abstractmethod
    def __call__(self, position_ecef: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the field [T] at an Earth-fixed position [m], Earth-fixed components."""


class InternalField(AbstractMagneticField):
    """Magnetic field of an internal source; degree one is a centred dipole, more is the main field."""

    g: Float[Array, "n n"]
    """Cosine coefficients, Schmidt semi-normalised, [degree, order] [T]."""
    h: Float[Array, "n n"]
    """Sine coefficients [T]."""
    radius: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_RADIUS_MEAN)
    """Reference radius of the coefficients [m]."""

    def __call__(self, position_ecef: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the field [T] at an Earth-fixed position [m], Earth-fixed components."""
        return internal_field(position_ecef, self.g, self.h, self.radius)


class CentredDipole(AbstractMagneticField):
    """Magnetic field of a dipole at the Earth's centre, along the axis of rotation or tilted."""

    moment: Float[Array, "3"] = eqx.field(converter=float_array)
    """Dipole moment, Earth-fixed axes [A m^2]; the Earth's points south."""

    def __call__(self, position_ecef: Float[Array, "3"]) -> Float[Array, "3"]:
        """Return the field [T] at an Earth-fixed position [m], Earth-fixed components."""
        return dipole_field(position_ecef, self.moment)


def igrf_field(decimal_year: int | float, *, degree: int = 13) -> InternalField:
    """Return the IGRF-14 field at a date, cut off at `degree` (1 to 13; 1 is the centred tilted dipole)."""
    if degree not in range(1, 14):
        raise ValueError(f"degree must be in 1..13, got {degree}")
    g, h = igrf_coefficients(decimal_year)
    return InternalField(*(put(c[: degree + 1, : degree + 1]) for c in (g, h)))


def igrf_dipole(decimal_year: int | float) -> CentredDipole:
    """Return the dipole of the IGRF-14 at a date, m = 4 pi R^3/mu0 (g11, h11, g10): its degree one in closed form."""
    g, h = igrf_coefficients(decimal_year)
    return CentredDipole(EARTH_RADIUS_MEAN**3 / MU0_OVER_4PI * np.array([g[1, 1], h[1, 1], g[1, 0]]))


def dipole_from_pole(moment: int | float, *, latitude: int | float, longitude: int | float) -> CentredDipole:
    """Return the dipole of a strength [A m^2] whose north geomagnetic pole is at a geocentric place [rad].

    That pole is where the axis leaves the northern hemisphere, the south pole of the magnet (Alken et al. 2021):
    latitude pi/2 is the axial dipole.
    """
    across = math.cos(latitude)
    pole = np.array([across * math.cos(longitude), across * math.sin(longitude), math.sin(latitude)])
    return CentredDipole(-moment * pole)


def magnetic_field_eci(
    field: AbstractMagneticField, position_eci: Float[Array, "3"], greenwich_angle: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Return the field [T] at an inertial position [m], inertial components; Greenwich angle in rad."""
    dcm = dcm_eci_from_ecef(greenwich_angle)
    position_ecef = jnp.matmul(position_eci, dcm, precision="highest")
    return jnp.matmul(dcm, field(position_ecef), precision="highest")
