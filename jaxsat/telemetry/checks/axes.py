"""Checks of axes and signs: which of the 48 ways of reading a sensor agrees with another one, before any fit."""

import numpy as np
from jaxtyping import Float

from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors import Panels, Photodiodes
from jaxsat.sensors.abstract import AbstractSensor
from jaxsat.sensors.mounting import axes_text, signed_permutations
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.table.as_if import swaps_text
from jaxsat.telemetry.table.session import TableSession

_CLEAR, _DISTINCT = 0.4, 0.7
"""How far the best way of reading is off over that of the file, and over the next best, at most, to be told."""
Matrix = Float[np.ndarray, "3 3"]


def check_handedness(satellite: Satellite, session: TableSession) -> list[Finding]:
    """Axes of the satellite file that are a left-handed set."""
    found = []
    for name in session.channels:
        axes = _square_axes(satellite.model.sensors[name])
        if axes is not None and name not in satellite.conventions and np.linalg.det(axes) < 0.0:
            text = "its axes in the satellite file are a left-handed set: a sign, or two columns in the wrong order"
            found.append(finding(name, text, odd=True))
    return found


def other_readings(
    satellite: Satellite,
    session: TableSession,
    names: tuple[str, str],
    seen: tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]],
    expected: Float[np.ndarray, "n"],
) -> str:
    """What would make the angles between two sights those `expected` [rad], as options of a fit; empty if nothing."""
    # Of them the first is the file's own.
    ways = signed_permutations(mirrored=True)
    cosines = [np.einsum("ni,ni->n", seen[0] @ matrix.T, seen[1]) for matrix in ways]
    off = [float(np.degrees(np.median(np.abs(np.arccos(np.clip(c, -1.0, 1.0)) - expected)))) for c in cosines]
    best, second = np.argsort(off)[:2]
    if best == 0 or off[best] > min(_CLEAR * off[0], _DISTINCT * off[second]):
        return ""
    matrix = ways[best]
    options = [
        text
        for name, turn in zip(names, (matrix, matrix.T), strict=True)
        for text in [reading_text(satellite.model.sensors[name], session, name, turn)]
        if text
    ]
    return f"{off[best]:.1f} deg with {' or '.join(options)}" if options else ""


def reading_text(sensor: AbstractSensor, session: TableSession, name: str, turn: Matrix) -> str:
    """The option by which what a sensor sees is turned by a matrix of signed axes; empty where there is none."""
    axes = _square_axes(sensor)
    if axes is not None:
        return f"--as axes:{name}:{''.join(axes_text(axes @ turn.T))}"
    if not isinstance(sensor, Panels | Photodiodes):
        return ""
    normals = np.asarray(sensor.normals, float)
    # Face j is read by the column whose own normal is carried to it.
    order = np.argmax(normals @ (normals @ turn.T).T, axis=1)
    if len(set(order.tolist())) < len(normals) or not np.allclose((normals @ turn.T)[order], normals, atol=1e-6):
        return ""
    return " ".join(f"--as {text}" for text in swaps_text(session.channels[name].columns, order.tolist()))


def _square_axes(sensor: AbstractSensor) -> Matrix | None:
    """Of a sensor of three columns along signed body axes."""
    axes = np.asarray(getattr(sensor, "axes", np.zeros((0, 3))), float)
    return axes if axes.shape == (3, 3) and np.allclose(np.sort(np.abs(axes), axis=1), [0.0, 0.0, 1.0]) else None
