"""Accelerations of a satellite, objects that a propagation sums; true equator and equinox of date throughout."""

import abc
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from jaxsat.constants import AU, EARTH_MU, EARTH_ROTATION_RATE, SOLAR_PRESSURE
from jaxsat.environment.atmosphere import ExponentialAtmosphere, air_velocity_eci
from jaxsat.environment.orbit.abstract import AbstractOrbit
from jaxsat.environment.shadow import ConeShadow, CylinderShadow
from jaxsat.math import float_array, safe_norm

SUN_MU = 1.32712440041279e20
"""Gravitational parameter of the Sun [m^3/s^2] (DE440: Park et al. 2021, table 2)."""

MOON_MU = 4.902800118e12
"""Gravitational parameter of the Moon [m^3/s^2] (DE440: Park et al. 2021, table 2)."""

# Four seconds apart in a step of a minute; the penumbra of a low orbit lasts eight.
_INSTANTS = 16


class AbstractAcceleration(eqx.Module):
    """An acceleration in two halves: what is worked out once for a step of integration, and what each stage adds."""

    @abc.abstractmethod
    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> PyTree:
        """Return what the acceleration reads at `times` [s] (leading axis) of a step that begins in this state."""

    @abc.abstractmethod
    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless the acceleration is known at all `times` [s]; asked on the host, before tracing."""

    @abc.abstractmethod
    def __call__(
        self, given: PyTree, position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2], inertial components."""


def central_acceleration(position: Float[Array, "3"], mu: float | Float[Array, ""]) -> Float[Array, "3"]:
    """Return - mu r / r^3, the attraction of a point at the origin [m/s^2]."""
    r2 = jnp.sum(position * position)
    return -mu / (r2 * jnp.sqrt(r2)) * position


