"""The files of `jaxsat local`: attitude.csv, currents.csv, local.json (schema `jaxsat.local/1`) and pictures."""

import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.files.csv_files import csv_numbers, write_numbers_csv
from jaxsat.files.json_files import plain, write_json
from jaxsat.panel_names import PANEL_NAMES

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.local.session import LocalSamples
    from fitting.local.solutions import LocalSolutions
    from fitting.session import PreparedSession
    from jaxsat.time import Epoch

SCHEMA = "jaxsat.local/1"
FILES = ("attitude.csv", "currents.csv", "currents.png", "attitude.png", "local.json")
"""Of a directory, with `--satellite` or without: none of an earlier run stands beside a new one."""
CONVENTION = "a_ij: component i in inertial axes (equatorial of date) of body axis j; inertial vector = a body vector"
ATTITUDE_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    "solution": "1 for the best attitude of the sample, then others that explain it",
    **{f"a{i}{j}": f"inertial component {i} of body axis {j}" for i in (1, 2, 3) for j in (1, 2, 3)},
    **{f"q_{c}": "the same as a quaternion, scalar first, turns body axes into inertial ones" for c in "wxyz"},
    "field_angle_deg": "angle between the magnet's axis, body x for sun-field, and the magnetic field",
    "sigma_deg": "1-sigma of the attitude about its least seen axis, the magnet off the field in it; empty where "
    "nothing sees it",
    "direct": "factor of direct sunlight, 1 for the panels' nominal current",
    "albedo": "factor of the Earth's light, 1 for an Earth that returns all",
    "rms_mA": "of measured - modelled currents",
    "status": "of the sample",
    "reason": "why it is not solved",
}
"""Columns of attitude.csv; a sample without attitude has one row with empty fields."""
CURRENT_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    **{f"measured_{p}_mA": "panel current after cleaning" for p in PANEL_NAMES},
    **{f"direct_{p}_mA": "direct sunlight in it, at the best attitude" for p in PANEL_NAMES},
    **{f"albedo_{p}_mA": "light of the Earth in it" for p in PANEL_NAMES},
    **{f"less_albedo_{p}_mA": "measured less the light of the Earth" for p in PANEL_NAMES},
}
"""Columns of currents.csv: what the published `tPsorb`, `tPsun` and `tPsorb2` hold."""


def write_local(
    directory: Path,
    prepared: "PreparedSession",
    samples: "LocalSamples",
    solutions: "LocalSolutions",
    *,
    options: dict[str, Any],
    began: float,
    plots: bool,
) -> None:
    """Writes all files; `began` is when the command did, of perf_counter."""
    epoch = prepared.session.epoch
    direct, albedo = modelled_mA(samples, solutions)
    measured = 1e3 * samples.currents
    _write_attitudes(directory / "attitude.csv", samples.t, epoch, solutions)
    table = np.hstack([measured, direct, albedo, measured - albedo])
    write_numbers_csv(directory / "currents.csv", CURRENT_COLUMNS, samples.t, epoch, table)
    if plots:
        figures = draw_local(samples, solutions, direct, albedo, prepared.subtitle, options["method"])
        for name, png in figures.items():
            (directory / name).write_bytes(png)
    document = {
        "schema": SCHEMA,
        "telemetry": prepared.telemetry,
        "sha256": prepared.session.sha256,
        "epoch_utc": epoch.iso(3),
        **options,
        "convention": CONVENTION,
        "axis_off_field_deg": None if solutions.axis_off is None else np.degrees(solutions.axis_off),
        "status_counts": dict(Counter(solutions.status)),
        "reasons": dict(Counter(reason for reason in solutions.reason if reason)),
        "samples": _samples(samples.t, solutions),
        "timing_s": {"total": time.perf_counter() - began},
    }
    write_json(directory / "local.json", plain(document)[0])


def _write_attitudes(path: Path, t: np.ndarray, epoch: "Epoch", solutions: "LocalSolutions") -> None:
    """One row an attitude, the best of a sample first; a sample without has a row of empty fields."""
    from scipy.spatial.transform import Rotation

    listed = np.isfinite(solutions.rms)
    listed[:, 0] = True
    sample, place = np.nonzero(listed)
    q = solutions.quaternion[listed]
    known = np.isfinite(q[:, 0])
    cosines = np.full((len(q), 9), np.nan)
    cosines[known] = Rotation.from_quat(q[known], scalar_first=True).as_matrix().reshape(-1, 9)
    number = np.where(known, 1.0 + place, np.nan)
    numbers = csv_numbers(np.column_stack([number, cosines, q, *(x[listed] for x in _numbers(solutions).values())]))
    verdicts = [
        f'{status},"{reason}"' if reason else f"{status},"
        for status, reason in zip(solutions.status, solutions.reason, strict=True)
    ]
    rows = zip(csv_numbers(t[sample][:, None]), epoch.iso_texts(t[sample]), numbers, sample.tolist(), strict=True)
    with path.open("w", newline="", encoding="utf-8") as stream:
        stream.write(",".join(ATTITUDE_COLUMNS) + "\n")
        stream.writelines(f"{time},{utc},{row},{verdicts[k]}\n" for time, utc, row, k in rows)


