"""Two photodiodes of OPS-SAT, calibrated along the attitude that the satellite estimated itself.

    python -m experiments.flight.opssat --out flight-opssat [--data DIR]

The motion is given by quaternions, so the Sun in body axes is known; fitted are gain and axis of each diode, what
shades it at low elevations, the light of the Earth, and by how much each diode's stamps are late against those of the
quaternion. The same is done without that shade, with the element set on the other side of the session, to see what
elements of another month cost, and for 70 % of the time, to see whether the rest is predicted. Without DIR, the folder
of the published files, the excerpt beside this file is taken: every second row of the diodes. Writes figures.json,
opssat.png and the report of the first fit.
"""

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.flight.asked import Figure, told, write_figures
from experiments.flight.clustered import clustered_sigmas
from experiments.flight.opssat_files import EXCERPT, tables_of
from experiments.flight.opssat_picture import draw_opssat

HERE = Path(__file__).parent
ASKED_DEG = 2.5
BEFORE = {"pd3": 4.5, "pd6": 5.5}
"""Median difference [deg] of the nominal diodes, by a first look that took all quaternions."""
CLEAR = 0.03
"""Light of the Earth on a diode, over the Sun's, by the nominal albedo, below which it is clear of it (2 deg)."""
LOWEST = np.radians(3.0)
"""Sun over the plane of the diode at least."""


@dataclass(frozen=True)
class Diode:
    """Readings of one diode beside the fit; arrays run over its samples."""

    name: str
    t_s: np.ndarray
    measured: np.ndarray
    """[deg]"""
    modelled: np.ndarray
    used: np.ndarray
    """Bool: not left out as an outlier."""
    clear: np.ndarray
    """Bool: in full sunlight, above the plane, and clear of earthlight."""
    lit: np.ndarray
    """Bool: in full sunlight and above the plane."""

    @property
    def off(self) -> np.ndarray:
        """Size of the difference [deg]."""
        return np.abs(self.measured - self.modelled)


def main() -> None:
    """Fits, prints asked and measured, and writes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of the published files")
    parser.add_argument("--out", type=Path, default=Path("flight-opssat"))
    arguments = parser.parse_args()
    import jaxsat

    jaxsat.set_up_jax()
    import fitting
    from fitting.settings import FitSettings
    from jaxsat.satellites import Satellite

    with tempfile.TemporaryDirectory() as folder:
        if arguments.data is None:
            tables = EXCERPT / "opssat-attitude.csv", EXCERPT / "opssat-diodes.csv"
        else:
            tables = tables_of(arguments.data, Path(folder))

        def fit(changed=None, **settings):
            satellite = jaxsat.read_satellite(HERE / "opssat.sat.toml", changed=changed)
            assert isinstance(satellite, Satellite)
            session = jaxsat.read_telemetry(tables, satellite)
            # Errors of an attitude that is estimated on board have long tails.
            return fitting.fit(satellite, session, settings=FitSettings(likelihood="student", **settings), causes=False)

        lines = (HERE / "data" / "opssat.tle").read_text("ascii").splitlines()
        best, other, ahead = fit(), fit({"orbit.tle": lines[2:4]}), fit(holdout=0.3)
        plain = fit(free=("albedo", *(f"{d}.{key}" for d in BEFORE for key in ("gain", "tilts", "delay"))))
    diodes = diodes_of(best)
    figures = _figures(best, diodes)
    for what, found in (("without its rim", plain), ("by the element set of 12 December", other)):
        figures += [Figure(f"{d.name} clear, {what}", _median(d, d.clear), "deg median") for d in diodes_of(found)]
    figures.append(Figure("the two element sets apart, at most", orbits_apart_km(best, other), "km"))
    for name, channel in ahead.result.channels.items():
        if channel.holdout is not None:
            what = f"{name} predicted for the last 30 % of the time, over the promised"
            figures.append(Figure(what, channel.holdout.sigma_ratio, "times"))
    print(told(figures))
    for what, found in (("all fitted", best), ("70 % fitted", ahead)):
        print(f"{what}: {found.result.verdict}; {found.result.message}")
    for remark in best.result.remarks:
        print(f"- {remark}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    rows = best.session.rejected_by_reason
    numbers = {p.name: {"value": p.value, "unit": p.unit} for p in best.result.parameters if p.free}
    for name, (by_passes, by_samples) in clustered_sigmas(best).items():
        numbers[name] |= {"sigma_by_passes": by_passes, "sigma_by_samples": by_samples}
    verdicts = {"all": best.result.verdict, "predicting": ahead.result.verdict}
    write_figures(
        *(arguments.out / "figures.json", "jaxsat.flight/1", figures),
        left_out=rows, remarks=best.result.remarks, parameters=numbers, verdicts=verdicts,
    )  # fmt: skip
    draw_opssat(arguments.out / "opssat.png", diodes, best.session.epoch)
    best.write(arguments.out / "report")


def diodes_of(fit) -> list[Diode]:
    """Each diode's readings with what is known of its light."""
    result, problem = fit.result, fit.found.minima[0].problem
    diffuse = float(np.asarray(fit.satellite.model.albedo.diffuse))
    found = []
    for name, channel in result.channels.items():
        place = np.searchsorted(result.t_s, channel.t_s)
        sensor = fit.satellite.model.sensors[name]
        earth = diffuse * _diffuse(problem, result, np.asarray(sensor.normals)[0])[place]
        modelled = channel.modelled[:, 0]
        lit = (result.illumination[place] == 1.0) & (modelled > LOWEST)
        angles = np.degrees(channel.measured[:, 0]), np.degrees(modelled)
        found.append(Diode(name, channel.t_s, *angles, channel.used, lit & (earth < CLEAR), lit))
    return found