class CentralGravity(AbstractAcceleration):
    """Attraction of a spherical Earth."""

    mu: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_MU)
    """Gravitational parameter [m^3/s^2]."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> None:
        """Return nothing: the state of each stage decides."""

    def check_span(self, times: np.ndarray) -> None:
        """Accept any times."""

    def __call__(
        self, given: None, position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        return central_acceleration(position_eci, self.mu)


class HarmonicGravity(AbstractAcceleration):
    """Attraction of a field that turns with the Earth, its central term included."""

    field: Callable[[Float[Array, "3"]], Float[Array, "3"]]
    """Acceleration [m/s^2] by position [m], both Earth-fixed."""
    greenwich_angle_0: Float[Array, ""] = eqx.field(converter=float_array)
    """Greenwich apparent sidereal time at t = 0 [rad]."""
    earth_rotation_rate: Float[Array, ""] = eqx.field(converter=float_array, default=EARTH_ROTATION_RATE)
    """Its rate [rad/s]."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> tuple[Float[Array, "stages"], Float[Array, "stages"]]:
        """Return cosine and sine of the Greenwich angle."""
        angle = self.greenwich_angle_0 + self.earth_rotation_rate * times
        return jnp.cos(angle), jnp.sin(angle)

    def check_span(self, times: np.ndarray) -> None:
        """Accept any times."""

    def __call__(
        self,
        given: tuple[Float[Array, ""], Float[Array, ""]],
        position_eci: Float[Array, "3"],
        velocity_eci: Float[Array, "3"],
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        c, s = given
        return _about_pole(self.field(_about_pole(position_eci, c, -s)), c, s)


def third_body_acceleration(
    position: Float[Array, "3"], body: Float[Array, "3"], mu: float | Float[Array, ""]
) -> Float[Array, "3"]:
    """Return mu [(s - r)/|s - r|^3 - s/s^3], the attraction of a body at s less that on the Earth [m/s^2].

    Written so that the two nearly equal terms are not subtracted (Battin 1999, section 8.4).
    """
    s2 = jnp.sum(body * body)
    q = jnp.sum(position * (position - 2.0 * body)) / s2
    f = q * (3.0 + q * (3.0 + q)) / (1.0 + (1.0 + q) ** 1.5)
    distance = jnp.sqrt(s2 * (1.0 + q))
    return -mu / distance**3 * (position + f * body)


class ThirdBody(AbstractAcceleration):
    """Attraction of the Sun, the Moon or another point mass, against that on the Earth."""

    mu: Float[Array, ""] = eqx.field(converter=float_array)
    """Gravitational parameter of the body [m^3/s^2]."""
    body: AbstractOrbit
    """Its place about the Earth."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> Float[Array, "stages 3"]:
        """Return the body's positions [m]."""
        return jax.vmap(self.body)(times)[0]

    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless the body's place is known at all `times` [s]."""
        self.body.check_span(times)

    def __call__(
        self, given: Float[Array, "3"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        return third_body_acceleration(position_eci, given, self.mu)


class Drag(AbstractAcceleration):
    """Drag of the air on a ball, - (C_D A / m) rho/2 |v| v (Vallado 2013, eq. 8-28); the air turns with the Earth."""

    area_to_mass: Float[Array, ""] = eqx.field(converter=float_array)
    """Drag coefficient times cross-section over mass, C_D A / m [m^2/kg]: the inverse ballistic coefficient."""
    atmosphere: Callable[[Float[Array, "3"]], Float[Array, ""]] = eqx.field(default_factory=ExponentialAtmosphere)
    """Density [kg/m^3] by inertial position [m]."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> None:
        """Return nothing: the state of each stage decides."""

    def check_span(self, times: np.ndarray) -> None:
        """Accept any times."""

    def __call__(
        self, given: None, position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        air_velocity = air_velocity_eci(position_eci, velocity_eci)
        density = self.atmosphere(position_eci)
        return -0.5 * self.area_to_mass * density * safe_norm(air_velocity) * air_velocity


class SolarPressure(AbstractAcceleration):
    """Pressure of sunlight on a ball, - nu P (AU/d)^2 (C_R A / m) s (Montenbruck & Gill 2000, eq. 3.75).

    s is the direction to the Sun at the distance d, nu the visible fraction of its disk: its mean over each step, so
    that the impulse does not depend on how the stages fall about the edge of a shadow. (Taken at the stages, edges cost
    13 m in ten days of a low orbit with 0.01 m^2/kg at 60 s; their mean costs 4 cm.)
    """

    area_to_mass: Float[Array, ""] = eqx.field(converter=float_array)
    """Radiation coefficient (1 absorbs or mirrors, 1.44 scatters) times cross-section over mass, C_R A / m [m^2/kg]."""
    sun: AbstractOrbit
    """The Sun's place about the Earth."""
    shadow: CylinderShadow | ConeShadow = eqx.field(default_factory=ConeShadow)
    """The Earth's shadow."""
    pressure: Float[Array, ""] = eqx.field(converter=float_array, default=SOLAR_PRESSURE)
    """Momentum flux of sunlight at 1 AU [Pa]."""

    def given(
        self, times: Float[Array, "stages"], position_eci: Float[Array, "3"], velocity_eci: Float[Array, "3"]
    ) -> tuple[Float[Array, "stages 3"], Float[Array, "stages"]]:
        """Return the Sun's positions [m] and the mean of its visible fraction from first to last time."""
        sun = jax.vmap(self.sun)(times)[0]
        middle = 0.5 * (sun[0] + sun[-1])
        towards = middle / jnp.sqrt(jnp.sum(middle * middle))
        fall = 0.5 * central_acceleration(position_eci, EARTH_MU)

        def lit_after(t):
            # A parabola leaves the orbit by half a metre in a minute.
            return self.shadow(position_eci + t * (velocity_eci + t * fall), towards)

        elapsed = (times[-1] - times[0]) * jnp.asarray((np.arange(_INSTANTS) + 0.5) / _INSTANTS, times.dtype)
        lit = jnp.mean(jax.vmap(lit_after)(elapsed))
        return sun, jnp.broadcast_to(lit, times.shape)

    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless the Sun's place is known at all `times` [s]."""
        self.sun.check_span(times)

    def __call__(
        self,
        given: tuple[Float[Array, "3"], Float[Array, ""]],
        position_eci: Float[Array, "3"],
        velocity_eci: Float[Array, "3"],
    ) -> Float[Array, "3"]:
        """Return the acceleration [m/s^2]."""
        sun, lit = given
        to_sun = sun - position_eci
        distance = jnp.sqrt(jnp.sum(to_sun * to_sun))
        return -lit * self.pressure * (AU / distance) ** 2 * self.area_to_mass / distance * to_sun


def _about_pole(vector: Float[Array, "3"], c: Float[Array, ""], s: Float[Array, ""]) -> Float[Array, "3"]:
    """The vector turned about the pole by the angle with cosine c and sine s."""
    x, y, z = vector[0], vector[1], vector[2]
    return jnp.stack([c * x - s * y, s * x + c * y, z])
