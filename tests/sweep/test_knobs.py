"""Knobs: their leaves move as they say, common to all cases or of each; what cannot be moved is refused."""

import dataclasses

import fake_scenario
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.sweep import Knob
from jaxsat.sweep.knobs.knob import places_of
from jaxsat.sweep.knobs.turns import Turn, positive, turned

FAKE = fake_scenario.make({})


def test_turns_move_leaves_that_are_common_or_of_each_case():
    like = {"gain": jnp.asarray(2.0), "inertia": jnp.eye(3), "inverse": jnp.eye(3), "bias": jnp.array([1.0, 0.0, 3.0])}
    tree = like | {"bias": jnp.array([[1.5, 0.0, 3.0], [1.0, -0.5, 4.0]])}
    turns = (
        Turn(Knob("gain", "1", "", 2.0), (lambda t: t["gain"],)),
        Turn(Knob("inertia", "kg m2", "", 1.0), (lambda t: t["inertia"],), inverse=(lambda t: t["inverse"],)),
        Turn(Knob("errors", "1", "", 1.0), (lambda t: t["bias"],), about=True),
        Turn(Knob("offset", "deg", "", 0.0, shift=20.0), (lambda t: t["bias"],), to_si=0.1),
        Turn(Knob("last", "1", "", 3.0), (lambda t: t["bias"],), entry=2),
    )
    moved = np.zeros((2, 5))
    np.testing.assert_array_equal(turned(tree, like, turns, moved)["bias"], tree["bias"])
    moved[1] = [np.log(3.0), np.log(2.0), np.log(2.0), 0.5, np.log(10.0)]
    found = turned(tree, like, turns, moved)
    np.testing.assert_allclose(found["gain"], [2.0, 6.0])
    np.testing.assert_allclose(found["inertia"][1], 2.0 * np.eye(3))
    np.testing.assert_allclose(found["inertia"][1] @ found["inverse"][1], np.eye(3))
    # Half and one off the nominal become one and two, then all get 1, then the last is ten times as much.
    np.testing.assert_allclose(found["bias"], [[1.5, 0.0, 3.0], [2.0, 0.0, 60.0]])


def test_what_cannot_be_moved_is_refused():
    knob, off = Knob("a", "1", "", 1.0), Knob("b", "1", "", 0.0)
    for knobs, function, told in (
        ((knob,), None, "knobs need a function run_moved"),
        ((knob, knob), FAKE.run, "two knobs would be called a"),
        ((off,), FAKE.run, "knob b: expected a positive number to be moved by factors"),
        ((dataclasses.replace(off, shift=-1.0),), FAKE.run, "knob b: expected a positive shift"),
    ):
        with pytest.raises(ValueError, match=f"Scenario fake: {told}"):
            dataclasses.replace(FAKE, knobs=knobs, run_moved=function)
    # A gain that the options have switched off is no knob; an offset of zero is one.
    turns = [Turn(knob, ()), Turn(off, ()), Turn(dataclasses.replace(off, shift=1.0), ())]
    assert positive(turns) == (turns[0], turns[2])


def test_names_are_found_or_near_ones_are_told():
    assert places_of(["c", "a"], ["a", "b", "c"], "knob") == [2, 0]
    with pytest.raises(InputError, match="dampin: no such knob of this scenario; did you mean damping?"):
        places_of(["dampin"], ["damping", "gain"], "knob")
    with pytest.raises(InputError, match="there are damping, gain"):
        places_of(["x"], ["damping", "gain"], "knob")
    with pytest.raises(InputError, match="gain: is named twice among the knobs"):
        places_of(["gain", "gain"], ["damping", "gain"], "knob")
    assert Knob("f", "1", "", 0.8, shift=2.0).per == (0.005, "+0.01")
    assert Knob("f", "deg", "", 0.8, shift=2.0).per == (0.5, "+1 deg")