def _numbers(solutions: "LocalSolutions") -> dict[str, np.ndarray]:
    """[samples found] what is told of each attitude."""
    return {
        "field_angle_deg": np.degrees(solutions.field_angle),
        "sigma_deg": np.degrees(solutions.sigma),
        "direct": solutions.direct,
        "albedo": solutions.albedo,
        "rms_mA": np.where(np.isfinite(solutions.rms), 1e3 * solutions.rms, np.nan),
    }


def _samples(t: np.ndarray, solutions: "LocalSolutions") -> list[dict[str, Any]]:
    columns = {"quaternion_inertial_from_body": solutions.quaternion, **_numbers(solutions)}
    values = {name: column.tolist() for name, column in columns.items()}
    return [
        {
            "t_s": instant,
            "status": solutions.status[k],
            "reason": solutions.reason[k],
            "solutions": [{name: column[k][n] for name, column in values.items()} for n in range(count)],
        }
        for k, (instant, count) in enumerate(zip(t.tolist(), solutions.count.tolist(), strict=True))
    ]


def modelled_mA(samples: "LocalSamples", solutions: "LocalSolutions") -> tuple[np.ndarray, np.ndarray]:
    """[samples 6] currents of direct and of returned sunlight at the best attitudes [mA], NaN without one."""
    import jax

    from fitting.local.shares import patterns

    q = np.nan_to_num(solutions.quaternion[:, 0])
    parts = jax.jit(jax.vmap(patterns, (0, None, None, 0)))(q, samples.panels, samples.earth, samples.light)
    factors = solutions.direct[:, :1], solutions.albedo[:, :1]
    direct, albedo = (1e3 * factor * np.asarray(part) for factor, part in zip(factors, parts, strict=True))
    return direct, albedo


def draw_local(samples, solutions, direct, albedo, subtitle, method) -> dict[str, bytes]:
    """Returns the pictures as PNG by file name."""
    import jax
    import jax.numpy as jnp

    from fitting.local.turn import initial_attitude
    from jaxsat.math import quaternion
    from jaxsat.plotting import draw_currents, draw_local_attitudes, png_bytes

    measured = 1e3 * samples.currents
    lit = np.asarray(samples.light.illumination) > 0.0
    best = np.isfinite(solutions.rms[:, :1])
    angle, name, extent = (
        np.degrees(solutions.field_angle),
        "angle of the magnet's axis to the field, deg",
        (0.0, 180.0),
    )
    if method == "field-roll":
        # There the axis is on the field's line by assumption, and the roll is what was found.
        sun_body = jax.jit(jax.vmap(jax.vmap(quaternion.rotate_inverse, (0, None))))
        own = np.asarray(
            quaternion.to_dcm(initial_attitude(jnp.array([1.0, 0.0, 0.0]), jnp.asarray(samples.axis_body)))
        )
        seen = np.asarray(sun_body(solutions.quaternion, samples.light.sun_eci)) @ own.T
        angle = np.degrees(np.arctan2(seen[..., 2], seen[..., 1]))
        name, extent = "roll: direction of the Sun about the magnet's axis, deg", (-180.0, 180.0)
    figures = {
        "attitude.png": draw_local_attitudes(
            samples.t,
            angle,
            np.degrees(solutions.sigma[:, 0]),
            1e3 * solutions.rms[:, 0],
            {"direct": solutions.direct[:, 0], "albedo": solutions.albedo[:, 0]},
            status=np.array(solutions.status),
            lit=lit,
            angle_name=name,
            angle_range_deg=extent,
            subtitle=subtitle,
        ),
        "currents.png": draw_currents(
            samples.t,
            measured,
            np.nan_to_num(direct + albedo),
            np.nan_to_num(direct),
            weight=np.broadcast_to(best, measured.shape).astype(float),
            lit=lit,
            title="Panel currents at the best attitude of each sample",
            subtitle=subtitle,
        ),
    }
    return {name: png_bytes(figure) for name, figure in figures.items()}


def local_summary(solutions: "LocalSolutions", name: str) -> "RenderableType":
    """Returns how many samples came to what, and medians over those that have an attitude."""
    from rich.console import Group
    from rich.text import Text

    from fitting.local.solutions import DOES_NOT_FIT
    from jaxsat.cli.shared.terminal import plain_table

    table = plain_table("samples", "status", "reason", right=(0,))
    for (status, reason), count in Counter(zip(solutions.status, solutions.reason, strict=True)).most_common():
        table.add_row(str(count), status, reason)
    parts: list[RenderableType] = [Text(name, style="bold"), table]
    found = solutions.count > 0
    if found.any():
        rms, sigma = (
            float(np.median(values[found, 0])) for values in (1e3 * solutions.rms, np.degrees(solutions.sigma))
        )
        told = f"{sigma:.2g} deg" if np.isfinite(sigma) else "without bound"
        parts.append(Text(f"median over {found.sum()} with an attitude: residual RMS {rms:.3g} mA, attitude 1σ {told}"))
        denied = solutions.status.count(DOES_NOT_FIT)
        if denied:
            text = f"{denied} of them do not fit the model"
            if solutions.axis_off:
                off = f"{np.degrees(solutions.axis_off):.2g} deg (1σ)"
                text += f": by the residuals the magnet's axis is {off} off the field"
            parts.append(Text(text, style="yellow"))
    return Group(*parts)
