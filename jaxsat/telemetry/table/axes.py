"""Positions and quaternions of a table in the inertial axes of the house, true equator and equinox of date."""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.frames import dcms_eci_from_gcrf
from jaxsat.time import Epoch, greenwich_angles


def positions_of_date(
    epoch: Epoch, t_s: Float[np.ndarray, "n"], positions: Float[np.ndarray, "n 3"], frame: str
) -> Float[np.ndarray, "n 3"]:
    """Positions of date from `eci` (the same), `gcrf` or `ecef` ones."""
    if frame == "gcrf":
        return np.einsum("nij,nj->ni", dcms_eci_from_gcrf(epoch, t_s), positions)
    if frame == "ecef":
        return about_pole(positions, greenwich_angles(epoch, t_s))
    return positions


def from_earth_fixed(
    epoch: Epoch, t_s: Float[np.ndarray, "n"], position: Float[np.ndarray, "n 3"], velocity: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """States of date from those of axes that turn with the Earth; polar motion, 10 m on the ground, is left out."""
    angle = greenwich_angles(epoch, t_s)
    carried = EARTH_ROTATION_RATE * np.stack([-position[:, 1], position[:, 0], np.zeros(len(position))], axis=1)
    return about_pole(position, angle), about_pole(velocity + carried, angle)


def about_pole(vectors: Float[np.ndarray, "n 3"], angle: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
    """Vectors turned about z by angles [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=1)


def quaternions_of_date(
    epoch: Epoch,
    t_s: Float[np.ndarray, "n"],
    quaternions: Float[np.ndarray, "n 4"],
    *,
    scalar: str,
    sense: str,
    frame: str,
) -> Float[np.ndarray, "n 4"]:
    """Unit quaternions, inertial from body, scalar first, without leaps of sign, from those of a table.

    `scalar` is `first` or `last`, `sense` `inertial_from_body` or `body_from_inertial`, `frame` `eci` or `gcrf`.
    """
    last = quaternions if scalar == "last" else np.roll(quaternions, -1, axis=1)
    turn = Rotation.from_quat(last)
    if sense == "body_from_inertial":
        turn = turn.inv()
    if frame == "gcrf":
        turn = Rotation.from_matrix(dcms_eci_from_gcrf(epoch, t_s)) * turn
    return without_leaps(np.roll(turn.as_quat(), 1, axis=1))


def without_leaps(quaternions: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n 4"]:
    """The same attitudes by quaternions each of which is nearer to the one before than its opposite is."""
    leaps = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0.0
    return quaternions * np.cumprod(np.concatenate([[1.0], np.where(leaps, -1.0, 1.0)]))[:, None]
