"""Scenarios keep their promises, and their options are checked in one line."""

import dataclasses

import fake_scenario
import jax
import numpy as np
import pytest

from jaxsat.cli.sweep.scenarios import SCENARIOS
from jaxsat.errors import InputError
from jaxsat.sweep import Scenario, Source, case_keys, choice_of, drawn_inputs, number_of, run_cases
from jaxsat.sweep.source import factory

FAKE = fake_scenario.make({})
CASES = np.arange(8, dtype=np.int64)


def test_options_have_defaults_and_an_order():
    assert list(fake_scenario.make.filled({"chunk": "4"}).items()) == [("scale", "1"), ("pause_s", "0"), ("chunk", "4")]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"scal": "1"}, "scal: no such option of this scenario; did you mean scale?"),
        ({"q": "1"}, "q: no such option of this scenario; options are scale, pause_s, chunk"),
        ({"scale": "one"}, "scale: expected a number of at least 0, found 'one'"),
        ({"scale": "-1"}, "scale: expected a number of at least 0, found '-1'"),
        ({"scale": "nan"}, "found 'nan'"),
        ({"scale": "1_0"}, "found '1_0'"),
    ],
)
def test_wrong_options_are_one_line(options, expected):
    with pytest.raises(InputError) as caught:
        fake_scenario.make(options)
    assert expected in str(caught.value) and "\n" not in str(caught.value)


def test_numbers_and_choices():
    assert number_of({"a": " 1.5e-3 "}, "a", low=0.0, high=1.0) == 1.5e-3
    with pytest.raises(InputError, match="a number from 0 to 1, found '2'"):
        number_of({"a": "2"}, "a", low=0.0, high=1.0)
    assert choice_of({"a": "b"}, "a", ("b", "c")) == "b"
    with pytest.raises(InputError, match="a: expected one of b, c, found 'd'"):
        choice_of({"a": "d"}, "a", ("b", "c"))


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"status": np.full(8, 3)}, "status must be a whole number below 3"),
        ({"status": np.zeros(8)}, "status must be a whole number"),
        ({"miss_deg": np.zeros(7)}, r"miss_deg has shape \(7,\), expected \(8,\)"),
        ({"more": np.zeros(8)}, r"returned .*'more'.*, expected"),
    ],
)
def test_a_scenario_that_breaks_its_promise_is_named(changed, expected):
    wrong = dataclasses.replace(FAKE, run=lambda seed, cases: {**FAKE.run(seed, cases), **changed})
    with pytest.raises(ValueError, match=f"scenario fake.* {expected}"):
        run_cases(wrong, 0, CASES)


def test_words_and_columns_of_a_scenario_are_checked():
    with pytest.raises(ValueError, match="different words"):
        dataclasses.replace(FAKE, statuses=("a", "a"))
    with pytest.raises(ValueError, match="no metric may be called case"):
        dataclasses.replace(FAKE, metrics={"case": FAKE.metrics["miss_deg"]})


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"draw": None}, "inputs need a function draw"),
        ({"inputs": fake_scenario.INPUTS[:1] * 2}, "two columns would be called in_luck"),
        ({"metrics": {"in_deg": FAKE.metrics["miss_deg"]}}, "metric in_deg: names with in_ are those of inputs"),
    ],
)
def test_columns_of_inputs_are_their_own(changed, expected):
    with pytest.raises(ValueError, match=f"Scenario fake: {expected}"):
        dataclasses.replace(FAKE, **changed)


def test_an_input_that_is_not_of_its_shape_is_named():
    wrong = dataclasses.replace(FAKE, draw=lambda seed, cases: np.zeros((len(cases), 2)))
    with pytest.raises(ValueError, match=r"scenario fake: input push has shape \(8, 1\), expected \(8, 2\)"):
        drawn_inputs(wrong, 0, CASES)
    assert drawn_inputs(dataclasses.replace(FAKE, inputs=()), 0, CASES) == {}


@pytest.mark.parametrize("name", SCENARIOS)
def test_bundled_scenarios_say_what_they_draw(name):
    """Nothing is computed for this: what is drawn follows from the options."""
    made = factory(SCENARIOS[name].address)
    columns = made({}).input_columns
    assert len(columns) >= 6 and all(column.startswith("in_") for column in columns)


def test_keys_are_those_of_the_cases_alone():
    keys = jax.random.key_data(case_keys(5, CASES + 1000))
    alone = jax.random.key_data(jax.random.fold_in(jax.random.key(5), 1003))
    np.testing.assert_array_equal(keys[3], alone)


def test_a_function_is_a_factory_without_options():
    source = Source.of("fake_scenario:broken", {})
    assert isinstance(source.scenario(), Scenario) and source.scenario() is source.scenario()
    with pytest.raises(InputError, match="there are none"):
        Source.of("fake_scenario:plain", {"scale": "2"})


@pytest.mark.parametrize("address", ["nowhere_at_all:make", "fake_scenario:nothing", ":", "fake_scenario:STATUSES"])
def test_an_address_that_leads_nowhere(address):
    with pytest.raises(InputError, match=address):
        factory(address)
