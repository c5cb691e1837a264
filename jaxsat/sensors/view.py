"""What a sensor meets at one instant: attitude and rate of the satellite, and field, light and Earth around it."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.environment import LightTable
from jaxsat.math import quaternion, unit
from jaxsat.sensors.solar_panels import Albedo, earthlight


class View(eqx.Module):
    """One sample, SI; what no sensor of a satellite asked for is None. Batch with `jax.vmap`."""

    attitude: Float[Array, "4"]
    """Quaternion, inertial from body, scalar first."""
    rate: Float[Array, "3"]
    """Angular velocity against inertial space, body axes [rad/s]."""
    time: Float[Array, ""]
    """Since the epoch [s]."""
    position_eci: Float[Array, "3"]
    """From the Earth's centre [m]."""
    velocity_eci: Float[Array, "3"]
    """[m/s]"""
    b_field_eci: Float[Array, "3"]
    """Magnetic flux density, inertial components [T]."""
    light: LightTable | None = None
    """Sunlight and earthlight."""
    albedo: Albedo | None = None
    """Reflectivity of the Earth."""
    columns: Mapping[str, Float[Array, ""]] = eqx.field(default_factory=dict)
    """Telemetered numbers of this instant by the name of their column, such as measured currents."""

    def body(self, vector_eci: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Body components of inertial vectors."""
        return quaternion.rotate_inverse(self.attitude, vector_eci)

    @property
    def field(self) -> Float[Array, "3"]:
        """Magnetic flux density, body axes [T]."""
        return self.body(self.b_field_eci)

    @property
    def sun(self) -> Float[Array, "3"]:
        """Unit vector to the Sun, body axes; there in the dark too."""
        return self.body(self.lit.sun_eci)

    @property
    def nadir(self) -> Float[Array, "3"]:
        """Unit vector to the Earth's centre, body axes."""
        return self.body(-unit(self.position_eci))

    @property
    def lit(self) -> LightTable:
        """The light; ValueError where nobody tabulated it."""
        if self.light is None:
            raise ValueError("View.light is None: a sensor that reads it has 'light' in its `needs`")
        return self.light

    def sunlight(self, normals: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Cosine of the Sun on faces of these normals (body axes) times its visible share; zero from behind."""
        return self.lit.illumination * jnp.maximum(normals @ self.sun, 0.0)

    def earthlight(self, normals: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Light of the Earth on faces of these normals over that of the Sun square on (`albedo_currents`)."""
        if self.albedo is None:
            raise ValueError("View.albedo is None: a sensor that reads it has 'light' in its `needs`")
        return earthlight(normals @ quaternion.to_dcm(self.attitude).T, self.albedo, self.lit)
