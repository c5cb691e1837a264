"""Whether a satellite can be as a minimum has it."""

from fitting.outcome.looking import Look
from fitting.parameters.free import FreeParameters
from fitting.parameters.transforms import thinnest
from jaxsat.satellites.model import INERTIA_PLACE, sensor_of
from jaxsat.sensors import Panels


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
