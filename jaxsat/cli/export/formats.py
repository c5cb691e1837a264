"""What `jaxsat export` reads of a fit, and the content of each format."""

import io
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fitting.report.schema.fit_file import Exported
from fitting.report.schema.reading import FIT, read_stored
from jaxsat.errors import InputError
from jaxsat.telemetry.ccsds.aem import AttitudeEphemeris, aem_text
from jaxsat.telemetry.ccsds.oem import OrbitEphemeris, oem_text
from jaxsat.telemetry.czml import czml_document, icrf_quaternion, to_celestial
from jaxsat.time import Epoch

_FRAME_NAMES = {"tod": "TOD", "eme2000": "EME2000", "gcrf": "GCRF"}
FITTED_ORBIT = "Kepler orbit fitted to the positions of a telemetry session."
GIVEN_ORBIT = "Orbit that the fit of the attitude was given."
BODY_FRAME = "SC_BODY_1"
"""How messages call the satellite's own axes."""


@dataclass(frozen=True)
class ExportedRun:
    """Attitude and orbit of a fit; inertial axes are the true equator and equinox of date."""

    status: str
    epoch: Epoch
    t_s: np.ndarray
    """[time]"""
    quaternion: np.ndarray
    """[time 4] inertial-from-body, scalar first."""
    angular_velocity: np.ndarray
    """[time 3] body axes [rad/s]."""
    field_angle_deg: np.ndarray
    """[time] between body x and the magnetic field; NaN where it is not known."""
    position: np.ndarray | None
    """[time 3] [m]; None where the fit does not say."""
    velocity: np.ndarray | None
    object_name: str
    object_id: str
    source: str
    """What the attitude was fitted to."""
    orbit_source: str

    @staticmethod
    def read(path: Path, *, object_name: str | None = None, object_id: str | None = None) -> "ExportedRun":
        """Reads fit.json; raises `InputError` where it is none, or its numbers are not those of an attitude."""
        document = read_stored(path, FIT, Exported)
        try:
            epoch = Epoch.from_iso(document["epoch_utc"])
            attitude, orbit = document["attitude"], document.get("orbit") or {}
            t = _array(attitude["t_s"], (-1,))
            n = len(t)
            q = _array(attitude["quaternion_inertial_from_body"], (n, 4))
            found = ExportedRun(
                status=document["status"],
                epoch=epoch,
                t_s=t,
                quaternion=q,
                angular_velocity=_array(attitude["angular_velocity_rad_s"], (n, 3)),
                field_angle_deg=_array(attitude["field_angle_deg"] or [None] * n, (n,), gaps=True),
                position=_array(orbit["position_eci_m"], (n, 3)) if orbit else None,
                velocity=_array(orbit["velocity_eci_m_s"], (n, 3)) if orbit else None,
                object_name=object_name or orbit.get("object_name") or "SATELLITE",
                object_id=object_id or orbit.get("object_id") or "UNKNOWN",
                source=_source(document),
                orbit_source=FITTED_ORBIT if "elements" in orbit else GIVEN_ORBIT,
            )
        except (TypeError, ValueError) as error:
            raise InputError(f"is damaged: {error}", file=path) from None
        if n < 2 or not (np.diff(t) > 0.0).all():
            raise InputError("expected two samples or more, in order of time", file=path, field="attitude.t_s")
        if np.abs(np.linalg.norm(q, axis=1) - 1.0).max() > 1e-6:
            raise InputError("expected unit quaternions", file=path, field="attitude.quaternion_inertial_from_body")
        return found

    def states(self) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and velocity [m/s]; ValueError where the fit has none."""
        if self.position is None or self.velocity is None:
            raise ValueError("the fit holds no orbit: it was not kept, or an earlier version made it; fit again")
        return self.position, self.velocity


def file_bytes(run: ExportedRun, kind: str, frame: str) -> bytes:
    """Content of one of the formats; raises ValueError where the run lacks what it needs."""
    if kind == "czml":
        document = czml_document(
            run.object_name,
            run.epoch,
            run.t_s,
            position_eci_m=run.states()[0],
            velocity_eci_m_s=run.states()[1],
            q_inertial_from_body=run.quaternion,
            angular_velocity=run.angular_velocity,
        )
        return (json.dumps(document, allow_nan=False, separators=(",", ":")) + "\n").encode()
    if kind in ("csv", "parquet"):
        return _table(run, frame, parquet=kind == "parquet")
    if kind == "oem":
        return _oem(run, frame).encode()
    return _aem(run, frame, old=kind == "aem1").encode()


def _aem(run: ExportedRun, frame: str, *, old: bool) -> str:
    attitude = AttitudeEphemeris(
        object_name=run.object_name,
        object_id=run.object_id,
        # The registry of version 2.0 says whose equator it is.
        frame_a="TOD_EARTH" if frame == "tod" and not old else _FRAME_NAMES[frame],
        frame_b=BODY_FRAME,
        epoch=run.epoch,
        t_s=run.t_s,
        quaternion_a_from_b=_quaternion(run, frame),
        angular_velocity_b=run.angular_velocity,
    )
    comments = (f"Attitude fitted to {run.source}.", f"Status of the fit: {run.status}.")
    return aem_text(attitude, version="1.0" if old else "2.0", created=_now(), comments=comments)


def _oem(run: ExportedRun, frame: str) -> str:
    position, velocity = _states(run, frame)
    orbit = OrbitEphemeris(
        object_name=run.object_name,
        object_id=run.object_id,
        frame=_FRAME_NAMES[frame],
        epoch=run.epoch,
        t_s=run.t_s,
        position_m=position,
        velocity_m_s=velocity,
    )
    return oem_text(orbit, created=_now(), comments=(run.orbit_source,))


def _source(document: dict[str, Any]) -> str:
    # A line of a message has at most 254 characters.
    return f"readings of {', '.join(_ascii(name) for name in document['channels'])}"[:200]


def _ascii(text: str) -> str:
    """Messages hold printable ASCII alone."""
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text)


def _quaternion(run: ExportedRun, frame: str) -> np.ndarray:
    if frame == "tod":
        return run.quaternion
    return icrf_quaternion(run.epoch, run.t_s, run.quaternion, eme2000=frame == "eme2000")


def _states(run: ExportedRun, frame: str) -> tuple[np.ndarray, np.ndarray]:
    position, velocity = run.states()
    if frame == "tod":
        return position, velocity
    # The axes of date turn by 1e-11 rad/s: 1e-4 m/s in a low orbit would be seen only over months.
    turn = to_celestial(run.epoch, run.t_s, eme2000=frame == "eme2000")
    return np.einsum("nij,nj->ni", turn, position), np.einsum("nij,nj->ni", turn, velocity)


def columns(run: ExportedRun, frame: str) -> dict[str, np.ndarray]:
    """Attitude, and orbit where there is one, by names with units."""
    q = _quaternion(run, frame)
    found = {
        **{f"q_{c}": q[:, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_rad_s": run.angular_velocity[:, k] for k, c in enumerate("xyz")},
        "field_angle_deg": run.field_angle_deg,
    }
    if run.position is not None:
        position, velocity = _states(run, frame)
        found |= {f"position_{c}_km": position[:, k] / 1e3 for k, c in enumerate("xyz")}
        found |= {f"velocity_{c}_km_s": velocity[:, k] / 1e3 for k, c in enumerate("xyz")}
    return found


def _table(run: ExportedRun, frame: str, *, parquet: bool) -> bytes:
    utc, values = run.epoch.iso_texts(run.t_s, 6), columns(run, frame)
    if parquet:
        import pyarrow as pa
        import pyarrow.parquet as pq

        note = {
            "schema": "jaxsat.session/1",
            "frame": frame,
            "epoch_utc": run.epoch.iso(6),
            "quaternion": "scalar first, turns body axes into inertial ones",
            "object_name": run.object_name,
        }
        table = pa.table({"t_s": run.t_s, "utc": utc, **values})
        buffer = io.BytesIO()
        pq.write_table(table.replace_schema_metadata({k: str(v) for k, v in note.items()}), buffer)
        return buffer.getvalue()
    lines = [",".join(["t_s", "utc", *values])]
    for t, text, row in zip(run.t_s.tolist(), utc, np.column_stack(list(values.values())).tolist(), strict=True):
        lines.append(",".join([repr(t), text, *(repr(x) if math.isfinite(x) else "" for x in row)]))
    return ("\n".join(lines) + "\n").encode()


def _array(value: Any, shape: tuple[int, ...], *, gaps: bool = False) -> np.ndarray:
    """Numbers of a shape, -1 being any length; null is NaN where there may be gaps."""
    array = np.array([math.nan if x is None else x for x in value] if gaps else value, dtype=np.float64)
    if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape, strict=True)):
        raise ValueError(f"expected an array of shape {shape}, found {array.shape}")
    if not gaps and not np.isfinite(array).all():
        raise ValueError("expected finite numbers")
    return array


def _now() -> Epoch:
    import datetime

    now = datetime.datetime.now(datetime.UTC)
    return Epoch.from_utc(now.year, now.month, now.day, now.hour, now.minute, now.second)
