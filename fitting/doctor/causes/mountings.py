"""Axes of magnetometers, gyroscopes and Sun sensors: which of the 48 ways of reading agrees with the other sensors."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from fitting.starts.conventions import Convention, conventions, with_axes
from jaxsat.sensors.mounting import axes_text

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
        if sum(not channel.witness for channel in bench.samples.channels.values()) == 1:
            yield from _other_hand(bench, name, axes)
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


def _other_hand(bench: Bench, name: str, axes: np.ndarray) -> Iterator[Trial]:
    """A sensor that is alone, read with the other hand.

    Right-handed axes in another order turn the body with them, and nothing but its inertia tells; so of all that are
    left-handed one is enough.
    """
    convention = Convention({name: -axes}, 0.0)
    for chi2 in anew(bench, bench.samples, STARTS, change=lambda problem: with_axes(problem, convention)):
        told = axes_text(-axes)
        yield Trial(
            "axes",
            f"columns of {name} are of the other hand, as {', '.join(told)}",
            f"one column has a turned sign, or two are exchanged, which one a sensor alone does not tell: "
            f"sensors.{name}.axes",
            chi2,
            1,
            f"--as axes:{name}:{''.join(told)}",
        )
