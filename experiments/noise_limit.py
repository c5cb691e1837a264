"""How far the noise that a sample session really contains moves the best possible estimate.

The truth files hold the currents before noise, so the noise of a session is known: measured - clean. Projected through
the Jacobian at the truth it gives the error that any efficient estimator makes on these very data, without a fit.
Where that exceeds three sigmas, no fit of these currents can do better but by luck.

    .venv/bin/python experiments/noise_limit.py --session b --free alsI0,albedo.specular
"""

import argparse
import json
from pathlib import Path

import jax
import numpy as np
from munin_sessions import FILES, true_values


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--session", choices=list(FILES), default="b")
    parser.add_argument("--free", default="alsI0,albedo.specular")
    parser.add_argument("--out", type=Path, default=Path("noise-limit.json"))
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)

    from fitting.measurements.abstract import RATE_UNIT
    from fitting.measurements.assembly import Samples, build_problem
    from fitting.parameters.chosen import chosen_leaves
    from fitting.parameters.free import free_parameters
    from fitting.surroundings import surroundings
    from jaxsat.bundled import BUNDLED
    from jaxsat.integrators import BLOCK
    from jaxsat.satellites import read_satellite
    from jaxsat.telemetry import read_telemetry

    path = BUNDLED.parent / f"{FILES[arguments.session]}.RAW_SUN"
    truth = json.loads(path.with_suffix(".truth.json").read_text())
    true = true_values(truth["cfg"])
    inertia = {key: true[f"inertia.{key}"] for key in ("xx", "yy", "zz", "xy", "xz", "yz")}
    satellite = read_satellite(
        changed={
            "spacecraft.magnet_A_m2": [float(m) for m in truth["cfg"]["magnet"]],
            "spacecraft.rods_A_m2": truth["cfg"]["rods"],
            "spacecraft.imax_mA": true["imax"],
            "spacecraft.inertia_kg_m2": inertia,
            "albedo.specular": true["albedo.specular"],
            "albedo.diffuse": true["albedo.diffuse"],
        }
    )
    session = read_telemetry(path, satellite)
    cells = session.channels["cells"]
    samples = Samples.of({"cells": cells}, session.epoch, {})
    around, _ = surroundings(satellite, session)
    problem = build_problem(samples, satellite.model, around, delayed=(), max_step=4.0, room_for=4.0)
    free = chosen_leaves(satellite.leaves, arguments.free.split(","), satellite.aliases)
    parameters = free_parameters(satellite.model, satellite.leaves, free, held=satellite.held)
    sigma_mA = 1e3 * cells.sigma

    x = np.zeros(len(parameters.names))
    x[3:6] = np.array(truth["cfg"]["w0"]) / RATE_UNIT
    everything = np.asarray(len(problem.grid.step) // BLOCK)
    prediction, jacobian = jax.jit(lambda x, q: problem.predict(parameters.tree, x, q, everything))(
        x, np.array(truth["cfg"]["q0"])
    )
    count = len(samples.t)
    clean = np.array(truth["currents_clean"])
    used = clean > 0
    if truth["cfg"]["clip"]:
        used &= ~((samples.t >= truth["cfg"]["clip"][0]) & (samples.t <= truth["cfg"]["clip"][1]))[:, None]
    measured = 1e3 * samples.values["cells"]
    modelled = measured + np.asarray(prediction.residual)[:count] * sigma_mA
    noise = ((measured - clean) / sigma_mA)[used]
    A = np.asarray(jacobian)[:count][used][:, parameters.everything]
    cov = np.linalg.inv(A.T @ A)
    error = cov @ A.T @ noise
    names = [name for name, moves in zip(parameters.names, parameters.everything, strict=True) if moves]
    result = {
        "session": FILES[arguments.session],
        "noise_rms_mA": float(np.sqrt(np.mean(noise**2)) * sigma_mA),
        "model_minus_clean_rms_mA": float(np.sqrt(np.mean((modelled - clean)[used] ** 2))),
        "error_over_sigma": dict(zip(names, (error / np.sqrt(np.diagonal(cov))).tolist(), strict=True)),
    }
    print(f"{result['session']}: noise {result['noise_rms_mA']:.3f} mA RMS,", end=" ")
    print(f"our model at the truth differs from the clean currents by {result['model_minus_clean_rms_mA']:.3f} mA RMS")
    for name, value in result["error_over_sigma"].items():
        print(f"  {name:16s} {value:+.2f} sigma")
    arguments.out.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
