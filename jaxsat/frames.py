"""Frames and the turns between them: inertial (true equator and equinox of date), Earth-fixed, orbital, ecliptic, TEME.

A matrix `dcm_a_from_b` turns components in b into components in a. Polar motion (0.3", 10 m on the ground) is left out.
"""

import math

import equinox as eqx
import erfa
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.math import cross, float_array, safe_norm, unit
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angles

WGS84_RADIUS = 6378137.0
"""Equatorial radius of the reference ellipsoid [m] (NGA 2014, WGS 84, table 3.1)."""
WGS84_FLATTENING = 1.0 / 298.257223563
"""Its flattening (NGA 2014, table 3.1)."""

_ARCSECOND = math.pi / 648000.0
# The fastest terms of nutation that matter have periods of 5 days: cubics over half a day err by less than 1e-9 rad.
_PIECE_S = 43200.0

# Multiples of l, l', F, D, Omega (Delaunay), then the coefficients [0.0001"] of sine in longitude and cosine in
# obliquity: the largest 35 terms of IAU 1980 (Seidelmann 1982; Meeus 1998, table 22.A).
_NUTATION = np.array(
    """
    0  0 0  0 1 -171996 92025   0 0 2 -2 2 -13187 5736   0  0 2  0 2 -2274  977   0 0 0  0 2  2062 -895
    0  1 0  0 0    1426    54   1 0 0  0 0    712   -7   0  1 2 -2 2  -517  224   0 0 2  0 1  -386  200
    1  0 2  0 2    -301   129   0 -1 2 -2 2   217  -95   1  0 0 -2 0  -158   -1   0 0 2 -2 1   129  -70
    -1 0 2  0 2     123   -53   1 0 0  0 1     63  -33   0  0 0  2 0    63   -2  -1 0 2  2 2   -59   26
    -1 0 0  0 1     -58    32   1 0 2  0 1    -51   27   2  0 0 -2 0    48    1  -2 0 2  0 1    46  -24
    0  0 2  2 2     -38    16   2 0 2  0 2    -31   13   2  0 0  0 0    29   -1   1 0 2 -2 2    29  -12
    0  0 2  0 0      26    -1   0 0 2 -2 0    -22    0  -1  0 2  0 1    21  -10   0 2 0  0 0    17    0
    0  2 2 -2 2     -16     7  -1 0 0  2 1     16   -8   0  1 0  0 1   -15    9   1 0 0 -2 1   -13    7
    0 -1 0  0 1     -12     6   2 0 -2 0 0     11    0  -1  0 2  2 1   -10    5
    """.split(),
    float,
).reshape(-1, 7)
# The same arguments, degrees by powers of TT Julian centuries since J2000 (Meeus 1998, chapter 22).
_DELAUNAY_DEG = np.array(
    [
        [134.96298, 477198.867398, 0.0086972],
        [357.52772, 35999.050340, -0.0001603],
        [93.27191, 483202.017538, -0.0036825],
        [297.85036, 445267.111480, -0.0019142],
        [125.04452, -1934.136261, 0.0020708],
    ]
)


def dcm_eci_from_ecef(greenwich_angle: float | Float[Array, ""]) -> Float[Array, "3 3"]:
    """Return the turn from Earth-fixed axes (x to Greenwich, z to the pole) by apparent sidereal time [rad]."""
    return _turn_about_z(greenwich_angle)


def dcm_eci_from_teme(equinox_difference: float | Float[Array, ""]) -> Float[Array, "3 3"]:
    """Return the turn from SGP4's true equator and mean equinox, by `jaxsat.time.equinox_difference` [rad]."""
    return _turn_about_z(equinox_difference)


def dcm_eci_from_gcrf(epoch: Epoch) -> Float[np.ndarray, "3 3"]:
    """Return the turn from the GCRF by bias, precession and nutation IAU 2006/2000A (ERFA pnm06a; a NumPy edge).

    The mean equator and equinox of J2000 lie within 0.02" of the GCRF, 0.8 m in a low orbit.
    """
    return erfa.pnm06a(*epoch.tt())


