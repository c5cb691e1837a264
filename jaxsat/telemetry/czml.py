"""CZML documents of an orbit and an attitude, for globes such as Cesium (CZML Guide, czml-writer).

Positions are in the inertial frame of CZML, the axes of the ICRF. An orientation is always the turn from body axes to
Earth-fixed ones, its quaternion [x, y, z, w]; players join its samples by the shortest turn, so there must be enough.
"""

from typing import Any

import erfa
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from jaxsat.environment import sidereal_time
from jaxsat.frames import dcms_eci_from_gcrf
from jaxsat.math.attitude_between import attitude_between
from jaxsat.time import Epoch

LARGEST_TURN = np.radians(15.0)
"""Between two samples of an orientation [rad]."""


def czml_document(
    name: str,
    epoch: Epoch,
    t_s: Float[np.ndarray, "time"],
    *,
    position_eci_m: Float[np.ndarray, "time 3"],
    velocity_eci_m_s: Float[np.ndarray, "time 3"],
    q_inertial_from_body: Float[np.ndarray, "time 4"],
    angular_velocity: Float[np.ndarray, "time 3"],
) -> list[dict[str, Any]]:
    """Returns the packets of a document with one satellite: position, path and orientation, of at least two samples.

    Inertial axes are the true equator and equinox of date, quaternions scalar first, `angular_velocity` in body axes
    [rad/s]; between samples the attitude is joined smoothly, until it turns by `LARGEST_TURN` at most.
    """
    first, last = (f"{text}Z" for text in epoch.iso_texts(t_s[[0, -1]], 3))
    to_icrf = np.swapaxes(dcms_eci_from_gcrf(epoch, t_s), 1, 2)
    position, velocity = (np.einsum("nij,nj->ni", to_icrf, x) for x in (position_eci_m, velocity_eci_m_s))
    t_fine, q_fine = attitude_between(t_s, q_inertial_from_body, angular_velocity, largest_turn=LARGEST_TURN)
    orientation = fixed_from_body(epoch, t_fine, q_fine)
    samples = np.column_stack([t_s, position, velocity])
    return [
        {
            "id": "document",
            "name": name,
            "version": "1.0",
            "clock": {"interval": f"{first}/{last}", "currentTime": first, "multiplier": 30, "range": "LOOP_STOP"},
        },
        {
            "id": "satellite",
            "name": name,
            "availability": f"{first}/{last}",
            "position": {
                "epoch": first,
                "referenceFrame": "INERTIAL",
                "interpolationAlgorithm": "HERMITE",
                "interpolationDegree": min(7, 2 * len(t_s) - 1),
                "cartesianVelocity": _rounded(samples, (3, 3, 3, 3, 6, 6, 6)),
            },
            "orientation": {
                "epoch": first,
                "interpolationAlgorithm": "LINEAR",
                "interpolationDegree": 1,
                "unitQuaternion": _rounded(np.column_stack([t_fine, orientation]), (3, 12, 12, 12, 12)),
            },
            "point": {"pixelSize": 6, "color": {"rgba": [255, 220, 120, 255]}},
            "label": {"text": name, "font": "12pt sans-serif", "pixelOffset": {"cartesian2": [10.0, -10.0]}},
            "path": {
                "resolution": 60,
                "width": 1.5,
                "material": {"solidColor": {"color": {"rgba": [90, 160, 255, 200]}}},
            },
        },
    ]


def fixed_from_body(
    epoch: Epoch, t_s: Float[np.ndarray, "time"], q_inertial_from_body: Float[np.ndarray, "time 4"]
) -> Float[np.ndarray, "time 4"]:
    """Returns the quaternion [x, y, z, w] that turns body components into Earth-fixed ones; no sign leaps."""
    angle = sidereal_time(epoch, t_s, dcms_eci_from_gcrf(epoch, t_s))
    turn = Rotation.from_euler("z", -angle[:, None])
    q = (turn * Rotation.from_quat(np.roll(q_inertial_from_body, -1, axis=1))).as_quat()
    leaps = np.sum(q[1:] * q[:-1], axis=1) < 0.0
    return q * np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))[:, None]


def icrf_quaternion(
    epoch: Epoch, t_s: Float[np.ndarray, "time"], q_inertial_from_body: Float[np.ndarray, "time 4"], *, eme2000: bool
) -> Float[np.ndarray, "time 4"]:
    """Returns the quaternion, scalar first, from body axes to those of the GCRF or of the mean equator of J2000."""
    turn = Rotation.from_matrix(to_celestial(epoch, t_s, eme2000=eme2000))
    q = (turn * Rotation.from_quat(np.roll(q_inertial_from_body, -1, axis=1))).as_quat()
    return np.roll(q, 1, axis=1)


def to_celestial(epoch: Epoch, t_s: Float[np.ndarray, "time"], *, eme2000: bool) -> Float[np.ndarray, "time 3 3"]:
    """Returns the turns from the true equator and equinox of date to the GCRF, or to EME2000 (frame bias, 0.02")."""
    matrices = np.swapaxes(dcms_eci_from_gcrf(epoch, t_s), 1, 2)
    bias = np.eye(3)
    if eme2000:
        bias, _, _ = erfa.bp06(2451545.0, 0.0)
    return bias @ matrices


def _rounded(table: np.ndarray, decimals: tuple[int, ...]) -> list[float]:
    columns = [np.round(column, digits) for column, digits in zip(table.T, decimals, strict=True)]
    return np.column_stack(columns).ravel().tolist()
