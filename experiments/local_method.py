"""Table 3 of Penkov et al. 2009 (sec. 3.4): attitude from single samples, and how far the local methods can be trusted.

1. The published sample at t = 448 s, 13 16 0 216 0 128 mA, on the orbit of Table 1 with both assignments of the pair
   +X -X: the Earth's light on one and the Sun's on the other, or the reverse. The published 13 mA are the residual of
   sides that are said to be lit; beside it that of all sides, where the Sun shines on whatever faces it.
2. The same table for a synthetic session: the published columns, and beside them what nobody could know then, the
   error against the truth, with the currents as measured and as they were before noise.
3. Errors of all three local methods over the session, x taken to be along the field.

    .venv/bin/python experiments/local_method.py --session b --out out/local-method
"""

import argparse
import dataclasses
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from munin_sessions import FILES

PUBLISHED = {
    0: (0.03657383, 32.7485),
    64: (0.00000015, 0.00000017),
    128: (0.00000017, 20.3003),
    256: (0.00000117, 25.1797),
    320: (0.00000009, 4.7217),
    384: (0.00000478, 15.3352),
    448: (13.0, 0.8636),
    1152: (0.00000003, 0.4697),
}
"""Residual [mA] and angle [deg] at each time [s]; with the pair the other way round, 448 s gives 6.2e-7 and 0.2671."""
AMBIGUOUS_MA = (13.0, 16.0, 0.0, 216.0, 0.0, 128.0)
ELEMENTS = {
    "a_km": 7630.026457,
    "e": 0.072661,
    "i_deg": 95.438873,
    "raan_deg": 64.818790,
    "argp_deg": 16.675906,
    "t_perigee_s": 3230.533197,
}
DIRECT_SIGMA = 0.02


def published_sample() -> list[dict]:
    """Where the search ends for each panel of the pair +X -X that may face the Sun, x along the field."""
    from fitting.local.five_parameter import compromise_start, fit_five_parameters
    from fitting.local.shares import mirror_earth, mirror_light, patterns
    from fitting.local.sun_body import sun_on_sides
    from jaxsat.environment import (
        apparent_sun,
        igrf_field,
        orbit_from_perigee_time_km_deg,
        tabulate_light,
        tabulate_orbit,
    )
    from jaxsat.math import angle_between, quaternion
    from jaxsat.panel_names import PANEL_NAMES
    from jaxsat.spacecraft import SolarPanels, box_normals
    from jaxsat.time import Epoch

    epoch, t = Epoch.from_utc(2001, 1, 18, 4, 54, 15), jnp.array([448.0])
    orbit = orbit_from_perigee_time_km_deg(**ELEMENTS)
    sun, _ = apparent_sun(epoch, np.asarray(t))
    table = tabulate_orbit(orbit, t, igrf_field(epoch.decimal_year()), np.radians(191.28))
    light = jax.tree.map(lambda leaf: leaf[0], mirror_light(tabulate_light(orbit, t, jnp.asarray(sun))))
    field, measured = table.b_field_eci[0], 1e-3 * jnp.asarray(AMBIGUOUS_MA)
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    rows = []
    for name, x_lit in (("-X", False), ("+X", True)):
        sides = jnp.asarray([x_lit, False, False])
        sunny = jnp.array([float(x_lit), float(not x_lit), 0.0, 1.0, 0.0, 1.0])
        sun_body = sun_on_sides(measured, sides)
        start = compromise_start(sun_body, jnp.array([1.0, 0.0, 0.0]), light.sun_eci, field)
        found = start
        for _ in range(6):
            result = fit_five_parameters(found, measured, panels, mirror_earth(), light, sunny=sunny)
            found = result.fit.quaternion
        x_eci = quaternion.rotate(found, jnp.array([1.0, 0.0, 0.0]))
        direct, returned = patterns(found, panels, mirror_earth(), light)
        all_sides = 1e3 * np.asarray(result.fit.direct * direct + result.fit.albedo * returned - measured)
        rows.append(
            {
                "sun_on": name,
                "residual_mA": 1e3 * float(result.fit.rms) * np.sqrt(6.0),
                "all_sides_residual_mA": float(np.linalg.norm(all_sides)),
                "by_side_mA": dict(zip(PANEL_NAMES, all_sides.tolist(), strict=True)),
                "field_angle_deg": float(jnp.degrees(angle_between(x_eci, field))),
                "direct": float(result.fit.direct),
                "albedo": float(result.fit.albedo),
                "sun_to_x_by_currents_deg": float(jnp.degrees(angle_between(sun_body, jnp.array([1.0, 0.0, 0.0])))),
                "sun_to_field_deg": float(jnp.degrees(angle_between(light.sun_eci, field))),
                "mirror_to_field_deg": float(jnp.degrees(angle_between(light.specular_direction_eci, field))),
            }
        )
    return rows


