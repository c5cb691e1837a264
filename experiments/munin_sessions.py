"""The five synthetic Munin sessions against their truth and against independent Cramer-Rao bounds.

Classic sets (`als` ... `alsI0J`, with the specular albedo also free) with what is not free fixed at the truth, then
everything free; d and e blind with everything free, e tumbling. Prints a table, writes JSON and a picture.

    .venv/bin/python experiments/munin_sessions.py --out munin-sessions
"""

import argparse
import json
import time
from pathlib import Path

import jax
import numpy as np

SPECULAR = "albedo.specular"
EVERYTHING = "magnet,rods,imax,inertia,albedo.specular"
NOMINAL_INERTIA = 0.05283  # kg m2, unit of the inertia bounds
NOMINAL_MAGNET = 0.3  # A m2, unit of the dipole bounds

# 1-sigma bounds computed by another program: forward-mode derivatives of its own model, noise sqrt(2^2 + 1/12) mA.
# Attitude about x y z [deg], dipole [0.3 A m2], rods [A m2], I_max [mA], inertia xx yy zz xy xz yz [0.05283 kg m2].
BOUNDS = [
    ("a", "als", {"attitude": (0.136, 0.135, 0.134), "s": 0.0070}),
    ("b", "als", {"attitude": (0.128, 0.123, 0.111), "s": 0.0044}),
    ("c", "als", {"attitude": (0.127, 0.103, 0.103), "s": 0.0046}),
    ("b", "alsI0", {"attitude": (0.132, 0.153, 0.165), "magnet": (0.00056, 0.0012, 0.0011), "s": 0.0044}),
    ("a", "alsI23", {"attitude": (0.143, 0.143, 0.136), "rods": (0.0028, 0.0027), "s": 0.0070}),
    ("b", "alsI23", {"attitude": (0.133, 0.125, 0.143), "rods": (0.0035, 0.0033), "s": 0.0044}),
    ("c", "alsI23", {"attitude": (0.131, 0.116, 0.150), "rods": (0.0015, 0.0015), "s": 0.0046}),
    ("b", "alsImax", {"attitude": (0.129, 0.123, 0.111), "imax": 0.33, "s": 0.0055}),
    (
        "b",
        "alsJ",
        {
            "attitude": (0.151, 0.199, 0.213),
            "inertia": (0.0010, 0.0059, 0.0072, 0.0011, 0.0010, 0.0055),
            "s": 0.0044,
        },
    ),
    (
        "c",
        "alsJ",
        {
            "attitude": (0.169, 0.215, 0.199),
            "inertia": (0.0009, 0.0045, 0.0041, 0.0011, 0.0010, 0.0031),
            "s": 0.0046,
        },
    ),
    (
        "b",
        "alsI0J",
        {
            "attitude": (0.184, 0.219, 0.257),
            "magnet": (None, 0.0043, 0.0035),
            "inertia": (0.0011, 0.0061, 0.0072, 0.0038, 0.0031, 0.0056),
            "s": 0.0045,
        },
    ),
    (
        "a",
        EVERYTHING,
        {
            "attitude": (0.188, 0.313, 0.253),
            "magnet": (None, 0.0039, 0.0038),
            "rods": (0.0069, 0.0055),
            "imax": 0.46,
            "inertia": (0.013, 0.014, 0.018, 0.0031, 0.0030, 0.0058),
            "s": 0.0117,
        },
    ),
    (
        "b",
        EVERYTHING,
        {
            "attitude": (0.187, 0.239, 0.302),
            "magnet": (None, 0.0044, 0.0039),
            "rods": (0.0071, 0.0081),
            "imax": 0.33,
            "inertia": (0.0084, 0.017, 0.015, 0.0038, 0.0031, 0.0057),
            "s": 0.0056,
        },
    ),
    (
        "c",
        EVERYTHING,
        {
            "attitude": (0.188, 0.222, 0.246),
            "magnet": (None, 0.0023, 0.0026),
            "rods": (0.0030, 0.0028),
            "imax": 0.32,
            "inertia": (0.0064, 0.0089, 0.0081, 0.0018, 0.0018, 0.0037),
            "s": 0.0057,
        },
    ),
    ("a", "state (no albedo)", {}),
    ("b", "magnet,rods,imax,inertia,albedo", {}),
    ("c", "magnet,rods,imax,inertia,albedo", {}),
    ("d", "magnet,rods,imax,inertia,albedo", {}),
    ("e", "magnet,rods,imax,inertia,albedo", {}),
]
FILES = {
    "a": "a-nominal-exact",
    "b": "b-specular50",
    "c": "c-specular50-limited",
    "d": "d-mixed-albedo",
    "e": "e-tumbling",
}


