"""One fault each: what is done to a session, and what counts as its name.

`truth` faults change the settings of the independent program, `table` faults what the fit reads of its session. Either
answers what the first cause of the table must read like: a regular expression for `kind: cause [option]`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.doctor import data_faults as data
from experiments.doctor import true_faults as true
from jaxsat.telemetry import TableSession

Draw = np.random.Generator


@dataclass(frozen=True)
class Fault:
    """A kind of fault on one kind of session."""

    base: str
    """`munin` or `cube`."""
    truth: Callable[[dict[str, Any], Draw], str] | None = None
    table: Callable[[TableSession, Draw], tuple[TableSession, str]] | None = None
    free: tuple[str, ...] | None = None
    """What is free in place of everything."""
    refused: str = r"(?!)"
    """What a refusal before the fit must say, a regular expression; by default none is right."""
    absorbed: bool = False
    """Whether a converged fit at the truth is right too: the fit takes the fault for what it is."""


FAULTS: dict[str, Fault] = {
    "faces swapped": Fault("munin", table=data.swapped),
    "faces half turned": Fault("munin", table=data.half_turned),
    "faces cyclic": Fault("munin", table=data.turned),
    "face dead": Fault("munin", truth=true.dead_face),
    "face weak": Fault("munin", truth=true.weak_face),
    "gains": Fault("munin", truth=true.gains),
    "tilts": Fault("munin", truth=true.tilts),
    "offset": Fault("munin", table=data.offset),
    "imax drifts": Fault("munin", table=data.fading),
    "noise": Fault("munin", truth=true.noisy),
    "outliers": Fault("munin", table=data.outliers, absorbed=True),
    "positions late": Fault("munin", table=data.late_positions),
    "stamps jump": Fault("munin", table=data.jumping),
    "clock rate": Fault("munin", table=data.running_away),
    "positions Earth-fixed": Fault("munin", table=data.earth_fixed),
    "zone": Fault("munin", table=data.zone),
    # A few years change field and Sun by less than a fit sees, and the age of the element set is a remark.
    "year": Fault("munin", table=data.year, absorbed=True),
    "magnet reversed": Fault("munin", truth=true.other_pole, absorbed=True),
    "magnet's axis": Fault("munin", truth=true.other_axis, absorbed=True),
    "hysteresis": Fault("munin", truth=true.hysteresis),
    "eddy currents": Fault("munin", truth=true.eddy),
    "constant torque": Fault("munin", truth=true.residual),
    "kick": Fault("munin", truth=true.kick),
    "coil": Fault("munin", truth=true.coil),
    "albedo not free": Fault("munin", truth=true.no_albedo, free=("magnet", "rods", "imax", "inertia")),
    "aliased": Fault("munin", truth=true.fast, absorbed=True),
    "drag": Fault("cube", truth=true.drag),
    "magnetometer mirrored": Fault("cube", table=data.mag_axes),
    "magnetometer turned": Fault("cube", table=data.mag_turned, absorbed=True),
    "gyro sign": Fault("cube", table=data.gyro_axes),
    "gyro rad/s": Fault("cube", table=data.gyro_unit),
    "magnetometer nT": Fault("cube", table=data.mag_unit, refused=r"mag.unit: .*nT"),
    "diodes swapped": Fault("cube", table=data.diodes_order),
    "magnetometer late": Fault("cube", table=data.late_mag, absorbed=True),
}
