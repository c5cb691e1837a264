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
    """The channel's arrays; quaternions without a change of sign from sample to sample, measured ones as modelled."""
    measured, modelled, count = channel.measured, channel.modelled, channel.residual.shape[1]
    if channel.kind == ATTITUDE_KIND:
        turned = np.einsum("ni,ni->n", modelled[1:], modelled[:-1]) < 0.0
        modelled = np.where(np.concatenate([[False], turned])[:, None].cumsum(axis=0) % 2, -modelled, modelled)
        measured = np.where(np.nansum(measured * modelled, axis=1, keepdims=True) < 0.0, -measured, measured)
    same = count == len(channel.columns)
    others = TURNS if count == len(TURNS) else tuple(f"difference {k + 1}" for k in range(count))
    return Readings(
        t_s=channel.t_s,
        columns=tuple(channel.columns),
        measured=measured,
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
