"""The settings of a preparation or a fit of a RAW_SUN session, as results keep them."""

from typing import Any

from fitting.session import PreparedSession
from jaxsat.satellites import SatelliteNumbers
from jaxsat.setting_types import Section


def settings_document(
    prepared: PreparedSession, satellite: SatelliteNumbers, settings: Section | None = None
) -> dict[str, Any]:
    """Returns all settings that a preparation or a fit reads, by the sections of a configuration, as plain values."""
    sections = {**dict(prepared.given), **dict(satellite), "cleaning": prepared.session.cleaning}
    if settings is not None:
        sections["fit"] = settings
    return {name: section.model_dump(mode="json") for name, section in sections.items()}
