"""The Kepler orbit through a state: regular whatever its shape and plane, as classical elements are not."""

import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_MU
from jaxsat.environment.orbit.abstract import AbstractOrbit
from jaxsat.environment.orbit.kepler import LARGEST_ECCENTRICITY, KeplerOrbit, classical_elements, solve_kepler
from jaxsat.math import float_array, is_known


class StateOrbit(AbstractOrbit):
    """An unperturbed elliptic orbit about the Earth, held as its state at t = 0; calling it gives the state at `t`.

    Its derivatives by that state are those of the motion for circular, equatorial and retrograde orbits too, where node
    and perigee do not exist. The classical elements are worked out each time that one is asked for.
    """

    position_eci: Float[Array, "3"] = eqx.field(converter=float_array)
    """At t = 0 [m]."""
    velocity_eci: Float[Array, "3"] = eqx.field(converter=float_array)
    """At t = 0 [m/s]."""
    mu: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_MU)
    """Gravitational parameter [m^3/s^2]."""

    def __check_init__(self):
        if is_known(self.position_eci, self.velocity_eci, self.mu):
            _check_ellipse(np.asarray(self.position_eci), np.asarray(self.velocity_eci), np.asarray(self.mu))

    @property
    def semi_major_axis(self) -> Float[Array, ""]:
        """Semi-major axis [m]."""
        distance = jnp.linalg.norm(self.position_eci, axis=-1)
        return 1.0 / (2.0 / distance - jnp.sum(self.velocity_eci**2, axis=-1) / self.mu)

    @property
    def elements(self) -> KeplerOrbit:
        """The same orbit by its classical elements (`classical_elements`)."""
        of_each = classical_elements
        for _ in range(self.position_eci.ndim - 1):
            of_each = jax.vmap(of_each)
        return of_each(self.position_eci, self.velocity_eci, self.mu)

    @property
    def eccentricity(self) -> Float[Array, ""]:
        """Eccentricity."""
        return self.elements.eccentricity

    @property
    def inclination(self) -> Float[Array, ""]:
        """Inclination to the equator [rad]."""
        return self.elements.inclination

    @property
    def raan(self) -> Float[Array, ""]:
        """Right ascension of the ascending node [rad]."""
        return self.elements.raan

    @property
    def argument_of_perigee(self) -> Float[Array, ""]:
        """Argument of perigee [rad]."""
        return self.elements.argument_of_perigee

    @property
    def mean_anomaly(self) -> Float[Array, ""]:
        """Mean anomaly at t = 0 [rad]."""
        return self.elements.mean_anomaly

    @property
    def mean_motion(self) -> Float[Array, ""]:
        """Mean angular rate [rad/s]."""
        return jnp.sqrt(self.mu / self.semi_major_axis) / self.semi_major_axis

    @property
    def period(self) -> Float[Array, ""]:
        """Orbital period [s]."""
        return 2.0 * math.pi / self.mean_motion

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], inertial frame, `t` seconds after the epoch.

        Lagrange's coefficients in the eccentric anomaly passed since t = 0 (Battin 1999, eq. 4.41), f and g written so
        that nothing in them grows with time; NaN where a traced state is not that of an ellipse.
        """
        r, v, a, n = self.position_eci, self.velocity_eci, self.semi_major_axis, self.mean_motion
        start = jnp.linalg.norm(r)
        e_cos, e_sin = 1.0 - start / a, jnp.sum(r * v) / (n * a * a)
        passed = _anomaly_passed(n * t, e_cos, e_sin)
        s, versine = jnp.sin(passed), 2.0 * jnp.sin(0.5 * passed) ** 2
        distance = a * (1.0 - e_cos * jnp.cos(passed) + e_sin * s)
        f, g = 1.0 - a / start * versine, ((1.0 - e_cos) * s + e_sin * versine) / n
        f_rate, g_rate = -n * a * a * s / (distance * start), 1.0 - a / distance * versine
        return f * r + g * v, f_rate * r + g_rate * v

    def check_span(self, times: np.ndarray) -> None:
        """Do nothing: an ellipse has no ends."""


@jax.custom_jvp
def _anomaly_passed(
    mean_anomaly_passed: Float[Array, ""], e_cos: Float[Array, ""], e_sin: Float[Array, ""]
) -> Float[Array, ""]:
    """Eccentric anomaly x passed since E, by the mean anomaly passed: x - e_cos sin x + e_sin (1 - cos x).

    e cos E and e sin E are regular where e is zero and E is nothing; the derivative is that of the equation.
    """
    start = jnp.arctan2(e_sin, e_cos)
    e = jnp.sqrt(e_cos * e_cos + e_sin * e_sin)
    return solve_kepler(start - e_sin + mean_anomaly_passed, e) - start


@_anomaly_passed.defjvp
def _anomaly_passed_jvp(primals, tangents):
    _, e_cos, e_sin = primals
    d_mean, d_cos, d_sin = tangents
    x = _anomaly_passed(*primals)
    s, c = jnp.sin(x), jnp.cos(x)
    return x, (d_mean + s * d_cos - (1.0 - c) * d_sin) / (1.0 - e_cos * c + e_sin * s)


def elements_from_state(
    position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"], mu: float | Float[Array, ""] = EARTH_MU
) -> StateOrbit:
    """Return the elliptic orbit through a state at t = 0, with its classical elements as properties.

    Raises ValueError where the state is not that of an ellipse of e <= 0.95; from a traced one comes NaN.
    """
    return StateOrbit(position_eci, velocity_eci, mu)


def _check_ellipse(position: np.ndarray, velocity: np.ndarray, mu: np.ndarray) -> None:
    told = f"position {position} m, velocity {velocity} m/s"
    finite = np.isfinite(position).all() and np.isfinite(velocity).all() and np.isfinite(mu).all()
    if not (finite and position.any(axis=-1).all() and np.all(mu > 0.0)):
        raise ValueError(f"expected a finite state off the Earth's centre and mu above zero, got {told}, mu = {mu}")
    distance = np.linalg.norm(position, axis=-1)
    inverse_axis = 2.0 / distance - np.sum(velocity**2, axis=-1) / mu
    laplace = np.cross(velocity, np.cross(position, velocity)) / mu[..., None] - position / distance[..., None]
    e = np.linalg.norm(laplace, axis=-1)
    if not np.all((inverse_axis > 0.0) & (e <= LARGEST_ECCENTRICITY)):
        raise ValueError(
            f"expected the state of an ellipse of e in 0..{LARGEST_ECCENTRICITY}, got e = {np.max(e):.6g} of {told}"
        )
