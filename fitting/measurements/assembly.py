"""From a table of channels to the padded problem of a fit."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import numpy as np

from fitting.measurements.abstract import PAD_SAMPLES, PAD_STEPS
from fitting.measurements.contradicted import BRIGHT, contradicted
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.given import motion_at
from fitting.measurements.groups import Group, Groups, over_columns
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around, Sky, nodes_at, sky_at
from jaxsat.environment import Commands
from jaxsat.errors import InputError
from jaxsat.integrators import StepGrid
from jaxsat.math.sizes import few_sizes
from jaxsat.satellites.model import Model
from jaxsat.sensors import Panels
from jaxsat.telemetry import Channel, TableSession
from jaxsat.time import Epoch
from jaxsat.torques.commanded import commanded_columns

OUT_OF_RANGE = 5.0
"""Readings beyond so many times what nine of ten stay below are out of range."""


@dataclass(frozen=True)
class Samples:
    """Channels on the union of their times."""

    t: np.ndarray
    """[time] rising [s]."""
    values: Mapping[str, np.ndarray]
    """[time readings] of each channel, SI, NaN where not measured."""
    channels: Mapping[str, Channel]
    epoch: Epoch
    columns: Mapping[str, tuple[np.ndarray, np.ndarray]]
    """Times and values of further columns: commands, currents that disturb."""
    given: tuple[np.ndarray, np.ndarray] | None = None
    """Times and quaternions of a motion that is given."""

    @staticmethod
    def of(
        channels: Mapping[str, Channel],
        epoch: Epoch,
        columns: Mapping[str, tuple[np.ndarray, np.ndarray]],
        given: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> "Samples":
        """The channels at each time at which any of them measured."""
        measured = {name: np.isfinite(channel.values).any(axis=1) for name, channel in channels.items()}
        t = np.unique(np.concatenate([channel.t_s[measured[name]] for name, channel in channels.items()]))
        values = {}
        for name, channel in channels.items():
            rows = np.full((len(t), channel.values.shape[1]), np.nan)
            rows[np.searchsorted(t, channel.t_s[measured[name]])] = channel.values[measured[name]]
            values[name] = rows
        return Samples(t, values, channels, epoch, columns, given)

    def part(self, which: slice | np.ndarray) -> "Samples":
        """Some of the samples, in their order, by their numbers."""
        return replace(self, t=self.t[which], values={name: rows[which] for name, rows in self.values.items()})


def channels_within(session: TableSession, arc_s: tuple[float, float] | None) -> dict[str, Channel]:
    """Channels with a reading, of the samples in an arc [s] alone; raises `InputError` where there is none."""
    found = {}
    for name, channel in session.channels.items():
        inside = np.ones(len(channel.t_s), bool)
        if arc_s is not None:
            inside = (channel.t_s >= arc_s[0]) & (channel.t_s <= arc_s[1])
        if np.isfinite(channel.values[inside]).any():
            found[name] = replace(channel, t_s=channel.t_s[inside], values=channel.values[inside])
    if not found and arc_s is not None:
        first, last = session.span_s
        reason = f"no sample between {arc_s[0]:g} and {arc_s[1]:g} s; the session runs from {first:g} to {last:g} s"
        raise InputError(reason, file=session.paths[0], field="arc")
    if not found:
        raise InputError("no channel of the satellite file has a reading", file=session.paths[0])
    return found


def groups_of(model: Model, samples: Samples) -> Groups:
    """The columns of residuals of each channel, in the order of the channels."""
    found = []
    for name, rows in samples.values.items():
        sensor = model.sensors[name]
        reading = jax.ShapeDtypeStruct((rows.shape[1],), float)
        width = eqx.filter_eval_shape(sensor.difference, reading, reading).shape[0]
        found.append(Group(name, width, loss=samples.channels[name].loss))
    return tuple(found)


def build_problem(
    samples: Samples,
    model: Model,
    around: Around,
    *,
    delayed: tuple[str, ...],
    max_step: float,
    room_for: float,
    whole: Samples | None = None,
    sky: Sky | None = None,
) -> Problem:
    """Tables and padded measurements for steps of at most `max_step` [s].

    Where the samples are a part of a `whole` session, they get its shape for steps of `room_for` [s]. `sky` is that of
    the whole session where it was computed before.
    """
    t, t_whole = samples.t, (whole or samples).t
    free = samples.given is None
    max_step, room_for = (step if free else 1e9 for step in (max_step, room_for))
    commands = commands_of(model, samples)
    stops = None if commands is None or not free else commands.jumps()
    steps = len(StepGrid.through(t_whole, start=t_whole[0], max_step=min(room_for, max_step), stops=stops).step)
    pad_samples, pad_steps = few_sizes(len(t_whole), PAD_SAMPLES), few_sizes(steps, PAD_STEPS)
    grid = StepGrid.through(t, start=t[0], max_step=max_step, stops=stops, pad_samples=pad_samples, pad_steps=pad_steps)
    extra = len(grid.sample_index) - len(t)
    padded_t = np.pad(t, (0, extra), mode="edge")
    of_sky = _of_sky(samples, model, around, padded_t)
    if sky is None:
        # Compiled while what follows is traced, compiled and done.
        sky_at.compile(*of_sky)
    nodes = np.asarray(grid.node_times)
    node_sun = around.sun_eci(samples.epoch, nodes) if around.pushed else None
    orbit = nodes_at(around, nodes, node_sun)
    if commands is not None:
        orbit = replace(orbit, commands=commands(nodes))
    around_samples = sky_at(*of_sky) if sky is None else _sky_since(sky, t_whole, padded_t)
    groups = groups_of(model, samples)
    measured = {name: np.pad(np.nan_to_num(rows), ((0, extra), (0, 0))) for name, rows in samples.values.items()}
    known = np.pad(np.hstack([_known(samples.values[group.name], group) for group in groups]), ((0, extra), (0, 0)))
    sigma = np.concatenate([np.full(group.width, samples.channels[group.name].sigma) for group in groups])
    return Problem(
        grid=grid,
        orbit=orbit,
        sky=around_samples,
        measured=measured,
        known=known,
        sigma=sigma,
        valid=np.arange(len(padded_t)) < len(t),
        floor=np.pad(_floors(samples, model, groups), ((0, extra), (0, 0)), constant_values=NO_FLOOR),
        bright=np.pad(_bright(samples, model, groups), ((0, extra), (0, 0))),
        model=model,
        motion=None if samples.given is None else motion_at(samples.given, padded_t),
        of_sensors=groups,
        delayed=delayed,
    )


def sky_of(samples: Samples, model: Model, around: Around, t: np.ndarray) -> Sky:
    """Returns the sky at times `t` [s], columns of the samples between their own times."""
    return sky_at(*_of_sky(samples, model, around, t))


def _of_sky(samples: Samples, model: Model, around: Around, t: np.ndarray) -> tuple:
    """What the sky at times is made of."""
    lit = any("light" in sensor.needs for sensor in model.sensors.values())
    columns = {name: np.interp(t, *pair) for name, pair in samples.columns.items()}
    return around, t, around.sun_eci(samples.epoch, t) if lit else None, columns


def _sky_since(sky: Sky, t_whole: np.ndarray, t: np.ndarray) -> Sky:
    """The same from that of the whole session: of its last samples, and then of the very last again."""
    first = int(np.searchsorted(t_whole, t[0]))
    index = np.minimum(first + np.arange(len(t)), len(t_whole) - 1)
    return sky if first == 0 else jax.tree.map(lambda leaf: np.asarray(leaf)[index], sky)


def commands_of(model: Model, samples: Samples) -> Commands | None:
    """Telemetered commands that parts of the satellite follow; None where there are none."""
    held, linear = commanded_columns(model.spacecraft.parts)
    return Commands.of(samples.columns, held=held, linear=linear) if held or linear else None


def _known(rows: np.ndarray, group: Group) -> np.ndarray:
    finite = np.isfinite(rows)
    if rows.shape[1] == group.width:
        return finite
    # A quaternion is measured as a whole or not at all.
    return np.repeat(np.all(finite, axis=1, keepdims=True), group.width, axis=1)


def _floors(samples: Samples, model: Model, groups: Groups) -> np.ndarray:
    """What a current of zero may have been at most, in sigmas: the telemetry of panels has nothing below it."""
    found = []
    for group in groups:
        rows, channel = samples.values[group.name], samples.channels[group.name]
        cut = (
            isinstance(model.sensors[group.name], Panels)
            and bool(channel.quantum)
            and channel.zero_is_floor
            and not np.any(rows < 0.0)
        )
        floor = 0.5 * (channel.quantum or 0.0) / channel.sigma
        found.append(np.where(rows == 0.0, floor, NO_FLOOR) if cut else np.full((len(rows), group.width), NO_FLOOR))
    return np.hstack(found)


def _bright(samples: Samples, model: Model, groups: Groups) -> np.ndarray:
    """[time groups] whether there is a reading, and of a sensor of light one that stands out of the noise."""
    found = []
    for group in groups:
        rows = samples.values[group.name]
        seen = np.isfinite(rows).any(axis=1)
        if model.sensors[group.name].sees == "sun":
            seen &= np.nan_to_num(np.abs(rows)).max(axis=1) > BRIGHT * samples.channels[group.name].sigma
        found.append(seen)
    return np.stack(found, axis=1)


def usable(problem: Problem, samples: Samples) -> np.ndarray:
    """[samples channels] 1 where a measurement counts: 0 of sensors of light where the shadow contradicts them.

    In the penumbra a second decides what they read, and that says nothing about the attitude.
    """
    wild = np.pad(_wild(samples), ((0, len(problem.valid) - len(samples.t)), (0, 0)))
    weight = np.asarray(problem.known, float) * np.asarray(problem.valid)[:, None]
    weight[over_columns(wild, problem.groups)] = 0.0
    witness = np.array([samples.channels[group.name].witness for group in problem.groups])
    weight[:, over_columns(witness, problem.groups)] = 0.0
    if problem.sky.light is None:
        return weight
    share = np.asarray(problem.sky.light.illumination)
    lit = np.array([problem.model.sensors[group.name].sees == "sun" for group in problem.groups])
    doubtful = (((share > 0.0) & (share < 1.0))[:, None] & lit) | contradicted(problem)
    return np.where(over_columns(doubtful, problem.groups), 0.0, weight)


def _wild(samples: Samples) -> np.ndarray:
    """[time channels] readings out of all range of their channel, as of wrong bytes: no motion makes them."""
    found = []
    for rows in samples.values.values():
        size = np.nan_to_num(np.abs(rows)).max(axis=1)
        measured = size[np.isfinite(rows).any(axis=1)]
        found.append(size > OUT_OF_RANGE * np.quantile(measured, 0.9))
    return np.stack(found, axis=1)
