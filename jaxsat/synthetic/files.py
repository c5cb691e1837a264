"""The files of a simulated session: session and truth, tables of currents and angles, pictures."""

import csv
from pathlib import Path

import jax
import numpy as np

from jaxsat.files.csv_files import write_columns_csv
from jaxsat.files.json_files import write_json
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.synthetic.panels import panel_columns
from jaxsat.synthetic.session import SessionPlan, SimulatedSession
from jaxsat.synthetic.truth import Truth, truth_document
from jaxsat.telemetry.limb_angles import COLUMNS as LIMB_COLUMNS
from jaxsat.versions import versions

FILES = (
    "session.RAW_SUN",
    "session.truth.json",
    "angles.csv",
    "currents.csv",
    "limb.csv",
    "panels.csv",
    "currents.png",
    "angles.png",
)
"""All names that a simulation may write."""
SMOOTH_DEG = 4.0
"""Turn between two points of a curve, which a straight line joins."""
MOST_POINTS = 4000


def write_simulation(directory: Path, session: SimulatedSession, plan: SessionPlan, *, plots: bool) -> None:
    """Writes `FILES` of a session."""
    truth, epoch = session.truth, session.epoch
    # The reader wants an ASCII body with the line ends that were asked for, whatever the platform.
    (directory / "session.RAW_SUN").write_bytes(session.raw_sun.encode("utf-8"))
    write_json(directory / "session.truth.json", document(session, plan))
    write_columns_csv(directory / "angles.csv", truth.t, epoch, angle_columns(truth))
    write_columns_csv(directory / "currents.csv", truth.t, epoch, current_columns(session))
    if session.panels is not None:
        earth, albedo = plan.given.earth, plan.satellite.albedo
        mirror = {"earth_radius": 1e3 * earth.radius_km, "reflectivity": albedo.specular}
        write_columns_csv(directory / "panels.csv", truth.t, epoch, panel_columns(session.panels, truth, **mirror))
    with (directory / "limb.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(LIMB_COLUMNS)
        limb = np.degrees(truth.limb).tolist()
        writer.writerows(
            [utc, f"{a:.6f}", f"{b:.6f}"] for utc, (a, b) in zip(epoch.iso_texts(truth.t), limb, strict=True)
        )
    if plots:
        for name, png in pictures(session, plan).items():
            (directory / name).write_bytes(png)


def document(session: SimulatedSession, plan: SessionPlan) -> dict:
    """Returns the content of session.truth.json."""
    s = plan.settings
    content = truth_document(
        session.truth,
        session.spacecraft,
        session.albedo,
        session.epoch,
        elements=session.elements,
        seed=s.seed,
        duration=s.duration_s,
        cadence=s.sampling_s,
        noise=s.noise_mA,
        zero_offset=s.zero_offset_mA,
        mess=False,
        tle=list(session.tle),
        clip=None if s.limit_s is None else [*s.limit_s, *s.limit_factors],
    )
    return {
        **content,
        "greenwich0": session.greenwich_angle,
        "attitude_error_rad": session.truth.error,
        "settings": plan.document(),
        "versions": versions(),
    }


def angle_columns(truth: Truth) -> dict[str, np.ndarray]:
    """Returns attitude and angles at the times of `truth`, units in their names."""
    deviation, azimuth, roll = np.degrees(truth.sun_magnetic).T
    limb = np.degrees(truth.limb)
    return {
        **{f"q_{c}": np.asarray(truth.quaternion)[:, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_deg_s": np.degrees(truth.angular_velocity)[:, k] for k, c in enumerate("xyz")},
        "field_angle_deg": deviation,
        "sun_magnetic_azimuth_deg": azimuth,
        "sun_magnetic_roll_deg": roll,
        "sun_angle_deg": np.degrees(truth.sun_angle),
        "sun_field_angle_deg": np.degrees(truth.sun_field_angle),
        "limb_distance_deg": limb[:, 0],
        "limb_turn_deg": limb[:, 1],
        "lit": (np.asarray(truth.illumination) > 0.5).astype(float),
    }


def current_columns(session: SimulatedSession) -> dict[str, np.ndarray]:
    """Returns currents of each kind of light, after limiting, and as telemetered, units in their names."""
    truth = session.truth
    kinds = {
        "direct": 1e3 * np.asarray(truth.direct_current),
        "specular": 1e3 * np.asarray(truth.specular_current),
        "diffuse": 1e3 * np.asarray(truth.diffuse_current),
        "limited": session.limited_mA,
        "telemetered": session.telemetered_mA,
    }
    return {f"{kind}_{panel}_mA": values[:, k] for kind, values in kinds.items() for k, panel in enumerate(PANEL_NAMES)}


def pictures(session: SimulatedSession, plan: SessionPlan) -> dict[str, bytes]:
    """Returns the pictures as PNG by file name."""
    from jaxsat.plotting import draw_currents, png_bytes
    from jaxsat.plotting.channels.readings import Curve
    from jaxsat.plotting.currents import SIMULATED
    from jaxsat.plotting.history import draw_history

    truth, s, fine = session.truth, plan.settings, fine_truth(session)
    lit = np.asarray(truth.illumination) > 0.5
    limited = np.zeros(len(truth.t), bool)
    if s.limit_s is not None:
        limited = (truth.t >= s.limit_s[0]) & (truth.t <= s.limit_s[1])
    subtitle = f"{s.satellite}, simulated, epoch {session.epoch.iso(3)} UTC, seed {s.seed}"
    currents = draw_currents(
        truth.t,
        session.telemetered_mA,
        1e3 * np.asarray(truth.current),
        1e3 * np.asarray(truth.direct_current),
        weight=np.ones((len(truth.t), 6)),
        lit=lit,
        limited=limited,
        title="Simulated panel currents",
        subtitle=subtitle,
        curve=Curve(fine.t, 1e3 * np.asarray(fine.current), 1e3 * np.asarray(fine.direct_current)),
        words=SIMULATED,
    )
    angles = angle_columns(fine)
    charts = {
        "body x from the field, deg": {"": angles["field_angle_deg"]},
        "Sun-magnetic azimuth and roll, deg": {
            "azimuth": _unwrapped(angles["sun_magnetic_azimuth_deg"]),
            "roll": _unwrapped(angles["sun_magnetic_roll_deg"]),
        },
        "Sun from body x and from the field, deg": {
            "body x": angles["sun_angle_deg"],
            "field": angles["sun_field_angle_deg"],
        },
        "limb from body x, deg": {"": angles["limb_distance_deg"]},
        "turn of the limb about body x, deg": {"": _unwrapped(angles["limb_turn_deg"])},
        "angular velocity, body axes, deg/s": {c: angles[f"rate_{c}_deg_s"] for c in "xyz"},
    }
    history = draw_history(fine.t, charts, title="Angles of the simulated attitude", subtitle=subtitle)
    return {"currents.png": png_bytes(currents), "angles.png": png_bytes(history)}


def fine_truth(session: SimulatedSession) -> Truth:
    """Returns the truth at the samples and, where the satellite turns far from one to the next, between them."""
    truth = session.truth
    t, n = truth.t, len(truth.t)
    if n < 2:
        return truth
    fastest = np.degrees(np.linalg.norm(truth.angular_velocity, axis=1).max())
    parts = min(int(np.ceil(fastest * np.diff(t).max() / SMOOTH_DEG)), MOST_POINTS // n)
    if parts < 2:
        return truth
    # As many times as there are samples at each call, for which the programs are there; the last one stays the last.
    shifts = np.append(np.diff(t), 0.0) / parts
    moved = [truth, *(session.truth_at(np.minimum(t + k * shifts, t[-1])) for k in range(1, parts))]
    shape = (n * parts,)
    leaves = [
        np.stack(columns, axis=1).reshape(shape + columns[0].shape[1:])[: (n - 1) * parts + 1]
        for columns in zip(*map(jax.tree.leaves, moved), strict=True)
    ]
    return jax.tree.unflatten(jax.tree.structure(truth), leaves)


def _unwrapped(angle_deg: np.ndarray) -> np.ndarray:
    """The same angle with a gap in the line where it passes half a turn, in place of a stroke across the picture."""
    jump = np.abs(np.diff(angle_deg, append=angle_deg[-1])) > 180.0
    return np.where(jump, np.nan, angle_deg)