def satellite_at_truth(truth: dict, free: str, *, blind: bool) -> dict[str, object]:
    """Keys of a satellite file: the truth for what is not free, the paper's nominal satellite for what is.

    Where magnet and inertia are both free the common scale is the truth's |magnet|; `blind` gives nothing away but it.
    """
    from fitting.parameters.chosen import chosen_leaves
    from jaxsat.satellites import read_satellite

    cfg, munin = truth["cfg"], read_satellite()
    names = chosen_leaves(munin.leaves, free.split(","), munin.aliases)
    given: dict[str, object] = {}
    if not any(name.startswith("magnet") for name in names):
        given["spacecraft.magnet_A_m2"] = [float(m) for m in cfg["magnet"]]
    elif any(name.startswith("inertia") for name in names):
        given["spacecraft.magnet_modulus_A_m2"] = float(np.linalg.norm(cfg["magnet"]))
    if blind:
        return given
    if "rods.y" not in names:
        given["spacecraft.rods_A_m2"] = cfg["rods"]
    if "imax" not in names:
        given["spacecraft.imax_mA"] = cfg["imax"]
    if "inertia.xx" not in names:
        J = cfg["inertia"]
        given["spacecraft.inertia_kg_m2"] = {
            "xx": J[0][0], "yy": J[1][1], "zz": J[2][2], "xy": J[0][1], "xz": J[0][2], "yz": J[1][2],
        }  # fmt: skip
    if "albedo.specular" not in names:
        given["albedo.specular"] = cfg["albedo_specular"]
    if "albedo.diffuse" not in names:
        given["albedo.diffuse"] = cfg["albedo_diffuse"]
    return given


def true_values(cfg: dict) -> dict[str, float]:
    """Values of the truth by the names of fit.json."""
    J = cfg["inertia"]
    values = dict(zip(("magnet.x", "magnet.y", "magnet.z"), cfg["magnet"], strict=True))
    values |= dict(zip(("rods.y", "rods.z"), cfg["rods"], strict=True))
    values |= {"imax": cfg["imax"], "albedo.specular": cfg["albedo_specular"], "albedo.diffuse": cfg["albedo_diffuse"]}
    places = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    return values | {f"inertia.{key}": J[i][k] for key, (i, k) in places.items()}


def bound_of(name: str, bounds: dict) -> float | None:
    """The independent 1-sigma bound of a parameter in its own unit, None where there is none."""
    group, _, axis = name.partition(".")
    if name == "imax":
        return bounds.get("imax")
    if name == SPECULAR:
        return bounds.get("s")
    order = {"magnet": "x y z", "rods": "y z", "inertia": "xx yy zz xy xz yz"}.get(group, "").split()
    if group not in bounds or axis not in order:
        return None
    value = bounds[group][order.index(axis)]
    unit = {"magnet": NOMINAL_MAGNET, "inertia": NOMINAL_INERTIA}.get(group, 1.0)
    return None if value is None else value * unit


