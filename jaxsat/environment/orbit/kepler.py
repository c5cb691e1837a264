"""The Kepler orbit by classical elements, and Kepler's equation with its exact derivative."""

import dataclasses
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_MU
from jaxsat.environment.orbit.abstract import AbstractOrbit
from jaxsat.math import float_array, is_known

Real = int | float
# Danby's fourth-order correction from his start value: the third leaves 1e-15 for e <= 0.95, one more is a margin.
_ITERATIONS = 4
LARGEST_ECCENTRICITY = 0.95


@jax.custom_jvp
def solve_kepler(mean_anomaly: Float[Array, "..."], eccentricity: Float[Array, "..."]) -> Float[Array, "..."]:
    """Return the eccentric anomaly E [rad] of E - e sin E = M, in the same revolution as M, for 0 <= e <= 0.95.

    Danby & Burkardt (1983): a fixed number of fourth-order corrections. The derivative is that of the equation itself,
    dE = (dM + sin E de) / (1 - e cos E), not of the iterations.
    """
    whole_turns = 2.0 * math.pi * jnp.round(mean_anomaly / (2.0 * math.pi))
    m = mean_anomaly - whole_turns
    ecc_anomaly = m + 0.85 * eccentricity * jnp.sign(jnp.sin(m))
    for _ in range(_ITERATIONS):
        s, c = eccentricity * jnp.sin(ecc_anomaly), eccentricity * jnp.cos(ecc_anomaly)
        f, f1 = ecc_anomaly - s - m, 1.0 - c
        newton = -f / f1
        halley = -f / (f1 + 0.5 * newton * s)
        ecc_anomaly += -f / (f1 + 0.5 * halley * s + halley**2 * c / 6.0)
    return ecc_anomaly + whole_turns


@solve_kepler.defjvp
def _solve_kepler_jvp(primals, tangents):
    mean_anomaly, eccentricity = primals
    d_mean_anomaly, d_eccentricity = tangents
    ecc_anomaly = solve_kepler(mean_anomaly, eccentricity)
    slope = 1.0 - eccentricity * jnp.cos(ecc_anomaly)
    return ecc_anomaly, (d_mean_anomaly + jnp.sin(ecc_anomaly) * d_eccentricity) / slope


def dcm_eci_from_perifocal(
    inclination: Float[Array, ""], raan: Float[Array, ""], argument_of_perigee: Float[Array, ""]
) -> Float[Array, "3 3"]:
    """Return the matrix whose columns are the perigee, along-track-at-perigee and normal axes in the inertial frame."""
    (ci, co, cw), (si, so, sw) = ((f(inclination), f(raan), f(argument_of_perigee)) for f in (jnp.cos, jnp.sin))
    perigee = jnp.stack([co * cw - so * sw * ci, so * cw + co * sw * ci, sw * si])
    along = jnp.stack([-co * sw - so * cw * ci, -so * sw + co * cw * ci, cw * si])
    normal = jnp.stack([so * si, -co * si, ci])
    return jnp.stack([perigee, along, normal], axis=-1)


