"""`jaxsat simulate` against the five synthetic sessions, which another program made: same settings, same session?

Attitude, rate, field angle, shadow and clean currents; then how the telemetry of the two differs beside its noise.
Prints a table, writes JSON.

    .venv/bin/python experiments/simulated_sessions.py --out out/simulated-sessions
"""

import argparse
import json
from pathlib import Path

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.given import Given, Orbit, Sun
from jaxsat.satellites import read_numbers
from jaxsat.synthetic.session import SessionPlan, make_session
from jaxsat.synthetic.settings import SimulationSettings
from jaxsat.telemetry import read_session

SESSIONS = ("a-nominal-exact", "b-specular50", "c-specular50-limited", "d-mixed-albedo", "e-tumbling")
DATA = Path(__file__).parent.parent / "jaxsat" / "data" / "munin"


def plan_of(truth: dict, seed: int = 0) -> SessionPlan:
    """The session that a truth file describes."""
    cfg, e, J = truth["cfg"], truth["cfg"]["elements"], truth["cfg"]["inertia"]
    orbit = Orbit(
        semi_major_axis_km=e["a"] / 1e3,
        eccentricity=e["e"],
        inclination_deg=e["i"],
        raan_deg=e["raan"],
        argument_of_perigee_deg=e["argp"],
        time_of_perigee_s=e["t_peri"],
    )
    satellite = {
        "spacecraft.magnet_A_m2": [float(m) for m in cfg["magnet"]],
        "spacecraft.rods_A_m2": cfg["rods"],
        "spacecraft.imax_mA": cfg["imax"],
        "spacecraft.gains": cfg["panel_ratio"],
        "spacecraft.inertia_kg_m2": {
            name: J["xyz".index(name[0])]["xyz".index(name[1])] for name in ("xx", "yy", "zz", "xy", "xz", "yz")
        },
        "albedo.specular": cfg["albedo_specular"],
        "albedo.diffuse": cfg["albedo_diffuse"],
    }
    simulate = {
        "epoch_utc": cfg["start"],
        "duration_s": cfg["duration"],
        "sampling_s": cfg["cadence"],
        "quaternion": cfg["q0"],
        "rate_deg_s": np.degrees(cfg["w0"]).tolist(),
        "noise_mA": cfg["noise"],
        "tle": cfg["tle"],
        "seed": seed,
    }
    if cfg["clip"] is not None:
        simulate |= {"limit_s": cfg["clip"][:2], "limit_factors": cfg["clip"][2:]}
    # The Sun is held fixed over the session, as in the files.
    given = Given(orbit=orbit, sun=Sun(direction_eci=tuple(truth["sun"])))
    return SessionPlan(SimulationSettings.model_validate(simulate), read_numbers(changed=satellite), given)


def differences(truth: dict, session) -> dict[str, float]:
    """Largest differences of a simulated session from a truth file."""
    ours = session.truth
    found, expected = (Rotation.from_quat(np.array(q), scalar_first=True) for q in (ours.quaternion, truth["q"]))
    current = np.abs(1e3 * np.asarray(ours.current) - np.array(truth["currents_clean"]))
    return {
        "attitude_deg": float(np.degrees((found.inv() * expected).magnitude()).max()),
        "rate_rad_s": float(np.abs(np.asarray(ours.angular_velocity) - np.array(truth["w"])).max()),
        "field_angle_deg": float(np.abs(np.degrees(ours.sun_magnetic[:, 0]) - np.array(truth["theta"])).max()),
        "greenwich_rad": abs(session.greenwich_angle - truth["greenwich0"]),
        "samples_lit_otherwise": int(np.sum((np.asarray(ours.illumination) > 0.5) != np.array(truth["lit"]))),
        "clean_current_mA": float(current.max()),
        "clean_current_median_mA": float(np.median(current[np.array(truth["currents_clean"]) > 0.0])),
    }


def telemetry_difference(file: Path, session) -> float:
    """RMS of (their readings - ours) over lit samples and panels, with independent noise in both [mA]."""
    theirs = read_session(file)
    rows = np.rint((theirs.epoch.seconds_since(session.epoch) + theirs.t_s) / 64.0).astype(int)
    difference = theirs.currents_mA - session.telemetered_mA[rows]
    seen = np.asarray(session.truth.current)[rows] > 0.0
    return float(np.sqrt(np.mean(difference[seen] ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/simulated-sessions"), help="directory for results")
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)

    results = {}
    for name in SESSIONS:
        truth = json.loads((DATA / f"{name}.truth.json").read_text())
        session = make_session(plan_of(truth))
        found = differences(truth, session)
        found["telemetry_rms_mA"] = telemetry_difference(DATA / f"{name}.RAW_SUN", session)
        results[name] = found
    print("largest difference".ljust(26), *(name[:12].rjust(13) for name in SESSIONS))
    for key in results[SESSIONS[0]]:
        print(key.ljust(26), *(f"{results[name][key]:13.3g}" for name in SESSIONS))
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "simulated_sessions.json").write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
