"""The light that the Earth returns to a panel: a mirror, a Lambert sphere, the zones of Knocke, Ries & Tapley (1988).

Four pictures of a panel's current over that of direct normal sunlight, and the numbers behind them as JSON. The mirror
and the Lambert sphere return all light; actual reflectivities are 0.1 to 0.5.

    .venv/bin/python experiments/albedo_maps.py --out out/albedo-maps
"""

import argparse
import json
from pathlib import Path

import jax
import numpy as np

HEIGHTS_KM = np.geomspace(200.0, 4000.0, 60)
SUN_DEG = np.linspace(0.0, 150.0, 101)  # from the zenith
ZONES_HEIGHT_KM = 700.0
MUNIN_HEIGHT_KM, MUNIN_SUN_DEG = 7630.026457 - 6371.2, 40.0
LATITUDES_DEG, DAYS = np.linspace(-90.0, 90.0, 61), np.linspace(0.0, 365.0, 53)
YEAR = 2001


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/albedo-maps"))
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    found = compute()
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "albedo_maps.json").write_text(json.dumps({k: np.round(v, 6).tolist() for k, v in found.items()}))
    (arguments.out / "albedo_maps.png").write_bytes(picture(found))
    ratio = found["zones_over_uniform"]
    print(f"zones over uniform: {ratio.min():.3f} to {ratio.max():.3f} of 0.34 at {ZONES_HEIGHT_KM:g} km")
    print(f"written to {arguments.out}/albedo_maps.json and .png")


def compute() -> dict[str, np.ndarray]:
    import jax.numpy as jnp

    from jaxsat.constants import EARTH_RADIUS_MEAN
    from jaxsat.environment import DiffuseAlbedo, SpecularAlbedo, apparent_sun, knocke_albedo
    from jaxsat.time import SECONDS_PER_DAY, Epoch

    def overhead(height_km, sun_deg):
        """Satellite on the z axis, Sun in the xz plane."""
        a = jnp.radians(sun_deg)
        distance = EARTH_RADIUS_MEAN + 1e3 * height_km
        return jnp.stack([0.0 * distance, 0.0 * distance, distance]), jnp.stack([jnp.sin(a), 0.0 * a, jnp.cos(a)])

    def mirror(height_km, sun_deg):
        return SpecularAlbedo()(*overhead(height_km, sun_deg))[1]

    def facing_nadir(position, light):
        directions, weights = light
        return -weights @ (directions @ position) / jnp.linalg.norm(position)

    def lambert(height_km, sun_deg):
        position, sun = overhead(height_km, sun_deg)
        return facing_nadir(position, DiffuseAlbedo()(position, sun))

    def tilted(tilt_deg):
        """Both lights on a panel whose normal stands `tilt_deg` from the zenith, positive toward the Sun's side."""
        position, sun = overhead(jnp.asarray(MUNIN_HEIGHT_KM), jnp.asarray(MUNIN_SUN_DEG))
        a = jnp.radians(tilt_deg)
        normal = jnp.stack([jnp.sin(a), 0.0 * a, jnp.cos(a)])
        direction, factor = SpecularAlbedo()(position, sun)
        directions, weights = DiffuseAlbedo()(position, sun)
        return factor * jnp.maximum(normal @ direction, 0.0), weights @ jnp.maximum(directions @ normal, 0.0)

    epoch = Epoch.from_utc(YEAR, 1, 1)
    t = DAYS * SECONDS_PER_DAY
    sun, _ = apparent_sun(epoch, t)
    zones = DiffuseAlbedo(reflectivity=knocke_albedo(epoch))

    def over_uniform(latitude_deg, sun_eci, t):
        """At the Sun's local noon: the satellite on the Sun's meridian."""
        b, right_ascension = jnp.radians(latitude_deg), jnp.arctan2(sun_eci[1], sun_eci[0])
        up = jnp.stack([jnp.cos(b) * jnp.cos(right_ascension), jnp.cos(b) * jnp.sin(right_ascension), jnp.sin(b)])
        position = (EARTH_RADIUS_MEAN + 1e3 * ZONES_HEIGHT_KM) * up
        uniform = 0.34 * facing_nadir(position, DiffuseAlbedo()(position, sun_eci))
        return facing_nadir(position, zones(position, sun_eci, t)) / uniform

    def over_grid(f):
        return np.asarray(jax.jit(jax.vmap(jax.vmap(f, (None, 0)), (0, None)))(HEIGHTS_KM, SUN_DEG))

    by_day = jax.vmap(over_uniform, (None, 0, 0))
    tilt = np.linspace(-180.0, 180.0, 361)
    one_way, scattered = jax.jit(jax.vmap(tilted))(tilt)
    return {
        "height_km": HEIGHTS_KM,
        "sun_from_zenith_deg": SUN_DEG,
        "mirror": over_grid(mirror),
        "lambert": over_grid(lambert),
        "latitude_deg": LATITUDES_DEG,
        "day_of_year": DAYS,
        "zones_over_uniform": np.asarray(jax.jit(jax.vmap(by_day, (0, None, None)))(LATITUDES_DEG, sun, t)),
        "tilt_deg": tilt,
        "mirror_by_tilt": np.asarray(one_way),
        "lambert_by_tilt": np.asarray(scattered),
    }


