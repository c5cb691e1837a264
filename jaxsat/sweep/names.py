"""Columns of a sweep as a person reads them: `settling_time_s` is a settling time, in s."""

from jaxsat.sweep.inputs import PREFIX, Input, unit_words


def title_of_scenario(name: str) -> str:
    """`Sun pointing` for `sun-pointing`."""
    return name.replace("-", " ").capitalize()


def title_of(name: str, unit: str) -> str:
    """A metric's name without its unit: `Settling time` for `settling_time_s`."""
    words = name.removesuffix(f"_{unit_words(unit)}").replace("_", " ").strip() or name
    return words[:1].upper() + words[1:]


def title_of_input(one: Input, column: str) -> str:
    """A drawn column's name without prefix and unit, its part at the end: `Rate x` for `in_rate_x_deg_s`."""
    return title_of(column.removeprefix(PREFIX), one.unit)
