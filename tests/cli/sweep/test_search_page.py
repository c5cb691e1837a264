"""What is written of one Earth search; its page in a real Chromium loads in silence, and slider and keys move it."""

import io
import os
import shutil
from importlib.util import find_spec

import numpy as np
import pytest
from matplotlib.image import imread

from jaxsat.cli.sweep.case import case_page, write_history
from jaxsat.control.earth_search.law import SENSORS
from jaxsat.sweep.scenarios import earth_search

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
REQUIRED = os.environ.get("JAXSAT_BROWSER") == "required"
driven = pytest.mark.skipif(
    not REQUIRED and (BROWSER is None or find_spec("playwright") is None),
    reason=f"playwright, or any of {', '.join(NAMES)}, is not installed: no browser can be driven",
)
PNG = b"\x89PNG\r\n\x1a\n"
STEPS = 120


SCENARIO = earth_search.make({"spacecraft": "small", "time_s": str(STEPS / 2), "brightness": "even"})


@pytest.fixture(scope="module")
def history():
    assert SCENARIO.history is not None
    return SCENARIO.history(1, 5)


@pytest.mark.slow
def test_a_case_has_a_history_and_a_picture(history, tmp_path):
    columns = history.columns
    assert history.t_s[1] == 0.5 and columns["mode"].shape == (STEPS,)
    write_history(tmp_path, history, SCENARIO, seed=1, case=5)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["history.csv", "history.png", "search.html"]
    rows = (tmp_path / "history.csv").read_text().splitlines()
    assert len(rows) == STEPS + 1 and rows[0].startswith("t_s,nadir_x") and "first-y_W_m2_sr" in rows[0]
    assert (tmp_path / "history.png").stat().st_size > 20_000
    nadir = np.stack([columns[f"nadir_{c}"] for c in "xyz"])
    np.testing.assert_allclose(np.linalg.norm(nadir, axis=0), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.cos(np.radians(columns["error_deg"])), nadir[2], atol=1e-9)


@pytest.fixture(scope="module")
def file(history, tmp_path_factory):
    page = case_page(history.page, PNG, SCENARIO.assumptions, title="Search <5>", subtitle="seed 1")
    path = tmp_path_factory.mktemp("search") / "search.html"
    path.write_text(page, encoding="utf-8")
    return path, history.columns


@pytest.fixture(scope="module")
def chromium():
    from playwright.sync_api import sync_playwright

    assert BROWSER, f"none of {', '.join(NAMES)} is installed"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--headless=new", "--no-sandbox"])
        yield browser
        browser.close()


def opened(chromium, path, width, **options):
    page = chromium.new_page(viewport={"width": width, "height": 900}, **options)
    page.set_default_timeout(120e3)
    page.heard = []
    page.on("console", lambda message: page.heard.append(message.text))
    page.on("pageerror", lambda error: page.heard.append(str(error)))
    page.on("request", lambda request: page.heard.append(request.url))
    page.goto(path.as_uri())
    return page


@pytest.mark.slow
@driven
@pytest.mark.parametrize(("width", "scheme"), [(1100, "light"), (360, "dark")])
def test_the_page_shows_the_search_as_it_goes(chromium, file, width, scheme):
    path, columns = file
    page = opened(chromium, path, width, color_scheme=scheme)
    assert page.heard == [path.as_uri()], "errors, or something fetched"
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("window.jaxsat.state().theme") == scheme

    # What the page shows of the Earth's centre at a step is what was simulated.
    for step in (0, 80):
        page.evaluate(f"window.jaxsat.seek({step / 2})")
        nadir = np.array([columns[f"nadir_{c}"][step] for c in "xyz"])
        off_deg = np.degrees(np.arctan2(np.hypot(nadir[0], nadir[1]), nadir[2]))
        x, y = (float(page.locator(".sky .centre").get_attribute(name)) for name in ("cx", "cy"))
        # A circle of 186 to the point behind; looking along z with x to the right, y points down.
        assert np.hypot(x, y) == pytest.approx(186.0 * off_deg / 180.0, abs=0.05)
        assert np.sign([x, y]) == pytest.approx(np.sign(nadir[:2]))
        assert page.locator(".sky .scan.present").count() == sum(
            int(columns[f"present{name}"][step]) for name in SENSORS
        )
        assert f"{off_deg:.2f} deg" in page.locator(".readouts dd").first.inner_text()

    before = page.locator(".sky .earth").get_attribute("d")
    page.locator("input[type=range]").focus()
    page.keyboard.press("Home")
    assert page.evaluate("window.jaxsat.state().t_s") == 0
    page.keyboard.press("ArrowRight")
    assert page.evaluate("window.jaxsat.state().t_s") == 0.5
    assert page.locator(".sky .earth").get_attribute("d") != before
    page.locator("button.play").click()
    assert page.evaluate("window.jaxsat.state().playing")
    page.evaluate("window.jaxsat.pause()")

    shot = imread(io.BytesIO(page.locator(".sky").screenshot()))[..., :3]
    assert len(np.unique((255 * shot).astype(int).reshape(-1, 3), axis=0)) > 20 and shot.std() > 0.02
    page.close()