def session_samples(session: str):
    """Prepared session, its samples for the local methods, and the truth."""
    from fitting.local.methods import local_samples
    from fitting.session import prepare_session
    from jaxsat.bundled import BUNDLED
    from jaxsat.satellites import read_numbers
    from jaxsat.telemetry import read_session

    path = BUNDLED.parent / f"{FILES[session]}.RAW_SUN"
    truth = json.loads(path.with_suffix(".truth.json").read_text())
    satellite = read_numbers(changed={"spacecraft.imax_mA": truth["cfg"]["imax"]})
    prepared = prepare_session(read_session(path, satellite))
    return prepared, local_samples(prepared, satellite, noise_mA=2.0), truth


def errors_deg(solutions, truth) -> np.ndarray:
    """[samples found] rotation from the true attitudes."""
    from jaxsat.math.on_host import angle_between_attitudes

    return np.degrees(angle_between_attitudes(solutions.quaternion, np.array(truth["q"])[:, None]))


def table(samples, truth, times) -> list[dict]:
    """Published columns of each sample with four panels lit, and the errors against the truth."""
    from fitting.local.session import solve_five_parameters

    clean = dataclasses.replace(samples, currents=1e-3 * np.array(truth["currents_clean"]))
    cases = {
        "measured": solve_five_parameters(samples),
        "exact": solve_five_parameters(clean),
        "measured_imax_known": solve_five_parameters(samples, direct_sigma=DIRECT_SIGMA),
    }
    rows = []
    for k in np.flatnonzero(cases["measured"].count):
        row = {"t_s": float(times[k]), "true_field_angle_deg": truth["theta"][k]}
        row["panels_lit"] = int(np.sum(samples.currents[k] >= 2e-3))
        for name, found in cases.items():
            errors = errors_deg(found, truth)[k]
            row[name] = {
                "residual_mA": 1e3 * float(found.rms[k, 0]) * np.sqrt(6.0),
                "field_angle_deg": float(np.degrees(found.field_angle[k, 0])),
                "status": found.status[k],
                "solutions": int(found.count[k]),
                "error_deg": float(errors[0]),
                "smallest_error_deg": float(np.nanmin(errors)) if found.count[k] else None,
                "sigma_deg": float(np.degrees(found.sigma[k, 0])),
            }
        rows.append(row)
    return rows


def all_methods(prepared, samples, truth) -> dict:
    """Errors over the session of each method, of its best attitude and of the nearest that it lists."""
    from fitting.local.methods import solve

    result = {}
    for method in ("field-roll", "five-parameter", "sun-field"):
        found = solve(method, prepared, samples, x="along")
        errors = errors_deg(found, truth)
        lit = found.count > 0
        result[method] = {
            "samples": int(lit.sum()),
            "error_deg": errors[:, 0].tolist(),
            "median_error_deg": float(np.median(errors[lit, 0])),
            "median_smallest_error_deg": float(np.median(np.nanmin(errors[lit], axis=1))),
        }
    return result


