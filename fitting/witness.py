"""What the magnetometer of a session of panel currents, which is not fitted, says of the motion."""

import numpy as np

from fitting.measurements.groups import Group
from fitting.outcome.result import FitResult
from fitting.outcome.sensed_result import WILD, Holdout
from fitting.outcome.sensed_verdict import Witness
from jaxsat.telemetry import Session

MAGNETOMETER_SIGMA_UT = 1.0
"""1-sigma of a magnetometer that nobody has calibrated in flight, as Munin's satellite file has it [uT]."""


def magnetometer_witness(result: FitResult, session: Session) -> Witness | None:
    """What the magnetometer of a session, which is not fitted, says of the motion; None where it has no reading."""
    modelled, by_attitude = result.field_body_uT, result.field_body_sigma_uT
    if modelled is None or by_attitude is None:
        return None
    rows = np.searchsorted(session.t_s, result.t_s)
    residual = (session.b_field_uT[rows] - modelled[:, 1:]) / MAGNETOMETER_SIGMA_UT
    promised = np.hypot(1.0, by_attitude[:, 1:] / MAGNETOMETER_SIGMA_UT)
    known = np.isfinite(residual) & np.isfinite(promised)
    asked = known.any(axis=1)
    if not asked.any():
        return None
    residual, promised = np.where(known, residual, 0.0)[asked], np.where(known, promised, 0.0)[asked]
    wild = (residual**2).sum(axis=1) > WILD * Group("mag", 2).limit * promised.max(axis=1) ** 2
    mask = known[asked] & ~wild[:, None]
    held = None
    if mask.any():
        rms, promise = (
            MAGNETOMETER_SIGMA_UT * float(np.sqrt((part[mask] ** 2).mean())) for part in (residual, promised)
        )
        held = Holdout(int(mask.sum()), int(wild.sum()), rms, promise, None)
    return Witness("mag", "uT", int(asked.sum()), held)
