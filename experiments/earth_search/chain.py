"""The chain of numbers of Melnikov et al. 2022, as printed and corrected, and the accuracy of the normalised output.

.venv/bin/python experiments/earth_search/chain.py --out out/earth-chain
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np

EARTH_RADIUS_KM, HEIGHT_KM, CORRELATION_KM = 6371.0, 800.0, 700.0
MEAN, LEAST, MOON = 6.0, 2.5, 0.182
"""Brightness [mW/(cm^2 sr)], and the full Moon's signal over that of the mean Earth."""
VARIATION, MOON_DEG = 0.15, 0.5
PRINTED_THETA_DEG = 12.0
PRINTED = {
    "horizon_deg": 63.0,
    "span_rad": 0.22,
    "theta_deg": 12.0,
    "moon_over_dimmest": 0.44,
    "earth_first": 0.64,
    "moon_first": 0.163,
    "threshold_over_dimmest": 0.21,
    "earth_over_threshold": 5.0,
    "correlation": 0.135,
    "step_mW": 1.2,
    "step_over_dimmest": 0.48,
    "along_horizon_over_threshold": 2.0,
    "footprint_km": 340.0,
}
ALTITUDES_KM = (400, 600, 800, 1000, 1200, 1500)
OFFSETS_DEG = (0.0, 1.0, 3.0, 5.0)
LIMB_KM = (10.0, 50.0)
"""Tangent heights between which a soft limb's signal falls from all to nothing: ASSUMED, the 15 um band."""
SAMPLES = 2880
DRAWS = 300


def moon_first(theta_deg: float) -> float:
    """First harmonic of a body of 0.5 deg at the end of the scan, over its signal: 2/pi sqrt(1 - v^2), v inner edge."""
    return 2.0 / math.pi * math.sqrt(1.0 - (1.0 - MOON_DEG / theta_deg) ** 2)


def chain() -> dict[str, float]:
    """All numbers recomputed from the paper's data and formulas, with theta_max at the 12 deg that it goes on with."""
    horizon = math.asin(EARTH_RADIUS_KM / (EARTH_RADIUS_KM + HEIGHT_KM))
    span = 2.0 * CORRELATION_KM / EARTH_RADIUS_KM
    theta = math.asin(math.sin(span / 2.0) * math.tan(horizon))
    moon = MOON * MEAN / LEAST
    earth = 2.0 / math.pi
    first = moon_first(PRINTED_THETA_DEG)
    threshold = 3.0 * first * moon
    correlation = math.exp(-2.0)
    step = VARIATION * MEAN * math.sqrt(2.0 * (1.0 - correlation))
    sine = math.radians(PRINTED_THETA_DEG)
    return {
        "horizon_deg": math.degrees(horizon),
        "span_rad": span,
        "theta_deg": math.degrees(theta),
        "moon_over_dimmest": moon,
        "earth_first": earth,
        "moon_first": first,
        "moon_first_at_15_deg": moon_first(15.0),
        "threshold_over_dimmest": threshold,
        "threshold_over_earth_first": threshold / earth,
        "threshold_printed_over_dimmest": 3.0 * 0.163 * 0.44,
        "threshold_printed_over_earth_first": 3.0 * 0.163 * 0.44 / 0.64,
        "earth_over_threshold": earth / threshold,
        "correlation": correlation,
        "step_mW": step,
        "step_over_dimmest": step / LEAST,
        "along_horizon_over_threshold": earth * step / LEAST / threshold,
        "footprint_km": 2.0 * HEIGHT_KM * math.tan(sine),
        "presence_printed_deg": PRINTED_THETA_DEG * math.sqrt(1.0 - (3.0 * 0.163 * 0.44 / 0.64) ** 2),
        "presence_deg": PRINTED_THETA_DEG * math.sqrt(1.0 - (threshold / earth) ** 2),
        "disk_deg": 2.0 * math.degrees(horizon),
        "full_turn_s": 360.0 / 0.25,
        "longest_turn_to_the_disk_s": (360.0 - 2.0 * math.degrees(horizon)) / 0.25,
        "longest_approach_s": 2.0 * math.degrees(horizon) / 0.1,
    }


def probabilities(found: dict[str, float]) -> dict[str, float]:
    """Of presence where the scan lies along the horizon: a normal difference of brightness beyond the threshold."""

    def beyond(ratio: float) -> float:
        return math.erfc(1.0 / ratio / math.sqrt(2.0))

    return {"printed_ratio": beyond(2.0), "corrected_ratio": beyond(found["along_horizon_over_threshold"])}


