"""A channel as tables, pictures and the page show it."""

import re
from collections.abc import Iterable

import numpy as np

from fitting.outcome.sensed_result import ChannelFit
from jaxsat.plotting.channels import Readings

TURNS = ("turn x", "turn y", "turn z")
"""What the residuals of a quaternion are of."""
ATTITUDE_KIND = "StarTracker"


def readings_of(channel: ChannelFit) -> Readings:
    """The channel's arrays; of the two signs of a modelled quaternion that of the measured one."""
    modelled, count = channel.modelled, channel.residual.shape[1]
    if channel.kind == ATTITUDE_KIND:
        overlap = np.nansum(channel.measured * modelled, axis=1, keepdims=True)
        modelled = np.where(overlap < 0.0, -modelled, modelled)
    same = count == len(channel.columns)
    others = TURNS if count == len(TURNS) else tuple(f"difference {k + 1}" for k in range(count))
    return Readings(
        t_s=channel.t_s,
        columns=tuple(channel.columns),
        measured=channel.measured,
        modelled=modelled,
        differences=tuple(channel.columns) if same else others,
        residual=channel.residual,
        promised=channel.promised,
        used=channel.used,
    )


def file_stems(names: Iterable[str]) -> dict[str, str]:
    """Names of files without their endings by channel: any name may stand in a satellite file, not all in a folder."""
    found: dict[str, str] = {}
    for name in names:
        stem = f"channel-{re.sub(r'[^A-Za-z0-9_+-]', '_', name)}"
        while stem in found.values():
            stem += "_"
        found[name] = stem
    return found
