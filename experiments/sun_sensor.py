"""The pyramid Sun sensor of Zhukov 2019: Table 1, figures 5 to 7 and 9 to 18, and the same with a better estimator.

Figures 9 to 18 are errors of the direction found, true less found, over the azimuth at fixed angles from the axis, and
their largest. Above, the published reconstruction, sample by sample. Below, all candidates of each sample followed by a
gyro through one turn about the axis, after a turn to settle. Prints a table of the largest errors and what share of the
field of view one sample leaves ambiguous, with all faces and with one dead; writes JSON and pictures.

    .venv/bin/python experiments/sun_sensor.py --out out/sun-sensor
"""

import argparse
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

AZIMUTH_STEP_DEG, ANGLE_STEP_DEG = 0.1, 0.1
SHOWN = {(9, 10): (61.0, 66.0, 71.0), (11, 12): (71.3, 74.0), (13, 14): (75.0, 78.0), (15, 16): (79.0, 84.0, 89.0)}
"""Figures of angle and azimuth errors, and the angles [deg] of their lines."""
LARGEST_DEG = 78.147661
"""Where the plus of eq. (15) ends: the largest errors of all, at azimuths that no even grid hits."""
EDGE_AZIMUTHS_DEG = np.arange(25.3, 25.5, 1e-4)
"""Beside which they are, and a quarter turn further."""
RANGES = {  # Table 1: [deg], faces lit, largest errors of angle and azimuth as the text has them [deg]
    "1": (0.0, 15.0, "4", 0.0, 0.0),
    "2": (15.0, 20.454791, "3, 4", 0.0, 0.0),
    "3": (20.454791, 60.257244, "2, 3", 0.0, 0.0),
    "4": (60.257244, 71.01466, "2, 3", 21.5, 4.2),
    "5": (71.01466, 74.0, "1, 2", None, None),
    "6, to 78.15": (74.0, LARGEST_DEG, "1, 2", None, None),
    "6, beyond": (78.147691, 90.0, "1, 2", 12.0, 8.0),
}
NOTE = "without noise; true less found, with the Sun at a fixed angle from the axis"
DEAD_FACE = 0
SAMPLES = 200_000  # evenly over the field of view, for its ambiguous shares
COLOURS = ("#2340a8", "#8a4b20", "#2e8b3d")
KINDS = {"one direction": "#dfe6ee", "two directions": "#e0a030", "a curve: one face lit": "#8e44ad", "dark": "#333333"}


def directions(angle_deg, azimuth_deg):
    """Unit vectors at angles from the axis and azimuths from y toward z (eq. 8)."""
    a, p = np.broadcast_arrays(np.radians(angle_deg), np.radians(azimuth_deg))
    return np.stack([np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)], axis=-1)


def errors_deg(found, angle_deg, azimuth_deg):
    """Errors of angle and azimuth, true less found, [2, angle, azimuth]."""
    angle = angle_deg - np.degrees(np.arctan2(np.hypot(found[..., 1], found[..., 2]), found[..., 0]))
    azimuth = azimuth_deg - np.degrees(np.arctan2(found[..., 2], found[..., 1]))
    return np.stack([angle, (azimuth + 180.0) % 360.0 - 180.0])


@jax.jit
@jax.vmap
def published(sun):
    from jaxsat.estimation import published_direction
    from jaxsat.sensors import PyramidSunSensor, face_currents

    sensor = PyramidSunSensor()
    reading = published_direction(sensor, face_currents(sensor, sun))
    return reading.direction, reading.lit


@jax.jit
def tracked(turn, suns):
    """Best directions along Suns of [sample, case, 3], the instrument turning by `turn` each sample."""
    from jaxsat.estimation import blank_track, carried, followed, sun_candidates
    from jaxsat.sensors import PyramidSunSensor, face_currents

    sensor = PyramidSunSensor()

    def step(track, sun):
        track = carried(track, turn)
        track = followed(track, sun_candidates(sensor, face_currents(sensor, sun), track.best()))
        return track, track.best()

    blank = jax.tree.map(lambda x: jnp.broadcast_to(x, (suns.shape[1], *x.shape)), blank_track())
    return jax.lax.scan(lambda track, sun: jax.vmap(step)(track, sun), blank, suns)[1]


