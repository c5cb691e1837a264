"""The page of a sweep: what it says and of how many cases, which it draws, and how it is used in a real Chromium."""

import base64
import io
import json
import os
import re
import shutil
from html import unescape
from importlib.util import find_spec

import numpy as np
import pytest
from matplotlib.image import imread

from jaxsat.report.sweep_page import FAILED, SHOWN, chosen_cases, sweep_page
from jaxsat.sweep import Input, Metric, Scenario, SweepPlan
from jaxsat.sweep.names import title_of, title_of_input
from jaxsat.sweep.summary import document, summarise_metric

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
REQUIRED = os.environ.get("JAXSAT_BROWSER") == "required"
driven = pytest.mark.skipif(
    not REQUIRED and (BROWSER is None or find_spec("playwright") is None),
    reason=f"playwright, or any of {', '.join(NAMES)}, is not installed: no browser can be driven",
)
METRICS = {
    "settling_time_s": Metric("s", "until it stood <still>; none in a case that never did", endless=True, limit=40.0),
    "pulses": Metric("1", "of all axes"),
}
INPUTS = (
    Input("rate", "deg/s", "at the start, body axes", lambda drawn: drawn, ("x", "y")),
    Input("field", "1", "true over the model's", lambda drawn: drawn[:, 0]),
)


def made(cases):
    """Columns of a sweep in which a fast turn about y leads to failure."""
    rng = np.random.default_rng(cases)
    rate = rng.normal(size=(cases, 2))
    status = np.where(np.abs(rate[:, 1]) > 2.0, 1, np.where(rate[:, 0] > 2.2, 2, 0))
    time = np.where(status == 1, np.nan, 20.0 * np.exp(0.5 * rate[:, 0]))
    columns = {
        "settling_time_s": time,
        "pulses": rng.poisson(6.0, cases).astype(float),
        "in_rate_x_deg_s": rate[:, 0],
        "in_rate_y_deg_s": rate[:, 1],
        "in_field": 1.0 + 0.1 * rng.normal(size=cases),
    }
    return status, columns


def page_of(cases, png=None):
    status, columns = made(cases)
    scenario = Scenario(
        "own-thing", ("succeeded", "not_settled", "let go"), METRICS, 100, lambda seed, cases: {},
        assumptions=("no air & no Sun",), inputs=INPUTS, draw=lambda seed, cases: None,
    )  # fmt: skip
    metrics = [summarise_metric(name, metric, columns[name], status == 0) for name, metric in METRICS.items()]
    plan = SweepPlan("own-thing", 3, {"gain": "2"}, 100, cases)
    html = sweep_page(
        scenario, document(scenario, plan, status, metrics), status, metrics, columns.__getitem__,
        command=("jaxsat", "sweep", "my own.py", "--out", "r", "--case"), success="That is so many.", png=png,
    )  # fmt: skip
    return html, status, columns


def data_of(html):
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)
    return json.loads(found)


def test_it_says_how_many_of_how_many_and_why():
    html, status, columns = page_of(500)
    text = unescape(re.sub(r"<[^>]+>", " ", html[: html.index("<script")])).replace("\u202f", "")
    good, late, gone = (int(np.sum(status == code)) for code in range(3))
    assert f"{good} of 500 cases succeeded." in text and late > 0 and gone > 0
    assert f"{500 - good} failed: {late} not settled, {gone} let go." in text
    assert f"Settling time: {late} cases of 500 without it" in text and f"those of the {500 - late} others" in text
    over = np.mean(np.where(np.isnan(columns["settling_time_s"]), np.inf, columns["settling_time_s"]) > 40.0)
    assert f"{100.0 * over:.4g} %" in text and "of all cases are over 40 s" in text
    for words in ("Until it stood <still>", "no air & no Sun", "jaxsat sweep 'my own.py' --out r --case NUMBER"):
        assert words in text


def test_numbers_are_those_of_the_table_and_the_first_view_tells_most():
    html, status, columns = page_of(500)
    data = data_of(html)
    assert data["case"] == list(range(500)) and data["status"] == status.tolist()
    for told in (*data["outcomes"], *data["inputs"]):
        values = np.frombuffer(base64.b64decode(told["values"]), "<f4")
        np.testing.assert_array_equal(values, columns[told["name"]].astype("f4"))
    assert data["across"] == "in_rate_y_deg_s"


