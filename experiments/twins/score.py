"""A finished fit against the truth: attitude, parameters over their sigmas, axes, and whether the fit knew.

`score` takes the document of fit.json and that of a truth file. What it needs of the former: `epoch_utc`, `status`,
`attitude` (`t_s`, `quaternion_inertial_from_body`, and if it is there `attitude_sigma_deg` about the body's axes),
`parameters`, and if they are there `axes` (what was found for sensors of unknown axes) and `alternatives`.
"""

import datetime as dt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

Array = NDArray[np.float64]

REACHED_DEG, REACHED_SIGMAS = 3.0, 5.0
"""RMS attitude error of a fit that is at the truth: one of the two, in degrees or over its own sigma."""
HELD = "held by its prior"
"""Note of a parameter that the data say nothing of."""
UNITS = {
    **{"deg": np.pi / 180.0, "deg/s": np.pi / 180.0, "nT": 1e-9, "uT": 1e-6, "mT": 1e-3, "G": 1e-4, "mA": 1e-3},
    **{"mA m2": 1e-3, "ms": 1e-3},
}
"""SI over the units that a fit may state; any other is SI itself."""


def score(fit: dict[str, Any], truth: dict[str, Any], *, holdout: float = 0.0) -> dict[str, Any]:
    """What one fit is worth; angles in degrees, `z` the errors of all free parameters over their sigmas."""
    t = np.array(fit["attitude"]["t_s"], float)
    error = attitude_error(fit, truth)
    fitted = t <= t[-1] - holdout * (t[-1] - t[0]) + 1e-9
    row: dict[str, Any] = {"session": truth["name"], "status": fit["status"], "verdict": fit.get("verdict")}
    row |= {"attitude_deg": _rms(error[fitted]), "worst_deg": float(np.linalg.norm(error[fitted], axis=1).max())}
    row["held_out_deg"] = _rms(error[~fitted]) if not fitted.all() else None
    sigma = fit["attitude"].get("attitude_sigma_deg")
    if sigma is not None:
        sigma = np.array(sigma, float)
        row |= {"sigma_deg": _rms(sigma[fitted]), "attitude_z": float(np.sqrt(np.mean((error / sigma)[fitted] ** 2)))}
        row["held_out_sigma_deg"] = _rms(sigma[~fitted]) if not fitted.all() else None
    row |= {"z": errors_over_sigma(fit, truth), "axes": axes_found(fit, truth)}
    row["held"] = [name for name, each in fit["parameters"].items() if each.get("note") == HELD]
    within = sigma is not None and row["attitude_deg"] <= REACHED_SIGMAS * row["sigma_deg"]
    row["within_sigmas"] = bool(within)
    row["reached"] = bool(row["attitude_deg"] <= REACHED_DEG or within)
    row["silent"] = fit["status"] == "converged" and (not row["reached"] or row["axes"] == "wrong")
    return row


def _rms(vectors: Array) -> float:
    """Of lengths of vectors [n 3]."""
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def attitude_error(fit: dict[str, Any], truth: dict[str, Any]) -> Array:
    """Small turn from the true attitude to the fitted one at each sample of the fit, body axes [n 3], deg.

    Raises ValueError where the truth does not reach that far.
    """
    start = dt.datetime.fromisoformat(fit["epoch_utc"]) - dt.datetime.fromisoformat(truth["epoch_utc"])
    t = np.array(fit["attitude"]["t_s"], float) + start.total_seconds()
    # The stamps of the table themselves are between the nodes of the fine truth.
    times, first = np.unique(np.round([*truth["t"], *truth["fine"]["t"]], 6), return_index=True)
    path = Slerp(times, Rotation.from_quat(np.array([*truth["q"], *truth["fine"]["q"]])[first], scalar_first=True))
    found = Rotation.from_quat(np.array(fit["attitude"]["quaternion_inertial_from_body"]), scalar_first=True)
    return np.degrees((path(np.round(t, 6)).inv() * found).as_rotvec())


def errors_over_sigma(fit: dict[str, Any], truth: dict[str, Any]) -> dict[str, float]:
    """(value - truth) / sigma of the free parameters that the truth names; rates refer to another time and are left."""
    z = {}
    for name, each in fit["parameters"].items():
        true = truth["parameters"].get(name)
        if true is not None and each["free"] and each["sigma"] and not name.startswith("rate."):
            factor = UNITS.get(each["unit"], 1.0)
            z[name] = (factor * each["value"] - true["value"]) / (factor * each["sigma"])
    return z


def axes_found(fit: dict[str, Any], truth: dict[str, Any]) -> str | None:
    """`found`, `listed` among the alternatives of a fit that calls itself ambiguous, or `wrong`; None: none unknown."""
    found = fit.get("axes") or {}
    if not found:
        return None
    true = {name: truth["sensors"][name]["axes"] for name in found}
    if all(list(found[name]) == true[name] for name in found):
        return "found"
    others = [other["axes"] for other in fit.get("alternatives", ()) if other.get("axes")]
    return "listed" if fit["status"] == "ambiguous" and true in others else "wrong"


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts of a study, and root mean squares of z over the sessions that are at the truth."""
    scored = [row for row in rows if "attitude_deg" in row]
    good = [row for row in scored if row["reached"]]
    z: dict[str, list[float]] = {}
    for row in good:
        for name, value in row["z"].items():
            z.setdefault(name, []).append(value)
    measured = [value for row in good for name, value in row["z"].items() if name not in row["held"]]
    everything = [value for values in z.values() for value in values]
    attitude = [row["attitude_z"] for row in good if "attitude_z" in row]
    statuses = [row["status"] for row in rows]
    return {
        "sessions": len(rows),
        "reached": len(good),
        "within_sigmas": sum(row["within_sigmas"] for row in scored),
        "silent": sum(row["silent"] for row in scored),
        "statuses": {status: statuses.count(status) for status in sorted(set(statuses))},
        "axes": {word: sum(row["axes"] == word for row in scored) for word in ("found", "listed", "wrong")},
        "attitude_deg_median": _quantile([row["attitude_deg"] for row in good], 0.5),
        "attitude_deg_95": _quantile([row["attitude_deg"] for row in good], 0.95),
        "attitude_z_rms": _root(attitude),
        "z_rms": _root(everything),
        "z_rms_measured": _root(measured),
        "z_beyond_3.5": sum(abs(value) > 3.5 for value in everything),
        "z_count": len(everything),
        "z_rms_of": {name: _root(values) for name, values in sorted(z.items())},
        "seconds_median": _quantile([row["seconds"] for row in scored if "seconds" in row], 0.5),
    }


def _root(values: list[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None


def _quantile(values: list[float], share: float) -> float | None:
    return float(np.quantile(values, share)) if values else None
