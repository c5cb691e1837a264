"""Figures 9 to 29 of Penkov et al. 2009: the paper's way and ours on the same synthetic currents, with no first guess.

The currents hold 50 % of mirrored light and no noise, as the paper's do (`--noise` adds it). Its way has no albedo in
the model and adaptive weights (`fitting.solvers.adaptive`); ours frees the albedo and estimates which samples were
limited.

    .venv/bin/python experiments/blind/paper_figures.py --out munin-paper

Writes table.json, figures.png (angle of body x to the field) and residuals.png (figures 14, 16, 18).
"""

import argparse
import datetime as dt
import json
from pathlib import Path
from typing import Any

import jax
import numpy as np
from motion import simulate
from paper_settings import LIMITED, NOMINAL_TRUTH, SETTINGS, START_DEG, Setting
from rich.progress import track
from scipy.spatial.transform import Rotation
from surroundings import greenwich_angle, kepler, magnetic_field

import fitting
from fitting.outcome.result import FitResult
from fitting.settings import AdaptiveRules, FitSettings
from jaxsat.given import Earth, Given
from jaxsat.panel_names import PANEL_NAMES
from jaxsat.plotting.style import INK, dress, new_figure
from jaxsat.satellites import read_numbers
from jaxsat.satellites.described import Readings, described
from jaxsat.telemetry import Channel, TableSession
from jaxsat.time import Epoch

jax.config.update("jax_enable_x64", True)

SHOWN = ("rods", "imax", "magnet")
RESIDUALS = {"13, 14": ("14", "+x", "-x"), "15, 16": ("16", "+x", "-x"), "17, 18": ("18", "+z", "-z")}
"""Figures of residual currents by the figures of their settings, and the two panels that they show."""
COLOURS = {"paper": "#c0392b", "ours": "#2340a8"}
BODY = ("xx", "yy", "zz", "xy", "xz", "yz")
WAYS = {
    "paper": (AdaptiveRules(on=True), {}),
    "ours": (AdaptiveRules(), {"albedo.specular": 0.3}),
}
"""Rules of the weights, and what of the nominal satellite is other than in the setting."""


def truth_of(setting: Setting) -> dict[str, Any]:
    """The true session, x axis `START_DEG` from the field at the start."""
    cfg = {**NOMINAL_TRUTH, **setting.truth}
    start = dt.datetime.fromisoformat(cfg["start"])
    zero = np.zeros(1)
    position, _ = kepler(cfg["elements"], zero)
    field = magnetic_field(position, start, zero, greenwich_angle(start))[0]
    along = field / np.linalg.norm(field)
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    x = Rotation.from_rotvec(np.radians(START_DEG) * across).apply(along)
    dcm = np.stack([x, across, np.cross(x, across)], axis=1)
    return simulate({**cfg, "q0": Rotation.from_matrix(dcm).as_quat(scalar_first=True).tolist()})


def measured(truth: dict[str, Any], setting: Setting, noise_mA: float, seed: int) -> np.ndarray:
    """[time 6] currents [mA]: clean, limited where the setting says so, noisy where something shines on the panel."""
    clean, t = truth["currents_clean"].copy(), truth["t"]
    if setting.limited:
        inside = (t >= LIMITED["from_s"]) & (t <= LIMITED["to_s"])
        clean[inside] *= np.repeat(LIMITED["factors"], 2)
    noise = noise_mA * np.random.default_rng(seed).normal(size=clean.shape)
    return np.where(clean > 0.0, np.maximum(clean + noise, 0.0), 0.0)


def fitted(truth: dict[str, Any], currents_mA: np.ndarray, setting: Setting, way: str) -> FitResult:
    """The fit of the setting's arc."""
    free = (setting.free, "albedo.specular") if way == "ours" else (setting.free,)
    adaptive, changed = WAYS[way]
    numbers = read_numbers(changed={**changed, **setting.nominal})
    satellite = described(numbers, readings=Readings(quantum_mA=0.0))
    inside = truth["t"] <= setting.until_s
    cfg, t = truth["cfg"], truth["t"][inside]
    epoch = Epoch.from_iso(cfg["start"])
    position, velocity = kepler(cfg["elements"], t)
    session = TableSession(
        paths=(Path(f"figures {setting.figures}"),),
        sha256=(),
        epoch=epoch,
        channels={"cells": Channel.of("cells", satellite.channels["cells"], t, currents_mA[inside])},
        columns={},
        rejections=(),
        remarks=(),
        positions=(t, position),
        velocities=velocity,
    )
    # The true angle, which is not quite that of our own time scales.
    angle = float(np.degrees(greenwich_angle(dt.datetime.fromisoformat(cfg["start"]))))
    given = Given(earth=Earth(greenwich_angle_deg=(angle + 180.0) % 360.0 - 180.0))
    return fitting.fit(
        satellite, session, free=free, settings=FitSettings(adaptive=adaptive), given=given, causes=False
    ).result


