"""Is the attitude filter as good as it says? NEES and NIS of many cases against their 95 % bands.

A satellite on a polar orbit turns at a rate of its own, with a magnetometer (dipole field), a Sun sensor that sees
nothing in the Earth's shadow, readings that are lost now and then, and a gyro whose bias walks. What the filter begins
with is off as its own first covariance says. NEES is the squared error of attitude and bias over the covariance, NIS
the squared innovations over theirs: of N cases each sums to a chi-square. Nothing of the truth is by `jaxsat`: SciPy
turns it, NumPy draws it. Three runs: two orbits, the first minutes closely,
and the same from 30 deg off. Writes JSON and pictures.

    .venv/bin/python experiments/estimation/nees.py --cases 1000 --out out/nees
    .venv/bin/python experiments/estimation/nees.py --cases 1000 --outliers 0.01 --gate 0.9999 --out out/nees-gate
"""

import argparse
import json
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import stats
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Setting:
    """The satellite, its sensors and how long it flies."""

    dt_s: float = 2.0
    orbit_s: float = 5700.0
    shadow: tuple[float, float] = (0.55, 0.9)
    """Begin and end of the eclipse in parts of an orbit."""
    looks: int = 19
    steps: int = 300
    """Updates from one look at the errors to the next."""
    rate_deg_s: float = 0.5
    """1-sigma of the rate about each axis, of its steady part and of one that swings within ten minutes."""
    gyro_deg_sqrt_h: float = 0.15
    bias_walk_deg_s_sqrt_h: float = 0.003
    """1-sigma by which the bias goes away in an hour."""
    magnetometer_deg: float = 0.5
    sun_deg: float = 0.2
    lost: float = 0.05
    """Share of readings that are lost."""
    first_deg: float = 3.0
    first_bias_deg_s: float = 0.05
    looks_of_update: int = 3
    gate: float | None = None
    """Probability of a right reading to be taken; None for all."""
    outliers: float = 0.0
    """Share of readings that are off by `outlier_sigmas` in any direction across."""
    outlier_sigmas: float = 20.0


RUNS = {
    "two orbits": Setting(),
    "first minutes": Setting(looks=20, steps=10),
    "from 30 deg off": Setting(looks=20, steps=10, first_deg=30.0),
}


def truth(setting: Setting, cases: int, seed: int) -> dict[str, np.ndarray]:
    """Attitudes and biases at the looks, and readings at all updates, with the cases last."""
    rng = np.random.default_rng(seed)
    dt, count = setting.dt_s, setting.looks * setting.steps
    t = dt * np.arange(1, count + 1)
    eci = _directions(setting, t)
    steady, swing = np.radians(setting.rate_deg_s) * rng.normal(size=(2, cases, 3))
    phase = rng.uniform(0.0, 2.0 * np.pi, (cases, 3))
    v = np.radians(setting.gyro_deg_sqrt_h) / 60.0
    u = np.radians(setting.bias_walk_deg_s_sqrt_h) / 60.0
    sigma = np.radians([setting.magnetometer_deg, setting.sun_deg])
    begin = attitude = Rotation.random(cases, rng=rng)
    bias = first_bias = np.radians(setting.first_bias_deg_s) * rng.normal(size=(cases, 3))
    off = Rotation.from_rotvec(np.radians(setting.first_deg) * rng.normal(size=(cases, 3)))
    rates, bodies, attitudes, biases = np.empty((count, cases, 3)), np.empty((count, cases, 2, 3)), [], []
    for k in range(count):
        rate = steady + swing * np.sin(2.0 * np.pi * t[k] / 600.0 + phase)
        attitude = attitude * Rotation.from_rotvec(dt * rate)
        before, bias = bias, bias + u * np.sqrt(dt) * rng.normal(size=(cases, 3))
        # Farrenkopf's gyro (Crassidis & Junkins 2012, eq. 7.143).
        white = np.sqrt(v**2 / dt + u**2 * dt / 12.0) * rng.normal(size=(cases, 3))
        rates[k] = rate + 0.5 * (before + bias) + white
        for j in range(2):
            seen = attitude.inv().apply(eci[k, j])
            bodies[k, :, j] = Rotation.from_rotvec(sigma[j] * rng.normal(size=(cases, 3))).apply(seen)
        if (k + 1) % setting.steps == 0:
            attitudes.append(attitude.as_quat(scalar_first=True))
            biases.append(bias)
    lost = rng.random(bodies.shape[:3]) < setting.lost
    gross = rng.random(bodies.shape[:3]) < setting.outliers
    across = np.cross(bodies[gross], rng.normal(size=(int(gross.sum()), 3)))
    across *= setting.outlier_sigmas * sigma[np.nonzero(gross)[2], None] / np.linalg.norm(across, axis=1, keepdims=True)
    bodies[gross] = Rotation.from_rotvec(across).apply(bodies[gross]) if gross.any() else 0.0
    bodies[lost] = np.nan
    part = (t / setting.orbit_s) % 1.0
    bodies[(part > setting.shadow[0]) & (part < setting.shadow[1]), :, 1] = np.nan
    return {
        "t_s": t[setting.steps - 1 :: setting.steps],
        "first": (begin * off.inv()).as_quat(scalar_first=True),
        "first_bias": first_bias,
        "rate": rates,
        "body": bodies,
        "eci": eci,
        "attitude": np.array(attitudes),
        "bias": np.array(biases),
    }


