"""From the command line of `jaxsat sweep`, and the sweep that its directory may hold, to what is run."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

from cyclopts import CycloptsError

from jaxsat import numerics
from jaxsat.cli.sweep.defaults import CASES, SEED
from jaxsat.cli.sweep.scenarios import SCENARIOS, address_of
from jaxsat.errors import InputError
from jaxsat.sweep import CodeError, Scenario, Source, SweepPlan, read_plan
from jaxsat.versions import LAST_DIGITS, versions

PREPARE = "jaxsat.numerics:set_up_jax"


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

    @property
    def resuming(self) -> str:
        """The command that finishes the sweep; all else stands in its directory."""
        return f"jaxsat sweep {shlex.quote(self.scenario)} --out {shlex.quote(str(self.out))} --resume"

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
        notice = numerics.set_up_jax()
        if notice:
            print(f"jaxsat: {notice}", file=sys.stderr)
        given = self.options if stored is None else {**stored.options, **self.options}
        try:
            source = Source.of(address_of(self.scenario), given, prepare=PREPARE)
            made = source.scenario()
        except CodeError:
            raise
        except InputError as error:
            # What is wrong with a file is bad input, what is wrong with an option wrong usage.
            if error.file is not None:
                raise
            raise CycloptsError(msg=str(error)) from None
        seed = self.seed if self.seed is not None else stored.seed if stored else SEED
        cases = self.cases if self.cases is not None else stored.cases if stored else CASES
        plan = SweepPlan(made.name, seed, dict(source.options), made.chunk, cases, versions(LAST_DIGITS), source.code)
        return source, made, plan
