"""The Earth's main magnetic field: IGRF-14, or any internal field in Schmidt semi-normalised coefficients."""

import datetime
import functools
import math
from importlib import resources

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.math import float_array

TESLA_PER_NANOTESLA = 1e-9


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
    year = int(decimal_year)
    start, end = (datetime.date(y, 1, 1).toordinal() for y in (year, year + 1))
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


def solid_harmonics(
    position: Float[Array, "3"], radius: float | Float[Array, ""], degree: int
) -> Float[Array, "n 2 m"]:
    """Return V_nm and W_nm, (R/r)^(n+1) P_nm(sin latitude) (cos, sin)(m longitude), Schmidt semi-normalised.

    Cartesian recursion (Cunningham 1970; Montenbruck & Gill 2000, eqs. 3.29-3.31), regular at the poles, with the
    powers (x + i y)^m kept apart: what remains is a polynomial in z. One row of all orders per degree, so that the
    traced program is one step long whatever the degree.
    """
    scale = radius / jnp.sum(position * position)
    x, y, z = position * scale
    rho2 = radius * scale

    def next_degree(carry, coefficients):
        last, before_last, cosine, sine = carry
        vertical, backward, sectoral = coefficients
        row = vertical * (z * last) - backward * (rho2 * before_last) + sectoral
        cosine, sine = x * cosine - y * sine, y * cosine + x * sine
        return (row, last, cosine, sine), (row, jnp.stack([cosine, sine]))

    monopole = jnp.zeros(degree + 1, position.dtype).at[0].set(1.0)
    power = jnp.stack([jnp.sqrt(rho2), jnp.zeros_like(rho2)])
    start = (monopole, jnp.zeros_like(monopole), power[0], power[1])
    tables = [jnp.asarray(table, position.dtype) for table in _recursion_tables(degree)]
    _, (rows, powers) = jax.lax.scan(next_degree, start, tables)
    rows = jnp.concatenate([monopole[None], rows])
    powers = jnp.concatenate([power[None], powers])
    return rows[:, None, :] * powers.T[None]


def internal_field(
    position_ecef: Float[Array, "3"], g: Float[Array, "n n"], h: Float[Array, "n n"], radius: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Return the field [T] of an internal source, Earth-fixed Cartesian components, outside the reference sphere.

    B = -grad R sum (R/r)^(n+1) P_nm (g_nm cos m lambda + h_nm sin m lambda) (Alken et al. 2021, eq. 1), the gradient
    as a linear map on the harmonics of the next degree (Montenbruck & Gill 2000, eq. 3.33, without its factor mu/R^2).
    """
    degree = g.shape[0] - 1
    harmonics = solid_harmonics(position_ecef, radius, degree + 1)[1:]
    # The weights do not depend on position: under vmap they are computed once and this is a matrix product.
    weights = _field_weights(g, h).reshape(3, -1)
    return jnp.matmul(weights, harmonics.reshape(-1), precision="highest")


class InternalField(eqx.Module):
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


def igrf_field(decimal_year: int | float, *, degree: int = 13) -> InternalField:
    """Return the IGRF-14 field at a date, cut off at `degree` (1 to 13; 1 is the centred tilted dipole)."""
    if not 1 <= degree <= 13:
        raise ValueError(f"degree must be in 1..13, got {degree}")
    g, h = igrf_coefficients(decimal_year)
    return InternalField(*(jnp.asarray(c[: degree + 1, : degree + 1]) for c in (g, h)))


def magnetic_field_eci(
    field: InternalField, position_eci: Float[Array, "3"], greenwich_angle: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Return the field [T] at an inertial position [m], inertial components; Greenwich angle in rad."""
    c, s = jnp.cos(greenwich_angle), jnp.sin(greenwich_angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    dcm_eci_from_ecef = jnp.stack([c, -s, zero, s, c, zero, zero, zero, one]).reshape(3, 3)
    return dcm_eci_from_ecef @ field(position_eci @ dcm_eci_from_ecef)


@functools.cache
def _schmidt_factors(degree: int) -> np.ndarray:
    """Factor from unnormalised to Schmidt semi-normalised P_nm, without the Condon-Shortley sign; zero above n."""
    factors = np.zeros((degree + 1, degree + 1))
    for n in range(degree + 1):
        for m in range(n + 1):
            factors[n, m] = math.sqrt((1 if m == 0 else 2) * math.factorial(n - m) / math.factorial(n + m))
    return factors


@functools.cache
def _recursion_tables(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Over degrees 1..degree, orders 0..degree: factors of the row below and of the next one, and P_nn / cos^n."""
    f = _schmidt_factors(degree)
    vertical, backward, sectoral = np.zeros((3, degree, degree + 1))
    for n in range(1, degree + 1):
        for m in range(n):
            vertical[n - 1, m] = (2 * n - 1) / (n - m) * f[n, m] / f[n - 1, m]
            if m <= n - 2:
                backward[n - 1, m] = (n + m - 1) / (n - m) * f[n, m] / f[n - 2, m]
        sectoral[n - 1, n] = f[n, n] * math.prod(range(1, 2 * n, 2))
    return vertical, backward, sectoral


def _field_weights(g: Float[Array, "n n"], h: Float[Array, "n n"]) -> Float[Array, "3 n 2 m"]:
    """Weights of (V, W) of degrees 1.. on the field components, from coefficients of one degree less."""
    higher, lower, level = (jnp.asarray(table, g.dtype) for table in _gradient_tables(g.shape[0] - 1))
    up = lambda c: jnp.pad(higher * c, ((0, 0), (1, 0)))  # noqa: E731  order m feeds harmonic order m + 1
    down = lambda c: jnp.pad((lower * c)[:, 1:], ((0, 0), (0, 2)))  # noqa: E731  order m feeds harmonic order m - 1
    along_x = jnp.stack([up(g) - down(g), up(h) - down(h)], axis=1)
    along_y = jnp.stack([-up(h) - down(h), up(g) + down(g)], axis=1)
    along_z = jnp.pad(jnp.stack([level * g, level * h], axis=1), ((0, 0), (0, 0), (0, 1)))
    return jnp.stack([along_x, along_y, along_z])


@functools.cache
def _gradient_tables(degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factors of coefficient (n, m) on harmonic (n + 1, m + 1), (n + 1, m - 1) and (n + 1, m), all normalised."""
    f = _schmidt_factors(degree + 1)
    higher, lower, level = np.zeros((3, degree + 1, degree + 1))
    for n in range(degree + 1):
        for m in range(n + 1):
            higher[n, m] = (1.0 if m == 0 else 0.5) * f[n, m] / f[n + 1, m + 1]
            level[n, m] = (n - m + 1) * f[n, m] / f[n + 1, m]
            if m > 0:
                lower[n, m] = 0.5 * (n - m + 2) * (n - m + 1) * f[n, m] / f[n + 1, m - 1]
    return higher, lower, level
