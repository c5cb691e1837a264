"""Panels that never show light while others of their sensor do: dead, or never turned to the Sun.

What a dead panel does not show says nothing of the Sun, and a search that takes it for alive turns the satellite away
from it. So where there is such a panel, and its gain is free, the search begins in both ways.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fitting.measurements.assembly import Samples
from fitting.measurements.contradicted import BRIGHT
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE
from jaxsat.satellites.model import Model
from jaxsat.sensors import Panels

RARELY = 0.01
"""Share of a panel's readings that may stand out of the noise by chance or wrong bytes where it shows no light."""


@dataclass(frozen=True)
class Silent:
    """Panels of free gain that may be dead."""

    panels: Mapping[str, np.ndarray]
    """Numbers of the columns of each sensor that has such panels."""

    def left_out(self, samples: Samples) -> Samples:
        """The samples as if these panels had not been measured."""
        values = dict(samples.values)
        for name, columns in self.panels.items():
            values[name] = values[name].copy()
            values[name][:, columns] = np.nan
        return replace(samples, values=values)

    def unknowns(self, parameters: FreeParameters) -> np.ndarray:
        """[unknowns] of a solver: their gains are zero, all other panels as bright as they are nominally."""
        values = np.array(parameters.tree.nominal, float)
        spots = {leaf.spot: number for number, leaf in enumerate(parameters.leaves)}
        for name, columns in self.panels.items():
            gains = [number for (place, _), number in spots.items() if place == f"sensors.{name}.gain"]
            before = values[gains].mean()
            values[[spots[f"sensors.{name}.gain", (int(column),)] for column in columns]] = 0.0
            if f"{name}.gain" in parameters.gauged:
                # The gauge spreads the mean of all over those that are left.
                values[spots[f"sensors.{name}.max_current", (0,)]] *= values[gains].mean() / before
        lower, upper = parameters.bounds()
        return np.clip(np.concatenate([np.zeros(len(STATE)), parameters.shifts(values)]), lower, upper)


def silent_panels(samples: Samples, model: Model, parameters: FreeParameters) -> Silent:
    """Panels whose gain may be zero, dark in all samples while another of their sensor lights up."""
    chosen = [parameters.leaves[k] for k in parameters.columns if k >= 0]
    free = {leaf.spot for leaf in chosen if leaf.lower <= 0.0}
    found = {}
    for name, rows in samples.values.items():
        channel = samples.channels[name]
        if not isinstance(model.sensors[name], Panels) or channel.witness:
            continue
        measured = np.isfinite(rows).sum(axis=0)
        lit = (np.nan_to_num(rows) > BRIGHT * channel.sigma).sum(axis=0)
        dark = (measured > 0) & (lit <= RARELY * measured)
        columns = [k for k in np.flatnonzero(dark) if (f"sensors.{name}.gain", (int(k),)) in free]
        if columns and not dark.all():
            found[name] = np.array(columns)
    return Silent(found)