def _diffuse(problem, result, normal) -> np.ndarray:
    """[samples] what an Earth of reflectivity one would add on a face, over the Sun square on."""
    import jax
    import jax.numpy as jnp

    from jaxsat.math import quaternion
    from jaxsat.sensors import Albedo
    from jaxsat.sensors.solar_panels import earthlight

    n, albedo = len(result.t_s), Albedo(jnp.asarray(0.0), jnp.asarray(1.0))
    light = jax.tree.map(lambda leaf: jnp.asarray(leaf)[:n], problem.sky.light)
    faces = jax.vmap(lambda q: quaternion.rotate(q, jnp.asarray(normal)))(result.quaternion_inertial_from_body)
    return np.asarray(jax.vmap(lambda face, light: earthlight(face[None], albedo, light)[0])(faces, light))


def orbits_apart_km(one, other) -> float:
    """Largest distance between the positions by the orbits of two fits, at the samples of the first."""
    import jax

    positions = [np.asarray(jax.vmap(fit.around.orbit)(one.result.t_s)[0]) for fit in (one, other)]
    return 1e-3 * float(np.linalg.norm(positions[0] - positions[1], axis=1).max())


def _median(diode: Diode, part: np.ndarray) -> float:
    return float(np.median(diode.off[part]))


def _figures(fit, diodes: list[Diode]) -> list[Figure]:
    found = []
    for each in diodes:
        what = f"{each.name} clear of earthlight ({int(each.clear.sum())} samples)"
        found.append(Figure(what, _median(each, each.clear), "deg median", ASKED_DEG, BEFORE[each.name]))
        found.append(
            Figure(f"{each.name} clear, eight of ten within", float(np.quantile(each.off[each.clear], 0.8)), "deg")
        )
        found.append(Figure(f"{each.name} all in sunlight", _median(each, each.lit), "deg median"))
        early = each.clear & (each.t_s < 11.0 * 86400.0)
        found.append(Figure(f"{each.name} clear, 15 to 25 November", _median(each, early), "deg median"))
        found.append(Figure(f"{each.name} clear, 26 to 29 November", _median(each, each.clear & ~early), "deg median"))
    sigmas = clustered_sigmas(fit)
    for p in fit.result.parameters:
        if p.free:
            by_passes, by_samples = sigmas[p.name]
            label = f"{p.name}, sigma by passes {by_passes:.2g}, by samples {by_samples:.2g}"
            found.append(Figure(label, p.value, "" if p.unit == "1" else p.unit))
    return found


if __name__ == "__main__":
    main()
