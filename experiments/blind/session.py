"""A generated session as the fit meets it, and its truth in the terms of the fit's result."""

import datetime as dt
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from generate import MAX_SPIN_DEG_S, regime_of, session_file
from scipy.spatial.transform import Rotation

import fitting
from fitting.identify import FINE_TOLERANCE, Identified, Minimum
from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.outcome.result import FitResult
from fitting.outcome.summary import summarize
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.settings import FitSettings
from fitting.solvers.refine import refine
from fitting.starts.conventions import conventions
from fitting.starts.multi_start import Starts
from fitting.surroundings import surroundings
from jaxsat.integrators import RK4, step_for
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

EVERYTHING = ("magnet", "rods", "imax", "inertia", "albedo")
MAGNET = ("magnet.x", "magnet.y", "magnet.z")
GAINS = tuple(f"gains.{panel}" for panel in PANEL_NAMES)
CELLS = "cells"
"""Channel of the six currents."""


@dataclass(frozen=True)
class BlindSession:
    """What a fit is given, and the truth."""

    number: int
    satellite: Satellite
    session: TableSession
    settings: FitSettings
    truth: dict[str, Any]
    offset_s: float
    """Time of the truth at t = 0 of the session."""

    def true_index(self, t_s: np.ndarray) -> np.ndarray:
        """Samples of the truth at times of the session."""
        times = np.array(self.truth["t"])
        return np.argmin(np.abs(times[None, :] - (np.asarray(t_s) + self.offset_s)[:, None]), axis=1)

    def parameters(self) -> FreeParameters:
        """What the fit frees."""
        craft = self.satellite
        free = chosen_leaves(craft.leaves, self.settings.free, craft.aliases)
        return free_parameters(craft.model, craft.leaves, free, held=craft.held)

    def fit(self) -> FitResult:
        """The blind fit."""
        return fitting.fit(self.satellite, self.session, settings=self.settings, causes=False).result


def blind_session(number: int, cache: Path, *, hard: bool) -> BlindSession:
    """Reads a session with the nominal Munin and everything free; the one thing known is how fast it may spin."""
    path = session_file(number, cache, hard=hard)
    truth = json.loads(path.with_suffix(".truth.json").read_text())
    regime = regime_of(number)
    settings = FitSettings(free=EVERYTHING + (("gains",) if hard else ()), starts=256)
    if regime < len(MAX_SPIN_DEG_S):
        settings = settings.changed(max_rate_deg_s=MAX_SPIN_DEG_S[regime])
    satellite = read_satellite()
    session = read_telemetry(path, satellite)
    epoch = dt.datetime.fromisoformat(session.epoch.iso(3))
    offset = (epoch.replace(tzinfo=None) - dt.datetime.fromisoformat(truth["cfg"]["start"])).total_seconds()
    return BlindSession(number, satellite, session, settings, truth, offset)


def nominal(session: BlindSession) -> dict[str, float]:
    """Nominal values by name, SI."""
    return dict(zip(_names(session), np.asarray(session.parameters().tree.nominal).tolist(), strict=True))


def _names(session: BlindSession) -> list[str]:
    return [leaf.name for leaf in session.satellite.leaves]


def true_values(session: BlindSession) -> dict[str, float]:
    """Truth by the names of fit.json, SI, with its common scales moved to where the fit's gauges hold them.

    The motion is that of the truth: |magnet| is the nominal one and the mean gain is one. What is not in it is nominal.
    """
    cfg, given = session.truth["cfg"], nominal(session)
    scale = np.linalg.norm([given[name] for name in MAGNET]) / np.linalg.norm(cfg["magnet"])
    J = scale * np.array(cfg["inertia"])
    mean_gain = float(np.mean(cfg["panel_ratio"]))
    inertia = {"xx": J[0, 0], "yy": J[1, 1], "zz": J[2, 2], "xy": J[0, 1], "xz": J[0, 2], "yz": J[1, 2]}
    return {
        **given,
        **{f"inertia.{name}": float(value) for name, value in inertia.items()},
        **dict(zip(MAGNET, (scale * np.array(cfg["magnet"])).tolist(), strict=True)),
        **dict(zip(("rods.y", "rods.z"), (scale * np.array(cfg["rods"])).tolist(), strict=True)),
        "imax": 1e-3 * cfg["imax"] * mean_gain,
        **dict(zip(GAINS, (np.array(cfg["panel_ratio"]) / mean_gain).tolist(), strict=True)),
        "albedo.specular": cfg["albedo_specular"],
        "albedo.diffuse": cfg["albedo_diffuse"],
    }


