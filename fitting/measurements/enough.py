"""Whether the readings can tell an attitude at all: asked before the work of a fit."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fitting.measurements.problem import Problem
from jaxsat.errors import InputError
from jaxsat.satellites.model import Model
from jaxsat.sensors import Panels
from jaxsat.telemetry import Channel

FIELD = "currents"
"""What an error names."""
FEWEST_LIT = 5
"""Samples with light."""


def check_light(channels: Mapping[str, Channel], model: Model, path: Path) -> None:
    """Raises `InputError` where panels are all that is fitted and their currents cannot tell an attitude.

    Needed are `FEWEST_LIT` samples with some current above the noise, and light seen along two directions: panels that
    look along one axis leave the direction to the Sun free to turn about it.
    """
    fitted = {name: channel for name, channel in channels.items() if not channel.witness}
    if len(fitted) != 1:
        return
    ((name, channel),) = fitted.items()
    sensor = model.sensors[name]
    if not isinstance(sensor, Panels):
        return
    told = f"{channel.sigma * channel.to_unit:.2g} {channel.unit}"
    seen = np.nan_to_num(channel.values) > channel.sigma
    lit, count = int(seen.any(axis=1).sum()), len(seen)
    if lit == 0:
        raise InputError(f"all {count} samples are in shadow: no current exceeds {told}", file=path, field=FIELD)
    ever = np.asarray(seen.any(axis=0))
    normals = np.asarray(sensor.normals)[ever]
    if np.linalg.matrix_rank(normals, tol=0.1) < 2:
        panels = [column for column, found in zip(channel.columns, ever, strict=True) if found]
        which = f"panel {panels[0]}" if len(panels) == 1 else f"the panels {' and '.join(panels)}"
        reason = f"only {which} ever exceed(s) {told}; the attitude needs light on panels of two axes"
        raise InputError(reason, file=path, field=FIELD)
    if lit < FEWEST_LIT:
        reason = f"only {lit} of {count} samples are lit (a current above {told}); at least {FEWEST_LIT} are needed"
        raise InputError(reason, file=path, field=FIELD)


def check_sunlit(problem: Problem, witness: Mapping[str, bool], fewest: int) -> None:
    """Raises `InputError` where all that is fitted sees light alone, and too few samples do so outside the shadow."""
    light, sensors = problem.sky.light, problem.model.sensors
    fitted = np.array([not witness[group.name] for group in problem.groups])
    seeing = np.array([sensors[group.name].sees == "sun" for group in problem.groups])
    if light is None or np.any(fitted & ~seeing):
        return
    lit = np.asarray(problem.bright)[:, fitted].any(axis=1) & (np.asarray(light.illumination) > 0.0) & problem.valid
    if lit.sum() < fewest:
        raise InputError(
            f"only {lit.sum()} samples both outside the computed shadow and with light; a fit needs at least {fewest}"
        )