def both_errors_deg(angle_deg, azimuth_deg):
    """Errors of the published algorithm and of the tracker, each [2, angle, azimuth]."""
    angle, azimuth = angle_deg[:, None], azimuth_deg[None]
    suns = directions(angle, azimuth)
    found, _ = published(suns.reshape(-1, 3))
    along = np.swapaxes(np.concatenate([suns, suns], axis=1), 0, 1)
    # The Sun goes round by a step of azimuth as the instrument turns back by it.
    best = tracked(jnp.asarray([-np.radians(AZIMUTH_STEP_DEG), 0.0, 0.0]), along)[azimuth_deg.size :]
    both = np.asarray(found).reshape(suns.shape), np.swapaxes(np.asarray(best), 0, 1)
    return [errors_deg(each, angle, azimuth) for each in both]


@jax.jit
def kinds_of(sun, dead):
    """Index into `KINDS`: what one sample says, for each Sun, with all faces or, where `dead`, one less."""
    from jaxsat.estimation import sun_candidates
    from jaxsat.sensors import PyramidSunSensor, face_currents

    sensor, alive = PyramidSunSensor(), (jnp.arange(4) != DEAD_FACE) | ~dead

    def of_one(v):
        found = sun_candidates(sensor, face_currents(sensor, v), v, alive=alive)
        several = jnp.where(jnp.sum(found.possible) > 1, 1, 0)
        return jnp.where(found.lit == 0, 3, jnp.where(found.lit == 1, 2, several))

    return jax.vmap(of_one)(sun)


def shares(dead: bool) -> dict:
    rng = np.random.default_rng(0)
    sun = directions(np.degrees(np.arccos(rng.uniform(0.0, 1.0, SAMPLES))), rng.uniform(0.0, 360.0, SAMPLES))
    counts = np.bincount(np.asarray(kinds_of(sun, jnp.asarray(dead))), minlength=4)
    return dict(zip(KINDS, (counts / SAMPLES).tolist(), strict=True))


def plain_figures(folder: Path) -> None:
    """Figures 5 to 7: the shade, one current, a difference of two."""
    from jaxsat.plotting.style import FAINT, INK, dress, new_figure, png_bytes
    from jaxsat.sensors import PyramidSunSensor, face_currents, lit_fraction

    sensor = PyramidSunSensor()
    alpha = np.linspace(-90.0, 90.0, 3601)
    suns = directions(alpha, 90.0)
    current = np.asarray(jax.vmap(lambda v: face_currents(sensor, v))(suns))
    share = np.asarray(jax.vmap(lambda x: lit_fraction(sensor, x))(np.cos(np.radians(alpha))))
    without = np.maximum(share * np.cos(np.radians(alpha - 68.0)), 0.0)
    difference = [(current[:, 0] - current[:, 1], INK, "-")]
    pictures = {
        "figure_05": ("Share of a face that the hood leaves lit", "K_C", [(share, INK, "-")]),
        "figure_06": ("Current of face 1", "K_C cos(incidence)", [(without, FAINT, "--"), (current[:, 0], INK, "-")]),
        "figure_07": ("Difference of the currents of faces 1 and 2", "i1 - i2, of the largest current", difference),
    }
    for name, (title, label, lines) in pictures.items():
        note = "; dashed: without total reflection beyond 83 deg of incidence" if len(lines) > 1 else ""
        figure = new_figure(7.0, 4.0, f"Figure {int(name[-2:])}: {title}", "the Sun in the plane across face 1" + note)
        axes = figure.add_axes((0.11, 0.13, 0.86, 0.7))
        for y, colour, style in lines:
            axes.plot(alpha, y, color=colour, ls=style, lw=1.4)
        first, step = (60, 5) if name == "figure_05" else (-90, 15)
        axes.set(xlim=(first, 90), xticks=np.arange(first, 91, step))
        dress(axes, y_label=label, x_label="angle of the Sun from the axis, deg")
        (folder / f"{name}.png").write_bytes(png_bytes(figure))


