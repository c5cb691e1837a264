"""Which numbers of the model a fit may change, in which order, with which scale, bounds and prior.

Every parameter has a public name in the unit of the results (`imax` in mA). Inside, a fit works on `x`, the shift
of each free parameter from its nominal value in units of its prior sigma; the attitude enters as a small rotation
in body axes, so it has no entry of its own beyond that shift.
"""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.errors import InputError
from jaxsat.sensors.solar_panels import Albedo
from jaxsat.spacecraft import PANEL_NAMES, MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor

STATE = ("attitude.x", "attitude.y", "attitude.z", "rate.x", "rate.y", "rate.z")
MAGNET = ("magnet.x", "magnet.y", "magnet.z")
RODS = ("rods.y", "rods.z")
INERTIA = ("inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz")
GAINS = tuple(f"gains.{panel}" for panel in PANEL_NAMES)
ALBEDO = ("albedo.specular", "albedo.diffuse")

DYNAMIC = MAGNET + RODS + INERTIA
"""Parameters that move the satellite."""
SENSOR = ("imax", *GAINS, *ALBEDO)
"""Parameters that only change what its panels report: they need no sensitivity through the integration."""
MODEL = DYNAMIC + SENSOR

GROUPS = {
    "state": STATE,
    "magnet": MAGNET,
    "rods": RODS,
    "imax": ("imax",),
    "gains": GAINS,
    "inertia": INERTIA,
    "albedo": ALBEDO,
}
CLASSIC = {
    "als": (),
    "alsi0": ("magnet",),
    "alsi23": ("rods",),
    "alsimax": ("imax",),
    "alsj": ("inertia",),
    "alsi0j": ("magnet", "inertia"),
}
"""The programs of Penkov et al. 2009, sec. 2.2, by lower-case name; the scans print I0 as IO or 10."""

UNITS = {
    **dict.fromkeys(("attitude.x", "attitude.y", "attitude.z"), "deg"),
    **dict.fromkeys(("rate.x", "rate.y", "rate.z"), "deg/s"),
    **dict.fromkeys(MAGNET + RODS, "A m2"),
    **dict.fromkeys(INERTIA, "kg m2"),
    **dict.fromkeys(GAINS + ALBEDO, "1"),
    "imax": "mA",
}
TO_UNIT = {**dict.fromkeys(STATE, float(np.degrees(1.0))), "imax": 1e3}
"""Factors from SI to the unit of the name; 1 where absent."""


def parse_free(text: str | list[str] | tuple[str, ...]) -> tuple[str, ...]:
    """Names of the free model parameters (the state is always free and not listed), in the order of `MODEL`.

    `text` lists groups (`state,magnet,rods,imax,gains,inertia,albedo`), classic program names (`als`, `alsI0`, ...)
    and single parameters (`albedo.specular`), in any mixture. Raises ValueError naming the first unknown item.
    """
    items = text.split(",") if isinstance(text, str) else list(text)
    chosen: set[str] = set()
    for item in (part.strip() for part in items):
        classic = CLASSIC.get(item.lower().replace("sio", "si0").replace("s10", "si0"))
        if classic is not None:
            chosen.update(name for group in classic for name in GROUPS[group])
        elif item in GROUPS:
            chosen.update(GROUPS[item])
        elif item in MODEL or item in STATE:
            chosen.add(item)
        else:
            known = ", ".join([*GROUPS, "als", "alsI0", "alsI23", "alsImax", "alsJ", "alsI0J"])
            raise ValueError(f"unknown free parameter {item!r}; expected any of {known} or a single name as {MODEL[0]}")
    return tuple(name for name in MODEL if name in chosen)


@dataclass(frozen=True)
class PriorSigma:
    """Weak priors about the nominal values; absolute unless the name says relative."""

    magnet: float = 0.05
    """[A m^2] for each component."""
    rods: float = 0.05
    """[A m^2]"""
    imax_relative: float = 0.2
    gains: float = 0.1
    inertia_relative: float = 0.15
    """Of the mean moment of inertia, for each of the six components."""
    albedo: float = 0.5


@dataclass(frozen=True)
class Nominal:
    """Nominal model, SI: the values of what is not free, and the centre of the priors of what is."""

    magnet: np.ndarray
    """[3] body axes [A m^2]."""
    rods: np.ndarray
    """[2] moments of the y and z rods in the reference field [A m^2]."""
    reference_field: float
    """[T]"""
    inertia: np.ndarray
    """[6] xx yy zz xy xz yz [kg m^2]."""
    max_current: float
    """[A]"""
    gains: np.ndarray
    """[6] +x -x +y -y +z -z."""
    albedo: np.ndarray
    """[2] specular, diffuse."""

    def vector(self) -> np.ndarray:
        """Values in the order of `MODEL`."""
        parts = [self.magnet, self.rods, self.inertia, [self.max_current], self.gains, self.albedo]
        return np.concatenate([np.asarray(part, dtype=float) for part in parts])


