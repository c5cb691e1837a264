"""The files of a simulated session of any satellite: table, truth, satellite file, pictures."""

from pathlib import Path
from typing import Any

import equinox as eqx
import numpy as np
from scipy.spatial.transform import Rotation

from jaxsat.errors import InputError
from jaxsat.files.json_files import plain, write_json
from jaxsat.files.units import parsed_unit
from jaxsat.satellites.model import array_at, nominal_values
from jaxsat.significant import unit_text
from jaxsat.synthetic.twins.copied import satellite_files
from jaxsat.synthetic.twins.table import table_text
from jaxsat.synthetic.twins.twin import Twin
from jaxsat.versions import versions

SCHEMA = "jaxsat.twin/1"


def name_of(path: Path) -> str:
    """Name of a session by its satellite file: without `.toml` and `.sat`."""
    return path.name.removesuffix(".toml").removesuffix(".sat")


def owned_files(twin: Twin) -> tuple[str, ...]:
    """All names that `write_twin` may write."""
    name = name_of(twin.satellite.path)
    tables = [f"{name}.{ending}" for ending in ("csv", "truth.json", "sat.toml", "tle", "omm", "oem", "motion.png")]
    return (*tables, *(f"{name}.{channel}.png" for channel in twin.channels))


def write_twin(directory: Path, twin: Twin, *, plots: bool = True, target: Path | None = None) -> None:
    """Writes a session into a directory that is there: `jaxsat fit NAME.csv --satellite NAME.sat.toml` reads it.

    `target` is where the files end up. Raises `InputError` where the satellite file itself would be written over.
    """
    name, files = name_of(twin.satellite.path), satellite_files(twin, name_of(twin.satellite.path))
    for file, content in files.items():
        place = (target or directory) / file
        if place.exists() and place.resolve() == twin.satellite.path.resolve() and place.read_bytes() != content:
            raise InputError("the copy with its own orbit would be written over it; give another --out", file=place)
        (directory / file).write_bytes(content)
    (directory / f"{name}.csv").write_text(table_text(twin), encoding="utf-8", newline="\n")
    write_json(directory / f"{name}.truth.json", plain(truth(twin))[0])
    if plots:
        for file, png in pictures(twin, name).items():
            (directory / file).write_bytes(png)


def truth(twin: Twin) -> dict[str, Any]:
    """Returns the content of `NAME.truth.json`, SI: t after `epoch_utc`, q inertial from body, w, all numbers."""
    spots = [leaf.spot for leaf in twin.satellite.leaves]
    true, nominal = nominal_values(twin.model, spots), nominal_values(twin.satellite.model, spots)
    parameters = {
        f"rate.{axis}": {"value": value, "unit": "rad/s"}
        for axis, value in zip("xyz", twin.motion.angular_velocity[0].tolist(), strict=True)
    }
    for leaf, value, before in zip(twin.satellite.leaves, true.tolist(), nominal.tolist(), strict=True):
        parameters[leaf.name] = {
            "value": value,
            "unit": parsed_unit(leaf.unit).quantity,
            "nominal": before,
            "drawn": leaf.sigma is not None and not twin.settings.nominal,
        }
    sensors = {
        name: {"columns": list(twin.satellite.channels[name].columns), "stamp_s": each.stamp_s, "mean": each.mean}
        for name, each in twin.channels.items()
    }
    for name in twin.satellite.conventions:
        sensors[name]["axes"] = np.asarray(array_at(twin.model, f"sensors.{name}.axes"))
    return {
        "schema": SCHEMA,
        "epoch_utc": twin.epoch.iso(6),
        "frame": "true of date",
        "t": twin.motion.t_s,
        "q": twin.motion.quaternion,
        "w": twin.motion.angular_velocity,
        "attitude_error_rad": twin.motion.error,
        "parameters": parameters,
        "sensors": sensors,
        "settings": twin.settings.model_dump(mode="json"),
        "versions": versions(),
    }


def pictures(twin: Twin, name: str) -> dict[str, bytes]:
    """Returns the pictures as PNG by file name."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    subtitle = f"{name}, simulated, epoch {twin.epoch.iso(3)} UTC, seed {twin.settings.seed}"
    motion = twin.motion
    field = np.array(eqx.filter_jit(twin.around)(motion.t_s).b_field_eci)
    body = 1e6 * Rotation.from_quat(motion.quaternion, scalar_first=True).inv().apply(field)
    charts = {
        "angular velocity, body axes, deg/s": dict(zip("xyz", np.degrees(motion.angular_velocity).T, strict=True)),
        "magnetic field, body axes, uT": dict(zip("xyz", body.T, strict=True)),
    }
    found = {"motion": draw_history(motion.t_s, charts, title="Motion of the simulated session", subtitle=subtitle)}
    for channel, each in twin.channels.items():
        settings = twin.satellite.channels[channel]
        readings = {
            ", ".join(filter(None, (column, unit_text(settings.unit)))): {
                "simulated, as sent": each.values[:, k],
                "simulated, without noise": each.mean[:, k],
            }
            for k, column in enumerate(settings.columns)
            if column
        }
        found[channel] = draw_history(
            each.stamp_s, readings, title=f"Simulated readings of {channel}", subtitle=subtitle
        )
    return {f"{name}.{key}.png": png_bytes(figure) for key, figure in found.items()}
