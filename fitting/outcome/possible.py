"""Whether a satellite can be as a minimum has it."""

from collections.abc import Mapping
from itertools import permutations

import jax.numpy as jnp
import numpy as np

from fitting.outcome.looking import Look
from fitting.parameters.free import FreeParameters
from fitting.parameters.transforms import ENTRIES, tensor_of, thinnest
from jaxsat.satellites.model import INERTIA_PLACE, sensor_of
from jaxsat.sensors import Panels
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import axes_text, body_from_sensor

LARGE_TURN = np.radians(45.0)
"""Of a sensor, beyond which other axes of the body are nearer to its own than those of the satellite file."""

OTHER_BODY, AS_TOLD = 40.0, 15.0
"""Sums of squares of what moments of inertia are off their priors [sigma]: what no chance makes, and what one may."""


def no_body(parameters: FreeParameters, seen: Look) -> bool:
    """Whether no body has this inertia, as may be where its entries move by themselves."""
    index = [k for k, leaf in enumerate(parameters.leaves) if leaf.place == INERTIA_PLACE]
    return len(index) == 6 and thinnest(seen.values[index]) < -1e-9


def renamed_axes(parameters: FreeParameters, seen: Look) -> str:
    """Axes of the satellite file that stand as x, y, z of the inertia that was found; empty: as they are.

    All sensors turned alike, as where columns are in another order than the file's axes, are fitted by a motion that
    is turned likewise, and the inertia and its prior alone tell of it. The common scale, which motion may not tell, is
    left open.
    """
    index = [k for k, leaf in enumerate(parameters.leaves) if leaf.place == INERTIA_PLACE]
    sigma = np.array([parameters.leaves[k].sigma or np.inf for k in index])
    if len(index) != 6 or not np.isfinite(sigma).all():
        return ""
    told, found = np.asarray(parameters.tree.nominal)[index], seen.values[index]
    order, off = other_names(told, found, sigma)
    return "" if off is None else ", ".join(order)


def other_names(told: np.ndarray, found: np.ndarray, sigma: np.ndarray) -> tuple[str, float | None]:
    """The axes of `told` that are x, y, z of `found`, and what is off then; None: no other order explains it.

    All are entries xx yy zz xy xz yz [6] of a tensor.
    """

    def off(order: tuple[int, ...]) -> float:
        # Signs of axes change products of inertia alone, which are small and of either sign.
        as_told = tensor_of(found)[np.ix_(order, order)][ENTRIES][:3] / sigma[:3]
        nominal = told[:3] / sigma[:3]
        scale = float(as_told @ nominal / (as_told @ as_told))
        return float(((scale * as_told - nominal) ** 2).sum())

    orders = sorted(permutations(range(3)), key=off)
    best, same = off(orders[0]), off((0, 1, 2))
    if same < OTHER_BODY or best > min(AS_TOLD, 0.2 * same):
        return "xyz", None
    # Row k of `found` in this order is the file's axis k: inverted, the file's axis that each of `found` is.
    return "".join("xyz"[k] for k in np.argsort(orders[0])), best


def without_light(parameters: FreeParameters, seen: Look) -> frozenset[str]:
    """Names of gains of panels that stand at zero, as of a panel that never sees light."""
    return frozenset(
        leaf.name
        for leaf, value in zip(parameters.leaves, seen.values, strict=True)
        if value <= 0.0 and leaf.place.endswith(".gain") and isinstance(sensor_of(leaf, seen.model), Panels)
    )


def wrong_axes(sensors: Mapping[str, AbstractSensor]) -> tuple[str, ...]:
    """Remarks on sensors that were found turned so far that the satellite file must have their axes wrong."""
    found = []
    for name, sensor in sensors.items():
        turn, axes = (np.asarray(getattr(sensor, each, np.zeros(0)), float) for each in ("turn", "axes"))
        if turn.shape != (3,) or axes.ndim != 2 or np.linalg.norm(turn) < LARGE_TURN:
            continue
        # Column k reads along row k of the axes, of a vector in the sensor's own.
        told = axes_text(_nearest_axes(axes @ body_from_sensor(jnp.asarray(turn)).T))
        angle = np.degrees(np.linalg.norm(turn))
        found.append(
            f"the turn of {name} is {angle:.0f} deg: its axes are likely {', '.join(told)} "
            f"(sensors.{name}.axes, or --as axes:{name}:{''.join(told)})"
        )
    return tuple(found)


def _nearest_axes(rows: np.ndarray) -> np.ndarray:
    """The signed permutation nearest to a rotation: each axis once, where rows by themselves may agree."""
    taken = max(permutations(range(3)), key=lambda order: np.abs(rows[range(3), order]).sum())
    found = np.zeros((3, 3))
    found[range(3), taken] = np.where(rows[range(3), taken] < 0.0, -1.0, 1.0)
    return found