def error_figure(number: int, title: str, note: str, x_label: str, x, lines, folder: Path) -> None:
    """One figure of the paper: published above, tracked below on the same scale; `lines` of label and both errors."""
    from jaxsat.plotting.style import dress, head, new_figure, png_bytes

    figure = new_figure(9.0, 6.4, f"Figure {number}: {title}", note)
    grid = figure.add_gridspec(2, 1, left=0.095, right=0.98, top=0.86, bottom=0.085, hspace=0.3, height_ratios=(3, 2))
    for row, name in enumerate(("published algorithm, sample by sample", "all candidates, followed by a gyro")):
        axes = figure.add_subplot(grid[row, 0])
        for (label, errors), colour in zip(lines, COLOURS, strict=False):
            axes.plot(x, errors[row], color=colour, lw=1.2, label=label)
        axes.set_xlim(x[0], x[-1])
        low, high = (side([0.0, *(side(errors[0]) for _, errors in lines)]) for side in (np.min, np.max))
        axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
        if x_label.startswith("azimuth"):
            axes.set_xticks(np.arange(0, 361, 30))
        dress(axes, y_label="error, deg", x_label=x_label if row else "")
        largest = max(np.max(np.abs(errors[row])) for _, errors in lines)
        head(axes, f"{name}: up to {largest:.2f} deg" if largest > 1e-3 else f"{name}: up to {largest:.0e} deg")
        if row == 0 and lines[0][0]:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(lines), fontsize=8.5, frameon=False)
    (folder / f"figure_{number:02d}.png").write_bytes(png_bytes(figure))