def pointing_errors(altitude_km: float, offset_deg: float, draws: int = DRAWS) -> dict[str, float]:
    """Errors of the angle toward x from normalised outputs, arc minutes; the nadir is off toward x and y alike.

    `curved`: a sharp even Earth, of which a straight horizon misses the curvature, with one sensor and with the
    difference of two opposite ones; `soft`: a soft limb whose middle is taken for the horizon; `bright_sigma`: of the
    difference, RMS over draws of the brightness; the scan is summed directly.
    """
    import jax.numpy as jnp

    from jaxsat.control.earth_search.sensing import ground
    from jaxsat.environment.albedo.infrared import random_brightness
    from jaxsat.sensors.horizon_sensor import (
        HorizonSensor,
        band_harmonics,
        chord_of_disk,
        normalised_output,
        scan_harmonics,
    )

    distance = (EARTH_RADIUS_KM + altitude_km) / EARTH_RADIUS_KM
    disk = math.asin(1.0 / distance)
    sensor = HorizonSensor(disk)
    theta, true = float(sensor.amplitude), math.radians(offset_deg)
    nadir = np.array([math.tan(true), math.tan(true), 1.0])
    nadir /= np.linalg.norm(nadir)
    outward = np.array([1.0, -1.0]) * nadir[0]
    c, s = math.cos(disk), math.sin(disk)
    chord = chord_of_disk(jnp.asarray(s * outward + c * nadir[2]), jnp.asarray(s * nadir[2] - c * outward), c)
    sharp = band_harmonics(*(jnp.clip(edge / theta, -1.0, 1.0) for edge in chord))

    v = np.tile(np.sin(2.0 * np.pi * np.arange(SAMPLES) / SAMPLES), 2)
    azimuths = np.repeat([[1.0, 0.0], [-1.0, 0.0]], SAMPLES, axis=0)
    cone = disk - theta * v
    down = (azimuths @ nadir[:2]) * np.sin(cone) + np.cos(cone) * nadir[2]
    tangent_km = EARTH_RADIUS_KM * (distance * np.sqrt(1.0 - down**2) - 1.0)
    limb = np.clip((LIMB_KM[1] - tangent_km) / (LIMB_KM[1] - LIMB_KM[0]), 0.0, 1.0)
    lifted = math.asin((1.0 + 0.5 * sum(LIMB_KM) / EARTH_RADIUS_KM) / distance) - disk

    def errors(harmonics, lift):
        plus, minus = -theta * np.asarray(normalised_output(*harmonics)) + lift
        return -plus - true, 0.5 * (minus - plus) - true

    def summed(signal):
        return scan_harmonics(jnp.asarray(signal.reshape(2, SAMPLES)))

    curved_one, curved = errors(sharp, 0.0)
    soft_one, soft = errors(summed(limb), lifted)
    field, generator, bright = random_brightness(0), np.random.default_rng(0), []
    sensed = np.c_[azimuths, np.zeros(len(v))], np.array([0.0, 0.0, 1.0]), v, nadir, distance
    places = np.asarray(ground(sensor, *map(jnp.asarray, sensed)))
    for _ in range(draws):
        turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
        share = 1.0 + VARIATION * np.asarray(field(jnp.asarray(places @ turn.T)))
        bright.append(errors(summed(limb * share), lifted)[1] - soft)
    found = {
        "curved_one": curved_one,
        "curved": curved,
        "soft_one": soft_one,
        "soft": soft,
        "bright_sigma": math.sqrt(np.mean(np.square(bright))),
    }
    minutes = {name: float(math.degrees(value) * 60.0) for name, value in found.items()}
    return {"altitude_km": altitude_km, "offset_deg": offset_deg, **minutes}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/earth-chain"), help="directory of the results")
    parser.add_argument("--draws", type=int, default=DRAWS, help="of the brightness at each altitude and offset")
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    found = chain()
    print("| number | printed | recomputed |\n|---|---|---|")
    for name, value in found.items():
        print(f"| {name} | {PRINTED.get(name, '')} | {value:.6f} |")
    chances = probabilities(found)
    for name, value in chances.items():
        print(f"presence along the horizon, {name}: probability {value:.3f} (paper: close to one)")
    print("\nerrors in arc minutes (paper: 3 sigma about 6)")
    rows = [pointing_errors(float(h), x, arguments.draws) for h in ALTITUDES_KM for x in OFFSETS_DEG]
    names = list(rows[0])
    print("| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|")
    for row in rows:
        print("| " + " | ".join(f"{value:.3g}" for value in row.values()) + " |")
    arguments.out.mkdir(parents=True, exist_ok=True)
    content = {"printed": PRINTED, "recomputed": found, "probability": chances, "accuracy_arcmin": rows}
    (arguments.out / "chain.json").write_text(json.dumps(content, indent=1))
    (arguments.out / "accuracy.png").write_bytes(picture(rows))


def picture(rows: list[dict[str, float]]) -> bytes:
    """What each cause adds to the error, over the altitude, at each offset."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.style import INK, dress, head, new_figure

    figure = new_figure(9.6, 3.6, "Accuracy of the normalised output", "arc minutes over altitude, km")
    axes = figure.subplots(1, 3, gridspec_kw={"left": 0.06, "right": 0.985, "top": 0.72, "bottom": 0.12})
    shown = {
        "curved_one": "curvature, one sensor",
        "soft": "soft limb, two opposite",
        "bright_sigma": "brightness, 1 sigma of two",
    }
    for each, (name, title) in zip(axes, shown.items(), strict=True):
        for offset in OFFSETS_DEG:
            part = [row for row in rows if row["offset_deg"] == offset]
            label = f"{offset:g} deg off"
            each.plot([row["altitude_km"] for row in part], [row[name] for row in part], label=label, linewidth=1.2)
        dress(each)
        head(each, title)
    axes[2].set_ylim(bottom=0.0)
    # 3 sigma of 6 arc minutes, as published.
    axes[2].axhline(2.0, color=INK, linewidth=0.8, linestyle="--")
    axes[2].text(ALTITUDES_KM[-1], 3.0, "published", fontsize=8, color=INK, ha="right")
    curves = axes[0].get_lines()
    figure.legend(handles=curves, loc="upper right", ncols=len(curves), fontsize=8, frameon=False)
    return png_bytes(figure)


if __name__ == "__main__":
    main()
