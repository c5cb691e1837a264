"""The configuration with the command line's options in place of its keys."""

from pathlib import Path

from jaxsat.cli.settings.files import load_config
from jaxsat.cli.settings.sections import Config


def read_settings(
    config: Path | None,
    *,
    free: str | None = None,
    arc: tuple[float, float] | None = None,
    drop: list[tuple[float, float]] | None = None,
    starts: int | None = None,
    seed: int | None = None,
) -> Config:
    """Returns the configuration with the command line's options in place of its keys; `drop` adds to the file's."""
    options = {"fit.free": free, "fit.arc_s": arc, "fit.starts": starts, "fit.seed": seed}
    given: dict[str, object] = {key: value for key, value in options.items() if value is not None}
    settings = load_config(config, given)
    if drop:
        settings = load_config(config, {**given, "cleaning.drop_s": [*settings.cleaning.drop_s, *drop]})
    return settings