def _directions(setting, t):
    """Field of a dipole along a polar orbit, and the Sun [time 2 3]."""
    angle = 2.0 * np.pi * t / setting.orbit_s
    up = np.stack([np.cos(angle), np.zeros_like(t), np.sin(angle)], axis=1)
    pole = np.array([0.15, 0.1, 0.98])
    field = 3.0 * (up @ pole)[:, None] * up - pole
    sun = np.broadcast_to([0.3, -0.93, 0.2], field.shape)
    both = np.stack([field, sun], axis=1)
    return both / np.linalg.norm(both, axis=-1, keepdims=True)


def filtered(setting: Setting, flown: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """NEES [looks cases], NIS and its degrees of freedom summed between looks, and 1-sigma of attitude and bias."""
    import jax
    import jax.numpy as jnp

    from jaxsat.estimation import AttitudeFilter, AttitudeReadings, GyroErrors
    from jaxsat.math import quaternion

    gyro = GyroErrors(np.radians(setting.gyro_deg_sqrt_h) / 60.0, np.radians(setting.bias_walk_deg_s_sqrt_h) / 60.0)
    estimator = AttitudeFilter(gyro, setting.looks_of_update, setting.gate)
    sigma = jnp.asarray(np.radians([setting.magnetometer_deg, setting.sun_deg]))
    known = jnp.ones(2, bool)

    def step(carry, given):
        rate, body, eci = given
        belief, surprise, freedom = carry
        belief, found = estimator.update(belief, AttitudeReadings(rate, body, eci, sigma, known), setting.dt_s)
        return (belief, surprise + found.surprise, freedom + found.freedom), None

    def look(belief, given):
        *readings, q, bias = given
        (belief, surprise, freedom), _ = jax.lax.scan(step, (belief, jnp.zeros(()), jnp.zeros(())), tuple(readings))
        off = quaternion.to_rotation_vector(quaternion.multiply(quaternion.conjugate(belief.quaternion), q))
        error = jnp.concatenate([off, bias - belief.bias])
        nees = error @ jnp.linalg.solve(belief.covariance, error)
        variances = jnp.diagonal(belief.covariance)
        told = jnp.sqrt(jnp.stack([jnp.mean(variances[:3]), jnp.mean(variances[3:])]))
        made = jnp.sqrt(jnp.stack([jnp.mean(error[:3] ** 2), jnp.mean(error[3:] ** 2)]))
        return belief, (nees, surprise, freedom, told, made)

    def one(first, rate, body, q, bias, eci):
        degrees = np.radians(setting.first_deg), np.radians(setting.first_bias_deg_s)
        belief = estimator.start(first, sigma_rad=degrees[0], bias_sigma_rad_s=degrees[1])
        return jax.lax.scan(look, belief, (rate, body, eci, q, bias))[1]

    def parts(array):
        return jnp.asarray(array.reshape(setting.looks, setting.steps, *array.shape[1:]))

    run = jax.jit(jax.vmap(one, in_axes=(0, 2, 2, 1, 1, None), out_axes=1))
    given = jnp.asarray(flown["first"]), parts(flown["rate"]), parts(flown["body"])
    given = *given, jnp.asarray(flown["attitude"]), jnp.asarray(flown["bias"]), parts(flown["eci"])
    found = jax.device_get(run(*given))
    return dict(zip(("nees", "nis", "freedom", "told", "made"), found, strict=True))


def band(freedom: float, share: float = 0.95) -> tuple[float, float]:
    """The range that a chi-square of so many degrees of freedom keeps, over them."""
    ends = stats.chi2.ppf([0.5 * (1.0 - share), 0.5 * (1.0 + share)], freedom)
    return float(ends[0] / freedom), float(ends[1] / freedom)


def judged(flown: dict[str, np.ndarray], found: dict[str, np.ndarray]) -> list[dict]:
    """A row a look: means over the cases with their bands, each over its degrees of freedom, so that 1 is right."""
    rows = []
    for k, t in enumerate(flown["t_s"]):
        cases = found["nees"].shape[1]
        told, made = (np.degrees(np.sqrt(np.mean(found[name][k] ** 2, axis=0))) for name in ("told", "made"))
        nees, nees_band = float(np.mean(found["nees"][k]) / 6.0), band(6.0 * cases)
        freedom = float(np.sum(found["freedom"][k]))
        nis, nis_band = float(np.sum(found["nis"][k]) / freedom), band(freedom)
        inside = float(np.mean(found["nees"][k] < stats.chi2.ppf(0.95, 6)))
        rows.append(
            {
                "t_s": float(t),
                "nees": nees,
                "nees_band": nees_band,
                "nees_inside": nees_band[0] <= nees <= nees_band[1],
                "cases_inside_95": inside,
                "nis": nis,
                "nis_band": nis_band,
                "nis_inside": nis_band[0] <= nis <= nis_band[1],
                "attitude_deg": {"told": float(told[0]), "made": float(made[0])},
                "bias_deg_s": {"told": float(told[1]), "made": float(made[1])},
            }
        )
    return rows


def draw(setting: Setting, rows: list[dict], cases: int, path: Path) -> None:
    """NEES and NIS in their bands, and the errors beside what the covariance tells."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.style import INK, SHADOW, dress, head, new_figure

    t = np.array([row["t_s"] for row in rows]) / 60.0
    figure = new_figure(9.6, 6.0, "Attitude filter: what it says and what it does", f"{cases} cases")
    layout = {"left": 0.07, "right": 0.98, "top": 0.86, "bottom": 0.09, "hspace": 0.4, "wspace": 0.2}
    places = figure.subplots(2, 2, gridspec_kw=layout)
    orbit = setting.orbit_s / 60.0
    for axes in places.flat:
        for turn in range(int(np.ceil(t[-1] / orbit))):
            axes.axvspan(*(min(orbit * (turn + part), t[-1]) for part in setting.shadow), color=SHADOW, zorder=0)
        axes.set_xlim(0.0, t[-1])
    for axes, name, title in zip(
        places[0],
        ("nees", "nis"),
        ("NEES over 6, 95 % band", "NIS over its degrees of freedom, 95 % band"),
        strict=True,
    ):
        low, high = np.array([row[f"{name}_band"] for row in rows]).T
        axes.fill_between(t, low, high, color="#3f9fd8", alpha=0.3, linewidth=0)
        axes.plot(t, [row[name] for row in rows], "o-", color=INK, markersize=3, linewidth=0.8)
        dress(axes)
        head(axes, title)
    for axes, name, title in zip(
        places[1], ("attitude_deg", "bias_deg_s"), ("error of attitude, deg", "error of bias, deg/s"), strict=True
    ):
        axes.semilogy(t, [row[name]["told"] for row in rows], color="#3f9fd8", label="1-sigma told")
        axes.semilogy(t, [row[name]["made"] for row in rows], "o", color=INK, markersize=3, label="RMS of the cases")
        dress(axes, x_label="time, min; grey is eclipse")
        head(axes, title)
        axes.legend(fontsize=8, frameon=False)
    path.write_bytes(png_bytes(figure))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--gate", type=float, help="probability of a right reading to be taken")
    parser.add_argument("--outliers", type=float, default=0.0, help="share of readings that are off by 20 sigmas")
    parser.add_argument("--out", type=Path, default=Path("out/nees"))
    arguments = parser.parse_args()

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    arguments.out.mkdir(parents=True, exist_ok=True)
    document = {key: getattr(arguments, key) for key in ("cases", "seed", "gate", "outliers")} | {"runs": {}}
    for name, setting in RUNS.items():
        setting = replace(setting, gate=arguments.gate, outliers=arguments.outliers)
        flown = truth(setting, arguments.cases, arguments.seed)
        began = time.perf_counter()
        found = filtered(setting, flown)
        seconds = time.perf_counter() - began
        rows = judged(flown, found)
        inside = {kind: sum(row[f"{kind}_inside"] for row in rows) for kind in ("nees", "nis")}
        print(f"\n{name}\n")
        tell(rows)
        print(f"\ninside their bands: NEES {inside['nees']}, NIS {inside['nis']} of {len(rows)} looks")
        updates = setting.looks * setting.steps * arguments.cases
        print(f"{seconds:.1f} s for {updates:.3g} updates, compilation included")
        document["runs"][name] = {"seconds": seconds, "inside": inside, "looks": rows}
        draw(setting, rows, arguments.cases, arguments.out / f"nees-{name.replace(' ', '-')}.png")
    (arguments.out / "nees.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def tell(rows: list[dict]) -> None:
    """A table for a page."""
    print("| min | NEES/6 | band | NIS/dof | band | attitude, deg: told, made | bias, deg/s: told, made |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        ends = [f"{row[name][0]:.3f} ... {row[name][1]:.3f}" for name in ("nees_band", "nis_band")]
        pairs = [f"{row[name]['told']:.3g}, {row[name]['made']:.3g}" for name in ("attitude_deg", "bias_deg_s")]
        print(
            f"| {row['t_s'] / 60:.3g} | {row['nees']:.3f} | {ends[0]} | {row['nis']:.4f} | {ends[1]} | "
            f"{pairs[0]} | {pairs[1]} |"
        )


if __name__ == "__main__":
    main()
