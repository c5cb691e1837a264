"""What one fit takes: from tables and a satellite file, or from a RAW_SUN file and a configuration."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import CycloptsError

from fitting.parameters.chosen import chosen_leaves, spelt_out
from fitting.parameters.free import free_parameters
from fitting.profile.profile import check_profile
from fitting.settings import FitSettings
from jaxsat.errors import InputError
from jaxsat.given import Given
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.satellites.described import LIMB
from jaxsat.telemetry import TableSession, read_session, read_telemetry
from jaxsat.telemetry.limb_angles import limb_channel
from jaxsat.telemetry.raw_sun.table import table_of

if TYPE_CHECKING:
    from jaxsat.cli.settings.sections import Config
    from jaxsat.cli.settings.tables import TableConfig


@dataclass(frozen=True)
class Inputs:
    """A satellite, a session of it, and how it is fitted."""

    satellite: Satellite
    session: TableSession
    settings: FitSettings
    given: Given = Given()


@dataclass(frozen=True)
class OfTables:
    """Reads tables by a satellite file."""

    satellite: Satellite
    settings: FitSettings
    given: Given = Given()

    @staticmethod
    def by(
        path: Path, config: "TableConfig", free: str | None, file: Path | None, profiles: Sequence[str] = ()
    ) -> "OfTables":
        """Reads the satellite file; `profiles` are names of what shall have one.

        Raises `InputError`, also where the configuration's `file` frees what the satellite does not have, and
        CycloptsError where `free`, of the command line, does, and for a profile that the fit does not have.
        """
        satellite, settings = read_satellite(path), config.fit
        _check_names(satellite, settings.free, profiles, file=None if free is not None else file)
        return OfTables(satellite, settings, config.given)

    def __call__(self, files: Sequence[Path]) -> Inputs:
        """The files are one session; raises `InputError`."""
        session = read_telemetry(files, self.satellite)
        return Inputs(self.satellite, session, self.settings, self.given)


@dataclass(frozen=True)
class OfRawSun:
    """Reads RAW_SUN files of the satellite of a configuration."""

    satellite: Satellite
    config: "Config"
    settings: FitSettings
    limb: Path | None
    """File of limb angles."""

    @staticmethod
    def by(
        config: "Config",
        limb: Path | None,
        free: str | None,
        holdout: float | None,
        file: Path | None = None,
        profiles: Sequence[str] = (),
    ) -> "OfRawSun":
        """Raises CycloptsError where `free`, of the command line, names what Munin has not, `InputError` for its key in
        the configuration's `file`; and CycloptsError for a name of `profiles` that is not free."""
        used = limb is not None and config.fit.limb_weight > 0.0
        satellite = config.described(limb=used)
        settings = config.fit.settings
        if holdout is not None:
            settings = settings.changed(holdout=holdout)
        _check_names(satellite, settings.free, profiles, file=None if free is not None else file)
        return OfRawSun(satellite, config, settings, limb)

    def __call__(self, files: Sequence[Path]) -> Inputs:
        """The one file is a session; raises `InputError`."""
        (path,) = files
        config, limb = self.config, self.limb
        cleaned = read_session(path, config.numbers, cleaning=config.cleaning)
        own = {name: channel for name, channel in self.satellite.channels.items() if name != LIMB}
        session = table_of(cleaned, replace(self.satellite, channels=own))
        if limb is not None and LIMB not in self.satellite.channels:
            # As that of `vesABlimb` = 0 the file may be missing or a dummy.
            remark = f"{limb}: limb angles are not used, for fit.limb_weight is 0"
            session = replace(session, remarks=(*session.remarks, remark))
        elif limb is not None:
            channel, remarks, sha256 = limb_channel(limb, cleaned, LIMB, self.satellite.channels[LIMB])
            session = replace(
                session,
                channels={**session.channels, LIMB: channel},
                remarks=(*session.remarks, *remarks),
                paths=(*session.paths, limb),
                sha256=(*session.sha256, sha256),
            )
        return Inputs(self.satellite, session, self.settings, config.given)


def _check_names(
    satellite: Satellite, free: Sequence[str] | None, profiles: Sequence[str], file: Path | None = None
) -> None:
    """Wrong usage where an option names what cannot be free or have a profile, bad input where the `file` does."""
    try:
        names = chosen_leaves(satellite.leaves, free, satellite.aliases)
        moves = satellite.motion.kind == "free"
        parameters = free_parameters(satellite.model, satellite.leaves, names, free_motion=moves, held=satellite.held)
    except InputError as error:
        if file is not None:
            raise InputError(error.reason, file=file, field="fit.free") from None
        raise CycloptsError(msg=f"Invalid value for --free: {error.reason}") from None
    try:
        for name in (each for item in profiles for each in spelt_out(item, satellite.aliases)):
            check_profile(parameters, name)
    except InputError as error:
        raise CycloptsError(msg=f"Invalid value for --profile: {error.reason}") from None
