"""Three estimators of the Sun's direction from the pyramid sensor when its readings are noisy, coarse, or missing.

An instrument turns at a random constant rate, sampled once a second for five minutes; the published reconstruction,
the tracker (every candidate followed by the gyro) and the filter (followed by Kalman filters) see the same readings.
Samples count while in view, from 30 s after the first light. Prints a table of errors, writes JSON and a picture.

    .venv/bin/python experiments/sun_estimators.py --out out/sun-estimators
"""

import argparse
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from scipy.spatial.transform import Rotation

CASES, SAMPLES, SETTLING = 1000, 300, 30
GYRO_DEG_S = 0.005
RATES_DEG_S = {"slow": (0.0, 0.2), "middle": (0.1, 0.5), "fast": (0.3, 2.0)}
CLEAN = {"noise": 0.0, "bits": 0, "gain": 0.0, "dead": 0}
READINGS = {  # 1-sigma of a detector over the largest current, bits of the converter, 1-sigma of gains, dead faces
    "exact": {},
    "noise 0.05 %": {"noise": 0.0005},
    "noise 0.2 %": {"noise": 0.002},
    "noise 0.5 %": {"noise": 0.005},
    "8 bits": {"bits": 8},
    "12 bits": {"bits": 12},
    "gains 1 %": {"gain": 0.01},
    "one face dead": {"dead": 1},
    "noise 0.2 %, one face dead": {"noise": 0.002, "dead": 1},
}
ESTIMATORS = {"published": "#b0413e", "tracking": "#8a8f98", "filter": "#2340a8"}


