"""What a sweep runs: a scenario of numbered cases, and the factory that makes it from named options."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any, get_args

import numpy as np

from jaxsat.errors import InputError
from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import PREFIX, Input, check_inputs
from jaxsat.sweep.knobs.knob import Knob, check_knobs
from jaxsat.sweep.pinned import pinned
from jaxsat.sweep.precision.keys import key_of

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_OWN_COLUMNS = ("case", "status")


@dataclass(frozen=True)
class Metric:
    """One number of each case; its name carries the unit too, as `settling_time_s`."""

    unit: str
    """`1` for a pure number."""
    meaning: str
    endless: bool = False
    """Whether a case without it has not got there in its time: among all cases it then counts as beyond any number."""
    limit: float | None = None
    """What somebody claims to be its largest value; the summary has the share of all cases beyond it."""


@dataclass(frozen=True)
class Scenario:
    """Numbered random cases that are run in chunks of one shape.

    `run(seed, cases)` takes the numbers of `chunk` cases [int64] and returns `status` and each metric, all [chunk]. A
    case's numbers may depend on the seed and on its own number only, and `run` may be called from several threads.
    """

    name: str
    statuses: tuple[str, ...]
    """How a case may end: 0 is success, the others are reasons of failure."""
    metrics: Mapping[str, Metric]
    """A metric that a case does not have is NaN."""
    chunk: int
    """Cases of a chunk: last digits may depend on it, so it is part of a sweep's identity."""
    run: Callable[[int, np.ndarray], Mapping[str, np.ndarray]]
    assumptions: tuple[str, ...] = ()
    """Sentences on what decides the result and nobody has measured; they go into summary.json."""
    history: Callable[[int, int], History] | None = None
    """`history(seed, case)` runs one case again and returns what happened in it."""
    inputs: tuple[Input, ...] = ()
    """What differs at random between its cases, with the options that it has."""
    draw: Callable[[int, np.ndarray], Any] | None = None
    """`draw(seed, cases)` returns what `run` begins from, in which each of the `inputs` finds its values."""
    only_float64: str = ""
    """Why it cannot be run in single precision, in words; empty where it can."""
    knobs: tuple[Knob, ...] = ()
    """What may be turned at it, with the options that it has: what means are differentiated by."""
    run_moved: Callable[[int, np.ndarray, Any], Mapping[str, Any]] | None = None
    """`run_moved(seed, cases, moved)` is `run` with the knobs of each case moved by a row of `moved` [cases knobs]: see
    `Knob`. With zeros it has the numbers of `run` but for rounding. Of any number of cases, and from several threads;
    where it is written in JAX throughout, exact derivatives are taken through it."""
    horizon_s: float | None = None
    """Simulated time of a case: up to it the mean of an endless metric goes [s]."""

    def __post_init__(self):
        if not 1 <= len(set(self.statuses)) == len(self.statuses) <= 127:
            raise ValueError(f"Scenario {self.name}: statuses must be 1 to 127 different words, got {self.statuses}")
        if self.chunk < 1:
            raise ValueError(f"Scenario {self.name}: chunk must be at least 1, got {self.chunk}")
        taken = [name for name in _OWN_COLUMNS if name in self.metrics]
        if taken:
            raise ValueError(f"Scenario {self.name}: no metric may be called {taken[0]}, every sweep has that column")
        taken = [name for name in self.metrics if name.startswith(PREFIX)]
        if taken:
            raise ValueError(f"Scenario {self.name}: metric {taken[0]}: names with {PREFIX} are those of inputs")
        if self.inputs and self.draw is None:
            raise ValueError(f"Scenario {self.name}: inputs need a function draw(seed, cases)")
        if self.knobs and self.run_moved is None:
            raise ValueError(f"Scenario {self.name}: knobs need a function run_moved(seed, cases, moved)")
        try:
            check_inputs(self.inputs, self.metrics)
            check_knobs(self.knobs)
        except ValueError as error:
            raise ValueError(f"Scenario {self.name}: {error}") from None

    @property
    def input_columns(self) -> tuple[str, ...]:
        """Names of the columns of all inputs."""
        return tuple(column for one in self.inputs for column in one.columns)


