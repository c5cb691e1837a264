"""What the terminal says of a fit of any satellite: the verdict last, in a hundred columns."""

import io
from dataclasses import replace

from made_up_fit import make_fit_result, make_session
from rich.console import Console

from fitting.outcome.result import AMBIGUOUS_VERDICT, FITS_ONLY, WRONG_MODEL, Cause
from jaxsat.cli.fit.text import fit_text


def shown(result, *, colours=False, whole=False) -> str:
    stream = io.StringIO()
    # Colours are asked for in so many words: NO_COLOR of whoever runs the tests would else take them away.
    Console(file=stream, width=100, force_terminal=colours, no_color=not colours).print(
        fit_text(result, "pass", make_session().rejections, whole=whole)
    )
    return stream.getvalue()


def test_the_verdict_comes_last_below_the_parameters_and_nothing_is_wider_than_the_terminal():
    lines = shown(make_fit_result()).splitlines()
    assert lines[-1].startswith("pass: Predicts. One motion explains the data")
    assert max(map(len, lines)) <= 100
    (mag,) = [line.split() for line in lines if line.strip().startswith("mag ")]
    assert mag == ["mag", "78/120", "nT", "306", "300", "480", "450", "1.07", "0.90°"]
    second, first = [line for line in lines if line.strip().startswith("magnet.x")]
    assert first.split() == ["magnet.x", "0.3049", "±", "0.0012", "A", "m²", "54321"]
    assert second.split() == ["magnet.x", "mag.bias.x", "-0.950"]
    text = "\n".join(lines)
    assert text.index("fixed: inertia.xx") < text.index("parameter  ") < text.index("pass: Predicts")
    assert "2 cells or rows: out of range" in text
    assert "- 2 of 80 samples of mag left out" in text and "mag +y, -z, -x" in text


def test_the_colour_is_that_of_the_verdict():
    colours = {FITS_ONLY: "\x1b[1;33m", AMBIGUOUS_VERDICT: "\x1b[1;33m", WRONG_MODEL: "\x1b[1;31m"}
    for verdict, colour in colours.items():
        assert f"{colour}{verdict.capitalize()}." in shown(make_fit_result(verdict=verdict), colours=True)


def test_causes_stand_with_the_option_of_one_that_explains_all():
    one = Cause("axes", "+X and -X exchanged", "columns are exchanged", 4264.4, 196.6, 1, True, "columns = [-X, +X]")
    text = shown(make_fit_result(verdict=WRONG_MODEL, causes=(one, replace(one, cause="a drift", explains=False))))
    assert "what would explain the data" in text and "to fit it so: columns = [-X, +X]" in text
    assert "a drift (in part)" in text and max(map(len, text.splitlines())) <= 100
    assert "to fit it so" not in shown(make_fit_result(causes=(replace(one, explains=False),)))


def test_a_fit_of_the_motion_alone_has_no_table_of_parameters():
    nothing = {"parameters": (), "buys": {}, "correlations": {}, "remarks": (), "alternatives": (), "axes": {}}
    result = make_fit_result(**nothing, unseen=(), gauge=None)
    text = shown(result)
    assert "buys" not in text and "fixed" not in text and "correlated" not in text