def principal(values: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments and axes of six entries."""
    xx, yy, zz, xy, xz, yz = (values[f"inertia.{name}"] for name in BODY)
    return np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def judged(truth: dict[str, Any], result: FitResult) -> dict[str, Any]:
    """What the table says of a fit."""
    k = np.searchsorted(truth["t"], result.t_s - 1e-6)
    overlap = np.abs(np.sum(result.quaternion_inertial_from_body * truth["q"][k], axis=1))
    row: dict[str, Any] = {
        "status": result.status,
        "attitude_max_deg": float(np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0))).max()),
        "field_angle_max_deg": float(np.abs(result.field_angle_deg - truth["theta"][k]).max()),
        "left_out": int((~result.channels["cells"].used).sum()),
    }
    values = {p.name: p.value for p in result.parameters}
    row["values"] = {p.name: [p.value, p.sigma] for p in result.parameters if p.free}
    if "inertia.xx" in row["values"]:
        moments, axes = principal(values)
        true = np.array(truth["cfg"]["inertia"])
        true_moments, true_axes = np.linalg.eigh(true)
        row["moments_relative"] = np.abs(moments / true_moments - 1.0).tolist()
        cosine = np.abs(np.sum(axes * true_axes, axis=0))
        row["axes_deg"] = np.degrees(np.arccos(np.minimum(cosine, 1.0))).tolist()
    return row


def picture(cases: list[dict[str, Any]], path: Path) -> None:
    """Angle of body x to the field in every figure: true, the paper's way, ours; settings of one figure together."""
    figures: dict[str, list[dict[str, Any]]] = {}
    for case in cases:
        figures.setdefault(case["setting"].figures, []).append(case)
    columns, rows = 4, -(-len(figures) // 4)
    figure = new_figure(
        14.0,
        2.2 * rows + 0.6,
        "Angle of body x to the magnetic field, deg",
        "synthetic currents with 50 % mirrored light; true, by the paper's way, by ours",
    )
    top = 1.0 - 0.65 / (2.2 * rows + 0.6)
    grid = figure.add_gridspec(
        rows, columns, left=0.04, right=0.99, top=top - 0.02, bottom=0.035, hspace=0.45, wspace=0.16
    )
    for number, (name, own) in enumerate(figures.items()):
        axes = figure.add_subplot(grid[number // columns, number % columns])
        dress(axes)
        truth, setting = own[0]["truth"], own[0]["setting"]
        axes.plot(truth["t"], truth["theta"], color=INK, linewidth=2.4, alpha=0.35, label="true")
        for case in own:
            imax = case["setting"].nominal.get("spacecraft.imax_mA")
            which = f", {imax:g} mA" if len(own) > 1 else ""
            for way, style in (("paper", "--"), ("ours", "-")):
                width = 1.1 if case is own[0] else 0.6
                how = {"color": COLOURS[way], "linewidth": width, "label": f"{way}{which}"}
                axes.plot(case[way].t_s, case[way].field_angle_deg, style, **how)
        axes.set_title(f"fig. {name}: {setting.free}, {setting.until_s:g} s", fontsize=9)
        if number == 0 or len(own) > 1:
            axes.legend(fontsize=6, frameon=len(own) > 1, framealpha=0.8, loc="upper right")
    figure.savefig(path)


def residual_picture(cases: list[dict[str, Any]], path: Path) -> None:
    """Measured less modelled currents of a pair of panels, by the paper's way and by ours."""
    shown = [case for case in cases if case["setting"].figures in RESIDUALS]
    subtitle = "synthetic currents with 50 % mirrored light; panels with plus drawn through, with minus dashed"
    figure = new_figure(14.0, 4.2, "Residual currents, mA: figures 14, 16 and 18", subtitle)
    grid = figure.add_gridspec(1, len(shown), left=0.04, right=0.99, top=0.8, bottom=0.12, wspace=0.14)
    for number, case in enumerate(shown):
        name, *pair = RESIDUALS[case["setting"].figures]
        axes = figure.add_subplot(grid[0, number])
        for way, colour in COLOURS.items():
            cells = case[way].channels["cells"]
            for panel, style in zip(pair, ("-", "--"), strict=True):
                k = PANEL_NAMES.index(panel)
                residual = cells.measured[:, k] - cells.modelled[:, k]
                axes.plot(cells.t_s, residual, style, color=colour, linewidth=1.1, label=f"{way}, {panel}")
        axes.set_title(f"fig. {name}: {case['setting'].free}, {case['setting'].until_s:g} s", fontsize=9)
        axes.legend(fontsize=7, frameon=False)
        dress(axes, x_label="time since epoch, s")
    figure.savefig(path)


def line(row: dict[str, Any]) -> str:
    """A row of the table for a terminal."""
    shown = [(name, value) for name, (value, _) in row["values"].items() if name.split(".")[0] in SHOWN]
    extra = "".join(f" {name} {value:.5g}" for name, value in shown)
    if "moments_relative" in row:
        extra += f" moments {100 * max(row['moments_relative']):.2f} %, axes {max(row['axes_deg']):.2f} deg"
    errors = f"{row['attitude_max_deg']:7.2f}{row['field_angle_max_deg']:7.2f}"
    head = f"{row['figures']:7s}{row['free']:8s}{row['until_s']:6g} {row['way']:6s}{row['status']:14s}"
    return f"{head}{errors}{extra}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--noise", type=float, default=0.0, metavar="mA", help="added noise, 1-sigma")
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument("--out", type=Path, default=Path("munin-paper"), help="directory of the table and the picture")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    cases, rows = [], []
    for setting in track(SETTINGS, "settings"):
        truth = truth_of(setting)
        currents = measured(truth, setting, arguments.noise, arguments.seed)
        case: dict[str, Any] = {"setting": setting, "truth": truth}
        for way in WAYS:
            case[way] = fitted(truth, currents, setting, way)
            published = setting.paper if way == "paper" else {}
            rows.append(
                {
                    "figures": setting.figures,
                    "free": setting.free,
                    "until_s": setting.until_s,
                    "way": way,
                    "published": published,
                    **judged(truth, case[way]),
                }
            )
        cases.append(case)
    (arguments.out / "table.json").write_text(json.dumps(rows, indent=1))
    picture(cases, arguments.out / "figures.png")
    residual_picture(cases, arguments.out / "residuals.png")
    print(f"{'figure':7s}{'free':8s}{'s':>6s} {'way':6s}{'status':14s}{'att.':>7s}{'angle':>7s} deg, largest errors")
    for row in rows:
        print(line(row))


if __name__ == "__main__":
    main()
