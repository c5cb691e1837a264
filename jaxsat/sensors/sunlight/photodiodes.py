"""Photodiodes, or other single cells, with a law of response and the light of the Earth."""

from typing import ClassVar, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.math import angle_between, float_array, optional_array
from jaxsat.sensors.abstract import AbstractSensor, Sight
from jaxsat.sensors.sunlight.sun_of_cells import Cells, sun_of_cells
from jaxsat.sensors.view import View


def power_response(
    angle: Float[Array, " n"], limit: Float[Array, ""], exponent: Float[Array, ""]
) -> Float[Array, " n"]:
    """1 - (angle / limit)^exponent below the limit, zero beyond; its slope is zero on the axis and at the limit."""
    inside = (angle > 0.0) & (angle < limit)
    ratio = jnp.where(inside, angle / limit, 1.0)
    # On the axis itself, where a power below one has no slope, the response is one and flat.
    return jnp.where(inside, 1.0 - ratio**exponent, jnp.where(angle < limit, 1.0, 0.0))


class Photodiodes(AbstractSensor):
    """Readings of cells on any faces: gain times (share of the Sun's disk x response to its angle + earthlight)."""

    needs: ClassVar[frozenset[str]] = frozenset({"light"})
    sees: ClassVar[Sight | None] = "sun"

    normals: Float[Array, "n 3"] = eqx.field(converter=float_array)
    """Unit vectors along which each cell looks, body axes."""
    gain: Float[Array, " n"] = eqx.field(converter=float_array)
    """Reading with the Sun on the axis."""
    limit: Float[Array, ""] | None = eqx.field(converter=optional_array, default=None)
    """Angle of the Sun from which a cell of `power` law sees nothing [rad]."""
    exponent: Float[Array, ""] | None = eqx.field(converter=optional_array, default=None)
    """Of the `power` law."""
    table_angle: Float[Array, " k"] | None = eqx.field(converter=optional_array, default=None)
    """Rising angles of the `table` law [rad]; beyond the last one nothing is seen."""
    table_value: Float[Array, " k"] | None = eqx.field(converter=optional_array, default=None)
    """Response there, one on the axis."""
    response: Literal["cosine", "power", "table"] = eqx.field(static=True, default="cosine")
    """Law of the Sun's light. That of the Earth, which comes from all sides, always counts by the cosine."""
    earthlight: bool = eqx.field(static=True, default=True)

    def __check_init__(self):
        wanted = {"cosine": (), "power": ("limit", "exponent"), "table": ("table_angle", "table_value")}
        if self.response not in wanted:
            raise ValueError(f"Photodiodes.response: expected one of {', '.join(wanted)}, got {self.response!r}")
        missing = [name for name in wanted[self.response] if getattr(self, name) is None]
        if missing:
            raise ValueError(f"Photodiodes: response {self.response!r} wants {' and '.join(missing)}")

    def __call__(self, view: View) -> Float[Array, " n"]:
        seen = self._sunlight(view)
        return self.gain * (seen + view.earthlight(self.normals) if self.earthlight else seen)

    def _sunlight(self, view: View) -> Float[Array, " n"]:
        angle = angle_between(self.normals, jnp.broadcast_to(view.sun, self.normals.shape))
        if self.response == "power" and self.limit is not None and self.exponent is not None:
            return view.lit.illumination * power_response(angle, self.limit, self.exponent)
        if self.response == "table" and self.table_angle is not None and self.table_value is not None:
            return view.lit.illumination * jnp.interp(angle, self.table_angle, self.table_value, right=0.0)
        return view.sunlight(self.normals)

    def direct(
        self, readings: Float[np.ndarray, "n cells"], sigma: float
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
        """Directions of the Sun, NaN in the dark; the Earth's light is part of the error (`sun_of_cells`)."""
        gain, normals = np.asarray(self.gain, float), np.asarray(self.normals, float)
        cells = self._cells_on_host(normals)
        return sun_of_cells(readings / gain, sigma / np.abs(gain), cells, normals, earthlight=self.earthlight)

    def _cells_on_host(self, normals: np.ndarray) -> Cells:
        def angle(sun):
            return np.arccos(np.clip(sun @ normals.T, -1.0, 1.0))

        if self.response == "power" and self.limit is not None and self.exponent is not None:
            limit, exponent = float(self.limit), float(self.exponent)
            return lambda sun: 1.0 - np.minimum(angle(sun) / limit, 1.0) ** exponent
        if self.response == "table" and self.table_angle is not None and self.table_value is not None:
            angles, values = np.asarray(self.table_angle, float), np.asarray(self.table_value, float)
            return lambda sun: np.interp(angle(sun), angles, values, right=0.0)
        return lambda sun: np.maximum(sun @ normals.T, 0.0)
