"""Random sessions of the nanosatellite Munin with their truth, by an independent program, as RAW_SUN and truth.json.

One third each: any spin to 1.5 deg/s every 64 s, any spin to 5 deg/s every 10 s, captured by the field every 64 s.
Session K of a seed is the same whatever else is made. Hard sessions have lost a quarter of their samples and one
panel, and their panels' gains are off. `--validate` compares with other truth files instead.

    .venv/bin/python experiments/blind/generate.py --sessions 30 --cache blind-sessions
    .venv/bin/python experiments/blind/generate.py --validate jaxsat/data/munin
"""

import argparse
import datetime as dt
import json
from pathlib import Path
from typing import Any

import numpy as np
from motion import dcm_eci_from_body, simulate
from numpy.typing import NDArray
from rich.progress import track
from scipy.spatial.transform import Rotation
from surroundings import apparent_sun, greenwich_angle, is_lit, kepler, magnetic_field

Array = NDArray[np.float64]

SEED = 20010118
DURATION_S = 4500.0
MIN_LIT = 20
EPOCH = dt.datetime(2001, 1, 18, 4, 54, 15)
MUNIN = {"a": 7630026.457, "e": 0.072661, "i": 95.438873, "raan": 64.81879, "argp": 16.675906}
PERIOD_S = 6632.848
ORBITAL_RATE = 9.47283e-4  # rad/s
REGIMES = ("spin to 1.5 deg/s, 64 s", "spin to 5 deg/s, 10 s", "captured, 64 s")
CADENCE_S = (64.0, 10.0, 64.0)
MAX_SPIN_DEG_S = (1.5, 5.0)
CAPTURE_DEG, CAPTURED_SPIN, TRANSVERSE_RATE = 15.0, 11.0 * ORBITAL_RATE, 1.0e-3  # rad/s
NOISE_MA, POSITION_ERROR_KM, VELOCITY_ERROR_KM_S, MAGNETOMETER_ERROR_UT = 2.0, 0.3, 3e-4, 0.3
DROPPED, GAIN_SPREAD = 0.25, 0.1
TLE = [
    "1 26621U 00075C   01018.00000000  .00001000  00000-0  10000-3 0  9994",
    "2 26621  95.4389  64.8188 0726610  16.6759 100.0000 13.02600000  8009",
]


def regime_of(number: int) -> int:
    """Index into `REGIMES`."""
    return number % len(REGIMES)


def draw_satellite(rng: np.random.Generator) -> dict[str, Any]:
    """A satellite as far off nominal as those of the sample sessions."""
    principal = 0.05283 * np.sort(rng.uniform(0.94, 1.11, 3))
    axes = Rotation.from_rotvec(np.radians(rng.normal(0.0, 6.0, 3))).as_matrix()
    magnet = [rng.normal(0.3, 0.008), *rng.normal(0.0, 0.012, 2)]
    return {
        "inertia": (axes @ np.diag(principal) @ axes.T).tolist(),
        "magnet": [float(m) for m in magnet],
        "rods": rng.uniform(0.02, 0.04, 2).tolist(),
        "imax": float(rng.uniform(228.0, 252.0)),
    }


def draw_state(rng: np.random.Generator, regime: int, field: Array) -> tuple[Array, Array]:
    """Quaternion and rate [rad/s] at t = 0, where the field is `field` in inertial axes."""
    if regime < len(MAX_SPIN_DEG_S):
        q = rng.normal(size=4)
        axis = rng.normal(size=3)
        spin = np.radians(rng.uniform(0.0, MAX_SPIN_DEG_S[regime]))
        return q / np.linalg.norm(q), spin * axis / np.linalg.norm(axis)
    # Body x anywhere in a cone about the field, then any roll.
    along = field / np.linalg.norm(field)
    angle = np.arccos(rng.uniform(np.cos(np.radians(CAPTURE_DEG)), 1.0))
    across = np.cross(along, rng.normal(size=3))
    tilt = Rotation.from_rotvec(angle * across / np.linalg.norm(across))
    x_axis = tilt.apply(along)
    y_axis = np.cross(x_axis, rng.normal(size=3))
    y_axis /= np.linalg.norm(y_axis)
    dcm = np.stack([x_axis, y_axis, np.cross(x_axis, y_axis)], axis=1)
    q = Rotation.from_matrix(dcm).as_quat(scalar_first=True)
    return q, np.array([rng.uniform(-CAPTURED_SPIN, CAPTURED_SPIN), *rng.normal(0.0, TRANSVERSE_RATE, 2)])


def draw(number: int, *, hard: bool) -> dict[str, Any]:
    """Settings of session `number`, as `cfg` of the truth files."""
    rng = np.random.default_rng([SEED, int(hard), number])
    regime = regime_of(number)
    satellite = draw_satellite(rng)
    ratio = np.ones(6)
    if hard:
        ratio = rng.uniform(1.0 - GAIN_SPREAD, 1.0 + GAIN_SPREAD, 6)
        ratio[rng.integers(6)] = 0.0
    t = np.arange(0.0, DURATION_S, CADENCE_S[regime])
    while True:
        start = EPOCH + dt.timedelta(seconds=int(rng.integers(-365 * 86400, 365 * 86400)))
        elements = {**MUNIN, "t_peri": float(rng.uniform(0.0, PERIOD_S))}
        position, _ = kepler(elements, t)
        if is_lit(position, apparent_sun(start, t)).sum() >= MIN_LIT:
            break
    field = magnetic_field(position[:1], start, t[:1], greenwich_angle(start))[0]
    q, w = draw_state(rng, regime, field)
    return {
        "seed": SEED,
        "session": number,
        "regime": REGIMES[regime],
        "start": start.isoformat(),
        "elements": elements,
        "duration": DURATION_S,
        "cadence": CADENCE_S[regime],
        "q0": q.tolist(),
        "w0": w.tolist(),
        **satellite,
        "panel_ratio": ratio.tolist(),
        "albedo_specular": float(rng.uniform(0.0, 0.6)),
        "albedo_diffuse": float(rng.uniform(0.0, 0.4)),
        "noise": NOISE_MA,
        "mess": hard,
        "tle": TLE,
        "clip": None,
    }


