"""Which numbers of the model a fit may change, in which order, with which scale, bounds and prior.

Every parameter has a public name in the unit of the results (`imax` in mA). Inside, a fit works on `x`, the shift
of each free parameter from its nominal value in units of its prior sigma; the attitude enters as a small rotation
in body axes, so it has no entry of its own beyond that shift.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.parameters.names import (
    ALBEDO,
    GAINS,
    INERTIA,
    MAGNET,
    MODEL,
    NAMED,
    POLAR,
    QUOTED_FIELD,
    RODS,
    STATE,
    TILTS,
)
from fitting.parameters.nominal import Nominal
from fitting.parameters.transforms import (
    dipole_from_polar,
    inertia_shift,
    physical_inertia,
    polar_from_dipole,
    second_moment_root,
    thinnest,
)
from fitting.settings import PriorSigma
from jaxsat.errors import InputError
from jaxsat.munin import munin_panels, munin_satellite
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import SolarPanels, Spacecraft

FLAT = 0.05
"""Least principal second moment of mass over the mean one of a nominal body below which a prior sigma of its inertia
spans thicknesses many times its own, and entries of the inertia move by themselves."""
MAX_ELEVATION = np.radians(80.0)
"""Highest elevation of a nominal dipole that angles may describe."""


def _place(names: tuple[str, ...]) -> slice:
    """Where a group stands in the vector of the model."""
    return slice(MODEL.index(names[0]), MODEL.index(names[-1]) + 1)


MAGNET_SLICE, RODS_SLICE, INERTIA_SLICE = _place(MAGNET), _place(RODS), _place(INERTIA)
GAINS_SLICE, TILTS_SLICE = _place(GAINS), _place(TILTS)


class Parametrization(eqx.Module):
    """Map between the solver's `x` and the model; `free` is static, so each choice of it is one program.

    Arrays over `NAMED`. An inertia that is free as a whole stays that of a body (`transforms.physical_inertia`) unless
    the nominal one is all but flat; what else has a limit is held by bounds, which a minimum may touch: a rod or an
    albedo of exactly zero is a good answer.
    """

    nominal: Float[Array | np.ndarray, " named"]
    scale: Float[Array | np.ndarray, " named"]
    lower: Float[Array | np.ndarray, " named"]
    upper: Float[Array | np.ndarray, " named"]
    reference_field: Float[Array | np.ndarray, ""]
    inertia_root: Float[Array | np.ndarray, "3 3"]
    """`transforms.second_moment_root` of the nominal inertia."""
    inertia_root_inverse: Float[Array | np.ndarray, "3 3"]
    free: tuple[str, ...] = eqx.field(static=True)
    physical: bool = eqx.field(static=True)
    """Whether the inertia stays that of a body."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the solver's unknowns: the state, then the free model parameters."""
        return STATE + self.free

    @property
    def tree(self) -> "Parametrization":
        """What of it a compiled program takes."""
        return self

    @property
    def everything(self) -> np.ndarray:
        """[unknowns] bool: what may move at the end."""
        return np.ones(len(self.names), bool)

    @property
    def polar(self) -> bool:
        """Whether the dipole moves by its modulus and angles."""
        return bool(set(POLAR) & set(self.free))

    @property
    def gauged(self) -> bool:
        """Whether the common scale of inertia, magnet and rods is fixed by the magnet's modulus.

        It is also where rods that are not free give the scale away: their torque is too weak to say it well.
        """
        free = set(self.free)
        return set(INERTIA) <= free and (set(MAGNET) <= free or POLAR[0] in free)

    @property
    def gains_gauged(self) -> bool:
        """Whether the common scale of the gains and the maximum current is fixed by the mean gain."""
        return "imax" in self.free and set(GAINS) <= set(self.free)

    def quoted(self, name: str) -> float:
        """Factor from a value of the model to the one that results quote: that of rods is told in `QUOTED_FIELD`."""
        return QUOTED_FIELD / float(self.reference_field) if name in RODS else 1.0

    def indices(self) -> np.ndarray:
        """Positions of the free parameters in `NAMED`."""
        return np.array([NAMED.index(name) for name in self.free], dtype=int)

    def values(self, x_model: Float[Array, " free"]) -> Float[Array, " model"]:
        """Physical values of all model parameters, SI. Differentiable."""
        index = self.indices()
        nominal = jnp.asarray(self.nominal)
        shift = jnp.zeros_like(nominal)
        if len(index):
            shift = shift.at[index].set(jnp.asarray(self.scale)[index] * x_model)
        full = (nominal + shift)[: len(MODEL)]
        if self.polar:
            full = full.at[MAGNET_SLICE].set(dipole_from_polar((nominal + shift)[len(MODEL) :]))
        if self.physical:
            root, inverse = jnp.asarray(self.inertia_root), jnp.asarray(self.inertia_root_inverse)
            full = full.at[INERTIA_SLICE].set(physical_inertia(root, inverse, shift[INERTIA_SLICE]))
        if self.gauged:
            # (inertia, magnet, rods) -> c (inertia, magnet, rods) leaves the motion as it is: hold |magnet|.
            modulus = jnp.sqrt(jnp.sum(nominal[MAGNET_SLICE] ** 2))
            full = full.at[MAGNET_SLICE].multiply(modulus / jnp.sqrt(jnp.sum(full[MAGNET_SLICE] ** 2)))
        if self.gains_gauged:
            mean = jnp.mean(full[GAINS_SLICE])
            full = full.at[GAINS_SLICE].multiply(jnp.mean(nominal[GAINS_SLICE]) / mean)
        return full

    def named(self, x_model: Float[Array, " free"]) -> Float[Array, " named"]:
        """The same, followed by modulus and angles of the dipole. Differentiable."""
        values = self.values(x_model)
        polar = polar_from_dipole(values[MAGNET_SLICE])
        if self.gauged:
            # Held by definition: no rounding shall pass for a slope.
            polar = polar.at[0].set(jax.lax.stop_gradient(polar[0]))
        return jnp.concatenate([values, polar])

    def shifts(self, values: np.ndarray) -> np.ndarray:
        """[free] the `x_model` that gives the `values` [model], on the host; where scales are gauged, their ratios."""
        values = np.asarray(values, dtype=float)
        polar = np.asarray(polar_from_dipole(jnp.asarray(values[MAGNET_SLICE])))
        shift = np.concatenate([values, polar]) - np.asarray(self.nominal)
        azimuth = NAMED.index(POLAR[1])
        shift[azimuth] = np.angle(np.exp(1j * shift[azimuth]))
        if self.physical:
            shift[INERTIA_SLICE] = inertia_shift(np.asarray(self.inertia_root), values[INERTIA_SLICE])
        return (shift / np.asarray(self.scale))[self.indices()]

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest `x` of the solver's unknowns; the state is unbounded."""
        index = self.indices()
        nominal, scale = np.asarray(self.nominal)[index], np.asarray(self.scale)[index]
        free = np.full(len(STATE), np.inf)
        lower, upper = np.asarray(self.lower)[index], np.asarray(self.upper)[index]
        return np.concatenate([-free, (lower - nominal) / scale]), np.concatenate([free, (upper - nominal) / scale])


