"""Changes of a satellite and its sensors that no reading tells: what a direction without information may be called."""

from collections.abc import Iterator
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from fitting.parameters.free import MODULUS, FreeParameters
from fitting.parameters.transforms import ENTRIES, polar_from_dipole, tensor_of
from jaxsat.satellites.model import INERTIA_PLACE, MAGNET_PLACE, POLAR_PLACE, Model

PRIORS = "the priors"
"""What holds a change where no gauge does."""
SIZES = (MAGNET_PLACE, "spacecraft.rods.moments", "spacecraft.hysteresis_rods.volumes", "spacecraft.parts.")
"""Where numbers stand to which a torque, or a wheel's momentum, is in proportion."""
LOOP_FIELDS = ("remanence", "saturation", "induction")
"""Flux densities of hysteresis rods, which scale their torque together where the volumes are known."""


@dataclass(frozen=True)
class Change:
    """One change to first order."""

    name: str
    held_by: str
    """What fixes it where the data do not."""
    values: np.ndarray
    """[leaves] of each, SI, free or not."""


def invisible_changes(parameters: FreeParameters, values: np.ndarray, model: Model) -> list[Change]:
    """What may be invisible with these free parameters about these `values` [leaves, SI]."""
    free = _free(parameters)
    scale = _common_scale(parameters, values, model, free)
    return [*([] if scale is None else [scale]), *_light_scales(parameters, values, free), *_turns(parameters, values)]


def relative_to(parameters: FreeParameters, values: np.ndarray) -> dict[str, str]:
    """The free leaves whose common size a gauge holds, and what they are told in proportion to.

    Their sigmas are those of the ratios: how well the held size is known is not in them.
    """
    free, names = _free(parameters), [leaf.name for leaf in parameters.leaves]
    places = np.array([leaf.place for leaf in parameters.leaves])
    found = {}
    for gauge in parameters.tree.gauges:
        if gauge.name not in parameters.gauged:
            continue
        if gauge.name == "magnet":
            own, held = (places == INERTIA_PLACE) | _sizes(places, values, free), "|magnet|"
        else:
            own, held = np.isin(np.arange(len(names)), [*gauge.leaves, *gauge.beside]), "mean gain"
        found |= {names[k]: f"given {held}" for k in np.flatnonzero(own & free)}
    return found


def _free(parameters: FreeParameters) -> np.ndarray:
    """[leaves] bool: what may move; a free modulus scales all of the vector."""
    leaves = parameters.leaves
    free = np.isin(np.arange(len(leaves)), parameters.columns)
    if any(leaves[k].spot == MODULUS for k in np.flatnonzero(free)):
        free |= np.array([leaf.place == MAGNET_PLACE for leaf in leaves])
    return free


def _common_scale(parameters: FreeParameters, values: np.ndarray, model: Model, free: np.ndarray) -> Change | None:
    """Of inertia and all torques beside the gravity gradient, which is in proportion to the inertia.

    A torque of known size tells it, but for one so weak that a gauge was declared all the same.
    """
    places = np.array([leaf.place for leaf in parameters.leaves])
    inertia, sizes = places == INERTIA_PLACE, _sizes(places, values, free)
    if not (free & inertia).any():
        return None
    gauged = "magnet" in parameters.gauged
    known = ~free & (values != 0.0) & (inertia | sizes)
    if not gauged and (known.any() or model.spacecraft.facets is not None):
        return None
    kinds = dict.fromkeys(parameters.leaves[k].name.split(".")[0] for k in np.flatnonzero(free & sizes))
    name = " and ".join(", ".join(["inertia", *kinds]).rsplit(", ", 1))
    length = np.array([leaf.spot == MODULUS for leaf in parameters.leaves])
    # Under the gauge the magnet alone is rescaled, so that its length is what does not count.
    part = places == MAGNET_PLACE if gauged else inertia | sizes
    modulus = float(np.linalg.norm(values[places == MAGNET_PLACE]))
    held = f"|magnet| = {modulus:.6g} A m²" if gauged else PRIORS
    return Change(f"common scale of {name}", held, np.where(part | length, values, 0.0))


def _sizes(places: np.ndarray, values: np.ndarray, free: np.ndarray) -> np.ndarray:
    """[leaves] bool: the numbers of `SIZES`; of hysteresis rods the flux where it is free and the volumes are not."""
    found = np.array([place.startswith(SIZES) for place in places])
    volumes = places == "spacecraft.hysteresis_rods.volumes"
    flux = np.isin(places, [f"spacecraft.hysteresis_rods.{field}" for field in LOOP_FIELDS])
    if volumes.any() and not (free & volumes).any() and not np.any(flux & ~free & (values != 0.0)):
        return (found & ~volumes) | flux
    return found


def _light_scales(parameters: FreeParameters, values: np.ndarray, free: np.ndarray) -> Iterator[Change]:
    """Of the gains of a sensor and its largest current."""
    places = np.array([leaf.place for leaf in parameters.leaves])
    sensors = [place.split(".")[1] for place in places if place.endswith(".max_current")]
    for sensor in sensors:
        largest, gains = places == f"sensors.{sensor}.max_current", places == f"sensors.{sensor}.gain"
        if not gains.any() or np.any((largest | gains) & ~free & (values != 0.0)):
            continue
        gauged = f"{sensor}.gain" in parameters.gauged
        change = np.where(gains, -values, 0.0) if gauged else np.where(gains, -values, np.where(largest, values, 0.0))
        whose = f" of {sensor}" if len(sensors) > 1 else ""
        held = f"the mean gain{whose} = {values[gains].mean():.6g}" if gauged else PRIORS
        yield Change(f"common scale of gains and imax{whose}", held, change)


def _turns(parameters: FreeParameters, values: np.ndarray) -> Iterator[Change]:
    """Of a satellite whose every vector and tensor turn about a body axis, a radian, and of sensors that turn with it.

    The attitude turns back, so that panels, dipole and inertia stay where they are in space. Axes of rods and of coils
    are no leaves and stay behind.
    """
    leaves, columns = parameters.leaves, parameters.columns
    if not any(leaves[k].place.endswith(".tilts") for k in columns if k >= 0):
        return
    places = np.array([leaf.place for leaf in leaves])
    sensed = [k for k, leaf in enumerate(leaves) if leaf.place.endswith((".tilts", ".turn"))]
    for axis, unit in zip("xyz", np.eye(3), strict=True):
        change = np.zeros(len(leaves))
        for place in dict.fromkeys(places):
            own = np.flatnonzero(places == place)
            if place == MAGNET_PLACE or (place.startswith("spacecraft.parts.") and place.endswith(".torque")):
                change[own] = np.cross(unit, values[own])
            elif place == POLAR_PLACE:
                dipole = values[places == MAGNET_PLACE]
                turning = jnp.asarray(np.cross(unit, dipole))
                change[own] = np.asarray(jax.jvp(polar_from_dipole, (jnp.asarray(dipole),), (turning,))[1])
            elif place == INERTIA_PLACE and len(own) == len(ENTRIES[0]):
                tensor, matrix = tensor_of(values[own]), np.cross(np.eye(3), unit)
                change[own] = (matrix @ tensor - tensor @ matrix)[ENTRIES]
        change[[k for k in sensed if leaves[k].name.endswith(f".{axis}")]] = 1.0
        yield Change(f"common turn of the panels about {axis}", PRIORS, change)