def session(rate_deg_s: tuple[float, float], readings: dict, seed: int):
    """Gyro turns [rad], currents, whether a face is alive, and Suns, of [sample, case, ...]."""
    from jaxsat.sensors import PyramidSunSensor, combine_detectors, face_currents, quantize

    rng = np.random.default_rng(seed)
    first, axes = rng.normal(size=(2, CASES, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    first /= np.linalg.norm(first, axis=1)[:, None]
    turn = axes * np.radians(rng.uniform(*rate_deg_s, size=(CASES, 1)))
    suns = np.stack([Rotation.from_rotvec(-turn * k).apply(first) for k in range(SAMPLES)])
    clean = jax.jit(jax.vmap(lambda sun: face_currents(PyramidSunSensor(), sun)))(suns.reshape(-1, 3))
    both = np.asarray(clean).reshape(SAMPLES, CASES, 4, 1) * (1.0 + readings["gain"] * rng.normal(size=(CASES, 4, 2)))
    both = np.maximum(both + readings["noise"] * rng.normal(size=both.shape), 0.0)
    if readings["bits"]:
        both = np.asarray(quantize(both, 2.0 ** -readings["bits"]))
    currents = np.asarray(jax.jit(jax.vmap(combine_detectors))(both.reshape(-1, 4, 2))).reshape(SAMPLES, CASES, 4)
    alive = np.tile(np.arange(4) >= readings["dead"], (CASES, 1))
    noise = np.radians(GYRO_DEG_S) if readings != CLEAN else 0.0
    return turn + noise * rng.normal(size=suns.shape), np.where(alive, currents, 0.0), alive, suns


@jax.jit
def estimates(gyro, currents, alive, settings):
    """Directions by the three estimators and whether a face was lit, of [sample, case, ...]."""
    from jaxsat.estimation import (
        blank_filter,
        blank_track,
        carried,
        corrected,
        followed,
        predicted,
        published_direction,
        sun_candidates,
    )
    from jaxsat.sensors import PyramidSunSensor

    sensor = PyramidSunSensor()
    sigma, gain, threshold, tolerance, gyro_sigma, share = settings

    def one(state, turn, i, alive):
        belief, track = state
        limits = {"alive": alive, "threshold": threshold, "tolerance": tolerance}
        belief = predicted(belief, turn, gyro_sigma)
        found = sun_candidates(sensor, i, belief.best(), **limits)
        each = jnp.sqrt(sigma**2 + (gain * i) ** 2)
        belief = corrected(belief, sensor, i, found, sigma=each, alive=alive, threshold=threshold)
        track = carried(track, turn)
        track = followed(track, sun_candidates(sensor, i, track.best(), **limits), gain=share)
        published = published_direction(sensor, i, threshold=threshold).direction
        return (belief, track), (jnp.stack([published, track.best(), belief.best()]), found.lit > 0)

    blank = jax.tree.map(lambda x: jnp.broadcast_to(x, (CASES, *x.shape)), (blank_filter(), blank_track()))
    return lax.scan(lambda state, x: jax.vmap(one)(state, *x, alive), blank, (gyro, currents))[1]


def errors_deg(rate_deg_s: tuple[float, float], readings: dict, seed: int) -> np.ndarray:
    """Errors of the counted samples, [estimator, sample]."""
    gyro, currents, alive, suns = session(rate_deg_s, readings, seed)
    noise, step = readings["noise"], 2.0 ** -readings["bits"] if readings["bits"] else 0.0
    exact = readings["noise"] == readings["gain"] == step == 0.0
    settings = np.array(
        [
            max(np.hypot(noise / np.sqrt(2.0), step / np.sqrt(12.0)), 1e-5),
            readings["gain"] / np.sqrt(2.0),
            5.0 * noise + 1.5 * step,
            4.0 * noise + step + 3.0 * readings["gain"],
            max(np.radians(GYRO_DEG_S) if readings != CLEAN else 0.0, 1e-6),
            1.0 if exact else 0.3,
        ]
    )
    found, lit = map(np.asarray, estimates(gyro, currents, alive, settings))
    first = np.where(lit.any(axis=0), np.argmax(lit, axis=0), SAMPLES)
    counted = lit & (np.arange(SAMPLES)[:, None] >= first + SETTLING)
    far = np.linalg.norm(found - suns[:, :, None], axis=-1)
    return np.degrees(2.0 * np.arcsin(np.minimum(0.5 * far, 1.0)))[counted].T


def picture(errors: dict[str, np.ndarray], path: Path) -> None:
    """Share of samples beyond an error, slow turns."""
    from jaxsat.plotting.style import dress, head, new_figure, png_bytes

    figure = new_figure(9.0, 4.4, "Errors of the Sun's direction under slow turns", "share of samples in view beyond")
    grid = figure.add_gridspec(1, len(errors), left=0.08, right=0.98, top=0.76, bottom=0.14, wspace=0.12)
    edges = np.geomspace(1e-3, 90.0, 200)
    for column, (name, off) in enumerate(errors.items()):
        axes = figure.add_subplot(grid[0, column])
        for one, (estimator, colour) in zip(off, ESTIMATORS.items(), strict=True):
            beyond = 100.0 * (1.0 - np.searchsorted(np.sort(one), edges) / one.size)
            axes.plot(edges, beyond, color=colour, lw=1.5, label=estimator)
        axes.set(xscale="log", xlim=(1e-3, 90.0), ylim=(0.0, 100.0))
        if column:
            axes.set_yticklabels([])
        dress(axes, y_label="" if column else "%", x_label="error, deg")
        head(axes, name)
        if column == 0:
            axes.legend(loc="lower left", fontsize=8.5, frameon=False)
    path.write_bytes(png_bytes(figure))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sun-estimators"), help="directory for results")
    folder = parser.parse_args().out
    jax.config.update("jax_enable_x64", True)
    folder.mkdir(parents=True, exist_ok=True)

    report, drawn = [], {}
    print("more than 1 deg off, % of samples; median error, deg:   published        tracking          filter")
    for seed, (name, changed) in enumerate(READINGS.items()):
        readings = {**CLEAN, **changed}
        for rate, span in RATES_DEG_S.items():
            off = errors_deg(span, readings, seed)
            beyond, median = 100.0 * np.mean(off > 1.0, axis=1), np.median(off, axis=1)
            row = "   ".join(f"{b:5.1f}  {m:7.4f}" for b, m in zip(beyond, median, strict=True))
            print(f"{name:28s} {rate:6s} {span[0]:g} to {span[1]:g} deg/s   {row}", flush=True)
            numbers = {"beyond_1_deg_percent": beyond.tolist(), "median_deg": median.tolist()}
            report.append({"readings": name, **readings, "rate_deg_s": span, "estimators": [*ESTIMATORS], **numbers})
            if rate == "slow" and name in ("exact", "noise 0.2 %", "one face dead"):
                drawn[name] = off
    picture(drawn, folder / "sun_estimators.png")
    (folder / "sun_estimators.json").write_text(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
