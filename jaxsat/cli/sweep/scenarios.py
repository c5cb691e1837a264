"""The scenarios that `jaxsat sweep` knows; a new one is a line in this table."""

from dataclasses import dataclass
from difflib import get_close_matches


@dataclass(frozen=True)
class Entry:
    """A scenario as help shows it, without importing it."""

    address: str
    """`module:name` of its `jaxsat.sweep.Factory`."""
    summary: str


SCENARIOS: dict[str, Entry] = {
    "sun-pointing": Entry(
        "jaxsat.cli.sun_pointing:make", "a spacecraft with a pyramid Sun sensor finds the Sun and holds it"
    ),
    "emergency-mode": Entry(
        "jaxsat.cli.emergency_mode:make", "a satellite with magnetic coils turns into its orbital attitude"
    ),
    "earth-search": Entry(
        "jaxsat.cli.earth_search:make", "a spacecraft with four horizon sensors finds the Earth and tracks it"
    ),
    "gravity-gradient": Entry(
        "jaxsat.cli.gravity_gradient:make", "a satellite under gravity gradient, let go at random: upright or tumbling"
    ),
}


def address_of(name: str) -> str:
    """Address of a scenario's factory by its name, or `name` itself where it is an address; ValueError for neither."""
    if ":" in name:
        return name
    if name not in SCENARIOS:
        close = get_close_matches(name, SCENARIOS, n=1)
        hint = f"Did you mean {close[0]}?" if close else f"Known: {', '.join(SCENARIOS)}; or module:factory."
        raise ValueError(f'There is no scenario "{name}". {hint}')
    return SCENARIOS[name].address
