"""Sigmas over many starts, and how they are run: here and now, or from the table of a sweep's directory."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
import pyarrow.parquet as pq

from fitting.sensitivity.choice import considered_sigmas, named_free
from fitting.sensitivity.plan import Columns
from fitting.sensitivity.scenarios.draws import Draws
from fitting.sensitivity.scenarios.maps import CHUNK, StartsMap, column_of
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.sweep import chunk_of, drawn_inputs, run_cases
from jaxsat.synthetic.twins import TwinSettings
from jaxsat.synthetic.twins.source import with_orbit


@dataclass(frozen=True)
class Scenarios:
    """What was drawn and what came of it; arrays over the scenarios in front."""

    draws: Draws
    instant_s: np.ndarray
    """[count] of the start, after that of the plan."""
    rate_deg_s: np.ndarray
    """[count] spin."""
    sun_deg: np.ndarray
    """[count] of the Sun above the orbit's plane."""
    lit: np.ndarray
    """[count] share of the arc in sunlight."""
    names: tuple[str, ...]
    """[rows] of the fitted numbers."""
    units: tuple[str, ...]
    sigma: np.ndarray
    """[count rows] in units of results; inf where nothing tells."""
    attitude_deg: np.ndarray
    """[count] 1-sigma, RMS over the arc of all three axes together."""
    attitude_noise_deg: np.ndarray
    """[count] from noise and priors alone."""
    attitude_assumed_deg: np.ndarray
    """[count] from the considered numbers alone."""
    spread: Mapping[str, np.ndarray]
    """[count] columns of the numbers of the satellite that were drawn."""
    seconds: float
    """That the scenarios took, the first chunk apart, with which their program is compiled."""
    timed: int
    """How many of them that were."""

    @staticmethod
    def of_table(
        made: StartsMap, draws: Draws, table: Mapping[str, np.ndarray], *, seconds: float, timed: int
    ) -> "Scenarios":
        """From the columns of a sweep's table."""
        inputs = made.scenario.inputs
        rate = np.stack([table[name] for name in inputs[2].columns], axis=1)
        return Scenarios(
            draws=draws,
            instant_s=table[inputs[0].columns[0]],
            rate_deg_s=np.linalg.norm(rate, axis=1),
            sun_deg=table["sun_deg"],
            lit=table["lit"],
            names=tuple(name for name, _ in made.rows),
            units=tuple(unit for _, unit in made.rows),
            sigma=np.stack([table[column_of(*row)] for row in made.rows], axis=1),
            attitude_deg=table["attitude_sigma_deg"],
            attitude_noise_deg=table["attitude_sigma_noise_deg"],
            attitude_assumed_deg=table["attitude_sigma_assumed_deg"],
            spread={one.columns[0]: table[one.columns[0]] for one in inputs[3:]},
            seconds=seconds,
            timed=timed,
        )

    @staticmethod
    def read(made: StartsMap, draws: Draws, path: Path, *, seconds: float, timed: int) -> "Scenarios":
        """From the table of a sweep's directory."""
        found = pq.read_table(path, columns=[*made.scenario.metrics, *made.scenario.input_columns])
        table = {name: found.column(name).to_numpy() for name in found.column_names}
        return Scenarios.of_table(made, draws, table, seconds=seconds, timed=timed)


def map_of(
    satellite: Satellite,
    plan: TwinSettings,
    draws: Draws,
    *,
    free: Sequence[str] | None = None,
    consider: Sequence[str] = (),
    spread: Sequence[str] = (),
    orbit: Path | None = None,
    columns: Columns | None = None,
) -> StartsMap:
    """The map of a plan's starts. Raises `InputError` as `scenarios` does."""
    sigmas = considered_sigmas(satellite, consider)
    try:
        drawn = considered_sigmas(satellite, spread)
    except InputError as error:
        raise InputError(error.reason.replace("considered", "drawn"), field="spread") from None
    return StartsMap(
        satellite,
        satellite if orbit is None else with_orbit(satellite, orbit),
        plan,
        draws,
        names=named_free(satellite, free, sigmas),
        considered=sigmas,
        spread=drawn,
        columns=columns or {},
    )


def scenarios(
    satellite: Satellite,
    plan: TwinSettings,
    draws: Draws,
    *,
    free: Sequence[str] | None = None,
    consider: Sequence[str] = (),
    spread: Sequence[str] = (),
    orbit: Path | None = None,
    columns: Columns | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> Scenarios:
    """Sigmas of the fitted numbers and of the attitude over so many starts of a plan's arc.

    Length, interval and first instant are those of the plan. `spread` are numbers of the satellite that are drawn for
    each start, by the sigma of the satellite file or NAME=SIGMA in the unit of results. Raises `InputError` as
    `vantage_of_plan` does, and for a motion that is given: it has no start.
    """
    how = {"free": free, "consider": consider, "spread": spread, "orbit": orbit, "columns": columns}
    made = map_of(satellite, plan, draws, **how)
    scenario, count = made.scenario, draws.count

    def run(first):
        cases = chunk_of(first, CHUNK)
        found = run_cases(scenario, draws.seed, cases) | drawn_inputs(scenario, draws.seed, cases)
        progress("scenarios", min(first + CHUNK, count), count)
        return found

    # One alone at first: its compiled program serves all others.
    parts = [run(0)]
    began = perf_counter()
    with ThreadPoolExecutor(2) as pool:
        parts += pool.map(run, range(CHUNK, count, CHUNK))
    table = {name: np.concatenate([part[name] for part in parts])[:count] for name in parts[0]}
    return Scenarios.of_table(made, draws, table, seconds=perf_counter() - began, timed=max(count - CHUNK, 0))
