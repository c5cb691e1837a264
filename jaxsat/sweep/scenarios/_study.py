"""What scenarios of a published study are made of: cases that are drawn, run, and run with knobs moved."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import Input
from jaxsat.sweep.scenario import Metric, Scenario, case_keys

Options = tuple[tuple[str, str], ...]
"""All options of a scenario and their values."""


@dataclass(frozen=True)
class Study:
    """What the options say."""

    settings: Any
    draw: Callable[[Any], Any]
    """Compiled, from keys to cases."""
    run: Callable[[Any], Mapping[str, Any]]
    """From cases to status and metrics."""
    run_moved: Callable[[Any, Any], Mapping[str, Any]]
    """The same with knobs moved."""
    one: Callable[[Any], Any]
    """The history of one of the cases."""
    turns: tuple[Any, ...]
    """Its knobs with the leaves that they move."""
    time_s: float
    """Simulated time of a case."""


def study_scenario(
    program: Callable[[Options], Study],
    options: Mapping[str, str],
    history: Callable[[Options, int, int], History],
    inputs: Callable[[Mapping[str, str]], tuple[Input, ...]],
    *,
    name: str,
    statuses: tuple[str, ...],
    metrics: Mapping[str, Metric],
    chunk: int,
) -> Scenario:
    """The scenario of a study that `program` makes of the options, and keeps.

    Whatever is wrong with the options is said before anything is compiled.
    """
    import jax

    chosen = tuple(options.items())
    made = program(chosen)

    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        own = program(chosen)
        return jax.device_get(own.run(own.draw(case_keys(seed, cases))))

    def run_moved(seed: int, cases: np.ndarray, moved: Any) -> Mapping[str, Any]:
        own = program(chosen)
        return own.run_moved(own.draw(case_keys(seed, cases)), moved)

    def draw(seed: int, cases: np.ndarray) -> Any:
        return jax.device_get(program(chosen).draw(case_keys(seed, cases)))

    return Scenario(
        name,
        statuses,
        metrics,
        chunk,
        run,
        history=partial(history, chosen),
        inputs=inputs(options),
        draw=draw,
        knobs=tuple(turn.knob for turn in made.turns),
        run_moved=run_moved,
        horizon_s=made.time_s,
    )
