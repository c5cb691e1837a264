"""Sessions of Munin with their truth as the problems that solvers take."""

import dataclasses
import json
from collections.abc import Sequence

import numpy as np

from fitting.measurements.assembly import Samples, build_problem, usable
from fitting.measurements.floor import NO_FLOOR
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

STEP_S, ROOM_S = 16.0, 6.0
"""Steps, and those for which there is room: as a whole fit has it, whose programs are then used."""


@dataclasses.dataclass(frozen=True)
class Truth:
    """Motion at the samples and the numbers of the file that made it, in its own units."""

    q: np.ndarray
    w: np.ndarray
    numbers: dict


class Case:
    """The currents of a session fitted and its magnetometer a witness; no reading is at the telemetry's floor."""

    def __init__(self, name: str, free: Sequence[str], *, samples: int | None = None, only: Sequence[str] = ()):
        path = BUNDLED.with_name(f"{name}.RAW_SUN")
        satellite = read_satellite()
        session = read_telemetry(path, satellite)
        whole = Samples.of(session.channels, session.epoch, session.columns)
        self.samples = whole if samples is None else whole.part(slice(samples))
        # Of few leaves where the program shall be a small one.
        leaves = tuple(leaf for leaf in satellite.leaves if not only or leaf.name in only)
        self.parameters = free_parameters(
            satellite.model, leaves, chosen_leaves(leaves, free), held=() if only else satellite.held
        )
        self.around, _ = surroundings(satellite, session)
        step = {"delayed": (), "max_step": STEP_S, "room_for": ROOM_S if samples is None else STEP_S}
        problem = build_problem(self.samples, satellite.model, self.around, **step)
        self.problem = dataclasses.replace(problem, floor=np.full(problem.floor.shape, NO_FLOOR))
        self.weight = usable(self.problem, self.samples)
        truth = json.loads(path.with_suffix(".truth.json").read_text())
        self.truth = Truth(np.array(truth["q"]), np.array(truth["w"]), truth["cfg"])

    def reordered(self, wanted: dict[str, float]) -> np.ndarray:
        """Values of all leaves, SI: those that are given by their names, the others nominal."""
        values = np.array(self.parameters.tree.nominal)
        names = [leaf.name for leaf in self.parameters.leaves]
        for name, value in wanted.items():
            values[names.index(name)] = value
        return values