def test_a_hundred_thousand_cases_are_thinned_and_stay_small():
    html, status, _ = page_of(100_000)
    data = data_of(html)
    assert len(html.encode()) < 300_000 and len(data["case"]) == SHOWN
    assert data["failed_shown"] == FAILED < data["failed"] == np.count_nonzero(status)
    # Histograms are of all.
    for told in data["outcomes"]:
        assert sum(told["succeeded"]) + sum(told["failed"]) + told["beyond"] + told["missing"] == 100_000


@pytest.mark.parametrize("failures", [0, 10, 2500, 9990, 10_000])
def test_failures_and_the_rest_are_spread_evenly(failures):
    status = np.zeros(10_000, int)
    status[np.random.default_rng(1).permutation(10_000)[:failures]] = 1
    found = chosen_cases(status)
    assert len(found) == SHOWN and np.all(np.diff(found) > 0)
    bad = int(np.sum(status[found]))
    assert bad == min(failures, max(FAILED, SHOWN - (10_000 - failures)))
    # Of each tenth of the sweep as many, but for chance in where failures are.
    assert np.histogram(found, np.linspace(0, 10_000, 11))[0].min() > 0.8 * SHOWN / 10
    assert chosen_cases(status[:SHOWN]).tolist() == list(range(SHOWN))


def test_columns_have_names():
    assert title_of("final_rate_deg_s", "deg/s") == "Final rate"
    assert title_of("impulse_N_s", "N s") == "Impulse" and title_of("firings", "1") == "Firings"
    assert title_of("s", "s") == "S"
    assert title_of_input(INPUTS[0], "in_rate_x_deg_s") == "Rate x" and title_of_input(INPUTS[1], "in_field") == "Field"


@driven
def test_the_page_in_a_browser(tmp_path):
    """Light and wide, dark and narrow: silent, no wider than its window; choosers, points and list lead to the case."""
    from playwright.sync_api import sync_playwright

    html, status, columns = page_of(500, png=b"\x89PNG\r\n\x1a\n")
    path = tmp_path / "sweep.html"
    path.write_text(html, encoding="utf-8")
    assert BROWSER, f"none of {', '.join(NAMES)} is installed"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--headless=new", "--no-sandbox"])
        for width, scheme in ((1400, "light"), (390, "dark")):
            page = browser.new_page(
                viewport={"width": width, "height": 900}, color_scheme="dark" if scheme == "dark" else "light"
            )
            page.set_default_timeout(120e3)
            heard = []
            page.on("console", lambda message, heard=heard: heard.append(message.text))
            page.on("pageerror", lambda error, heard=heard: heard.append(str(error)))
            page.on("request", lambda request, heard=heard: heard.append(request.url))
            page.goto(path.as_uri())
            page.locator(".scatter svg[role=img] path.case").first.wait_for(state="attached")
            # The stand-in for a picture is none.
            assert [line for line in heard if not line.startswith("data:")] == [path.as_uri()]
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            state = page.evaluate("window.jaxsat.state()")
            first = int(np.flatnonzero(status)[0])
            assert (state["case"], state["theme"], state["across"]) == (first, scheme, "in_rate_y_deg_s")
            assert state["drawn"] == 500 and page.locator(".outcome").count() == 2

            # Those without the outcome stand above the axis; without one kind of end its cases are gone.
            late = int(np.sum(status == 1))
            assert f"{late} without settling time stand above the axis" in page.locator(".scatter .note").inner_text()
            page.locator(".kind", has_text="not settled").click()
            assert page.evaluate("window.jaxsat.state().drawn") == 500 - late
            page.locator(".kind", has_text="not settled").click()

            # A number in the list leads to its command, and the point to what it was drawn from.
            gone = int(np.flatnonzero(status == 2)[0])
            page.locator(".failures select").select_option(label=f"let go: {np.sum(status == 2)}")
            page.locator(".failures td button").first.click()
            assert page.locator(".replay code").first.inner_text() == f"jaxsat sweep 'my own.py' --out r --case {gone}"
            said = page.locator(".scatter output").inner_text()
            assert said.startswith(f"Case {gone}, let go: Rate y {columns['in_rate_y_deg_s'][gone]:.4g} deg/s")
            page.locator(".scatter select[name=up]").select_option("pulses")
            assert f"Pulses {columns['pulses'][gone]:.0f}" in page.locator(".scatter output").inner_text()

            shot = imread(io.BytesIO(page.locator(".scatter svg[role=img]").screenshot()))[..., :3]
            assert shot.std() > 0.02
            page.close()
        browser.close()