def picture(rows, methods, times, truth, name, path: Path) -> None:
    from jaxsat.plotting.style import INK, LEFT_OUT, MAIN, dress, head, new_figure, png_bytes

    figure = new_figure(
        11.0,
        7.6,
        "Attitude of single samples against the truth",
        f"{name}, synthetic; five parameters where four panels show 2 mA",
    )
    upper, lower = figure.subplots(2, 1, gridspec_kw={"left": 0.07, "right": 0.98, "top": 0.87, "bottom": 0.07})
    colours = {"field-roll": MAIN, "five-parameter": "#c79a00", "sun-field": "#2e8b3d"}
    for method, found in methods.items():
        label = f"{method}, median {found['median_error_deg']:.1f} deg"
        upper.plot(times, found["error_deg"], "o", ms=4.5, color=colours[method], label=label)
    upper.plot(times, truth["theta"], color=INK, lw=1.0, label="true angle of x to the field")
    upper.set_ylim(0.0, 180.0)
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=4, fontsize=8.5, frameon=False)
    head(upper, "error, deg")
    dress(upper)
    t = [row["t_s"] for row in rows]
    for case, colour, label in (
        ("measured", "#c79a00", "as published"),
        ("measured_imax_known", LEFT_OUT, f"largest current known to {100 * DIRECT_SIGMA:g} %"),
    ):
        lower.plot(t, [row[case]["error_deg"] for row in rows], "o", ms=5, color=colour, label=label)
    lower.set_ylim(0.0, 60.0)
    lower.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2, fontsize=8.5, frameon=False)
    head(lower, "error of five-parameter, deg")
    dress(lower, x_label="time since epoch, s")
    path.write_bytes(png_bytes(figure))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--session", choices=list(FILES), default="b")
    parser.add_argument("--out", type=Path, default=Path("out/local-method"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    pair = published_sample()
    print("published sample at 448 s, 13 16 0 216 0 128 mA:")
    for row in pair:
        print(
            f"  Sun on {row['sun_on']}: residual {row['residual_mA']:.3g} mA, of all sides "
            f"{row['all_sides_residual_mA']:.3g} mA, x {row['field_angle_deg']:.2f} deg",
            end="",
        )
        print(f" off the field, direct {row['direct']:.3f}, albedo {row['albedo']:.3f}")
    prepared, samples, truth = session_samples(arguments.session)
    rows = table(samples, truth, samples.t)
    print(
        "     t  lit | residual, mA   angle  error  listed |  exact: error | I_max known: error   1 sigma | true angle"
    )
    for row in rows:
        m, e, i = row["measured"], row["exact"], row["measured_imax_known"]
        print(
            f"{row['t_s']:6.0f}  {row['panels_lit']:3d} | {m['residual_mA']:12.2e} {m['field_angle_deg']:7.2f} "
            f"{m['error_deg']:6.1f} {m['solutions']:7d} | {e['error_deg']:13.1f} | {i['error_deg']:18.1f} "
            f"{i['sigma_deg']:9.1f} | {row['true_field_angle_deg']:10.2f}"
        )
    methods = all_methods(prepared, samples, truth)
    for name, found in methods.items():
        print(
            f"{name:15s} {found['samples']:3d} samples, median error {found['median_error_deg']:.1f} deg, of the "
            f"nearest listed {found['median_smallest_error_deg']:.1f} deg"
        )
    arguments.out.mkdir(parents=True, exist_ok=True)
    report = {
        "published_table": {str(t): {"residual_mA": r, "angle_deg": a} for t, (r, a) in PUBLISHED.items()},
        "published_sample": pair,
        "session": FILES[arguments.session],
        "table": rows,
        "methods": methods,
    }
    from jaxsat.files.json_files import json_text, plain

    (arguments.out / "local_method.json").write_text(json_text(plain(report)[0]))
    picture(rows, methods, samples.t, truth, FILES[arguments.session], arguments.out / "local_method.png")


if __name__ == "__main__":
    main()
