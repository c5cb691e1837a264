"""The file curves.json of a fit (schema `jaxsat.curves/1`): what lines are drawn through, between the samples."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fitting.outcome.result import Between
from jaxsat.files.json_files import plain

SCHEMA = "jaxsat.curves/1"


def curves_document(between: Between) -> dict[str, Any]:
    """Returns the content of curves.json: readings in the units of their channels, null where not finite."""
    return plain({"schema": SCHEMA, **vars(between)})[0]


def stored_between(content: Mapping[str, Any], channels: Mapping[str, int]) -> Between:
    """Reads it back; `channels` are those of the fit with their numbers of columns.

    Raises KeyError or ValueError where it is not as written.
    """
    count = len(content["t_s"])
    shapes = {"quaternion_inertial_from_body": 4, "angular_velocity_rad_s": 3}
    motion = {name: _rows(content[name], count, width) for name, width in shapes.items()}
    readings = {
        kind: {name: _rows(rows, count, channels[name]) for name, rows in content[kind].items()}
        for kind in ("readings", "direct")
    }
    if set(readings["readings"]) != set(channels) or np.any(np.diff(content["t_s"]) < 0.0):
        raise ValueError("curves.json is not that of this fit")
    return Between(t_s=np.array(content["t_s"]), **motion, readings=readings["readings"], direct=readings["direct"])


def _rows(rows: list, count: int, width: int) -> np.ndarray:
    return np.array(rows, dtype=float).reshape(count, width)
