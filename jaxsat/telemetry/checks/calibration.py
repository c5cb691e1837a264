"""Check of a magnetometer's bias and scale by the size of the field, which no attitude changes."""

import numpy as np
from jaxtyping import Float

from jaxsat.errors import InputError
from jaxsat.estimation import MagnetometerCalibration, calibrate_magnetometer
from jaxsat.satellites.satellite import Satellite
from jaxsat.sensors import Magnetometer
from jaxsat.sensors.mounting import vectors_of
from jaxsat.significant import unit_text, value_and_sigma
from jaxsat.telemetry.checks.around import Around
from jaxsat.telemetry.checks.finding import Finding, finding
from jaxsat.telemetry.checks.sizes import whole_rows
from jaxsat.telemetry.table.session import Channel

_MOST, _FEWEST = 2000, 20
_SCALE_SEEN, _BIAS_SEEN = 0.05, 0.1
"""Largest 1-sigma with which a scale is told, and a bias in units of the field."""
_SIGMAS = 3.0
"""By which a number may be off what the satellite file has."""
_FIXED = 0.03
"""What it may be off where the file gives it no sigma, of the field or of one."""
_BETTER = 1.2


def check_calibration(satellite: Satellite, channel: Channel, around: Around) -> list[Finding]:
    """Bias, scale and what |B| misses by before and after; nothing for what is not the field with its size."""
    sensor = satellite.model.sensors[channel.name]
    if not isinstance(sensor, Magnetometer) or sensor.unit_vector:
        return []
    t, values = whole_rows(channel)
    read = vectors_of(values, sensor.axes)
    if read is None or len(read) < _FEWEST:
        return []
    every = -(-len(read) // _MOST)
    read, modulus = read[::every], np.linalg.norm(around.field_at(t[::every]), axis=1)
    field = float(np.median(modulus))
    found = _calibrated(read, modulus)
    if found is None:
        text = "|B| alone does not tell its bias: too few directions, another unit, or more than the field"
        return [finding(channel.name, text)]
    bias, scale, used = np.asarray(sensor.bias, float), np.asarray(sensor.scale, float), found.used
    size = np.linalg.norm(sensor.field_of(read[used]), axis=1)
    before, after = (float(np.sqrt(np.mean(off**2))) for off in (size - modulus[used], found.residual[used]))
    leaves = {leaf.name: leaf for leaf in satellite.leaves}
    first = leaves[f"{channel.name}.bias.x"]
    unit, to_unit, sigmas = unit_text(first.unit), first.to_unit, found.sigmas
    away = {f"bias.{c}": found.bias[k] - bias[k] for k, c in enumerate("xyz")}
    if sigmas["scale.x"]:
        away |= {f"scale.{c}": found.scale[k] - scale[k] for k, c in enumerate("xyz")}
    allowed = {name: _FIXED * (field if name.startswith("bias") else 1.0) for name in away}
    allowed |= {name: _SIGMAS * prior for name in away if (prior := leaves[f"{channel.name}.{name}"].sigma)}
    far = [name for name, size in away.items() if abs(size) > np.hypot(_SIGMAS * sigmas[name], allowed[name])]
    numbers = {f"bias_{c}_T": float(b) for c, b in zip("xyz", found.bias, strict=True)}
    numbers |= {f"scale_{c}": float(s) for c, s in zip("xyz", found.scale, strict=True)}
    numbers |= {"misses_before_T": before, "misses_after_T": after}
    text = (
        f"by |B| alone the bias of each axis is {_row(found.bias, sigmas, 'bias', to_unit)} {unit}"
        f"{', its scale ' + _row(found.scale, sigmas, 'scale', 1.0) if sigmas['scale.x'] else ''}: |B| then misses "
        f"that of IGRF by {to_unit * after:.3g} {unit}, with the numbers of the satellite file by "
        f"{to_unit * before:.3g}"
    )
    if far:
        text += f"; {', '.join(far)} {'is' if len(far) == 1 else 'are'} further off than the file allows"
    told = [finding(channel.name, text, odd=bool(far), numbers=numbers)]
    if before > _BETTER * after and channel.name not in satellite.conventions:
        text = f"for [sensors.{channel.name}]: {_keys(found, to_unit)}, its axes as they stand there"
        told.append(finding(channel.name, text))
    return told


def _calibrated(read: Float[np.ndarray, "n 3"], modulus: Float[np.ndarray, " n"]) -> MagnetometerCalibration | None:
    """All nine numbers where they are told, else the bias alone, else None: as where the unit is another."""
    for bias_only in (False, True):
        try:
            found = calibrate_magnetometer(read, modulus, bias_only=bias_only)
        except InputError:
            return None
        sigma = np.sqrt(np.diagonal(found.covariance))
        told = np.all(sigma[:3] < _BIAS_SEEN * np.median(modulus)) and np.all(sigma[3:] < _SCALE_SEEN)
        near = np.sqrt(np.mean(found.residual[found.used] ** 2)) < _BIAS_SEEN * np.median(modulus)
        if told and near and np.all(np.abs(np.log2(np.abs(found.scale))) < 1.0):
            return found
    return None


def _row(numbers, sigmas, name: str, to_unit: float) -> str:
    shown = (
        value_and_sigma(to_unit * number, to_unit * sigmas[f"{name}.{letter}"])
        for letter, number in zip("xyz", numbers, strict=True)
    )
    return ", ".join(f"{value} ± {sigma}" for value, sigma in shown)


def _keys(found: MagnetometerCalibration, to_unit: float) -> str:
    parts = {"bias": to_unit * found.bias, "scale": found.scale, "shear": found.shear}
    told = {name: numbers for name, numbers in parts.items() if name == "bias" or found.sigmas["scale.x"]}
    return " and ".join(f"{name} = [{', '.join(f'{number:.4g}' for number in row)}]" for name, row in told.items())
