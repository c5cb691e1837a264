"""Whether a satellite can be as a minimum has it."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from fitting.outcome.looking import Look
from fitting.parameters.free import FreeParameters
from fitting.parameters.transforms import thinnest
from jaxsat.satellites.model import INERTIA_PLACE, sensor_of
from jaxsat.sensors import Panels
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import axes_text, body_from_sensor

LARGE_TURN = np.radians(45.0)
"""Of a sensor, beyond which other axes of the body are nearer to its own than those of the satellite file."""


def no_body(parameters: FreeParameters, seen: Look) -> bool:
    """Whether no body has this inertia, as may be where its entries move by themselves."""
    index = [k for k, leaf in enumerate(parameters.leaves) if leaf.place == INERTIA_PLACE]
    return len(index) == 6 and thinnest(seen.values[index]) < -1e-9


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
        told = axes_text(axes @ body_from_sensor(jnp.asarray(turn)).T)
        angle = np.degrees(np.linalg.norm(turn))
        found.append(
            f"the turn of {name} is {angle:.0f} deg: its axes are likely {', '.join(told)} "
            f"(sensors.{name}.axes, or --as axes:{name}:{''.join(told)})"
        )
    return tuple(found)
