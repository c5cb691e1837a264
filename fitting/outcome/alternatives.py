"""Other minima of a fit beside the best one: how much worse, how far away."""

from typing import Any

import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.solvers.refine import Refined
from jaxsat.math.on_host import angle_between_attitudes

DIFFERENT_ATTITUDE_DEG = 3.0
"""Median distance between two motions that counts as another answer."""


def other_minimum(refined: Refined, number: int, quaternion: np.ndarray, score: float) -> tuple[float, dict[str, Any]]:
    """Distance [deg] of minimum `number` from the best one, whose attitudes at the first samples [n 4] and score are
    given, and what is told of it."""
    q = np.asarray(refined.points.prediction.quaternion)[number, : len(quaternion)]
    distance = float(np.degrees(np.median(angle_between_attitudes(quaternion, q))))
    rate = np.degrees(np.asarray(refined.points.x)[number, 3:6] * RATE_UNIT)
    return distance, {
        "chi2_above_best": round(float(2.0 * (refined.score[number] - score)), 3),
        "attitude_distance_deg": round(distance, 2),
        "rate_deg_s": [round(float(w), 5) for w in rate],
    }
