"""Parts of a satellite in its file: body, magnet, rods, actuators, surface, and the torques without a part."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from jaxsat.physical import check_inertia
from jaxsat.satellites.sections.fitted import (
    Direction,
    PositiveScalar,
    Scalar,
    Tensor,
    Triple,
    UnitText,
    plain,
)
from jaxsat.setting_types import NonNegative, Positive, Section, Vector


def _edges(size: tuple[float, float, float]) -> tuple[float, float, float]:
    if min(size) <= 0.0:
        raise ValueError("expected three edges above zero")
    return size


Size = Annotated[Vector, AfterValidator(_edges)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Body(Section):
    """Mass properties."""

    mass_kg: Positive | None = None
    """Wanted only where `inertia_kg_m2` is left out."""
    size_m: Size | None = None
    """Edges along the body axes."""
    inertia_kg_m2: Tensor | None = None
    """About the centre of mass; left out: that of a uniform box of this mass and size."""

    @model_validator(mode="after")
    def _of_a_body(self):
        if self.inertia_kg_m2 is None and (self.mass_kg is None or self.size_m is None):
            raise ValueError("give inertia_kg_m2, or mass_kg and size_m from which it follows")
        check_inertia(self.inertia())
        return self

    def inertia(self) -> np.ndarray:
        """[3 3] kg m2."""
        if self.inertia_kg_m2 is not None:
            given = np.asarray(self.inertia_kg_m2.value)
            return np.diag(given) if given.ndim == 1 else given
        squares = np.square(np.asarray(self.size_m))
        return np.diag((self.mass_kg or 0.0) / 12.0 * (squares.sum() - squares))


class Magnet(Section):
    """Permanent dipole."""

    dipole_A_m2: Triple = plain((0.0, 0.0, 0.0))
    """Along the body axes."""


class Rod(Section):
    """A rod of soft magnetic material: linear by `moment`, with hysteresis by the others."""

    axis: Direction
    """Along which it lies."""
    moment: Scalar | None = None
    """In `reference_field_T` along it [A m2]."""
    reference_field_T: Positive = 3.0e-5
    Hc: PositiveScalar | None = None
    """Coercive field [A/m]."""
    Br: PositiveScalar | None = None
    """Remanence [T]."""
    Bs: PositiveScalar | None = None
    """Saturation [T]."""
    volume: PositiveScalar | None = None
    """[m3]"""

    @model_validator(mode="after")
    def _one_law(self):
        loop = {name: getattr(self, name) for name in ("Hc", "Br", "Bs", "volume")}
        given = [name for name, value in loop.items() if value is not None]
        if self.moment is not None and given:
            raise ValueError(f"moment is that of a linear rod, {', '.join(given)} of one with hysteresis: give either")
        if self.moment is None and len(given) < 4:
            missing = [name for name in loop if name not in given]
            raise ValueError(
                f"give moment for a linear rod, or all of Hc, Br, Bs, volume: {', '.join(missing)} missing"
            )
        if self.Br is not None and self.Bs is not None and not self.Br.value < self.Bs.value:
            raise ValueError(f"expected Br < Bs, found {self.Br.value:g} and {self.Bs.value:g} T")
        return self


class Coil(Section):
    """A coil or a magnetorquer: one whose current a column tells, or one that a control law commands, or both.

    A column's command holds until its next row; what no column tells is off in a fit.
    """

    axis: Direction
    """Of its dipole for a positive current."""
    area_turns_m2: Scalar | None = None
    """Area times turns: A m2 for each A of the column."""
    column: str | None = None
    """In which its current stands."""
    unit: UnitText = "A"
    """Of the column."""
    max_dipole_A_m2: Positive | None = None
    """Largest dipole that a control law can command."""
    residual: Share = 0.0
    """Share of the dipole that is left when a control law has switched it off, as in a core."""

    @model_validator(mode="after")
    def _one_use(self):
        if (self.column is None) != (self.area_turns_m2 is None):
            raise ValueError("column and area_turns_m2 go together: a current, and the dipole of one of it")
        if self.column is None and self.max_dipole_A_m2 is None:
            raise ValueError("give column and area_turns_m2 where telemetry tells its current, or max_dipole_A_m2")
        return self


class Wheel(Section):
    """A wheel whose rate a column tells, or that a control law commands, or both.

    Without a column it is at rest in a fit.
    """

    axis: Direction
    """About which it turns with a positive rate."""
    inertia: Scalar
    """About its axis [kg m2]; that of the body contains it."""
    column: str | None = None
    """In which its rate against the body stands."""
    unit: UnitText = "rad/s"
    """Of the column."""
    max_torque_N_m: Positive | None = None
    """Largest torque of its motor, for a control law."""
    max_speed_rpm: Positive | None = None
    """Largest rate against the body, for a control law."""
    coulomb_N_m: NonNegative = 0.0
    """Dry friction, for a control law."""
    viscous_N_m_s: NonNegative = 0.0
    """Friction over rate, for a control law."""

    @model_validator(mode="after")
    def _one_use(self):
        if (self.max_torque_N_m is None) != (self.max_speed_rpm is None):
            raise ValueError("max_torque_N_m and max_speed_rpm go together: what a control law can have of it")
        if self.column is None and self.max_torque_N_m is None:
            raise ValueError("give column where telemetry tells its rate, or max_torque_N_m and max_speed_rpm")
        if self.max_torque_N_m is not None and not self.inertia.value > 0.0:
            raise ValueError("inertia: expected a value above zero for a control law")
        return self


class Thruster(Section):
    """Thrusters in opposite pairs about an axis, on or off, for a control law; silent in a fit."""

    axis: Direction
    """About which they turn the body, either way."""
    torque_N_m: Positive
    """While they fire."""
    lever_m: Positive
    """Torque over the thrust of all that fire together."""
    min_pulse_s: NonNegative = 0.0
    """Shortest firing."""


class Residual(Section):
    """A constant torque."""

    torque: Triple = plain((0.0, 0.0, 0.0))
    """Body axes [N m]."""


class Eddy(Section):
    """Damping by eddy currents: the torque k (w x B) x B."""

    coefficient: Scalar = plain(0.0)
    """k [S m4], that is A m2 s/T."""


class Facet(Section):
    """A flat piece of the surface."""

    area_m2: Positive
    center_m: Vector
    normal: Direction
    specular: NonNegative = 0.0
    diffuse: NonNegative = 0.0


class Surface(Section):
    """Outer surface, for drag and the pressure of sunlight: facets, or the box of `size_m` (that of the body)."""

    facets: Annotated[tuple[Facet, ...], Field(strict=False)] | None = None
    size_m: Size | None = None
    """Edges of the box; left out: those of the body."""
    center_of_mass_m: Vector = (0.0, 0.0, 0.0)
    """From the middle of the box."""
    specular: Scalar = plain(0.0)
    """Share that the box's faces mirror."""
    diffuse: Scalar = plain(0.0)
    """Share that they scatter."""
    drag_coefficient: PositiveScalar = plain(2.2)

    @model_validator(mode="after")
    def _one(self):
        if self.facets is not None and self.size_m is not None:
            raise ValueError("facets and size_m say the same: give one of them")
        return self


class Light(Section):
    """The Sun's light."""

    shadow: Literal["cone", "cylinder"] = "cone"
    """The Earth's: of a Sun of finite size, where readings in the penumbra tell nothing and do not count, or with a
    sharp edge, where all count that do not contradict it."""


class Reflectivity(Section):
    """Reflectivity of the Earth, mirror-like and diffuse."""

    specular: Scalar = plain(0.0)
    """Share of the sunlight that is mirrored."""
    diffuse: Scalar = plain(0.3)
    """Share that is scattered to all sides."""
