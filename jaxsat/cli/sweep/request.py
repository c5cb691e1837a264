"""From the command line of `jaxsat sweep`, and the sweep that its directory may hold, to what is run."""

import math
import shlex
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cyclopts import CycloptsError

from jaxsat import numerics
from jaxsat.cli.sweep.defaults import CASES, SEED
from jaxsat.cli.sweep.scenarios import SCENARIOS, address_of
from jaxsat.errors import InputError
from jaxsat.numerics import Device, Precision
from jaxsat.sweep import CodeError, Scenario, Source, SweepPlan, read_plan
from jaxsat.versions import LAST_DIGITS, versions

PREPARE = "jaxsat.numerics:set_up_jax"
GPU_CASES = 2**14
"""Of a chunk on a GPU, where nothing else is said: less leaves it idle."""


def scenario_of(word: str, given: Mapping[str, str], arguments: tuple[Any, ...] = ()) -> tuple[Source, Scenario]:
    """A scenario by its name or address with the options `given`, and where it comes from.

    `arguments` are those of `jaxsat.numerics.set_up_jax`. Raises `InputError` for what is wrong with a file or with
    one's own code, and CycloptsError for what is wrong with an option.
    """
    try:
        source = Source.of(address_of(word), given, prepare=PREPARE, arguments=arguments)
        return source, source.scenario()
    except CodeError:
        raise
    except InputError as error:
        if error.file is not None:
            raise
        raise CycloptsError(msg=str(error)) from None


@dataclass(frozen=True)
class Request:
    """What the command line says of the sweep."""

    scenario: str
    cases: int | None
    """None where not given, as the seed."""
    seed: int | None
    options: dict[str, str]
    out: Path
    from_stored: bool
    """Whether what is not given is that of the sweep in the directory."""
    precision: Precision | None = None
    device: Device | None = None
    chunk: int | None = None
    """Cases of a chunk."""

    @property
    def resuming(self) -> str:
        """The command that finishes the sweep; all else stands in its directory."""
        device = f" --device {self.device}" if self.device else ""
        return f"jaxsat sweep {shlex.quote(self.scenario)} --out {shlex.quote(str(self.out))} --resume{device}"

    @property
    def replaying(self) -> tuple[str, ...]:
        """Words of the command that shows a case of the sweep, whose number comes behind."""
        return ("jaxsat", "sweep", self.scenario, "--out", str(self.out), "--case")

    def resolve(self) -> tuple[Source, Scenario, SweepPlan]:
        """The scenario and the plan; raises `InputError`, or an error of usage for the options."""
        stored = read_plan(self.out) if self.from_stored else None
        if stored is not None and self.scenario in SCENARIOS and stored.scenario != self.scenario:
            reason = f"holds a sweep with scenario {stored.scenario}, not {self.scenario}; take another --out"
            raise InputError(reason, file=self.out)
        precision = self.precision or (stored.precision if stored else "float64")
        arguments: tuple[Any, ...] = () if (precision, self.device) == ("float64", None) else (precision, self.device)
        notice = numerics.set_up_jax(*arguments)
        if notice:
            print(f"jaxsat: {notice}", file=sys.stderr)
        given = self.options if stored is None else {**stored.options, **self.options}
        source, made = scenario_of(self.scenario, given, arguments)
        seed = self.seed if self.seed is not None else stored.seed if stored else SEED
        cases = self.cases if self.cases is not None else stored.cases if stored else CASES
        if made.only_float64 and precision != "float64":
            raise CycloptsError(msg=f"{made.name} runs in float64 alone: {made.only_float64}.")
        chunk = self._chunk_of(made, cases, stored)
        if chunk != made.chunk:
            source, made = replace(source, chunk=chunk), replace(made, chunk=chunk)
        begun = {**versions(LAST_DIGITS), "device": numerics.device_name()}
        plan = SweepPlan(made.name, seed, dict(source.options), chunk, cases, begun, source.code, precision)
        return source, made, plan

    def _chunk_of(self, made: Scenario, cases: int, stored: SweepPlan | None) -> int:
        """Cases of a chunk: as asked for, as the sweep has them, or as the device likes them."""
        own = made.chunk
        if self.chunk is not None:
            if self.chunk % own:
                raise CycloptsError(msg=f"--chunk: expected a multiple of {own} for {made.name}, got {self.chunk}.")
            return self.chunk
        if stored is not None and stored.chunk % own == 0:
            return stored.chunk
        if numerics.device_name().startswith("gpu"):
            return own * math.ceil(min(cases, GPU_CASES) / own)
        return own
