"""How sensors of directions are turned, where the motion is given: the start of a turn that may be any.

Along a known motion a known direction is known in body axes too, so the turn that carries what a sensor shows to what
it should show is that of Wahba 1965, whatever its size; from no turn at all a solver finds half a circle only by luck.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.assembly import Samples
from fitting.measurements.problem import Motion, Problem
from fitting.parameters.free import FreeParameters
from fitting.starts.multi_start import Starts
from fitting.starts.sights import Directions, sights_of
from jaxsat.satellites.model import array_at

FEWEST = 8
"""Samples with a direction."""


def body_directions(directions: Directions, motion: Motion) -> np.ndarray:
    """[samples 3] where a sensor should see its direction, by the motion."""
    turns = Rotation.from_quat(np.array(motion.quaternion)[: len(directions.inertial)], scalar_first=True)
    return turns.inv().apply(directions.inertial)


def with_turns(starts: Starts, problem: Problem, samples: Samples, parameters: FreeParameters) -> Starts:
    """The first start, and beside it one whose sensors are turned as the samples show."""
    assert problem.motion is not None
    spots = {leaf.spot: number for number, leaf in enumerate(parameters.leaves)}
    free = set(parameters.columns.tolist())
    values = np.array(parameters.tree.nominal, float)
    for name in samples.values:
        place = f"sensors.{name}.turn"
        numbers = [spots.get((place, (k,)), -1) for k in range(3)]
        one = replace(samples, values={name: samples.values[name]})
        if not free.issuperset(numbers):
            continue
        for directions in sights_of(problem, one).directions:
            seen, due = directions.body, body_directions(directions, problem.motion)
            good = np.isfinite(seen).all(axis=1)
            if good.sum() < FEWEST:
                continue
            apart = Rotation.align_vectors(due[good], seen[good])[0]
            nominal = Rotation.from_rotvec(np.array(array_at(problem.model, place), float))
            values[numbers] = (apart * nominal).as_rotvec()
    first = starts.take(np.arange(1))
    x = first.x.copy()
    x[:, -len(parameters.columns) :] = parameters.shifts(values)
    return first.followed_by(Starts(x, first.reference, first.cost))
