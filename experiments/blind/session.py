"""A generated session as the fit meets it, and its truth in the terms of the fit's result."""

import datetime as dt
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from generate import MAX_SPIN_DEG_S, regime_of, session_file

from fitting.estimate import FINE_TOLERANCE
from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.observations import Observations, build_problem
from fitting.measurements.problem import Problem
from fitting.outcome.result import FitResult
from fitting.outcome.summary import summarize
from fitting.parameters.names import DYNAMIC, GAINS, MAGNET, MODEL, TILTS, TO_UNIT
from fitting.parameters.nominal import Nominal, nominal_model
from fitting.parameters.parametrization import parametrization
from fitting.session import prepare_session
from fitting.settings import FitSettings
from fitting.solvers.refine import refine
from fitting.starts.multi_start import Starts
from jaxsat.integrators import RK4, step_for
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

EVERYTHING = "magnet,rods,imax,inertia,albedo"


@dataclass(frozen=True)
class BlindSession:
    """What a fit is given, and the truth."""

    number: int
    observations: Observations
    nominal: Nominal
    settings: FitSettings
    truth: dict[str, Any]
    offset_s: float
    """Time of the truth at t = 0 of the observations."""

    def true_index(self, t_s: np.ndarray) -> np.ndarray:
        """Samples of the truth at times of the observations."""
        times = np.array(self.truth["t"])
        return np.argmin(np.abs(times[None, :] - (np.asarray(t_s) + self.offset_s)[:, None]), axis=1)


def blind_session(number: int, cache: Path, *, hard: bool) -> BlindSession:
    """Reads a session with the nominal Munin and everything free; the one thing known is how fast it may spin."""
    path = session_file(number, cache, hard=hard)
    truth = json.loads(path.with_suffix(".truth.json").read_text())
    regime = regime_of(number)
    known = {"max_rate_deg_s": MAX_SPIN_DEG_S[regime]} if regime < len(MAX_SPIN_DEG_S) else {}
    settings = FitSettings(free=EVERYTHING + (",gains" if hard else "")).changed(**known)
    prepared = prepare_session(read_telemetry(path))
    epoch = dt.datetime.fromisoformat(prepared.session.epoch.iso(3))
    offset = (epoch.replace(tzinfo=None) - dt.datetime.fromisoformat(truth["cfg"]["start"])).total_seconds()
    return BlindSession(number, prepared.observations(), nominal_model(read_satellite()), settings, truth, offset)


def true_values(cfg: dict[str, Any], given: Nominal) -> dict[str, float]:
    """Truth by the names of fit.json, SI, with its common scales moved to where the fit's gauges hold them.

    The motion is that of the truth: |magnet| is the nominal one and the mean gain is one.
    """
    scale = np.linalg.norm(given.magnet) / np.linalg.norm(cfg["magnet"])
    J = np.array(cfg["inertia"])
    mean_gain = float(np.mean(cfg["panel_ratio"]))
    dynamic = [*cfg["magnet"], *cfg["rods"], J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]]
    sensor = [1e-3 * cfg["imax"] * mean_gain, *(np.array(cfg["panel_ratio"]) / mean_gain)]
    values = [
        *(scale * np.array(dynamic)),
        *sensor,
        cfg["albedo_specular"],
        cfg["albedo_diffuse"],
        *np.zeros(len(TILTS)),
    ]
    return dict(zip(MODEL, map(float, values), strict=True))


def step_s(session: BlindSession, spin: float, tolerance: float) -> float:
    """The step with which `fit` integrates motions of a `spin` [rad/s] to a tolerance [rad] over the session."""
    duration = max(float(np.ptp(session.observations.t)), 1.0)
    return min(session.settings.step_s, step_for(RK4, spin, duration, tolerance))


def problem_of(session: BlindSession, step: float, begin: int = 0) -> tuple[Observations, Problem, np.ndarray]:
    """As `fit` makes them: samples from the first lit one on, the problem, and the weights of its currents.

    Those from number `begin` of these samples on.
    """
    settings, samples = session.settings, session.observations
    common = {"noise": 1e-3 * settings.reading_sigma_mA, "floor": settings.floor}
    problem = build_problem(samples, max_step=step, **common)
    first = int(np.flatnonzero(problem.bright() & problem.sunlit())[0])
    if first + begin > 0:
        samples = samples.since(first + begin)
        problem = build_problem(samples, max_step=step, **common)
    use = np.repeat(np.asarray(problem.valid).astype(float)[:, None], 6, axis=1)
    use[problem.bright() != problem.sunlit()] = 0.0
    return samples, problem, use