def picture(found: dict[str, np.ndarray]) -> bytes:
    from matplotlib.colors import TwoSlopeNorm

    from jaxsat.plotting.style import FAINT, INK, dress, head, new_figure, png_bytes

    figure = new_figure(
        11.0,
        8.2,
        "Light returned by the Earth to a panel, over direct normal sunlight",
        "mirror and Lambert sphere that return everything; Knocke's zones against a uniform 0.34",
    )
    grid = figure.add_gridspec(2, 2, left=0.07, right=0.96, top=0.89, bottom=0.07, wspace=0.26, hspace=0.32)
    levels = [0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]
    for column, (name, title) in enumerate(
        [("mirror", "mirror: panel facing the Sun's image"), ("lambert", "Lambert sphere: panel facing the nadir")]
    ):
        axes = figure.add_subplot(grid[0, column])
        value = np.where(found[name] > 0.0, found[name], np.nan)
        axes.pcolormesh(SUN_DEG, HEIGHTS_KM, np.sqrt(value), cmap="YlGnBu", vmin=0.0, vmax=1.0, shading="gouraud")
        lines = axes.contour(SUN_DEG, HEIGHTS_KM, found[name], levels=levels, colors=INK, linewidths=0.7)
        axes.clabel(lines, fontsize=7, fmt="%g")
        axes.set_yscale("log")
        axes.set_yticks([200, 400, 700, 1000, 2000, 4000], ["200", "400", "700", "1000", "2000", "4000"])
        axes.minorticks_off()
        dress(axes, x_label="Sun from the zenith [deg]", y_label="height [km]" if column == 0 else "")
        head(axes, title)

    axes = figure.add_subplot(grid[1, 0])
    ratio = found["zones_over_uniform"]
    axes.pcolormesh(DAYS, LATITUDES_DEG, ratio, cmap="BrBG", norm=TwoSlopeNorm(1.0, 0.5, 2.0), shading="gouraud")
    lines = axes.contour(DAYS, LATITUDES_DEG, ratio, levels=np.arange(0.6, 2.2, 0.1), colors=INK, linewidths=0.7)
    axes.clabel(lines, fontsize=7, fmt="%.1f")
    axes.set_yticks(np.arange(-90, 91, 30))
    dress(axes, x_label=f"day of {YEAR}", y_label="latitude of the satellite [deg]")
    head(axes, f"Knocke's zones over a uniform 0.34: panel facing the nadir, {ZONES_HEIGHT_KM:g} km, noon")

    axes = figure.add_subplot(grid[1, 1])
    limit = np.degrees(np.arccos(6371.2 / (6371.2 + MUNIN_HEIGHT_KM)))
    axes.axvspan(-limit, limit, color="#eef0f4", linewidth=0)
    axes.text(0.0, 0.02, f"no Earth\nwithin {limit:.1f} deg", ha="center", va="bottom", fontsize=8, color=FAINT)
    for name, colour, label in (("mirror", "#8a4b20", "mirror"), ("lambert", "#2340a8", "Lambert sphere")):
        axes.plot(found["tilt_deg"], found[f"{name}_by_tilt"], color=colour, linewidth=1.6, label=label)
    axes.set_xticks(np.arange(-180, 181, 60))
    axes.set_xlim(-180, 180)
    axes.set_ylim(0.0, None)
    axes.legend(frameon=False, fontsize=8, loc="upper left")
    dress(axes, x_label="panel's normal from the zenith, toward the Sun's side [deg]")
    head(axes, f"panel of any tilt: {MUNIN_HEIGHT_KM:.0f} km, Sun {MUNIN_SUN_DEG:g} deg from the zenith")
    return png_bytes(figure)


if __name__ == "__main__":
    main()