def run_cases(scenario: Scenario, seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
    """Status [int8] and metrics [float64] of one chunk; `InputError` where the scenario breaks its own promise."""
    return checked_cases(scenario, scenario.run(seed, cases), cases)


def checked_cases(scenario: Scenario, found: Any, cases: np.ndarray) -> dict[str, np.ndarray]:
    """What a scenario's function returned, as status [int8] and metrics [float64]; `InputError` for anything else."""
    if not isinstance(found, Mapping):
        raise InputError(f"scenario {scenario.name}: run returned {type(found).__name__}, expected a dict of arrays")
    expected = {"status", *scenario.metrics}
    if set(found) != expected:
        raise InputError(f"scenario {scenario.name} returned {sorted(found)}, expected {sorted(expected)}")
    arrays = {name: np.asarray(values) for name, values in found.items()}
    for name, values in arrays.items():
        if values.shape != cases.shape:
            raise InputError(f"scenario {scenario.name}: {name} has shape {values.shape}, expected {cases.shape}")
    status = arrays["status"]
    if status.dtype.kind not in "iu" or status.min() < 0 or status.max() >= len(scenario.statuses):
        raise InputError(f"scenario {scenario.name}: status must be a whole number below {len(scenario.statuses)}")
    metrics = {name: arrays[name].astype(np.float64) for name in scenario.metrics}
    return {"status": status.astype(np.int8), **metrics}


def drawn_inputs(scenario: Scenario, seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of all inputs [cases, float64], which cases are drawn from; `InputError` where one has no such shape."""
    if not scenario.inputs or scenario.draw is None:
        return {}
    drawn, found = scenario.draw(seed, cases), {}
    for one in scenario.inputs:
        try:
            found |= one.values(drawn, len(cases))
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"scenario {scenario.name}: {error}") from None
    return found


def chunk_of(case: int, chunk: int) -> np.ndarray:
    """Numbers of all cases of a case's chunk [int64]; its own place among them is `case % chunk`."""
    return case - case % chunk + np.arange(chunk, dtype=np.int64)


def case_keys(seed: int, cases: np.ndarray) -> Any:
    """JAX random keys [cases], each of the seed and the case's own number alone.

    In single precision they draw what they draw in double precision, rounded; but for whole numbers of a range that is
    no power of two up to 256.
    """
    import jax

    # The generator takes numbers of 32 bits; `jaxsat sweep` lets no case go beyond them.
    return jax.vmap(jax.random.fold_in, in_axes=(None, 0))(key_of(seed), cases.astype(np.uint32))


@dataclass(frozen=True)
class Option:
    """A named choice of a scenario, given as text."""

    name: str
    default: str
    meaning: str
    """With the unit, where the name does not carry it."""
    file: bool = False
    """Whether it is the path of a file, whose content is then part of what the sweep is (`jaxsat.sweep.pinned`)."""


@dataclass(frozen=True)
class Factory:
    """Makes a scenario from its options; called with a mapping of those that are not to have their default."""

    build: Callable[[Mapping[str, str]], Scenario]
    """Gets every declared option; raises `InputError` for a value it cannot take (`number_of`, `choice_of`)."""
    options: tuple[Option, ...] = ()
    assumptions: tuple[str, ...] = ()
    """As those of its scenarios, for the list of all."""

    def __call__(self, given: Mapping[str, str]) -> Scenario:
        made = self.build(self.filled(given))
        return replace(made, assumptions=self.assumptions) if self.assumptions else made

    def filled(self, given: Mapping[str, str]) -> dict[str, str]:
        """All options in the order of their declaration; `InputError` for one that is not declared."""
        names = [option.name for option in self.options]
        for name in given:
            if name not in names:
                close = get_close_matches(name, names, n=1)
                known = f"options are {', '.join(names)}" if names else "there are none"
                hint = f"did you mean {close[0]}?" if close else known
                raise InputError(f"no such option of this scenario; {hint}", field=name)
        found = {option.name: given.get(option.name, option.default) for option in self.options}
        return found | {o.name: pinned(found[o.name], name=o.name) for o in self.options if o.file}


def number_of(options: Mapping[str, str], name: str, *, low: float = -math.inf, high: float = math.inf) -> float:
    """Value of an option that is a number from `low` to `high`; `InputError` for anything else."""
    text = options[name].strip()
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    if not (low <= value <= high and math.isfinite(value)):
        span = {
            (False, False): "a number",
            (True, False): f"a number of at least {low:g}",
            (False, True): f"a number of at most {high:g}",
            (True, True): f"a number from {low:g} to {high:g}",
        }[math.isfinite(low), math.isfinite(high)]
        raise InputError(f"expected {span}, found {options[name]!r}", field=name)
    return value


def as_numbers(options: Mapping[str, str]) -> dict[str, int | float | str]:
    """Options as results have them: those that are finite numbers as numbers."""
    return {name: _number(text) for name, text in options.items()}


def _number(text: str) -> int | float | str:
    if not (_NUMBER.fullmatch(text.strip()) and math.isfinite(value := float(text))):
        return text
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def choice_of(options: Mapping[str, str], name: str, choices: tuple[str, ...]) -> str:
    """Value of an option that is one of a few words; `InputError` for any other."""
    if options[name] not in choices:
        raise InputError(f"expected one of {', '.join(choices)}, found {options[name]!r}", field=name)
    return options[name]


@dataclass(frozen=True)
class Reader:
    """Values of a scenario's options by their names; `InputError` for any that is not what is asked for."""

    options: Mapping[str, str]

    def number(self, name: str, *, low: float = -math.inf, high: float = math.inf) -> float:
        """A number from `low` to `high`."""
        return number_of(self.options, name, low=low, high=high)

    def number_or(self, name: str, word: str, *, low: float = -math.inf, high: float = math.inf) -> float | None:
        """A number from `low` to `high`; None for the word."""
        if self.options[name] == word:
            return None
        try:
            return number_of(self.options, name, low=low, high=high)
        except InputError as error:
            raise InputError(error.reason.replace("expected", f"expected {word} or", 1), field=name) from None

    def choice(self, name: str, words: Any) -> Any:
        """One of the words of a `Literal`."""
        return choice_of(self.options, name, get_args(words))

    def word(self, name: str, words: tuple[str, ...]) -> str:
        """One of a few words."""
        return choice_of(self.options, name, words)