def true_start(session: BlindSession, parameters: FreeParameters, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """The truth as a start at a time of the session: unknowns with all parameters, and attitude."""
    k = int(session.true_index(np.array([t_s]))[0])
    values = true_values(session)
    q, w = np.array(session.truth["q"][k]), np.array(session.truth["w"][k])
    shift = parameters.shifts(np.array([values[name] for name in _names(session)]))
    lower, upper = parameters.bounds()
    return np.clip(np.concatenate([np.zeros(3), w / RATE_UNIT, shift]), lower, upper), q


def fit_from_truth(session: BlindSession) -> FitResult:
    """The minimum into which the truth itself runs."""
    parameters, model = session.parameters(), session.satellite.model
    around, _ = surroundings(session.satellite, session.session)
    samples = Samples.of(session.session.channels, session.session.epoch, {})
    spin = float(np.linalg.norm(session.truth["w"], axis=1).max())
    fastest = min(1.3 * spin + 1e-3, 2.0 * np.radians(session.settings.max_rate_deg_s))
    step = min(session.settings.step_s, step_for(RK4, fastest, float(np.ptp(samples.t)), FINE_TOLERANCE))
    problem = build_problem(samples, model, around, delayed=(), max_step=step, room_for=step)
    x, q = true_start(session, parameters, float(samples.t[0]))
    start = Starts(x[None], q[None], np.zeros(1))
    how = {"likelihood": session.settings.likelihood, "progress": lambda *_: None}
    refined = refine(problem, parameters, start, usable(problem, samples), **how)
    minimum = Minimum(conventions(problem, samples, {})[0], problem, refined)
    return summarize(Identified((minimum,), samples, parameters, len(samples.t), step, {}))


def compare(session: BlindSession, result: FitResult) -> dict[str, Any]:
    """Errors of a result against the truth: attitude over the arc, and everything over its sigma."""
    k = session.true_index(result.t_s)
    true_q, found_q = np.array(session.truth["q"])[k], result.quaternion_inertial_from_body
    turn = Rotation.from_quat(true_q, scalar_first=True).inv() * Rotation.from_quat(found_q, scalar_first=True)
    turn_deg = np.degrees(turn.as_rotvec())
    angle = np.linalg.norm(turn_deg, axis=1)
    true, given = true_values(session), nominal(session)
    fitted = {p.name: p for p in result.parameters}
    to_unit = {leaf.name: leaf.to_unit for leaf in session.satellite.leaves}
    moves = {leaf.name for leaf in session.satellite.leaves if leaf.moves}
    first = turn_deg[0] / result.attitude_sigma_deg[0]
    over_sigma = {f"attitude.{axis}": float(error) for axis, error in zip("xyz", first, strict=True)}
    dead = {name for name in GAINS if true[name] == 0.0}
    size = np.linalg.norm([given[name] for name in MAGNET])
    relative = float(np.linalg.norm([fitted[name].value for name in MAGNET]) / size)
    # A dead panel's gain cannot be stated, so the live ones alone tie the scale of gains and imax to the truth's.
    live = [name for name in GAINS if name not in dead]
    brightness = sum(true[name] for name in live) / sum(fitted[name].value for name in live)
    scale = dict.fromkeys(moves, relative) | {name: 1.0 / brightness for name in GAINS} | {"imax": brightness}
    values = {}
    for name in (p.name for p in result.parameters if p.free):
        true_value = true[name] * to_unit[name] * scale.get(name, 1.0)
        value, sigma = fitted[name].value, fitted[name].sigma
        values[name] = {"value": value, "truth": true_value, "sigma": sigma}
        if sigma and name not in dead:
            over_sigma[name] = (value - true_value) / sigma
    return {
        "attitude_median_deg": float(np.median(angle)),
        "attitude_rms_deg": float(np.sqrt(np.mean(angle**2))),
        "attitude_max_deg": float(angle.max()),
        "over_sigma": over_sigma,
        "parameters": values,
    }


def left_out(result: FitResult) -> int:
    """Samples of the currents that the fit did not use."""
    cells = result.channels[CELLS]
    return int((~cells.used & cells.fitted).sum())


def truncated_cost(session: BlindSession, result: FitResult, limit: float = 30.0) -> float:
    """Chi2 with no sample above `limit` and with the priors: comparable where fits left out different samples."""
    cells = result.channels[CELLS]
    assert result.illumination is not None
    lit = result.illumination[np.searchsorted(result.t_s, cells.t_s)] > 0.5
    noise = session.session.channels[CELLS].sigma * session.session.channels[CELLS].to_unit
    used = (np.nan_to_num(cells.measured).max(axis=1) > 3.0 * noise) == lit
    squares = np.nansum(cells.residual**2, axis=1)
    to_unit = {leaf.name: leaf.to_unit for leaf in session.satellite.leaves}
    found = nominal(session) | {p.name: p.value / to_unit[p.name] for p in result.parameters if p.name in to_unit}
    shift = session.parameters().shifts(np.array([found[name] for name in _names(session)]))
    return float(np.minimum(squares, limit)[used].sum() + shift @ shift)


def with_starts(session: BlindSession, starts: int, seed: int) -> BlindSession:
    """The same session under another search."""
    return replace(session, settings=session.settings.changed(starts=starts, seed=seed))
