"""Axes of magnetometers, gyroscopes and Sun sensors: which of the 48 ways of reading agrees with the other sensors."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from fitting.starts.conventions import conventions, with_axes

STARTS = 32
TRIED = 3
"""Conventions of a sensor that are fitted, those that agree best."""
BETTER = 0.9
"""Of the mismatch of the axes that the file has, above which others are no better."""


def other_axes(bench: Bench) -> Iterator[Trial]:
    """Sensors of three axes read otherwise, where two sensors that are fitted tell whether they agree."""
    for name in bench.samples.channels:
        sensor = bench.problem.model.sensors[name]
        axes = np.asarray(getattr(sensor, "axes", np.zeros((0, 3))))
        square = axes.shape == (3, 3) and np.allclose(axes @ axes.T, np.eye(3))
        if bench.samples.channels[name].witness or not square:
            continue
        ranked = conventions(bench.problem, bench.samples, {name: "mirrored"})
        own = next((each.mismatch for each in ranked if np.allclose(each.axes[name], axes)), np.inf)
        others = [each for each in ranked if not np.allclose(each.axes[name], axes)]
        for each in others[:TRIED]:
            if not each.mismatch < BETTER * own:
                break
            chi2s = anew(bench, bench.samples, STARTS, change=lambda problem, each=each: with_axes(problem, each))
            for chi2 in chi2s:
                told = each.spelt()[name]
                yield Trial(
                    "axes",
                    f"columns of {name} read {', '.join(told)}",
                    f"the sensor is mounted otherwise, or columns and signs are exchanged: sensors.{name}.axes",
                    chi2,
                    1,
                    f"--as axes:{name}:{''.join(told)}",
                )
