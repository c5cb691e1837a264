"""Conditions on rows: what they say, where they say nothing, and what they do not allow."""

import numpy as np
import pytest

from jaxsat.files.conditions import parsed_condition

NAN = float("nan")
COLUMNS = {
    "a": np.array([0.0, 1.0, -70000.0, NAN]),
    "b": np.array([5.0, NAN, 2.0, 1.0]),
    "s": np.array(["on", "off", "", "on"], dtype=object),
}


@pytest.mark.parametrize(
    ("text", "violated"),
    [
        ("a == 0", [0, 1, 1, 0]),
        ("abs(a) < 60000", [0, 0, 1, 0]),
        ("not a < 0", [0, 0, 1, 0]),
        ("a < 0 or b > 1", [0, 0, 0, 0]),
        ("a > 0 and b > 3", [1, 0, 1, 1]),
        ("0 <= a <= 1", [0, 0, 1, 0]),
        ("a + 2 * b - 1 != 9", [1, 0, 0, 0]),
        ("-a / b < 1", [0, 0, 1, 0]),
        ("s == 'on'", [0, 1, 0, 0]),
        ("s != 'on' or a == 0", [0, 0, 0, 0]),
        ("b / a > 0", [0, 0, 1, 0]),
    ],
)
def test_rows_known_not_to_meet_it(text, violated):
    # By hand; what is not measured decides nothing, as in Kleene's logic.
    assert parsed_condition(text).violated(COLUMNS).tolist() == [bool(each) for each in violated]


def test_columns_in_their_order():
    found = parsed_condition("s == 'on' and b > a")
    assert found.columns == ("s", "b", "a") and found.texts == {"s"}


@pytest.mark.parametrize(
    "text",
    [
        "a",
        "a = 0",
        "a ==",
        "1 < 2",
        "open('x') == 1",
        "abs(a, b) < 1",
        "max(a) < 1",
        "a.real < 1",
        "a[0] < 1",
        "(lambda: 1)() < 1",
        "a ** 9 < 1",
        "a < True",
        "a is 0",
        "a in (1, 2)",
        "s < 'on'",
        "__import__('os') == 1",
        "a < 1 if b else 2",
        "a == 1j",
        "x" * 501 + " < 1",
        "(" * 300 + "a" + ")" * 300 + " < 1",
        "",
    ],
)
def test_nothing_else_is_allowed(text):
    with pytest.raises(ValueError, match=r"."):
        parsed_condition(text)
