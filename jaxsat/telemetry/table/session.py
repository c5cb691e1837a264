"""What a table of telemetry gives: channels on their own times, further columns, and what was left out."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from jaxsat.bundled import told_names
from jaxsat.files.units import parsed_unit
from jaxsat.satellites.sections.session import ChannelSettings
from jaxsat.time import Epoch


@dataclass(frozen=True)
class RejectedRow:
    """A row, or one column of it, that is not used."""

    path: Path
    row: int
    """Line of a CSV file, from 1 with the header; number of a Parquet file's row, from 1."""
    column: str
    """Empty where it is the whole row."""
    reason: str
    """To be counted."""
    detail: str
    """What was found."""


@dataclass(frozen=True)
class Channel:
    """Readings of one sensor, in order of time."""

    name: str
    t_s: np.ndarray
    """[n] stamps after the session's epoch, strictly increasing."""
    values: np.ndarray
    """[n columns] SI; NaN = not measured. Each row has at least one number."""
    sigma: float
    """1-sigma of a number with its rounding, SI."""
    unit: str
    """As the table has it."""
    to_unit: float
    """From SI to that unit."""
    quantum: float | None
    """Step of the digits, SI."""
    columns: tuple[str, ...]
    zero_is_floor: bool = True
    """Whether a current of zero was half a quantum or less."""
    witness: bool = False
    """Whether it is not fitted, but asked afterwards whether it agrees."""
    loss: str | None = None
    """What may be wrong with a sample: `normal`, `student` or `mixture`; None: as the fit has it."""

    @staticmethod
    def of(name: str, settings: ChannelSettings, t_s: np.ndarray, values: np.ndarray) -> "Channel":
        """The channel of `values` [n columns] in the unit of its settings."""
        unit = parsed_unit(settings.unit)
        quantum = None if settings.quantum is None else settings.quantum * unit.factor
        noise = 0.0 if settings.sigma is None else settings.sigma * unit.factor
        return Channel(
            name=name,
            t_s=t_s,
            values=values * unit.factor,
            # Rounding to a step is a uniform error of variance step^2 / 12.
            sigma=math.hypot(noise, (quantum or 0.0) / math.sqrt(12.0)),
            unit=settings.unit,
            to_unit=1.0 / unit.factor,
            quantum=quantum,
            columns=settings.columns,
            zero_is_floor=settings.zero_is_floor,
            witness=settings.role == "witness",
            loss=settings.loss,
        )


@dataclass(frozen=True)
class TableSession:
    """One session of any satellite, read from one or several tables."""

    paths: tuple[Path, ...]
    sha256: tuple[str, ...]
    """Of the files' bytes."""
    epoch: Epoch
    """Instant of the first used row."""
    channels: Mapping[str, Channel]
    columns: Mapping[str, tuple[np.ndarray, np.ndarray]]
    """Commands and measured currents by column: times [s] and values, SI."""
    rejections: tuple[RejectedRow, ...]
    remarks: tuple[str, ...]
    """What is odd about the stamps, in words."""
    motion: tuple[np.ndarray, np.ndarray] | None = None
    """Times [s] and quaternions [n 4], inertial from body, scalar first, where the table tells the motion."""
    positions: tuple[np.ndarray, np.ndarray] | None = None
    """Times [s] and positions [n 3], true equator and equinox of date [m], where the table tells them."""
    velocities: np.ndarray | None = None
    """[n 3] at the times of the positions, likewise [m/s]."""
    unused: tuple[str, ...] = ()
    """Columns of the tables that the satellite file does not name."""
    rows: int = 0
    """Of the tables, the rejected ones among them."""
    object_name: str | None = None
    """What the file itself calls the satellite."""
    object_id: str | None = None
    """Its international designator, where the file tells it."""
    elements_epoch: Epoch | None = None
    """Of the element set that stands in the file itself."""

    @property
    def name(self) -> str:
        """Name of the first file without its ending, with the word synthetic for a bundled one."""
        return told_names(self.paths[0])[1]

    @property
    def telemetry(self) -> str:
        """The files as results name them."""
        return ", ".join(told_names(path)[0] for path in self.paths)

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last stamp of all channels."""
        ends = [channel.t_s[[0, -1]] for channel in self.channels.values() if channel.t_s.size]
        return float(min(first for first, _ in ends)), float(max(last for _, last in ends))

    def with_time_zero(self, zero_s: float) -> "TableSession":
        """The same session with time zero moved by `zero_s` seconds."""

        def moved(pair: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            return pair[0] - zero_s, pair[1]

        return replace(
            self,
            epoch=self.epoch.shifted(zero_s),
            channels={name: replace(each, t_s=each.t_s - zero_s) for name, each in self.channels.items()},
            columns={name: moved(pair) for name, pair in self.columns.items()},
            motion=None if self.motion is None else moved(self.motion),
            positions=None if self.positions is None else moved(self.positions),
        )

    def restamped(self, change: Callable[[np.ndarray], np.ndarray]) -> "TableSession":
        """The same with other stamps of all that was measured; positions, which another clock has, stay where they are.

        `change` is of times [n] that rise, and what it answers has to rise too.
        """
        return replace(
            self,
            channels={name: replace(each, t_s=change(each.t_s)) for name, each in self.channels.items()},
            columns={name: (change(t), values) for name, (t, values) in self.columns.items()},
            motion=None if self.motion is None else (change(self.motion[0]), self.motion[1]),
        )

    @property
    def rejected_by_reason(self) -> dict[str, int]:
        """Number of rejections of each reason, most frequent first."""
        return dict(Counter(rejection.reason for rejection in self.rejections).most_common())
