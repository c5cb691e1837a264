"""The limb angles of a fit: their file, read and matched to the session."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jaxsat.telemetry.limb_angles import MatchedLimbAngles, match_limb_angles, read_limb_angles

if TYPE_CHECKING:
    from fitting.settings import FitSettings
    from jaxsat.telemetry import Session


@dataclass(frozen=True)
class LimbInput:
    """What a file of limb angles gives to a fit."""

    matched: MatchedLimbAngles | None = None
    """None where no limb angles are fitted."""
    remarks: Sequence[str] = ()
    """What of the file is not used, and why."""

    @staticmethod
    def read(path: Path | None, session: "Session", settings: "FitSettings") -> "LimbInput":
        """Reads the file, if there is one, and matches it to the session; raises `InputError`.

        Under a weight of zero the file is not looked at, as that of `vesABlimb` = 0 may be missing or a dummy.
        """
        if path is None:
            return LimbInput()
        if settings.limb_weight == 0.0:
            return LimbInput(remarks=(f"{path}: limb angles are not used, for fit.limb_weight is 0",))
        matched = match_limb_angles(read_limb_angles(path), session)
        return LimbInput(matched, matched.remarks())

    @property
    def angles(self) -> np.ndarray | None:
        """[time 2] as `Observations.limb` of the whole session."""
        return None if self.matched is None else self.matched.angles
