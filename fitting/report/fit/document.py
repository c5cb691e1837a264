"""The file fit.json of a fit of any satellite (schema `jaxsat.fit/1`)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from fitting.outcome.diagnostics import diagnose
from fitting.outcome.result import ChannelFit, FitResult, Holdout
from fitting.outcome.witness import Witness
from jaxsat.files.json_files import plain
from jaxsat.telemetry import RejectedRow
from jaxsat.time import Epoch

if TYPE_CHECKING:
    from fitting.profile.profile import Profile

SCHEMA = "jaxsat.fit/1"
TIMINGS = ("import", "prepare", "compile", "solve", "total")
MILLIAMPERES = {"A": 1e3, "mA": 1.0, "uA": 1e-3}


def fit_document(
    result: FitResult,
    *,
    telemetry: str,
    epoch: Epoch,
    rejections: Iterable[RejectedRow] = (),
    orbit: Mapping[str, Any] | None = None,
    profiles: Sequence["Profile"] = (),
) -> tuple[dict[str, Any], list[str]]:
    """Returns the content of fit.json, and the places in it where a number that is not finite became null.

    `orbit` are states at the times of the attitude, as `orbit_document` of `surroundings` gives them.
    """
    counts: dict[str, int] = {}
    for rejection in rejections:
        counts[rejection.reason] = counts.get(rejection.reason, 0) + 1
    held = {
        name: holdout_document(c.holdout, c.unit) for name, c in result.channels.items() if c.holdout and not c.witness
    }
    asked = {name: Witness.of(c) for name, c in result.channels.items()}
    witness = {name: witness_document(each) for name, each in asked.items() if each is not None}
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "telemetry": telemetry,
        "epoch_utc": epoch.iso(3),
        "status": result.status,
        "message": result.message,
        "verdict": [result.verdict, result.message, *result.remarks],
        "chi2": result.chi2,
        "dof": result.dof,
        **_panel_rms(result.channels),
        "residual_rms": {name: {"value": c.rms, "unit": c.unit} for name, c in result.channels.items()},
        "holdout": held or None,
        "witness": witness or None,
        "parameters": {
            p.name: {"value": p.value, "sigma": p.sigma if p.free else None, "unit": p.unit, "free": p.free}
            for p in result.parameters
        },
        "gauge": result.gauge,
        "unseen": [direction.as_dict() for direction in result.unseen],
        "buys": dict(result.buys),
        "correlations": {name: dict(row) for name, row in result.correlations.items()},
        "axes": {name: list(axes) for name, axes in result.axes.items()},
        "alternatives": list(result.alternatives),
        "causes": [asdict(cause) for cause in result.causes],
        "delays": delays(result),
        "breaks": [break_document(name, c) for name, c in result.channels.items() if c.breaks],
        "channels": {name: channel_document(c) for name, c in result.channels.items()},
        "rejections": dict(sorted(counts.items(), key=lambda item: -item[1])),
        "attitude": {
            "t_s": result.t_s,
            "quaternion_inertial_from_body": result.quaternion_inertial_from_body,
            "angular_velocity_rad_s": result.angular_velocity_rad_s,
            "attitude_sigma_deg": result.attitude_sigma_deg,
            "field_angle_deg": result.field_angle_deg,
            "field_angle_sigma_deg": result.field_angle_sigma_deg,
            "fitted": result.fitted.astype(bool),
        },
        **({} if orbit is None else {"orbit": dict(orbit)}),
        "diagnostics": diagnose(result).as_dict(),
        "profiles": {p.name: p.as_dict() for p in profiles},
        "timing_s": {name: result.timing_s.get(name, 0.0) for name in TIMINGS},
    }
    return plain(document)


def holdout_document(held: Holdout, unit: str) -> dict[str, Any]:
    """How well a channel was predicted."""
    return {
        "rms": held.rms,
        "unit": unit,
        "promised_rms": held.promised_rms,
        "sigma_ratio": held.sigma_ratio,
        "angle_deg": held.angle_deg,
        "count": held.count,
        "outliers": held.outliers,
        "directions": held.directions,
    }


def witness_document(witness: Witness) -> dict[str, Any]:
    """Whether a sensor that was not fitted confirms the motion, and by which numbers."""
    held = witness.holdout
    numbers = {"outliers": witness.outliers} if held is None else holdout_document(held, witness.unit)
    wish = None if witness.wish is None else asdict(witness.wish)
    return {"confirms": not witness.denies, "says": witness.text, **numbers, "wish": wish}


def break_document(name: str, channel: ChannelFit) -> dict[str, Any]:
    """From when on constant changes of a sensor explain what is left."""
    changes = [
        {"t_s": b.t_s, "turn_deg": b.turn_deg, "bias": b.bias, "saving": b.saving, "left": list(b.left)}
        for b in channel.breaks
    ]
    return {"channel": name, "unit": channel.unit, "breaks": changes}


def channel_document(channel: ChannelFit) -> dict[str, Any]:
    """What a channel is, and how it was used; the readings themselves stand in its table."""
    fitted, used = channel.fitted.astype(bool), channel.used.astype(bool)
    return {
        "kind": channel.kind,
        "role": "witness" if channel.witness else "fitted",
        "columns": list(channel.columns),
        "unit": channel.unit,
        "sigma": channel.sigma,
        "samples": len(fitted),
        "samples_fitted": int((fitted & used).sum()),
        "samples_left_out": int((fitted & ~used).sum()),
        "samples_held_out": int((~fitted).sum()),
        "chi2_per_reading": channel.chi2_per_reading,
        "angle_deg": channel.angle_deg,
    }


def delays(result: FitResult) -> dict[str, dict[str, Any]]:
    """Stamp minus instant of each channel: as fitted, else as the residuals show it; s."""
    fitted = {p.name: p for p in result.parameters if p.free}
    found: dict[str, dict[str, Any]] = {}
    for name, channel in result.channels.items():
        own = fitted.get(channel.delay_name or f"{name}.delay")
        if own is not None:
            found[name] = {"value": own.value, "sigma": own.sigma, "unit": own.unit, "from": "fit"}
        elif channel.delay_s is not None:
            value = {"value": channel.delay_s, "sigma": channel.delay_sigma_s}
            found[name] = {**value, "unit": "s", "from": "residuals"}
    return found


def _panel_rms(channels: Mapping[str, ChannelFit]) -> dict[str, float | None]:
    """That of the panel currents where there is one such channel, as fits of six panels have it."""
    panels = [c for c in channels.values() if c.kind == "Panels" and c.unit in MILLIAMPERES]
    if len(panels) != 1:
        return {}
    rms = panels[0].rms
    return {"residual_rms_mA": None if rms is None else rms * MILLIAMPERES[panels[0].unit]}
