"""What a page says first: the numbers, and what there is to doubt about them."""

from dataclasses import replace

from made_up_fit import make_fit_result

from fitting.outcome.result import Cause
from fitting.report.page.head import confirmations, doubts, key_numbers


def test_key_numbers_are_those_of_the_result():
    numbers = {what: (value, words) for what, value, words in key_numbers(make_fit_result())}
    assert numbers["Attitude 1σ"] == ("0.20, 0.30, 0.50°", "about body x, y, z, median")
    assert numbers["chi2 / dof"] == ("1.03", "812.5 / 790")
    assert numbers["Fitted"][0] == "4 parameters"
    assert numbers["mag left"][0] == "306 nT" and "held out" in " ".join(numbers)
    # 1.6 of 1.5 sigmas.
    assert numbers["mag, held out"] == ("480 nT", "RMS, 1.07 times what the fit promises")


def test_what_gives_reason_to_doubt_is_said_once_and_the_rest_is_not():
    result = make_fit_result()
    said = doubts(result, ["stamps are whole seconds", "stamps are whole seconds"])
    text = " ".join(said)
    assert said.count("Stamps are whole seconds.") == 1 and text.count("samples of mag") == 1
    for part in (
        "2 of 80 samples of mag left out as outliers",
        "Held by its prior: magnet.y.",
        "2 of 40 samples of a/b cells were left out of the fit",
        "1 pair of parameters correlate beyond ±0.9, most of all magnet.x with mag.bias.x, -0.950",
    ):
        assert part in text, part
    # What the verdict says already is not said again.
    again = replace(result, remarks=("held by their priors, the data say nothing of them: magnet.y",))
    assert " ".join(doubts(again, [])).count("magnet.y") == 1
    # A third was held out, and no other motion fits nearly as well.
    assert "held out, so" not in text and "other motion" not in text and "cause" not in text
    near = ({**result.alternatives[0], "chi2_above_best": 3.0},)
    cause = Cause("axes", "mag turned", "wrong mounting", 900.0, 300.0, 3, True)
    worse = replace(result, fitted=result.fitted | True, alternatives=near, causes=(cause,))
    text = " ".join(doubts(worse, []))
    assert "Nothing was held out" in text and "nearest by 3 of chi2" in text and "1 cause would explain" in text


def test_a_witness_that_agrees_is_no_doubt():
    result = make_fit_result()
    asked = {**result.channels, "mag": replace(result.channels["mag"], witness=True)}
    result = replace(result, channels=asked)
    (text,) = confirmations(result)
    assert text.startswith("the witness mag confirms the motion")
    assert not any("witness" in line for line in doubts(replace(result, remarks=(text,)), []))
