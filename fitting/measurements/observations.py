"""What a fit is given: samples of currents with their surroundings, and the padded problem made of them."""

import dataclasses
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fitting.measurements.abstract import PAD_SAMPLES, PAD_STEPS
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.limb import LimbAngles
from fitting.measurements.problem import LIMB, Problem
from fitting.stored import Stored
from jaxsat.environment import (
    AbstractMagneticField,
    CylinderShadow,
    DiffuseAlbedo,
    KeplerOrbit,
    SpecularAlbedo,
    tabulate_light,
    tabulate_orbit,
)
from jaxsat.errors import InputError
from jaxsat.integrators import StepGrid

FINEST_USUAL_STEP_S = 8.0
"""Grids are padded to the number of steps of this length [s], unless more room is asked for."""
LIMB_FIELD = "limb angles"
"""The field that an `InputError` names where not the currents but the limb angles are at fault."""


@dataclass(frozen=True)
class Observations:
    """Samples of one session with their surroundings, SI; time zero is that of the orbit."""

    t: np.ndarray
    """[time] increasing [s]."""
    currents: np.ndarray
    """[time 6] +X -X +Y -Y +Z -Z [A]."""
    orbit: KeplerOrbit
    field: AbstractMagneticField
    greenwich_angle: float
    """At t = 0 [rad]."""
    earth_rotation_rate: float
    """[rad/s]"""
    earth_radius: float
    """Of shadow and albedo [m]."""
    sun_eci: np.ndarray
    """[time 3] unit vectors."""
    limb: np.ndarray | None = None
    """[time 2] distance of body x from the limb and turn about it [rad], NaN where not measured; None: not at all."""

    def since(self, first: int) -> "Observations":
        """The samples from number `first` on."""
        t, currents, sun_eci = self.t[first:], self.currents[first:], self.sun_eci[first:]
        limb = None if self.limb is None else self.limb[first:]
        return dataclasses.replace(self, t=t, currents=currents, sun_eci=sun_eci, limb=limb)


def _tabulate(orbit, field, greenwich, rate, radius, node_times, sample_times, sun_eci):
    light = tabulate_light(
        orbit,
        sample_times,
        sun_eci,
        shadow=CylinderShadow(radius),
        specular=SpecularAlbedo(radius),
        diffuse=DiffuseAlbedo(radius),
    )
    return tabulate_orbit(orbit, node_times, field, greenwich, rate), light


tabulate = Stored(_tabulate)


def _layout(
    observations: Observations, max_step: float, room_for: float, whole: Observations
) -> tuple[StepGrid, tuple]:
    """The padded grid and the arguments of `tabulate`."""
    t, t_whole = observations.t, whole.t
    # Steps are padded generously, so that the coarse and the fine grid of a session share one program.
    steps = len(StepGrid.through(t_whole, start=t_whole[0], max_step=min(room_for, max_step)).step)
    pad_samples = -(-len(t_whole) // PAD_SAMPLES) * PAD_SAMPLES
    pad_steps = -(-steps // PAD_STEPS) * PAD_STEPS
    grid = StepGrid.through(t, start=t[0], max_step=max_step, pad_samples=pad_samples, pad_steps=pad_steps)
    extra = len(grid.sample_index) - len(t)
    sun = np.pad(observations.sun_eci, ((0, extra), (0, 0)), mode="edge")
    arguments = (
        observations.orbit,
        observations.field,
        jnp.asarray(observations.greenwich_angle),
        jnp.asarray(observations.earth_rotation_rate),
        jnp.asarray(observations.earth_radius),
        grid.node_times,
        np.pad(t, (0, extra), mode="edge"),
        sun,
    )
    return grid, arguments


def build_problem(
    observations: Observations,
    *,
    noise: float,
    max_step: float,
    room_for: float = FINEST_USUAL_STEP_S,
    limb_sigma: float | None = None,
    floor: float | None = None,
    whole: Observations | None = None,
) -> Problem:
    """Tables and padded measurements for steps of at most `max_step` [s]; `noise` is one sigma [A].

    `room_for` [s] is the shortest step that any problem of the session will have: with it they share their programs.
    Where the observations are a part of a `whole` session, they get its shape.
    `floor` [A] is the largest current that reads as zero, half a step of the telemetry; None where zero is a reading
    as any other, as it is in a session with readings below it.
    `limb_sigma` is that of the limb angles, their weight included [rad]. Raises ValueError where there are any without
    it, and `InputError` where they are seen from inside the Earth.
    """
    grid, arguments = _layout(observations, max_step, room_for, whole or observations)
    orbit_table, light = tabulate(*arguments)
    if observations.limb is not None:
        lowest = float(np.linalg.norm(np.asarray(orbit_table.position_eci), axis=-1).min())
        if not lowest > observations.earth_radius:
            reason = f"the orbit goes down to {1e-3 * lowest:.0f} km, below the Earth's radius: there is no limb"
            raise InputError(reason, field=LIMB_FIELD)
    extra = len(grid.sample_index) - len(observations.t)
    measured = np.pad(observations.currents, ((0, extra), (0, 0)))
    floored = (measured == 0.0) & (floor is not None and not np.any(measured < 0.0))
    no_floor = [] if observations.limb is None else [np.full((len(measured), LIMB.width), NO_FLOOR)]
    return Problem(
        grid=grid,
        orbit=orbit_table,
        light=light,
        measured=measured,
        valid=np.arange(len(grid.sample_index)) < len(observations.t),
        noise=np.asarray(noise),
        floor=np.hstack([np.where(floored, (floor or 0.0) / noise, NO_FLOOR), *no_floor]),
        limb=_limb_angles(observations, extra, limb_sigma),
    )


def _limb_angles(observations: Observations, extra: int, sigma: float | None) -> LimbAngles | None:
    """The limb angles with `extra` samples of padding behind."""
    if observations.limb is None:
        return None
    if sigma is None:
        raise ValueError("build_problem: the observations hold limb angles, expected their limb_sigma [rad]")
    angles = np.pad(observations.limb, ((0, extra), (0, 0)), constant_values=np.nan)
    known = np.isfinite(angles)
    return LimbAngles(
        np.where(known, angles, 0.0), known, np.asarray(float(sigma)), np.asarray(observations.earth_radius)
    )
