"""The files of `jaxsat local`: attitude.csv, currents.csv, local.json (schema `jaxsat.local/1`) and pictures."""

import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.cli.output import PANELS, plain, write_csv, write_json

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fitting.local.session import LocalSamples
    from fitting.local.solutions import LocalSolutions
    from fitting.observations import Observations
    from jaxsat.cli.session import PreparedSession

SCHEMA = "jaxsat.local/1"
CONVENTION = "a_ij: component i in inertial axes (equatorial of date) of body axis j; inertial vector = a body vector"
ATTITUDE_COLUMNS = {
    "t_s": "seconds since the epoch",
    "utc": "UTC",
    "solution": "1 for the best attitude of the sample, then others that explain it",
    **{f"a{i}{j}": f"inertial component {i} of body axis {j}" for i in (1, 2, 3) for j in (1, 2, 3)},
    **{f"q_{c}": "the same as a quaternion, scalar first, turns body axes into inertial ones" for c in "wxyz"},
    "field_angle_deg": "angle between body x and the magnetic field",
    "sigma_deg": "1-sigma of the attitude about its least seen axis; empty where nothing sees it",
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
    **{f"measured_{p}_mA": "panel current after cleaning" for p in PANELS},
    **{f"direct_{p}_mA": "direct sunlight in it, at the best attitude" for p in PANELS},
    **{f"albedo_{p}_mA": "light of the Earth in it" for p in PANELS},
    **{f"less_albedo_{p}_mA": "measured less the light of the Earth" for p in PANELS},
}
"""Columns of currents.csv: what the published `tPsorb`, `tPsun` and `tPsorb2` hold."""


def write_local(
    directory: Path,
    prepared: "PreparedSession",
    observed: "Observations",
    samples: "LocalSamples",
    solutions: "LocalSolutions",
    *,
    options: dict[str, Any],
    began: float,
    plots: bool,
) -> None:
    """Writes all files; `began` is when the command did, of perf_counter."""
    from scipy.spatial.transform import Rotation

    epoch, count = prepared.session.epoch, solutions.count
    direct, albedo = modelled_mA(samples, solutions)
    measured = 1e3 * samples.currents
    rows, times = [], []
    for k, t in enumerate(observed.t.tolist()):
        for n in range(max(count[k], 1)):
            q = solutions.quaternion[k, n]
            cosines = Rotation.from_quat(q, scalar_first=True).as_matrix() if count[k] else np.full((3, 3), np.nan)
            numbers = [*cosines.ravel(), *q, *_numbers(solutions, k, n)]
            rows.append([n + 1 if count[k] else "", *numbers, solutions.status[k], solutions.reason[k]])
            times.append(t)
    write_csv(directory / "attitude.csv", ATTITUDE_COLUMNS, np.array(times), epoch, rows)
    table = np.hstack([measured, direct, albedo, measured - albedo])
    write_csv(directory / "currents.csv", CURRENT_COLUMNS, observed.t, epoch, table.tolist())
    if plots:
        for name, png in draw_local(observed, samples, solutions, direct, albedo, prepared.subtitle).items():
            (directory / name).write_bytes(png)
    document = {
        "schema": SCHEMA,
        "telemetry": prepared.telemetry,
        "sha256": prepared.session.sha256,
        "epoch_utc": epoch.iso(3),
        **options,
        "convention": CONVENTION,
        "status_counts": dict(Counter(solutions.status)),
        "reasons": dict(Counter(reason for reason in solutions.reason if reason)),
        "samples": [_sample(solutions, k, t) for k, t in enumerate(observed.t.tolist())],
        "timing_s": {"total": time.perf_counter() - began},
    }
    write_json(directory / "local.json", plain(document)[0])


def _numbers(solutions, k, n) -> list[float]:
    return [
        float(np.degrees(solutions.field_angle[k, n])),
        float(np.degrees(solutions.sigma[k, n])),
        float(solutions.direct[k, n]),
        float(solutions.albedo[k, n]),
        1e3 * float(solutions.rms[k, n]),
    ]


def _sample(solutions, k, t) -> dict[str, Any]:
    names = ("field_angle_deg", "sigma_deg", "direct", "albedo", "rms_mA")
    found = [
        {
            "quaternion_inertial_from_body": solutions.quaternion[k, n],
            **dict(zip(names, _numbers(solutions, k, n), strict=True)),
        }
        for n in range(solutions.count[k])
    ]
    return {"t_s": t, "status": solutions.status[k], "reason": solutions.reason[k], "solutions": found}


def modelled_mA(samples: "LocalSamples", solutions: "LocalSolutions") -> tuple[np.ndarray, np.ndarray]:
    """[samples 6] currents of direct and of returned sunlight at the best attitudes [mA], NaN without one."""
    import jax

    from fitting.local.shares import patterns

    q = np.nan_to_num(solutions.quaternion[:, 0])
    at = jax.jit(jax.vmap(patterns, (0, None, None, 0)))
    parts = at(q, samples.panels, samples.earth, samples.light)
    factors = solutions.direct[:, :1], solutions.albedo[:, :1]
    direct, albedo = (1e3 * factor * np.asarray(part) for factor, part in zip(factors, parts, strict=True))
    return direct, albedo


def draw_local(observed, samples, solutions, direct, albedo, subtitle) -> dict[str, bytes]:
    """Returns the pictures as PNG by file name."""
    from jaxsat.plotting import draw_currents, draw_local_attitudes, png_bytes

    measured = 1e3 * samples.currents
    lit = np.asarray(samples.light.illumination) > 0.0
    best = np.isfinite(solutions.rms[:, :1])
    figures = {
        "attitude.png": draw_local_attitudes(
            observed.t,
            np.degrees(solutions.field_angle),
            np.degrees(solutions.sigma[:, 0]),
            1e3 * solutions.rms[:, 0],
            {"direct": solutions.direct[:, 0], "albedo": solutions.albedo[:, 0]},
            status=np.array(solutions.status),
            lit=lit,
            subtitle=subtitle,
        ),
        "currents.png": draw_currents(
            observed.t,
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

    from jaxsat.cli.tables import plain_table

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
    return Group(*parts)
