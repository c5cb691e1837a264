"""`jaxsat sweep`: many random cases of a scenario, in chunks that survive anything, summed up at the end."""

import re
import time
import traceback
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import check_options, whole_number
from jaxsat.cli.shared.talk import USUAL, Talking
from jaxsat.cli.sweep.defaults import CASES, SEED
from jaxsat.cli.sweep.scenarios import SCENARIOS, address_of
from jaxsat.numerics import Device, Precision

LARGEST = 10**9
"""Case numbers stay below what a random key can tell apart, 2^32."""
FOLDER = default_folder("sweep")


def _check_scenario(_: Any, value: str | None) -> None:
    if value is not None:
        address_of(value)


def _shard(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    part, parts = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= part <= parts:
        raise ValueError(f'Expected I/N with I from 1 to N, as 2/8, got "{text}".')
    return part, parts


def _check_shard(_: Any, value: str | None) -> None:
    if value is not None:
        _shard(value)


def sweep(
    scenario: Annotated[
        str | None,
        Parameter(
            help="One of "
            + "; ".join(f"{name}: {entry.summary}" for name, entry in SCENARIOS.items())
            + ". Or one of your own: my_scenario.py, or module:factory. Without it, all are listed with their options.",
            validator=_check_scenario,
        ),
    ] = None,
    /,
    *,
    cases: Annotated[
        int | None,
        Parameter(
            help=f"Number of cases. With --resume a sweep may grow. [default: {CASES}, or that of the sweep resumed]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=LARGEST),
        ),
    ] = None,
    seed: Annotated[
        int | None,
        Parameter(
            help=f"Seed of all random numbers. [default: {SEED}, or that of the sweep resumed]",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=2**32),
        ),
    ] = None,
    options: Annotated[
        list[str] | None,
        Parameter(
            name="--set",
            help="NAME=VALUE: an option of the scenario; repeatable.",
            negative=(),
            validator=check_options,
        ),
    ] = None,
    satellite: Annotated[
        Path | None,
        Parameter(help="Satellite file (TOML) of the scenarios that take one. [default: a bundled CubeSat of 3 units]"),
    ] = None,
    orbit: Annotated[
        Path | None,
        Parameter(help="TLE, OMM or OEM in place of the orbit of the satellite file. [default: that of the file]"),
    ] = None,
    listed: Annotated[
        bool,
        Parameter(name="--list", help="Only say what the scenario takes, draws and returns.", negative=()),
    ] = False,
    new: Annotated[
        Path | None,
        Parameter(help="Write the file of a new scenario, which runs as it stands, to be changed.", negative=()),
    ] = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = FOLDER,
    resume: Annotated[bool, Parameter(help="Finish the sweep in DIR: run what is missing.", negative=())] = False,
    shard: Annotated[
        str | None,
        Parameter(
            help="I/N, as 2/8: run only this part of the chunks; all parts write into one DIR, at any time and on any "
            "machine. Whoever finishes last writes the results.",
            validator=_check_shard,
        ),
    ] = None,
    case: Annotated[
        int | None,
        Parameter(
            help="Run this case alone and write its whole history to DIR/case-K.",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=LARGEST),
        ),
    ] = None,
    engine: Annotated[
        Literal["local", "dask"], Parameter(help="Threads of this process, or dask.distributed.")
    ] = "local",
    workers: Annotated[
        int | None,
        Parameter(
            help="Number of threads, or of dask's processes. [default: one a core]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=4096),
        ),
    ] = None,
    scheduler: Annotated[
        str | None, Parameter(help="Address of a running dask scheduler. [default: a cluster on this machine]")
    ] = None,
    precision: Annotated[
        Precision | None,
        Parameter(
            help="Of all numbers. With float32 the first cases are run in float64 too, and how far they are apart is "
            "told. [default: float64, or that of the sweep resumed]"
        ),
    ] = None,
    device: Annotated[
        Device | None,
        Parameter(help="Where to compute; last digits differ from one to the other. [default: a GPU that JAX finds]"),
    ] = None,
    chunk: Annotated[
        int | None,
        Parameter(
            help="Cases that run at once, a multiple of the scenario's own number. [default: that number; about 16 000 "
            "on a GPU]",
            converter=whole_number,
            validator=validators.Number(gte=1, lte=LARGEST),
        ),
    ] = None,
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Run many random cases of a scenario and sum them up.

    Writes cases.parquet (one row a case), summary.json, distributions.png and
    sweep.html, a page to look at.
    Finished chunks of cases are kept in DIR/chunks: whatever stops a sweep,
    --resume finishes it. Case K of a seed is the same case in every sweep.

    Exit status: 0 done (cases that failed are results), 1 bad input or an
    error in a scenario of your own, 2 wrong usage.

    Example: jaxsat sweep gravity-gradient --cases 2000 --seed 1 --out tilts

    Example: jaxsat sweep gravity-gradient --out tilts --case 17

    Example: jaxsat sweep gravity-gradient --set rate_deg_s=0.1 --shard 1/4

    Example: jaxsat sweep --new my_scenario.py
    """
    from jaxsat.cli.sweep.listing import list_one, list_scenarios, write_new

    given = dict(text.split("=", 1) for text in options or ())
    given |= {name: str(path) for name, path in (("satellite", satellite), ("orbit", orbit)) if path is not None}
    if new is not None:
        if scenario is not None:
            raise CycloptsError(msg="--new writes a file and runs nothing: it goes without a scenario.")
        return write_new(new, talk)
    if scenario is None:
        list_scenarios()
        return 0
    _check_together(case, shard, resume, engine, scheduler)
    began = time.perf_counter()
    from jaxsat.cli.sweep.case import write_case
    from jaxsat.cli.sweep.request import Request
    from jaxsat.cli.sweep.run import SweepRun
    from jaxsat.sweep import CodeError

    try:
        if listed:
            list_one(scenario, given)
            return 0
        request = Request(scenario, cases, seed, given, out, resume or case is not None, precision, device, chunk)
        source, made, plan = request.resolve()
        imported = time.perf_counter() - began
        if case is not None:
            return write_case(made, plan, out, case, talk)
        part = _shard(shard) if shard else (1, 1)
        run = SweepRun(source, made, plan, out, part, engine, workers, scheduler, request.resuming, request.replaying)
        return run.carry_out(resume=resume, imported=imported, began=began, plots=plots, talk=talk)
    except CodeError as error:
        if talk.verbose and error.__cause__ is not None:
            traceback.print_exception(error.__cause__)
        raise


def _check_together(case: int | None, shard: str | None, resume: bool, engine: str, scheduler: str | None) -> None:
    if case is not None and (shard or resume or engine != "local"):
        raise CycloptsError(msg="--case runs one case: it goes with none of --shard, --resume, --engine.")
    if scheduler is not None and engine != "dask":
        raise CycloptsError(msg="--scheduler is dask's: add --engine dask.")