def map_figure(folder: Path) -> None:
    """The field of view seen along the axis, radius for angle: what one sample says where."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    from jaxsat.plotting.style import head, new_figure, png_bytes

    figure = new_figure(9.6, 5.6, "What one sample says of the Sun's direction", "radius: angle from the axis, deg")
    y, z = np.meshgrid(np.linspace(-90.0, 90.0, 601), np.linspace(-90.0, 90.0, 601))
    angle = np.hypot(y, z)
    for column, dead in enumerate((False, True)):
        axes = figure.add_axes((0.02 + 0.49 * column, 0.1, 0.46, 0.74))
        kind = np.asarray(kinds_of(directions(angle, np.degrees(np.arctan2(z, y))).reshape(-1, 3), jnp.asarray(dead)))
        kind = np.ma.masked_where(angle >= 89.99, kind.reshape(angle.shape))
        axes.imshow(
            kind, origin="lower", extent=(-90, 90, -90, 90), cmap=ListedColormap(list(KINDS.values())), vmin=0, vmax=3
        )
        around = np.linspace(0.0, 2.0 * np.pi, 361)
        for radius in (30.0, 60.0, 90.0):
            axes.plot(radius * np.cos(around), radius * np.sin(around), color="white" if radius < 90 else "k", lw=0.7)
            axes.text(0.0, radius, f"{radius:.0f}", fontsize=8, ha="center", va="bottom")
        for face, place in enumerate([(0, 103), (0, -103), (103, 0), (-103, 0)]):
            axes.text(*place, f"{face + 1}", ha="center", va="center", fontsize=9, fontweight="bold")
        axes.set(xlim=(-110, 110), ylim=(-110, 110))
        axes.set_axis_off()
        head(axes, f"face {DEAD_FACE + 1} dead" if dead else "all four faces")
    patches = [Patch(color=colour, label=name) for name, colour in KINDS.items()]
    figure.legend(handles=patches, loc="lower center", ncols=4, fontsize=9, frameon=False)
    (folder / "ambiguity.png").write_bytes(png_bytes(figure))


def within(begin: float, end: float, azimuth) -> tuple[str, np.ndarray, np.ndarray]:
    """Faces lit in a range of angles, and the largest errors of angle and azimuth, published and tracked."""
    angle = np.linspace(begin + 1e-6, end - 1e-6, 41)
    lit = np.asarray(published(directions(angle[:, None], azimuth[None]).reshape(-1, 3))[1])
    here, ours = (np.max(np.abs(errors), axis=(1, 2)) for errors in both_errors_deg(angle, azimuth))
    # At the range's end the errors of one sample are largest beside an azimuth that the even grid leaps over.
    last = np.array([[end]])
    found, _ = published(directions(last, EDGE_AZIMUTHS_DEG[None]).reshape(-1, 3))
    edge = errors_deg(np.asarray(found).reshape(1, -1, 3), last, EDGE_AZIMUTHS_DEG[None])
    here = np.maximum(here, np.max(np.abs(edge), axis=(1, 2)))
    return ", ".join(str(n) for n in sorted(set(lit.tolist()))), here, ours


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sun-sensor"), help="directory for results")
    folder = parser.parse_args().out
    jax.config.update("jax_enable_x64", True)
    folder.mkdir(parents=True, exist_ok=True)

    azimuth = np.arange(0.0, 360.0, AZIMUTH_STEP_DEG)
    names, report = ("viewing angle", "azimuth"), {"ranges": [], "at_angles_deg": {}}
    print("range      angle, deg       faces lit   largest errors of angle and azimuth, deg")
    print("                              here         paper        published, here        tracked")
    for name, (begin, end, lit, *paper) in RANGES.items():
        found, here, ours = within(begin, end, azimuth)
        said = " ".join("    -" if x is None else f"{x:5.1f}" for x in paper)
        numbers = f"{here[0]:9.5f} {here[1]:8.5f}    {ours[0]:8.1e} {ours[1]:8.1e}"
        print(f"{name:12s}{begin:7.3f} {end:7.3f}   {found:10s} {said}    {numbers}")
        entry = {"range": name, "angle_deg": [begin, end], "faces_lit": found, "faces_lit_paper": lit}
        report["ranges"].append(
            entry | {"largest_deg": {"paper": paper, "published": here.tolist(), "tracked": ours.tolist()}}
        )

    for numbers, angles in SHOWN.items():
        here, ours = both_errors_deg(np.array(angles), azimuth)
        for row, (number, name) in enumerate(zip(numbers, names, strict=True)):
            lines = [(f"{angle:g} deg", (here[row, k], ours[row, k])) for k, angle in enumerate(angles)]
            error_figure(number, f"error of the {name}", NOTE, "azimuth of the Sun, deg", azimuth, lines, folder)
        for k, angle in enumerate(angles):
            sizes = (("published", here[:, k]), ("tracked", ours[:, k]))
            report["at_angles_deg"][f"{angle:g}"] = {n: np.max(np.abs(e), axis=1).tolist() for n, e in sizes}

    angle = np.arange(60.0, 90.0, ANGLE_STEP_DEG)
    here, ours = both_errors_deg(angle, azimuth)
    for row, (number, name) in enumerate(zip((17, 18), names, strict=True)):
        lines = [("", [np.max(np.abs(errors[row]), axis=1) for errors in (here, ours)])]
        title, x_label = f"largest error of the {name}", "angle of the Sun from the axis, deg"
        error_figure(number, title, "without noise; over all azimuths", x_label, angle, lines, folder)

    plain_figures(folder)
    map_figure(folder)
    report["shares_of_the_field_of_view"] = {"all faces": shares(False), "one face dead": shares(True)}
    print("share of the field of view, from one sample:", *(f"{kind:>24s}" for kind in KINDS))
    for name, share in report["shares_of_the_field_of_view"].items():
        print(f"{name:>43s} ", *(f"{100.0 * value:22.2f} %" for value in share.values()))
    (folder / "sun_sensor.json").write_text(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
