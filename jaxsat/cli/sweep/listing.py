"""What `jaxsat sweep` says of scenarios without running them, and the file of a new one."""

from collections.abc import Mapping
from pathlib import Path

from jaxsat.cli.shared.talk import Talk
from jaxsat.cli.sweep.scenarios import PACKAGES, SCENARIOS, folder_of, summary_of
from jaxsat.errors import InputError

TEMPLATE = folder_of(PACKAGES[0]) / "_template.py"
_NAME, _FILE = "my-scenario", "my_scenario.py"
"""As they stand in the template."""


def list_scenarios() -> None:
    """Shows all bundled scenarios with their options."""
    from jaxsat.cli.shared.terminal import plain_table, show
    from jaxsat.sweep.source import factory

    for name, entry in SCENARIOS.items():
        table = plain_table("option", "default", "meaning")
        made = factory(entry.address)
        for option in made.options:
            table.add_row(option.name, option.default, option.meaning)
        assumed = "".join(f"\n  assumed: {sentence}" for sentence in made.assumptions)
        show(f"{name}: {entry.summary}", table, *([assumed.lstrip("\n") + "\n"] if assumed else []))
    show(f"Example: jaxsat sweep {next(iter(SCENARIOS))} --cases 2000 --seed 1 --out results")
    show("A scenario of your own: jaxsat sweep --new my_scenario.py")


def list_one(scenario: str, given: Mapping[str, str]) -> None:
    """Shows what a scenario takes, draws and returns; with options `given`, what it draws with those."""
    from jaxsat.cli.shared.terminal import plain_table, show
    from jaxsat.cli.sweep.request import Request
    from jaxsat.significant import unit_text, value_text
    from jaxsat.sweep.source import factory

    source, made, _ = Request(scenario, None, None, dict(given), Path(), from_stored=False).resolve()
    options = plain_table("option", "value" if given else "default", "meaning")
    for option in factory(source.address).options:
        options.add_row(option.name, given.get(option.name, option.default), option.meaning)
    metrics = plain_table("metric", "unit", "meaning")
    for name, metric in made.metrics.items():
        metrics.add_row(name, unit_text(metric.unit), metric.meaning)
    inputs = plain_table("drawn for each case", "unit", "meaning")
    for one in made.inputs:
        inputs.add_row(", ".join(one.columns), unit_text(one.unit), one.meaning)
    show(f"{made.name}: {_summary(scenario, source.address)}".rstrip(": "), options, metrics)
    knobs = plain_table("knob", "value", "unit", "meaning", right=(1,))
    for knob in made.knobs:
        knobs.add_row(knob.name, value_text(knob.value, 3), unit_text(knob.unit), knob.meaning)
    show(*([inputs] if made.inputs else []), *([knobs] if made.knobs else []))
    show(f"ends: {', '.join(word.replace('_', ' ') for word in made.statuses)}; chunks of {made.chunk} cases")
    for sentence in made.assumptions:
        show(f"assumed: {sentence}")


def _summary(scenario: str, address: str) -> str:
    if scenario in SCENARIOS:
        return SCENARIOS[scenario].summary
    path = Path(address.rpartition(":")[0])
    return summary_of(path.read_text("utf-8")) if path.suffix == ".py" else ""


def write_new(path: Path, talk: Talk) -> int:
    """Writes the file of a new scenario, which runs as it stands, and says how; returns the exit status."""
    if path.suffix != ".py" or not path.stem.isidentifier():
        raise InputError("expected a name of a module of Python's, as my_scenario.py", file=path)
    text = TEMPLATE.read_text("utf-8").replace(_NAME, path.stem.replace("_", "-")).replace(_FILE, str(path))
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError("is there already; take another name, or move it away", file=path) from None
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", file=path) from None
    if not talk.quiet:
        print(f"{path} is a scenario that runs as it stands:")
        print(f"  jaxsat sweep {path} --list")
        print(f"  jaxsat sweep {path} --cases 1000 --out results")
        print(f"  jaxsat sweep {path} --case 17 --out results")
    return 0
