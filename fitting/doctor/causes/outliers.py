"""Readings that are of no motion, here and there, among others that one motion explains to the noise."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.causes.scales import WHITE_P
from fitting.doctor.trial import Trial
from fitting.outcome.result import ChannelFit, FitResult
from fitting.outcome.verdict import MOST_MISFITS
from fitting.outcome.witness import MOST_LEFT_OUT

MOST, AT_NOISE = 0.35, 1.3
"""Share of a channel's samples, and chi2 per reading of the others, up to which the others are taken for explained."""
SCATTERED = 0.5
"""Runs of samples left out, over what chance makes of as many: a stretch of the session is none of this kind."""


def outlying_readings(bench: Bench, result: FitResult) -> Iterator[Trial]:
    """Samples that were left out, so many that they deny the fit, where the others leave nothing to be explained."""
    channels = {name: c for name, c in result.channels.items() if not c.witness and c.fitted.any()}
    gone = {name: c for name, c in channels.items() if _scattered(c)}
    if not gone or not all(_explained(channel) for channel in channels.values()):
        return
    counts = [
        f"{int((c.fitted & ~c.used).sum())} of {int(c.fitted.sum())} samples of {name}" for name, c in gone.items()
    ]
    yield Trial(
        "outliers",
        f"{', '.join(counts)} are of no motion, one here and one there; all others are explained",
        "frames that were damaged on their way, or other units mixed in: they are left out as they are; `used` is 0 in "
        "the channel's CSV",
        # Their readings explained as well as the others.
        float(result.chi2 / max(result.dof, 1) * bench.readings) + bench.of_witnesses,
        1,
    )


def _explained(channel: ChannelFit) -> bool:
    ratio = channel.chi2_per_reading
    return ratio is not None and ratio < AT_NOISE and channel.memory_p > WHITE_P


def _scattered(channel: ChannelFit) -> bool:
    out = ~channel.used[channel.fitted]
    share = float(out.mean())
    if share > MOST or not (channel.misfits > MOST_MISFITS or share > MOST_LEFT_OUT):
        return False
    runs = int(out[0]) + int(np.sum(out[1:] & ~out[:-1]))
    return bool(runs > SCATTERED * (1.0 - share) * out.sum())
