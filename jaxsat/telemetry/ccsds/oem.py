"""Orbit ephemeris messages of CCSDS (502.0-B), versions 1.0 to 3.0, as KEYWORD = VALUE."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxsat.errors import InputError
from jaxsat.files.text_file import REAL
from jaxsat.telemetry.ccsds.instants import instant, instants
from jaxsat.telemetry.ccsds.ndm import Segment, check_keywords, numbers, read_message
from jaxsat.telemetry.ccsds.writing import message_text
from jaxsat.time import Epoch

VERSIONS = ("1.0", "2.0", "3.0")
_KEYWORDS = (
    *("OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME", "REF_FRAME_EPOCH", "TIME_SYSTEM", "START_TIME"),
    *("STOP_TIME", "USEABLE_START_TIME", "USEABLE_STOP_TIME", "INTERPOLATION", "INTERPOLATION_DEGREE"),
)
_TRIANGLE = 6
"""Rows of a covariance of position and velocity."""


@dataclass(frozen=True)
class OrbitEphemeris:
    """One segment: states of a satellite in one frame."""

    object_name: str
    object_id: str
    """International designator, as 2000-075C."""
    frame: str
    epoch: Epoch
    t_s: Float[np.ndarray, "time"]
    """[s] after the epoch, increasing."""
    position_m: Float[np.ndarray, "time 3"]
    velocity_m_s: Float[np.ndarray, "time 3"]
    frame_epoch: Epoch | None = None
    """Instant of the frame's axes, where its name does not say it."""
    center_name: str = "EARTH"
    metadata: Mapping[str, str] = field(default_factory=dict)
    """All keywords of the segment as they stand in a message that was read."""


def oem_text(
    orbit: OrbitEphemeris, *, created: Epoch, originator: str = "JAXSAT", comments: tuple[str, ...] = ()
) -> str:
    """Returns a message of version 2.0 with one segment; positions to the millimetre."""
    times = orbit.epoch.iso_texts(orbit.t_s, 6)
    meta = {
        "OBJECT_NAME": orbit.object_name,
        "OBJECT_ID": orbit.object_id,
        "CENTER_NAME": orbit.center_name,
        "REF_FRAME": orbit.frame,
        **({} if orbit.frame_epoch is None else {"REF_FRAME_EPOCH": orbit.frame_epoch.iso(6)}),
        "TIME_SYSTEM": "UTC",
        "START_TIME": times[0],
        "STOP_TIME": times[-1],
        # The highest degree that this many states with their velocities determine, up to seven.
        "INTERPOLATION": "HERMITE",
        "INTERPOLATION_DEGREE": str(min(7, 2 * len(times) - 1)),
    }
    table = np.hstack([orbit.position_m, orbit.velocity_m_s]) / 1e3
    data = [
        f"{time} " + " ".join(f"{x:.6f}" for x in row[:3]) + " " + " ".join(f"{x:.9f}" for x in row[3:])
        for time, row in zip(times, table.tolist(), strict=True)
    ]
    head = {"CCSDS_OEM_VERS": "2.0", "CREATION_DATE": created.iso(0), "ORIGINATOR": originator}
    return message_text(head, [(meta, data)], aem=False, comments=comments)


def read_oem(path: str | Path) -> list[OrbitEphemeris]:
    """Reads the segments of a message of version 1.0, 2.0 or 3.0; accelerations and covariances are checked, not kept.

    Raises `InputError` with file, line and keyword for anything damaged, see
    `read_message`.
    """
    _, segments = read_message(path, kind="OEM", versions=VERSIONS)
    return [_orbit(segment) for segment in segments]


def _orbit(segment: Segment) -> OrbitEphemeris:
    meta = segment.meta
    check_keywords(segment, _KEYWORDS)
    epoch, t = instants(segment)
    for begin, lines in segment.covariances:
        _check_covariances(segment, begin, lines)
    table = 1e3 * numbers(segment, 6, optional=3)
    frame_epoch = meta.values.get("REF_FRAME_EPOCH")
    try:
        instant = None if frame_epoch is None else Epoch.from_iso(frame_epoch)
    except ValueError as error:
        raise meta.error("REF_FRAME_EPOCH", str(error)) from None
    return OrbitEphemeris(
        object_name=meta.required("OBJECT_NAME"),
        object_id=meta.required("OBJECT_ID"),
        frame=meta.required("REF_FRAME"),
        epoch=epoch,
        t_s=t,
        position_m=table[:, :3],
        velocity_m_s=table[:, 3:6],
        frame_epoch=instant,
        center_name=meta.required("CENTER_NAME"),
        metadata=dict(meta.values),
    )


def _check_covariances(segment: Segment, begin: int, lines: Sequence[tuple[int, str]]) -> None:
    """Raises `InputError` unless a block holds matrices: EPOCH, perhaps COV_REF_FRAME, the six rows of a triangle."""
    meta = segment.meta
    rows = _TRIANGLE
    for row, line in lines:
        key, equals, value = (part.strip() for part in line.partition("="))
        if key == "EPOCH" and equals and rows == _TRIANGLE:
            instant(value, meta.required("TIME_SYSTEM"), meta.file, row, "EPOCH of a covariance")
            rows = 0
        elif not (key == "COV_REF_FRAME" and equals and value and rows == 0):
            tokens = line.split()
            numbers = [float(token) for token in tokens if REAL.fullmatch(token)]
            if rows == _TRIANGLE or len(numbers) != len(tokens) or len(numbers) != rows + 1:
                wanted = "EPOCH = ..." if rows == _TRIANGLE else f"{rows + 1} numbers"
                reason = f"expected {wanted}, found {line[:40]!r}"
                raise InputError(reason, file=meta.file, row=row, field=f"covariance of line {begin}")
            rows += 1
    if rows != _TRIANGLE or not lines:
        reason = f"ends after {rows % _TRIANGLE} rows of a matrix, expected {_TRIANGLE}"
        raise InputError(reason, file=meta.file, row=begin, field="COVARIANCE_START")