def true_start(session: BlindSession, t_first: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The truth as a start at time `t_first` of the observations: unknowns with all parameters, attitude, rate."""
    k = int(session.true_index(np.array([t_first]))[0])
    parameters = parametrization(session.nominal, session.settings.free_names, session.settings.prior_sigma)
    values = true_values(session.truth["cfg"], session.nominal)
    q, w = np.array(session.truth["q"][k]), np.array(session.truth["w"][k])
    shift = parameters.shifts(np.array([values[name] for name in MODEL]))
    lower, upper = parameters.bounds()
    return np.clip(np.concatenate([np.zeros(3), w / RATE_UNIT, shift]), lower, upper), q, w


def _silent(*_: object) -> None:
    """No word on how far a fit is."""


def fit_from_truth(session: BlindSession) -> FitResult:
    """The minimum into which the truth itself runs."""
    spin = float(np.linalg.norm(session.truth["w"], axis=1).max())
    fastest = min(1.3 * spin + 1e-3, 2.0 * np.radians(session.settings.max_rate_deg_s))
    samples, problem, use = problem_of(session, step_s(session, fastest, FINE_TOLERANCE))
    parameters = parametrization(session.nominal, session.settings.free_names, session.settings.prior_sigma)
    x, q, _ = true_start(session, float(samples.t[0]))
    start = Starts(x[None], q[None], np.zeros(1))
    refined = refine(problem, parameters, start, use, likelihood=session.settings.likelihood, progress=_silent)
    return summarize(samples.t, problem, parameters, refined)


def compare(session: BlindSession, result: FitResult) -> dict[str, Any]:
    """Errors of a result against the truth: attitude over the arc, and everything over its sigma."""
    k = session.true_index(result.t_s)
    conjugate = np.array(session.truth["q"])[k] * np.array([1.0, -1.0, -1.0, -1.0])
    a, q = conjugate, result.quaternion_inertial_from_body
    vector = a[:, :1] * q[:, 1:] + q[:, :1] * a[:, 1:] + np.cross(a[:, 1:], q[:, 1:])
    scalar = a[:, 0] * q[:, 0] - np.sum(a[:, 1:] * q[:, 1:], axis=1)
    sine = np.linalg.norm(vector, axis=1)
    angle = np.degrees(2.0 * np.arctan2(sine, np.abs(scalar)))
    turn_deg = (np.sign(scalar) * angle / np.maximum(sine, 1e-300))[:, None] * vector
    true = true_values(session.truth["cfg"], session.nominal)
    fitted = {p.name: p for p in result.parameters}
    first = turn_deg[0] / result.attitude_sigma_deg[0]
    over_sigma = {f"attitude.{axis}": float(error) for axis, error in zip("xyz", first, strict=True)}
    dead = {name for name in GAINS if true[name] == 0.0}
    relative = float(np.linalg.norm([fitted[name].value for name in MAGNET]) / np.linalg.norm(session.nominal.magnet))
    # A dead panel's gain cannot be stated, so the live ones alone tie the scale of gains and imax to the truth's.
    live = [name for name in GAINS if name not in dead]
    brightness = sum(true[name] for name in live) / sum(fitted[name].value for name in live)
    scale = {name: relative for name in DYNAMIC} | {name: 1.0 / brightness for name in GAINS} | {"imax": brightness}
    values = {}
    for name in session.settings.free:
        unit = TO_UNIT.get(name, 1.0) * scale.get(name, 1.0)
        value, sigma = fitted[name].value, fitted[name].sigma
        values[name] = {"value": value, "truth": true[name] * unit, "sigma": sigma}
        if sigma and name not in dead:
            over_sigma[name] = (value - true[name] * unit) / sigma
    return {
        "attitude_median_deg": float(np.median(angle)),
        "attitude_rms_deg": float(np.sqrt(np.mean(angle**2))),
        "attitude_max_deg": float(angle.max()),
        "over_sigma": over_sigma,
        "parameters": values,
    }


def truncated_cost(session: BlindSession, result: FitResult, limit: float = 30.0) -> float:
    """Chi2 with no sample above `limit` and with the priors: comparable where fits left out different samples."""
    settings = session.settings
    noise_mA = settings.reading_sigma_mA
    used = (result.measured_mA.max(axis=1) > 3.0 * noise_mA) == result.lit
    squares = (((result.modelled_mA - result.measured_mA) / noise_mA) ** 2).sum(axis=1)
    parameters = parametrization(session.nominal, settings.free_names, settings.prior_sigma)
    value = {p.name: p.value / TO_UNIT.get(p.name, 1.0) for p in result.parameters}
    shift = parameters.shifts(np.array([value.get(name, 0.0) for name in MODEL]))
    return float(np.minimum(squares, limit)[used].sum() + shift @ shift)
