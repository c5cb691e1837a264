"""The time axis that all pictures of one fit share: its ends, the Earth's shadow, what was held out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from jaxsat.plotting.style import AXIS_COLOURS, MAIN, SHADOW, shadow_spans

HELD_OUT = "#fdf0d5"
_COLOURS = (MAIN, "#d99e10", "#c26fa6", "#3b9fe8", "#0f8a64", "#a5400b", "#6b7280", "#c81fb0")
Span = tuple[float, float]


@dataclass(frozen=True)
class Timeline:
    """Seconds since the epoch."""

    begin: float
    end: float
    shadow: Sequence[Span] = ()
    held_out: Sequence[Span] = ()

    @staticmethod
    def of(t_s: np.ndarray, fitted: np.ndarray, illumination: np.ndarray | None) -> "Timeline":
        """That of samples [time]: which of them were fitted, and which share of the Sun they saw (None: not known)."""
        shadow = [] if illumination is None else shadow_spans(t_s, np.asarray(illumination) > 0.5)
        return Timeline(float(t_s[0]), float(t_s[-1]), shadow, shadow_spans(t_s, fitted))

    def dress(self, axes: Axes) -> None:
        """Gives axes these limits and shades."""
        margin = 0.015 * (self.end - self.begin) or 1.0
        axes.set_xlim(self.begin - margin, self.end + margin)
        for spans, colour in ((self.held_out, HELD_OUT), (self.shadow, SHADOW)):
            for begin, end in spans:
                # One over the other: shadow within what was held out stays in sight.
                axes.axvspan(begin, end, color=colour, linewidth=0, zorder=0, alpha=0.8)

    def legend(self) -> list[Artist]:
        """What the shades mean, of those that there are."""
        shades = ((self.shadow, SHADOW, "Earth's shadow"), (self.held_out, HELD_OUT, "held out"))
        return [Patch(color=colour, label=text) for spans, colour, text in shades if spans]


def column_colours(count: int) -> list[str]:
    """Returns a colour for each of `count` readings: those of the body axes for three, else of a row that returns."""
    return list(AXIS_COLOURS.values()) if count == 3 else [_COLOURS[k % len(_COLOURS)] for k in range(count)]
