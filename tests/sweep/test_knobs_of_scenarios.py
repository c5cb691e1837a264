"""Every knob of the bundled scenarios: it stands for the option of its name, and moves leaves that are there."""

import math

import jax
import numpy as np
import pytest

from jaxsat.control.earth_search.law import EarthSearchLaw
from jaxsat.control.earth_search.vehicle import nominal_vehicle as earth_vehicle
from jaxsat.control.emergency_mode.law import EmergencyLaw
from jaxsat.control.emergency_mode.vehicle import nominal_vehicle as emergency_vehicle
from jaxsat.control.sun_pointing.law import SunPointingLaw
from jaxsat.control.sun_pointing.vehicle import nominal_vehicle as sun_vehicle
from jaxsat.sweep.flights.loops import Fixed
from jaxsat.sweep.knobs.turns import turned
from jaxsat.sweep.scenarios import detumble, earth_search, emergency_mode, point, settle, sun_pointing

FACTOR = 2.0


def loop_of(module, options):
    cases, _ = module._program(tuple(module.make.filled(options).items()))
    return Fixed(cases.nominal, cases.channels, cases.estimator, cases.controller), cases.turns


def settling():
    program = settle._program(tuple(settle.make.filled({"hours": "0.1"}).items()))
    return program.nominal, program.turns


def of_pair(module, *pair):
    return pair, module._turns(*pair)


TREES = {
    "point": lambda: loop_of(point, {}),
    "torquers": lambda: loop_of(point, {"actuators": "torquers", "attitude": "stand_in"}),
    "detumble": lambda: loop_of(detumble, {"law": "gyro"}),
    "settle": settling,
    "sun-pointing": lambda: of_pair(sun_pointing, SunPointingLaw(), sun_vehicle()),
    "emergency-mode": lambda: of_pair(emergency_mode, EmergencyLaw(), emergency_vehicle()),
    "earth-search": lambda: of_pair(earth_search, EarthSearchLaw(), earth_vehicle()),
}
"""Tree of one case and turns of each scenario, without anything compiled."""


@pytest.mark.parametrize("name", TREES)
def test_each_knob_moves_leaves_that_are_there(name):
    tree, turns = TREES[name]()
    leaves = [np.asarray(leaf, float) for leaf in jax.tree.leaves(tree)]
    assert len(turns) > 4
    for k, turn in enumerate(turns):
        moved = np.zeros((1, len(turns)))
        moved[0, k] = math.log(FACTOR)
        found = [np.asarray(leaf, float) for leaf in jax.tree.leaves(turned(tree, tree, turns, moved))]
        assert len(found) == len(leaves)
        ratios = set()
        for old, new in zip(leaves, found, strict=True):
            new = new[0] if new.ndim > old.ndim else new
            some = np.isfinite(old) & (old != 0.0)
            ratios |= set(np.round(new[some] / old[some], 12).tolist())
        if turn.knob.shift is not None or turn.about or turn.knob.name == "dipole":
            # A sum, or of what is nominal nothing: the drawn alone is moved.
            assert len(ratios) <= 2, turn.knob.name
        else:
            assert ratios == {1.0, FACTOR, *([1.0 / FACTOR] if turn.inverse else [])}, turn.knob.name


def test_values_are_those_of_the_options():
    for module, pairs in (
        (sun_pointing, {"attitude_gain": "attitude_gain", "slew_rate": "slew_rate_deg_s", "min_pulse": "min_pulse_s"}),
        (emergency_mode, {"fine_lead": "fine_lead", "fine_below": "fine_below_deg", "field_noise": "field_noise_nT"}),
        (earth_search, {"track_gain": "track_gain"}),
        (point, {"damping": "damping", "slew": "slew_deg_s", "friction_known": "friction_known"}),
    ):
        scenario = module.make({})
        knobs = {knob.name: knob.value for knob in scenario.knobs}
        for name, option in pairs.items():
            assert knobs[name] == pytest.approx(float(module.make.filled({})[option]), rel=1e-12), name
        assert scenario.horizon_s is not None and scenario.horizon_s > 0.0
    # What an option switches off is no knob.
    off = {knob.name for knob in point.make({"dumping": "0", "actuators": "wheels", "sensors": "perfect"}).knobs}
    assert "dumping" not in off and "field_noise" not in off and "frequency" in off
