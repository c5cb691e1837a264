"""Attitude ephemeris messages of CCSDS (504.0-B), versions 1.0 and 2.0, as KEYWORD = VALUE.

A quaternion of a message describes the turn of frame A into frame B (e sin(phi/2), cos(phi/2)), v_B = M(q) v_A with
M_12 = 2 (q1 q2 + q3 qc): read by Hamilton's product it turns components in B into components in A. With inertial axes
as A and the body as B it is our inertial-from-body quaternion itself. Version 1.0 may state the turn from B to A
(ATTITUDE_DIR), whose quaternion is the conjugate, and the scalar first (QUATERNION_TYPE); version 2.0 has neither.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float

from jaxsat.errors import InputError
from jaxsat.telemetry.ccsds.instants import instants
from jaxsat.telemetry.ccsds.ndm import Block, Segment, check_keywords, numbers, read_message
from jaxsat.telemetry.ccsds.writing import message_text
from jaxsat.time import Epoch

# Numbers behind the instant of each type of attitude that is read.
_COLUMNS = {
    "QUATERNION": 4,
    "QUATERNION/DERIVATIVE": 8,
    "QUATERNION/RATE": 7,
    "QUATERNION/ANGVEL": 7,
}
_TYPES = {
    "1.0": ("QUATERNION", "QUATERNION/DERIVATIVE", "QUATERNION/RATE"),
    "2.0": ("QUATERNION", "QUATERNION/DERIVATIVE", "QUATERNION/ANGVEL"),
}
_KEYWORDS = (
    *("OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME_A", "REF_FRAME_B", "ATTITUDE_DIR", "TIME_SYSTEM"),
    *("START_TIME", "STOP_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME", "ATTITUDE_TYPE", "QUATERNION_TYPE"),
    *("EULER_ROT_SEQ", "RATE_FRAME", "ANGVEL_FRAME", "INTERPOLATION_METHOD", "INTERPOLATION_DEGREE"),
)
_LENGTH_TOLERANCE = 1e-3


@dataclass(frozen=True)
class AttitudeEphemeris:
    """One segment: attitude of frame B against frame A."""

    object_name: str
    object_id: str
    """International designator, as 2000-075C."""
    frame_a: str
    frame_b: str
    epoch: Epoch
    t_s: Float[np.ndarray, "time"]
    """[s] after the epoch, increasing."""
    quaternion_a_from_b: Float[np.ndarray, "time 4"]
    """Scalar first, unit length: turns components in B into components in A."""
    angular_velocity_b: Float[np.ndarray, "time 3"] | None = None
    """Of B against A, components in B [rad/s]."""
    center_name: str = "EARTH"
    metadata: Mapping[str, str] = field(default_factory=dict)
    """All keywords of the segment as they stand in a message that was read."""


def aem_text(
    attitude: AttitudeEphemeris,
    *,
    version: Literal["1.0", "2.0"] = "2.0",
    created: Epoch,
    originator: str = "JAXSAT",
    comments: tuple[str, ...] = (),
    direction: Literal["A2B", "B2A"] = "A2B",
    quaternion_type: Literal["FIRST", "LAST"] = "LAST",
) -> str:
    """Returns a message of one segment.

    Version 2.0 has the angular velocity too, where there is one; 1.0 has the attitude alone, in the `direction` and
    with the scalar where asked. Raises ValueError for a direction or scalar that version 2.0 cannot state.
    """
    old = version == "1.0"
    if not old and (direction, quaternion_type) != ("A2B", "LAST"):
        raise ValueError(f"version 2.0 knows A2B and LAST only, got {direction} and {quaternion_type}")
    q = attitude.quaternion_a_from_b
    q = q if direction == "A2B" else q * np.array([1.0, -1.0, -1.0, -1.0])
    columns = q if quaternion_type == "FIRST" else np.roll(q, -1, axis=1)
    rates = None if old else attitude.angular_velocity_b
    times = attitude.epoch.iso_texts(attitude.t_s, 6)
    meta = {
        "OBJECT_NAME": attitude.object_name,
        "OBJECT_ID": attitude.object_id,
        "CENTER_NAME": attitude.center_name,
        "REF_FRAME_A": attitude.frame_a,
        "REF_FRAME_B": attitude.frame_b,
        **({"ATTITUDE_DIR": direction} if old else {}),
        "TIME_SYSTEM": "UTC",
        "START_TIME": times[0],
        "STOP_TIME": times[-1],
        "ATTITUDE_TYPE": "QUATERNION" if rates is None else "QUATERNION/ANGVEL",
        **({"QUATERNION_TYPE": quaternion_type} if old else {}),
        **({} if rates is None else {"ANGVEL_FRAME": attitude.frame_b}),
    }
    table = columns if rates is None else np.hstack([columns, np.degrees(rates)])
    data = [f"{time} " + " ".join(f"{x: .12f}" for x in row) for time, row in zip(times, table.tolist(), strict=True)]
    head = {"CCSDS_AEM_VERS": version, "CREATION_DATE": created.iso(0), "ORIGINATOR": originator}
    return message_text(head, [(meta, data)], aem=True, comments=comments)


def read_aem(path: str | Path) -> list[AttitudeEphemeris]:
    """Reads the segments of a message of version 1.0 or 2.0 whose attitude is a quaternion.

    Angular velocities are those stated (ANGVEL, deg/s), or follow from the quaternion's derivative; the rates of
    QUATERNION/RATE, about axes that version 1.0 leaves open, are checked and not kept. Raises `InputError` with file,
    line and keyword for anything damaged (see `read_message`), for types of attitude other than quaternions, and for a
    quaternion that is not of unit length within 0.001.
    """
    header, segments = read_message(path, kind="AEM", versions=tuple(_TYPES))
    version = header.values["CCSDS_AEM_VERS"]
    return [_attitude(segment, version) for segment in segments]


def _attitude(segment: Segment, version: str) -> AttitudeEphemeris:
    meta = segment.meta
    check_keywords(segment, _KEYWORDS)
    kind = meta.required("ATTITUDE_TYPE", _TYPES[version])
    if meta.required("REF_FRAME_A") == meta.required("REF_FRAME_B"):
        raise meta.error("REF_FRAME_B", f"{meta.values['REF_FRAME_B']} is REF_FRAME_A too")
    first, backward = _order(meta, version)
    epoch, t = instants(segment)
    table = numbers(segment, _COLUMNS[kind])
    q = table[:, :4] if first else np.roll(table[:, :4], 1, axis=1)
    lengths = np.linalg.norm(q, axis=1)
    if (wrong := np.abs(lengths - 1.0) > _LENGTH_TOLERANCE).any():
        k = int(np.argmax(wrong))
        reason = f"expected a unit quaternion, its length is {lengths[k]:.6g}"
        raise InputError(reason, file=meta.file, row=segment.data[k][0])
    q = q / lengths[:, None]
    conjugate = np.array([1.0, -1.0, -1.0, -1.0])
    rate = None
    if kind == "QUATERNION/DERIVATIVE":
        derivative = table[:, 4:] if first else np.roll(table[:, 4:], 1, axis=1)
        turn = (q * conjugate, derivative * conjugate) if backward else (q, derivative)
        rate = _rate(*turn)
    q = q * conjugate if backward else q
    if kind == "QUATERNION/ANGVEL":
        rate = _stated_rate(meta, q, np.radians(table[:, 4:]))
    return AttitudeEphemeris(
        object_name=meta.required("OBJECT_NAME"),
        object_id=meta.required("OBJECT_ID"),
        frame_a=meta.required("REF_FRAME_A"),
        frame_b=meta.required("REF_FRAME_B"),
        epoch=epoch,
        t_s=t,
        quaternion_a_from_b=q,
        angular_velocity_b=rate,
        center_name=meta.values.get("CENTER_NAME", ""),
        metadata=dict(meta.values),
    )


def _order(meta: Block, version: str) -> tuple[bool, bool]:
    """Whether the scalar is first, and whether the turn is from B to A."""
    if version == "1.0":
        first = meta.required("QUATERNION_TYPE", ("FIRST", "LAST")) == "FIRST"
        return first, meta.required("ATTITUDE_DIR", ("A2B", "B2A")) == "B2A"
    for key in ("QUATERNION_TYPE", "ATTITUDE_DIR"):
        if key in meta.values:
            raise meta.error(key, "is a keyword of version 1.0, in a message of version 2.0")
    return False, False


def _rate(q: np.ndarray, derivative: np.ndarray) -> np.ndarray:
    """Twice the vector part of conjugate(q) dq/dt: angular velocity in B [rad/s]."""
    scalar, vector = q[:, :1], q[:, 1:]
    return 2.0 * (scalar * derivative[:, 1:] - derivative[:, :1] * vector - np.cross(vector, derivative[:, 1:]))


def _stated_rate(meta: Block, q: np.ndarray, rate: np.ndarray) -> np.ndarray:
    key = "ANGVEL_FRAME"
    frame = meta.required(key)
    named = {"REF_FRAME_A": "A", "REF_FRAME_B": "B"}
    for name in ("REF_FRAME_A", "REF_FRAME_B"):
        named[meta.required(name)] = name[-1]
    if frame not in named:
        raise meta.error(key, f"expected that of REF_FRAME_A or REF_FRAME_B, found {frame[:40]!r}")
    if named[frame] == "B":
        return rate
    # Components in A turned into B: conjugate(q) (0, v) q.
    turned = 2.0 * np.cross(-q[:, 1:], rate)
    return rate + q[:, :1] * turned + np.cross(-q[:, 1:], turned)
