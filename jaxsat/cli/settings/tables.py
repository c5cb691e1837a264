"""The configuration that may stand beside a satellite file: how it is fitted, and what of orbit and Sun is given."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field

from fitting.settings import FitSettings
from jaxsat.cli.settings.sections import Config
from jaxsat.errors import InputError
from jaxsat.files.toml_files import read_toml, validated, with_values
from jaxsat.given import Earth, Given, Orbit, Sun, Time
from jaxsat.setting_types import Section


class TableConfig(Section):
    """Those sections of a configuration that are no numbers of a satellite."""

    orbit: Orbit = Orbit()
    time: Time = Time()
    earth: Earth = Earth()
    sun: Sun = Sun()
    fit: FitSettings = Field(default=FitSettings())

    @property
    def given(self) -> Given:
        """What of orbit, Earth and Sun is not to be found from the session."""
        return Given(orbit=self.orbit, time=self.time, earth=self.earth, sun=self.sun)


def load_table_config(path: Path | None, options: Mapping[str, object]) -> TableConfig:
    """Returns the configuration of a TOML file with `options`, by names of `FitSettings`, in place of its keys.

    Raises `InputError` for a key that is none, or that is of the satellite file.
    """
    data = {} if path is None else read_toml(path, kind="TOML configuration")
    for name in data:
        if name in Config.model_fields and name not in TableConfig.model_fields:
            own = ", ".join(f"[{section}]" for section in TableConfig.model_fields)
            raise InputError(f"belongs to Munin; beside --satellite a file may hold {own}", file=path, field=name)
    return validated(TableConfig, with_values(data, {f"fit.{name}": value for name, value in options.items()}), path)