def parametrization(nominal: Nominal, free: tuple[str, ...], prior: PriorSigma) -> Parametrization:
    """Scales, bounds and gauge for a set of free parameters.

    Raises `InputError` where the magnet's modulus has to hold the gauge and is zero, and where the nominal dipole has
    no angles to start from.
    """
    modulus = float(np.linalg.norm(nominal.magnet))
    if set(INERTIA) <= set(free) and set(MAGNET) <= set(free) and not modulus > 0.0:
        raise InputError("magnet and inertia are both free: a nominal |magnet| above 0 must hold their common scale")
    polar = np.asarray(polar_from_dipole(jnp.asarray(nominal.magnet, dtype=float)))
    if set(POLAR) & set(free) and not (modulus > 0.0 and abs(polar[2]) < MAX_ELEVATION):
        raise InputError(
            f"the dipole's angles are free: its nominal modulus must be above 0 and its elevation within "
            f"{np.degrees(MAX_ELEVATION):.0f} deg, or free the group magnet, the vector"
        )
    mean_inertia = float(np.mean(np.asarray(nominal.inertia)[:3]))
    sigma = {
        **dict.fromkeys((*MAGNET, POLAR[0]), prior.magnet_A_m2),
        **dict.fromkeys(POLAR[1:], min(prior.magnet_A_m2 / modulus, np.pi) if modulus > 0.0 else np.pi),
        **dict.fromkeys(RODS, prior.rods_A_m2),
        **dict.fromkeys(INERTIA, prior.inertia_relative * mean_inertia),
        "imax": prior.imax_relative * nominal.max_current,
        **dict.fromkeys(GAINS, prior.gains),
        **dict.fromkeys(ALBEDO, prior.albedo),
        **dict.fromkeys(TILTS, float(np.radians(prior.tilts_deg))),
    }
    lower = dict.fromkeys((*RODS, *ALBEDO, *GAINS, POLAR[0]), 0.0) | {"imax": 0.05 * nominal.max_current}
    thickness = thinnest(nominal.inertia)
    physical = set(INERTIA) <= set(free) and thickness > FLAT
    if not physical:
        lower |= dict.fromkeys(INERTIA[:3], 0.05 * mean_inertia)
    upper: dict[str, float] = dict.fromkeys(ALBEDO, 1.5)
    root = second_moment_root(nominal.inertia) if thickness > FLAT else np.eye(3)
    return Parametrization(
        nominal=np.concatenate([nominal.vector(), polar]),
        scale=np.array([sigma[name] for name in NAMED]),
        lower=np.array([lower.get(name, -np.inf) for name in NAMED]),
        upper=np.array([upper.get(name, np.inf) for name in NAMED]),
        reference_field=np.asarray(nominal.reference_field, dtype=float),
        inertia_root=root,
        inertia_root_inverse=np.linalg.inv(root),
        free=free,
        physical=physical,
    )


def build_model(
    values: Float[Array, " model"], reference_field: Float[Array, ""]
) -> tuple[Spacecraft, SolarPanels, Albedo]:
    """The satellite, the panels on it and the Earth's reflectivity from values in the order of `MODEL`, SI."""
    panels = munin_panels(values[MODEL.index("imax")], values[GAINS_SLICE], values[TILTS_SLICE].reshape(6, 2))
    spacecraft = munin_satellite(
        values[INERTIA_SLICE],
        values[MAGNET_SLICE],
        values[RODS_SLICE],
        reference_field=reference_field,
        panels=panels,
    )
    specular, diffuse = (values[MODEL.index(name)] for name in ALBEDO)
    return spacecraft, panels, Albedo(specular, diffuse)
