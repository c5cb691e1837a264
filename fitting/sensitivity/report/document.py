"""The file sensitivity.json (schema `jaxsat.sensitivity/1`), and the verdict in words."""

from dataclasses import asdict
from typing import Any

import numpy as np

from fitting.parameters.null_space import Direction
from fitting.sensitivity.analysis import STRONG, Sensitivity
from fitting.sensitivity.contributions import Contribution
from jaxsat.files.json_files import plain
from jaxsat.significant import value_text

SCHEMA = "jaxsat.sensitivity/1"
HELD = 0.7
"""Share of its prior sigma from which a number is called held by its prior."""


def document(found: Sensitivity, *, subject: str, epoch_utc: str) -> dict[str, Any]:
    """Returns the content of sensitivity.json; `subject` is the satellite file or the run."""
    t = found.vantage.samples.t
    noise, assumed = found.attitude_sigma_deg
    rms = found.attitude_rms_deg
    content = {
        "schema": SCHEMA,
        "subject": subject,
        "epoch_utc": epoch_utc,
        "verdict": verdict(found),
        "regular": found.regular,
        "samples": len(t),
        "arc_s": float(t[-1] - t[0]),
        "parameters": {
            row.name: {
                "value": row.value,
                "unit": row.unit,
                "sigma": row.sigma,
                "sigma_noise": row.sigma_noise,
                "sigma_assumed": row.sigma_assumed,
                "sigma_prior": row.prior,
            }
            for row in found.quoted.rows
        },
        "considered": {
            name: {"sigma": float(sigma * leaf.to_unit), "unit": leaf.unit}
            for name, sigma in zip(found.choice.considered, found.choice.sigma, strict=True)
            for leaf in found.vantage.satellite.leaves
            if leaf.name == name
        },
        "bias_per_unit": found.bias_per_unit(),
        "attitude": {
            "rms_deg": {"noise": rms[0], "assumed": rms[1], "total": rms[2]} if found.vantage.free_motion else None,
            "t_s": t,
            "sigma_noise_deg": noise,
            "sigma_assumed_deg": assumed,
        },
        "correlations": [{"of": a, "with": b, "value": value} for a, b, value in found.correlations],
        "null_space": [direction.as_dict() for direction in found.unseen],
        "gauge": found.choice.parameters.gauge_text,
        "worst": [{"words": w.words, "sigma_in_priors": w.sigma, "components": w.components} for w in found.worst],
        "linearity": [
            {"words": each.words, "second_order": each.second_order, "holds_to_sigmas": each.holds_to}
            for each in found.linearity
        ],
        "contributions": {
            "priors": found.contributions.priors,
            "channels": _contributions(found, found.contributions.channels),
            "parts": _contributions(found, found.contributions.parts),
            "samples": found.contributions.samples,
        },
        "sampling": None if found.sampling is None else _sampling(found),
        "without_last_tenth": None if found.without_end is None else asdict(found.without_end),
        "without_derivative": list(found.vantage.slopes.lost),
        "timing_s": dict(found.timing_s),
    }
    return plain(content)[0]


def verdict(found: Sensitivity) -> list[str]:
    """What limits accuracy, in sentences, the most important first."""
    lines = []
    noise, assumed, total = found.attitude_rms_deg
    if found.vantage.free_motion:
        because = "noise" if noise >= assumed else "what is only assumed"
        shares = f" ({value_text(noise, 3)} from noise, {value_text(assumed, 3)} from what is assumed)"
        by = f": {because} limits it{shares}" if found.choice.considered else ", from noise"
        lines.append(f"attitude known to {value_text(total, 3)} deg RMS over the arc{by}")
    state = "regular" if found.regular else "not regular"
    reasons = [f"{d.name} {'is told by nothing' if d.blind else 'is hardly told'}" for d in found.told_by_priors]
    bent = [each for each in found.linearity if each.holds_to < 1.0]
    reasons += [f"along {each.words} the linear picture holds to {value_text(each.holds_to, 2)} sigma" for each in bent]
    lines.append(f"the problem is {state}" + (f": {'; '.join(reasons)}" if reasons else _straight(found)))
    lines += [f"held by definition: {d.held_by}, for {d.name} is told by nothing" for d in _by_definition(found)]
    lines += _ahead(found)
    held = [row.name for row in found.quoted.rows if row.prior is not None and row.sigma_noise > HELD * row.prior]
    if held:
        lines.append(f"held by their priors: {', '.join(held)}")
    lost = [row for row in found.quoted.rows if row.sigma_assumed > row.sigma_noise]
    if lost:
        lines.append(f"more from what is assumed than from noise: {', '.join(row.name for row in lost)}")
    if found.worst:
        lines.append(f"worst known: {found.worst[0].words}")
    strong = [f"{a} and {b} ({value:+.3f})" for a, b, value in found.correlations if abs(value) > STRONG]
    if strong:
        lines.append(f"hardly told apart: {', '.join(strong[:4])}")
    return lines


def _ahead(found: Sensitivity) -> list[str]:
    """Whether a fit would predict: what the data tell of it, and by what it would miss what it has not seen."""
    told = found.without_end
    if told is None:
        return []
    state = "tuned to its data" if told.tuned else "predicts" if told.predicts else "hardly predicts"
    return [
        f"without the last tenth of the arc a fit {state}: its own error there is {value_text(told.ahead, 2)} of the "
        f"noise, and data tell {value_text(told.by_data, 3)} of {told.unknowns} fitted numbers"
    ]


def _by_definition(found: Sensitivity) -> list[Direction]:
    return [each for each in found.unseen if each not in found.told_by_priors]


def _straight(found: Sensitivity) -> str:
    least = min((each.holds_to for each in found.linearity), default=np.inf)
    return (
        f", the linear picture holds to {value_text(min(least, 100.0), 2)}{' or more' if least > 100.0 else ''} sigma"
    )


def _contributions(found: Sensitivity, each: tuple[Contribution, ...]) -> list[dict[str, Any]]:
    names = [row.name for row in found.quoted.rows]
    return [
        {
            "name": one.name,
            "readings": one.readings,
            "share": one.share,
            "attitude_rms_deg_without": one.attitude_deg if found.vantage.free_motion else None,
            "sigma_without": dict(zip(names, one.sigma.tolist(), strict=True)),
        }
        for one in each
    ]


def _sampling(found: Sensitivity) -> dict[str, Any]:
    own = found.sampling
    assert own is not None
    names = [row.name for row in found.quoted.rows]
    return {
        "arcs_s": own.arcs_s,
        "intervals_s": own.intervals_s,
        "samples": own.samples,
        "attitude_rms_deg": np.degrees(own.sigmas.attitude),
        "sigma": {name: own.sigmas.total[..., k] for k, name in enumerate(names)},
    }