def run(session: str, free: str, bounds: dict) -> dict:
    """One fit, compared with its truth."""
    import fitting
    from jaxsat.bundled import BUNDLED
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry

    path = BUNDLED.parent / f"{FILES[session]}.RAW_SUN"
    truth = json.loads(path.with_suffix(".truth.json").read_text())
    if free == "state (no albedo)":
        words = "state"
    else:
        words = f"{free},{SPECULAR}" if free.startswith("als") else free
    changed = satellite_at_truth(truth, words, blind=not bounds and words != "state")
    satellite = read_satellite(changed=changed)
    session_read = read_telemetry(path, satellite)
    began = time.perf_counter()
    found = fitting.fit(satellite, session_read, free=words, causes=False)
    result, cells = found.result, found.result.channels["cells"]
    seconds = time.perf_counter() - began

    index = [int(np.argmin(np.abs(np.array(truth["t"]) - t))) for t in result.t_s]
    overlap = np.abs(np.sum(np.array(truth["q"])[index] * result.quaternion_inertial_from_body, axis=1))
    angle = np.degrees(2 * np.arccos(np.minimum(overlap, 1.0)))
    field_error = np.abs(np.array(truth["theta"])[index] - result.field_angle_deg)
    true = true_values(truth["cfg"])
    rows = {}
    for p in result.parameters:
        if p.free:
            bound = bound_of(p.name, bounds)
            rows[p.name] = {
                "value": p.value,
                "sigma": p.sigma,
                "truth": true[p.name],
                "bound": bound,
                "error_over_bound": (p.value - true[p.name]) / (bound or p.sigma or np.nan),
                "sigma_over_bound": p.sigma / bound if bound and p.sigma else None,
            }
    attitude = bounds.get("attitude")
    return {
        "session": FILES[session],
        "free": free,
        "status": result.status,
        "message": result.message,
        "chi2": result.chi2,
        "dof": result.dof,
        "attitude_rms_deg": float(np.sqrt(np.mean(angle**2))),
        "field_angle_max_error_deg": float(field_error.max()),
        "left_out_s": cells.t_s[~cells.used].tolist(),
        "attitude_sigma_over_bound": (result.attitude_sigma_deg[0] / np.array(attitude)).tolist() if attitude else None,
        "seconds": seconds,
        "parameters": rows,
    }


def table(runs: list[dict]) -> str:
    """Markdown: one line a fit."""
    lines = [
        "| session | free | status | attitude RMS, deg | field angle max, deg | worst error / bound "
        "| sigma / bound | time, s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for r in runs:
        bounded = {k: v for k, v in r["parameters"].items() if v["bound"]}
        shown = bounded or r["parameters"]
        errors = {name: abs(v["error_over_bound"]) for name, v in shown.items() if np.isfinite(v["error_over_bound"])}
        worst = max(errors, key=lambda name: errors[name]) if errors else None
        sigmas = [v["sigma_over_bound"] for v in bounded.values() if v["sigma_over_bound"]]
        sigmas += r["attitude_sigma_over_bound"] or []
        lines.append(
            f"| {r['session'][0]} | {r['free']} | {r['status']} | {r['attitude_rms_deg']:.2f} "
            f"| {r['field_angle_max_error_deg']:.2f} "
            f"| {f'{errors[worst]:.1f} ({worst})' if worst else ''}{'' if bounded or not worst else ' of sigma'} "
            f"| {f'{min(sigmas):.2f} ... {max(sigmas):.2f}' if sigmas else ''} | {r['seconds']:.1f} |"
        )
    return "\n".join(lines)


def picture(runs: list[dict], path: Path) -> None:
    """Errors over independent bounds of every parameter of every fit, with the three-sigma limits."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    bounded = [r for r in runs if any(v["bound"] for v in r["parameters"].values())]
    figure = Figure(figsize=(10, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for column, r in enumerate(bounded):
        values = [(k, v["error_over_bound"]) for k, v in r["parameters"].items() if v["bound"]]
        spread = np.linspace(-0.3, 0.3, len(values)) if len(values) > 1 else [0.0]
        axes.plot(column + np.array(spread), [v for _, v in values], "o", ms=4, color="tab:blue")
    axes.axhspan(-1, 1, color="tab:green", alpha=0.15, label="1 bound")
    axes.axhline(3, color="tab:red", lw=0.8, label="3 bounds")
    axes.axhline(-3, color="tab:red", lw=0.8)
    labels = [f"{r['session'][0]}: {'everything' if r['free'] == EVERYTHING else r['free']}" for r in bounded]
    axes.set_xticks(range(len(bounded)), labels, rotation=35, ha="right")
    axes.set_ylabel("(fitted - truth) / Cramér-Rao bound")
    axes.set_title("Synthetic Munin sessions: errors of every fitted parameter over independent 1σ bounds")
    axes.legend(loc="upper right")
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("munin-sessions"), help="directory for results")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    runs = []
    for session, free, bounds in BOUNDS:
        runs.append(run(session, free, bounds))
        print(table(runs[-1:]).splitlines()[-1], flush=True)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "munin_sessions.json").write_text(json.dumps(runs, indent=1))
    picture(runs, arguments.out / "munin_sessions.png")
    print("\n" + table(runs))


if __name__ == "__main__":
    main()