def dcms_eci_from_gcrf(epoch: Epoch, t_s: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3 3"]:
    """Return `dcm_eci_from_gcrf` `t_s` seconds after an epoch; many instants are joined by cubics over half-days.

    The cubics err by less than 1e-9 rad.
    """
    t_s = np.asarray(t_s, float)
    tt1, tt2 = epoch.tt()
    start, end = (float(t_s.min()), float(t_s.max())) if t_s.size else (0.0, 0.0)
    nodes = 4 + int((end - start) / _PIECE_S)
    if t_s.size <= nodes:
        return erfa.pnm06a(tt1, tt2 + t_s / SECONDS_PER_DAY)
    grid = np.linspace(start, max(end, start + 1.0), nodes)
    return CubicSpline(grid, erfa.pnm06a(tt1, tt2 + grid / SECONDS_PER_DAY))(t_s)


def dcm_orbital_from_eci(position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Return the turn to the orbital axes: x radial (outward), y transverse (along the motion), z along r x v.

    The RSW or RTN frame (Vallado 2013, section 3.3.3); a state without orbital plane gives rows of zeros.
    """
    radial = unit(position_eci)
    normal = unit(cross(position_eci, velocity_eci))
    return jnp.stack([radial, cross(normal, radial), normal])


def dcm_eci_from_ecliptic(t_centuries: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Return the turn from the mean ecliptic and equinox of date to the true equator and equinox, by TT since J2000.

    Nutation in longitude about the ecliptic's pole, then the true obliquity about the equinox (Meeus 1998, chapter 22;
    mean obliquity of Capitaine et al. 2003, eq. 37). Within 0.03" of ERFA over 1990-2030.
    """
    in_longitude, in_obliquity = nutation(t_centuries)
    t = t_centuries
    mean_obliquity = (84381.406 - t * (46.836769 + t * (0.0001831 - t * 0.0020034))) * _ARCSECOND
    # Full precision by name: a GPU multiplies float32 matrices with ten bits otherwise.
    turns = _turn_about_x(mean_obliquity + in_obliquity), _turn_about_z(in_longitude)
    return jnp.matmul(*turns, precision="highest")


def nutation(t_centuries: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Return the nutation in longitude and in obliquity [rad] by TT Julian centuries since J2000.

    The 35 largest terms of the series of 1980 (Seidelmann 1982; Meeus 1998, table 22.A): within 0.02" of IAU 2000A.
    """
    dtype = t_centuries.dtype
    powers = jnp.stack([jnp.ones_like(t_centuries), t_centuries, t_centuries**2])
    delaunay = jnp.matmul(jnp.asarray(np.radians(_DELAUNAY_DEG), dtype), powers, precision="highest")
    argument = jnp.matmul(jnp.asarray(_NUTATION[:, :5], dtype), delaunay, precision="highest")
    longitude, obliquity = jnp.asarray(_NUTATION[:, 5:].T * (1e-4 * _ARCSECOND), dtype)
    # Coefficients drift too, the largest ones' by more than 1 mas in a century.
    growth = t_centuries * (1e-4 * _ARCSECOND)
    node = delaunay[4]
    return (
        jnp.sum(longitude * jnp.sin(argument)) - 174.2 * growth * jnp.sin(node),
        jnp.sum(obliquity * jnp.cos(argument)) + 8.9 * growth * jnp.cos(node),
    )


class GreenwichAngle(eqx.Module):
    """Greenwich apparent sidereal time as a function of time: uniform turning and, if given, its small departure.

    `GreenwichAngle(angle_0)` is the uniform convention, angle_0 + rate t, which leaves the real angle (nutation of the
    equinox) by up to 1e-6 rad in a day, 4e-6 in ten, 9e-6 in thirty; `greenwich` follows it within 1e-9 rad. In
    float32 the angle itself is rounded to 4e-6 rad after ten days, and the time before it.
    """

    value: Float[Array, ""] = eqx.field(converter=float_array)
    """Angle at t = 0, without the departure [rad]."""
    rate: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_ROTATION_RATE)
    """Its uniform rate [rad/s]."""
    departure: Float[Array, "pieces 4"] = eqx.field(converter=float_array, default_factory=lambda: np.zeros((1, 4)))
    """Cubics in the elapsed fraction of a piece, lowest power first [rad]; constant outside the pieces."""
    start: Float[Array, ""] = eqx.field(converter=float_array, default=0.0)
    """Beginning of the first piece [s]."""
    piece: Float[Array, ""] = eqx.field(converter=float_array, default=_PIECE_S)
    """Length of a piece [s]."""

    def __call__(self, t: Float[Array, ""]) -> Float[Array, ""]:
        """Return the angle [rad], not wrapped, `t` seconds after the epoch."""
        count = self.departure.shape[0]
        elapsed = (t - self.start) / self.piece
        # Not jnp.clip: at the ends it halves the derivative.
        elapsed = jnp.where(elapsed < 0.0, 0.0, jnp.where(elapsed > count, float(count), elapsed))
        k = jnp.minimum(elapsed.astype(int), count - 1)
        x, c = elapsed - k.astype(elapsed.dtype), self.departure[k]
        return self.value + self.rate * t + (c[0] + x * (c[1] + x * (c[2] + x * c[3])))


def greenwich(
    epoch: Epoch, *, start: int | float = 0.0, stop: int | float, ut1_minus_utc: int | float = 0.0
) -> GreenwichAngle:
    """Return the Greenwich angle from `start` to `stop` [s after `epoch`], IAU 2006/2000A (ERFA gst06a).

    A cubic spline over half-day nodes or shorter; outside the span the angle turns on uniformly. UT1 - UTC [s] is its
    value at the epoch. Raises ValueError unless stop is later than start.
    """
    if not start < stop < math.inf:
        raise ValueError(f"stop must be finite and later than start = {start}, got {stop}")
    pieces = max(3, math.ceil((stop - start) / _PIECE_S))
    nodes = np.linspace(start, stop, pieces + 1)
    value = float(greenwich_angles(epoch, np.zeros(1), ut1_minus_utc)[0])
    away = greenwich_angles(epoch, nodes, ut1_minus_utc) - (value + EARTH_ROTATION_RATE * nodes)
    away = (away + math.pi) % (2.0 * math.pi) - math.pi
    piece = (stop - start) / pieces
    cubics = CubicSpline(nodes, away).c[::-1].T * piece ** np.arange(4)
    return GreenwichAngle(value, departure=cubics, start=start, piece=piece)


def ecef_from_geodetic(
    longitude: Float[Array, ""], latitude: Float[Array, ""], height: Float[Array, ""]
) -> Float[Array, "3"]:
    """Return the Earth-fixed position [m] of geodetic longitude and latitude [rad] and height over WGS 84 [m].

    With the radius of curvature N = a / sqrt(1 - e^2 sin^2 B) (Montenbruck & Gill 2000, eqs. 5.83-5.84).
    """
    e2 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING)
    c, s = jnp.cos(latitude), jnp.sin(latitude)
    curvature = WGS84_RADIUS / jnp.sqrt(1.0 - e2 * s * s)
    across = (curvature + height) * c
    return jnp.stack([across * jnp.cos(longitude), across * jnp.sin(longitude), ((1.0 - e2) * curvature + height) * s])


def geodetic_from_ecef(
    position_ecef: Float[Array, "3"],
) -> tuple[Float[Array, ""], Float[Array, ""], Float[Array, ""]]:
    """Return geodetic longitude and latitude [rad] and height over WGS 84 [m] of an Earth-fixed position [m].

    Bowring's formula (1976) on his start of 1985, used twice: error below 1e-12 rad from 1000 km under the surface
    outwards. At a pole longitude is zero, and the derivatives of the angles, which do not exist, are zero too.
    """
    a, b = WGS84_RADIUS, WGS84_RADIUS * (1.0 - WGS84_FLATTENING)
    e2 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING)
    second_e2 = e2 / (1.0 - e2)
    x, y, z = position_ecef
    across = safe_norm(position_ecef[:2])
    # Cosine and sine of the reduced latitude: no tangent, so that the poles are points like others.
    reduced = unit(jnp.stack([a * across, b * z * (1.0 + second_e2 * b / safe_norm(position_ecef))]))
    for _ in range(2):
        c, s = reduced
        normal = unit(jnp.stack([across - e2 * a * c**3, z + second_e2 * b * s**3]))
        reduced = unit(jnp.stack([normal[0], (1.0 - WGS84_FLATTENING) * normal[1]]))
    c, s = normal
    height = across * c + z * s - a * jnp.sqrt(1.0 - e2 * s * s)
    off_axis = across > 0.0
    longitude = jnp.where(off_axis, jnp.arctan2(y, jnp.where(off_axis, x, 1.0)), 0.0)
    return longitude, jnp.arctan2(s, c), height


def _turn_about_z(angle: float | Float[Array, ""]) -> Float[Array, "3 3"]:
    """Matrix that turns vectors by `angle` about z."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([c, -s, zero, s, c, zero, zero, zero, one]).reshape(3, 3)


def _turn_about_x(angle: Float[Array, ""]) -> Float[Array, "3 3"]:
    """Matrix that turns vectors by `angle` about x."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    zero, one = jnp.zeros_like(c), jnp.ones_like(c)
    return jnp.stack([one, zero, zero, zero, c, -s, zero, s, c]).reshape(3, 3)
