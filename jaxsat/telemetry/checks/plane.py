"""Check of positions: an orbit lies in a plane, and leaves it where its axes turn with the Earth."""

import numpy as np
from jaxtyping import Float

from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.table.axes import from_earth_fixed
from jaxsat.telemetry.table.session import TableSession

_FEW = 5
_OFF_DEG = 1.0
"""RMS angle out of the best plane; of an orbit it is less than a tenth of that in a day."""


def check_plane(session: TableSession) -> list[Finding]:
    """Positions of the table that lie in no plane, and whether they do once the Earth's turn is put in."""
    if session.positions is None or len(session.positions[0]) < _FEW:
        return []
    t, position = session.positions
    off = _out_of_plane(position)
    if off < _OFF_DEG:
        return []
    turned, _ = from_earth_fixed(session.epoch, t, position, np.zeros_like(position))
    other = _out_of_plane(turned)
    text = f"positions are {off:.1f} deg (RMS) out of a plane, as no orbit is"
    if other < 0.3 * off:
        text += f', and {other:.1f} deg if their axes turn with the Earth: --as frame:ecef, or frame = "ecef"'
    return [finding("orbit", text, odd=True, numbers={"out_of_plane_deg": off, "as_ecef_deg": other})]


def _out_of_plane(position: Float[np.ndarray, "n 3"]) -> float:
    """RMS angle of directions to the plane through the centre that fits them best [deg]."""
    unit = position / np.linalg.norm(position, axis=1, keepdims=True)
    least = float(np.linalg.svd(unit, compute_uv=False)[-1])
    return float(np.degrees(least / np.sqrt(len(unit))))