class Parametrization(eqx.Module):
    """Map between the solver's `x` and the model; `free` is static, so each choice of it is one program."""

    nominal: Float[Array | np.ndarray, " model"]
    scale: Float[Array | np.ndarray, " model"]
    lower: Float[Array | np.ndarray, " model"]
    upper: Float[Array | np.ndarray, " model"]
    reference_field: Float[Array | np.ndarray, ""]
    free: tuple[str, ...] = eqx.field(static=True)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the solver's unknowns: the state, then the free model parameters."""
        return STATE + self.free

    @property
    def gauged(self) -> bool:
        """Whether the common scale of inertia, magnet and rods is fixed by the magnet's modulus.

        It is also where rods that are not free give the scale away: their torque is too weak to say it well.
        """
        return set(MAGNET + INERTIA) <= set(self.free)

    @property
    def gains_gauged(self) -> bool:
        """Whether the common scale of the gains and the maximum current is fixed by the mean gain."""
        return "imax" in self.free and set(GAINS) <= set(self.free)

    def indices(self) -> np.ndarray:
        """Positions of the free parameters in `MODEL`."""
        return np.array([MODEL.index(name) for name in self.free], dtype=int)

    def values(self, x_model: Float[Array, " free"]) -> Float[Array, " model"]:
        """Physical values of all model parameters, SI. Differentiable."""
        index = self.indices()
        full = jnp.asarray(self.nominal)
        if len(index):
            full = full.at[index].add(jnp.asarray(self.scale)[index] * x_model)
        if self.gauged:
            # (inertia, magnet, rods) -> c (inertia, magnet, rods) leaves the motion as it is: hold |magnet|.
            modulus = jnp.sqrt(jnp.sum(jnp.asarray(self.nominal)[:3] ** 2))
            full = full.at[:3].multiply(modulus / jnp.sqrt(jnp.sum(full[:3] ** 2)))
        if self.gains_gauged:
            full = full.at[12:18].multiply(jnp.mean(jnp.asarray(self.nominal)[12:18]) / jnp.mean(full[12:18]))
        return full

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest `x` of the solver's unknowns; the state is unbounded."""
        index = self.indices()
        nominal, scale = np.asarray(self.nominal)[index], np.asarray(self.scale)[index]
        free = np.full(len(STATE), np.inf)
        lower, upper = np.asarray(self.lower)[index], np.asarray(self.upper)[index]
        return np.concatenate([-free, (lower - nominal) / scale]), np.concatenate([free, (upper - nominal) / scale])


def parametrization(nominal: Nominal, free: tuple[str, ...], prior: PriorSigma) -> Parametrization:
    """Scales, bounds and gauge for a set of free parameters.

    Raises `InputError` where the magnet's modulus has to hold the gauge and is zero.
    """
    if set(MAGNET + INERTIA) <= set(free) and not np.linalg.norm(nominal.magnet) > 0.0:
        raise InputError("magnet and inertia are both free: a nominal |magnet| above 0 must hold their common scale")
    mean_inertia = float(np.mean(np.asarray(nominal.inertia)[:3]))
    sigma = {
        **dict.fromkeys(MAGNET, prior.magnet),
        **dict.fromkeys(RODS, prior.rods),
        **dict.fromkeys(INERTIA, prior.inertia_relative * mean_inertia),
        "imax": prior.imax_relative * nominal.max_current,
        **dict.fromkeys(GAINS, prior.gains),
        **dict.fromkeys(ALBEDO, prior.albedo),
    }
    lower = dict.fromkeys(RODS + ALBEDO, 0.0) | dict.fromkeys(GAINS, 0.0) | {"imax": 0.05 * nominal.max_current}
    lower |= dict.fromkeys(INERTIA[:3], 0.05 * mean_inertia)
    upper: dict[str, float] = dict.fromkeys(ALBEDO, 1.5)
    return Parametrization(
        nominal=nominal.vector(),
        scale=np.array([sigma[name] for name in MODEL]),
        lower=np.array([lower.get(name, -np.inf) for name in MODEL]),
        upper=np.array([upper.get(name, np.inf) for name in MODEL]),
        reference_field=np.asarray(nominal.reference_field, dtype=float),
        free=free,
    )


def build_model(values: Float[Array, " model"], reference_field: Float[Array, ""]) -> tuple[Spacecraft, Albedo]:
    """The satellite and the Earth's reflectivity from values in the order of `MODEL`, SI."""
    spacecraft = Spacecraft(
        inertia=symmetric_tensor(values[5:11]),
        magnet=values[0:3],
        rods=MagneticRods(values[3:5], jnp.eye(3, dtype=values.dtype)[1:], reference_field),
        panels=SolarPanels(box_normals(), values[11], values[12:18]),
    )
    return spacecraft, Albedo(values[18], values[19])