def raw_sun(truth: dict[str, Any], rng: np.random.Generator) -> str:
    """Text of the session file: measured currents are noisy, whole mA, and zero where a panel sees nothing."""
    cfg, clean = truth["cfg"], truth["currents_clean"]
    start = dt.datetime.fromisoformat(cfg["start"])
    received = start + dt.timedelta(seconds=2.0 * DURATION_S)
    count = len(truth["t"])
    noisy = np.rint(clean + rng.normal(0.0, cfg["noise"], clean.shape))
    current = np.where(clean > 0.0, np.maximum(noisy, 0.0), 0.0).astype(int)
    position = truth["position"] / 1e3 + rng.normal(0.0, POSITION_ERROR_KM, (count, 3))
    velocity = truth["velocity"] / 1e3 + rng.normal(0.0, VELOCITY_ERROR_KM_S, (count, 3))
    field = 1e6 * truth["field_body"][:, 1:] + rng.normal(0.0, MAGNETOMETER_ERROR_UT, (count, 2))
    kept = rng.uniform(size=count) >= DROPPED if cfg["mess"] else np.ones(count, bool)
    lines = ["MUNIN", *cfg["tle"]]
    for k in np.flatnonzero(kept):
        times = (start + dt.timedelta(seconds=float(truth["t"][k])), received)
        row = "".join(f"{time:%Y %m %d %H %M %S}.000  " for time in times)
        row += "".join(f"{x:12.3f}" for x in position[k]) + "".join(f"{v:11.6f}" for v in velocity[k])
        row += "".join(f"{mA:5d}" for mA in (*current[k], current[k].sum()))
        lines.append(row + "".join(f"{b:9.2f}" for b in field[k]))
    return "\n".join(lines) + "\n"


def session_file(number: int, cache: Path, *, hard: bool) -> Path:
    """Path of a session's RAW_SUN file in the cache, its truth beside; made where it is not there yet."""
    path = cache / f"{'hard' if hard else 'plain'}-{number:04d}.RAW_SUN"
    truth_path = path.with_suffix(".truth.json")
    if path.exists() and truth_path.exists():
        return path
    cache.mkdir(parents=True, exist_ok=True)
    truth = simulate(draw(number, hard=hard))
    path.write_text(raw_sun(truth, np.random.default_rng([SEED, int(hard), number, 1])))
    stored = ("cfg", "t", "q", "w", "theta", "sun", "greenwich0", "lit", "currents_clean")
    plain = {key: truth[key].tolist() if isinstance(truth[key], np.ndarray) else truth[key] for key in stored}
    truth_path.write_text(json.dumps(plain))
    return path


def validate(directory: Path) -> None:
    """Prints how far this generator is from each truth file of a directory, with that file's Sun and with its own."""
    for path in sorted(directory.glob("*.truth.json")):
        theirs = json.loads(path.read_text())
        ours = simulate(theirs["cfg"], sun=np.array(theirs["sun"]))
        turn = np.swapaxes(dcm_eci_from_body(ours["q"]), -1, -2) @ dcm_eci_from_body(np.array(theirs["q"]))
        angle = np.degrees(np.max(np.linalg.norm(turn - np.eye(3), axis=(1, 2))) / np.sqrt(2.0))
        t, clip = ours["t"], theirs["cfg"]["clip"]
        # Samples with limited charge current are no business of this generator.
        used = (t < clip[0]) | (t > clip[1]) if clip else np.ones(len(t), bool)
        clean = np.array(theirs["currents_clean"])[used]
        own_sun = simulate(theirs["cfg"])["currents_clean"][used]
        print(
            f"{path.name}: attitude {angle:.1e} deg, rate {np.abs(ours['w'] - theirs['w']).max():.1e} rad/s, "
            f"currents {np.abs(ours['currents_clean'][used] - clean).max():.4f} mA "
            f"({np.abs(own_sun - clean).max():.3f} mA with its own Sun), lit {np.all(ours['lit'] == theirs['lit'])}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=30, help="how many")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--hard", action="store_true", help="with samples and a panel lost, and gains off")
    parser.add_argument("--cache", type=Path, default=Path("blind-sessions"), help="directory of the files")
    parser.add_argument("--validate", type=Path, metavar="DIR", help="compare with the truth files of a directory")
    arguments = parser.parse_args()
    if arguments.validate:
        validate(arguments.validate)
        return
    for number in track(range(arguments.first, arguments.first + arguments.sessions), "sessions"):
        session_file(number, arguments.cache, hard=arguments.hard)


if __name__ == "__main__":
    main()