class KeplerOrbit(AbstractOrbit):
    """An unperturbed elliptic orbit about the Earth, equatorial inertial frame; calling it gives the state at `t`."""

    semi_major_axis: Float[Array, ""] = eqx.field(converter=float_array)
    """Semi-major axis [m]."""
    eccentricity: Float[Array, ""] = eqx.field(converter=float_array)
    """Eccentricity, 0 <= e <= 0.95."""
    inclination: Float[Array, ""] = eqx.field(converter=float_array)
    """Inclination to the equator [rad]."""
    raan: Float[Array, ""] = eqx.field(converter=float_array)
    """Right ascension of the ascending node [rad]."""
    argument_of_perigee: Float[Array, ""] = eqx.field(converter=float_array)
    """Argument of perigee [rad]."""
    mean_anomaly: Float[Array, ""] = eqx.field(converter=float_array)
    """Mean anomaly at t = 0 [rad]."""
    mu: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_MU)
    """Gravitational parameter [m^3/s^2]."""

    def __check_init__(self):
        # Traced numbers cannot be asked: with those that are none the state is NaN.
        for name in (field.name for field in dataclasses.fields(self)):
            value = getattr(self, name)
            if is_known(value) and not np.all(np.isfinite(value)):
                raise ValueError(f"KeplerOrbit: {name} must be finite, got {value}")
        if is_known(self.semi_major_axis) and not np.all(np.asarray(self.semi_major_axis) > 0.0):
            raise ValueError(f"KeplerOrbit: semi_major_axis must be above zero, got {self.semi_major_axis} m")
        if is_known(self.eccentricity):
            e = np.asarray(self.eccentricity)
            if not np.all((e >= 0.0) & (e <= LARGEST_ECCENTRICITY)):
                raise ValueError(f"KeplerOrbit: eccentricity must be in 0..{LARGEST_ECCENTRICITY}, got {e}")

    @property
    def mean_motion(self) -> Float[Array, ""]:
        """Mean angular rate n = sqrt(mu / a^3) [rad/s]."""
        return jnp.sqrt(self.mu / self.semi_major_axis) / self.semi_major_axis

    @property
    def period(self) -> Float[Array, ""]:
        """Orbital period [s]."""
        return 2.0 * math.pi / self.mean_motion

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], inertial frame, `t` seconds after the epoch."""
        a, e, n = self.semi_major_axis, self.eccentricity, self.mean_motion
        ecc_anomaly = solve_kepler(self.mean_anomaly + n * t, e)
        s, c, root = jnp.sin(ecc_anomaly), jnp.cos(ecc_anomaly), jnp.sqrt(1.0 - e * e)
        plane = dcm_eci_from_perifocal(self.inclination, self.raan, self.argument_of_perigee)[:, :2]
        position = plane * (a * jnp.stack([c - e, root * s]))[None, :]
        velocity = plane * (a * n / (1.0 - e * c) * jnp.stack([-s, root * c]))[None, :]
        return jnp.sum(position, axis=-1), jnp.sum(velocity, axis=-1)

    def check_span(self, times: np.ndarray) -> None:
        """Do nothing: an ellipse has no ends."""


def classical_elements(
    position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"], mu: Float[Array, ""]
) -> KeplerOrbit:
    """Return classical elements of the ellipse through a state at t = 0 (Montenbruck & Gill 2000, section 2.2.4).

    Where an angle is undefined it is zero: the node of an equatorial orbit, the perigee argument of a circular one.
    Derivatives of these angles are then called zero, which is not what their position along the orbit would need: to
    differentiate through a state take `elements_from_state`.
    """
    r = jnp.linalg.norm(position_eci)
    momentum = jnp.cross(position_eci, velocity_eci)
    a = 1.0 / (2.0 / r - jnp.sum(velocity_eci**2) / mu)
    n = jnp.sqrt(mu / a) / a
    raan = _angle(momentum[0], -momentum[1])
    inclination = jnp.arctan2(_length(momentum[0], momentum[1]), momentum[2])
    # e cos E and e sin E are regular for a circular orbit, e and E are not.
    e_cos, e_sin = 1.0 - r / a, jnp.dot(position_eci, velocity_eci) / (n * a * a)
    e, ecc_anomaly = _length(e_cos, e_sin), _angle(e_sin, e_cos)
    node = jnp.stack([jnp.cos(raan), jnp.sin(raan), jnp.zeros_like(raan)])
    across = jnp.cross(momentum / jnp.linalg.norm(momentum), node)
    latitude_argument = jnp.arctan2(jnp.dot(position_eci, across), jnp.dot(position_eci, node))
    true_anomaly = ecc_anomaly + 2.0 * jnp.arctan2(e_sin, 1.0 + jnp.sqrt(1.0 - e * e) - e_cos)
    return KeplerOrbit(
        semi_major_axis=a,
        eccentricity=e,
        inclination=inclination,
        raan=raan % (2.0 * math.pi),
        argument_of_perigee=(latitude_argument - true_anomaly) % (2.0 * math.pi),
        mean_anomaly=ecc_anomaly - e_sin,
        mu=mu,
    )


def orbit_from_elements_km_deg(
    *, a_km: Real, e: Real, i_deg: Real, raan_deg: Real, argp_deg: Real, mean_anomaly_deg: Real
) -> KeplerOrbit:
    """Return the orbit about the Earth from elements in kilometres and degrees, with the mean anomaly at t = 0."""
    angles = (math.radians(x) for x in (i_deg, raan_deg, argp_deg, mean_anomaly_deg))
    _check_elements(a_km, e)
    return KeplerOrbit(a_km * 1e3, e, *angles)


def orbit_from_perigee_time_km_deg(
    *, a_km: Real, e: Real, i_deg: Real, raan_deg: Real, argp_deg: Real, t_perigee_s: Real
) -> KeplerOrbit:
    """Return the orbit about the Earth from elements in kilometres and degrees, with the time of perigee passage."""
    _check_elements(a_km, e)
    mean_motion = math.sqrt(EARTH_MU / (a_km * 1e3) ** 3)
    i, raan, argp = (math.radians(x) for x in (i_deg, raan_deg, argp_deg))
    return KeplerOrbit(a_km * 1e3, e, i, raan, argp, -mean_motion * t_perigee_s)


def _check_elements(a_km: Real, e: Real) -> None:
    if not 0.0 < a_km < math.inf:
        raise ValueError(f"a_km must be positive, got {a_km}")
    if not 0.0 <= e <= LARGEST_ECCENTRICITY:
        raise ValueError(f"e must be in 0..{LARGEST_ECCENTRICITY}, got {e}")


def _length(x: Float[Array, ""], y: Float[Array, ""]) -> Float[Array, ""]:
    square = x * x + y * y
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


def _angle(y: Float[Array, ""], x: Float[Array, ""]) -> Float[Array, ""]:
    defined = (x != 0.0) | (y != 0.0)
    return jnp.where(defined, jnp.arctan2(y, jnp.where(defined, x, 1.0)), 0.0)
