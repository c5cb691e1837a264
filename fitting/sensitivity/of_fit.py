"""The motion that a fit found, to take derivatives along: of a `Fit` in memory, or of one read back from its files."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fitting.measurements.assembly import Samples, build_problem, channels_within
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.given import is_told
from fitting.measurements.groups import columns_of
from fitting.outcome.result import FitResult
from fitting.parameters.chosen import chosen_leaves
from fitting.sensitivity.plan import step_of
from fitting.sensitivity.vantage import Vantage, model_at
from fitting.settings import FitSettings
from fitting.starts.conventions import Convention, with_axes
from fitting.surroundings import surroundings
from jaxsat.errors import InputError
from jaxsat.given import Given
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession
from jaxsat.telemetry.table.motion import motion_for

if TYPE_CHECKING:
    from fitting.fitted import Fit

AGREES = 0.1
"""RMS difference [sigma of a reading] between the readings that a fit left and those computed again, at most."""
PRESSED = "at its bound"


def vantage_of_fit(found: "Fit") -> Vantage:
    """Of a fit in memory."""
    return vantage_of_result(found.result, found.satellite, found.session, found.settings)


def free_of_fit(result: FitResult, satellite: Satellite, settings: FitSettings) -> tuple[str, ...]:
    """Names of what a fit found, but for what a bound stopped."""
    wanted = chosen_leaves(satellite.leaves, settings.free, satellite.aliases)
    fitted = {p.name for p in result.parameters if p.free and p.note != PRESSED}
    return tuple(name for name in wanted if name in fitted)


def vantage_of_result(
    result: FitResult, satellite: Satellite, session: TableSession, settings: FitSettings, given: Given | None = None
) -> Vantage:
    """Of a result, with the telemetry, the satellite and the settings that it was made from.

    Raises `InputError` where the motion that follows from them is not that of the result.
    """
    if given is not None and given.time.zero_s:
        session = session.with_time_zero(given.time.zero_s)
    channels = channels_within(session, settings.arc_s)
    around, _ = surroundings(satellite, session, given)
    told = motion_for(satellite, session, around.orbit)
    if told is not None:
        inside = {name: is_told(told, each.t_s) for name, each in channels.items()}
        channels = {
            name: replace(each, t_s=each.t_s[inside[name]], values=each.values[inside[name]])
            for name, each in channels.items()
            if inside[name].any()
        }
    samples = Samples.of(channels, session.epoch, dict(session.columns), told)
    if len(samples.t) != len(result.t_s) or not np.allclose(samples.t, result.t_s, rtol=1e-9, atol=1e-6):
        raise InputError("its samples are not those of the telemetry any more", file=session.paths[0])
    fastest = float(np.linalg.norm(result.angular_velocity_rad_s, axis=1).max())
    step = min(settings.step_s, step_of(fastest, samples.t))
    values = {p.name: p.value for p in result.parameters}
    to_si = {leaf.name: values[leaf.name] / leaf.to_unit for leaf in satellite.leaves if leaf.name in values}
    model = model_at(satellite.model, satellite.leaves, to_si)
    problem = build_problem(samples, model, around, delayed=tuple(channels), max_step=step, room_for=step)
    axes = {name: _matrix(spelt) for name, spelt in result.axes.items()}
    problem = with_axes(problem, Convention(axes, 0.0))
    weight = np.zeros((len(problem.valid), problem.channels))
    for group, columns in zip(problem.groups, columns_of(problem.groups), strict=True):
        channel = result.channels[group.name]
        own = np.flatnonzero(np.isfinite(samples.values[group.name]).any(axis=1))
        counted = (channel.fitted & channel.used)[:, None] * np.isfinite(channel.residual)
        # A current at the telemetry's floor has no weight in the tables where it says next to nothing.
        floor = np.asarray(problem.floor)[own, columns] > NO_FLOOR
        told = counted if channel.weight is None else np.nan_to_num(channel.weight)
        weight[own, columns] = np.where(floor, counted, told)
    q, w = result.quaternion_inertial_from_body[0], result.angular_velocity_rad_s[0]
    found = Vantage(satellite, problem.model, problem, samples, q / np.linalg.norm(q), w, weight)
    _check(found, result, session)
    return found


def _matrix(spelt: list[str]) -> np.ndarray:
    """Rows of `+x` ... `-z`."""
    return np.array([(-1.0 if text[0] == "-" else 1.0) * np.eye(3)["xyz".index(text[1])] for text in spelt])


def _check(found: Vantage, result: FitResult, session: TableSession) -> None:
    """Raises `InputError` where the readings are not those that the fit left."""
    readings = found.readings(found.slopes)
    for name, channel in found.samples.channels.items():
        own = np.flatnonzero(np.isfinite(found.samples.values[name]).any(axis=1))
        off = (readings[name][own] * channel.to_unit - result.channels[name].modelled) / (
            channel.sigma * channel.to_unit
        )
        rms = float(np.sqrt(np.nanmean(off**2)))
        if not rms < AGREES:
            reason = (
                f"what {name} reads is {rms:.2g} sigma off what the fit left: fitted with other settings (--config, "
            )
            raise InputError(reason + "--as), or by another version of jaxsat?", file=session.paths[0])
