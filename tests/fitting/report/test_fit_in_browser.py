"""The report of any satellite in a real Chromium: silent, whole, in light and in dark."""

import io
import os
import shutil
import time

import numpy as np
import pytest
from matplotlib.image import imread

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
REQUIRED = os.environ.get("JAXSAT_BROWSER") == "required"
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_S = 120.0

if not REQUIRED:
    pytest.importorskip("playwright", reason="playwright is not installed: no browser can be driven")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None and not REQUIRED, reason=f"none of {', '.join(NAMES)} is installed"),
]


@pytest.fixture(scope="module", params=["light", "dark"])
def shown(request, fit_run):
    """The page, what it said on the console, and the theme that was asked for: dark on a phone."""
    from playwright.sync_api import sync_playwright

    assert BROWSER, f"none of {', '.join(NAMES)} is installed"
    width = 1000 if request.param == "light" else 360
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=request.param)
        context.set_default_timeout(1e3 * PATIENCE_S)
        page = context.new_page()
        heard: list[str] = []
        page.on("console", lambda message: heard.append(message.text))
        page.on("pageerror", lambda error: heard.append(str(error)))
        page.goto((fit_run / "report.html").as_uri())
        end = time.monotonic() + PATIENCE_S
        while not page.evaluate("window.jaxsat.state().frames > 0"):
            assert time.monotonic() < end
            time.sleep(0.02)
        yield page, heard, request.param
        browser.close()


def test_it_loads_in_silence_with_a_chart_for_each_reading(shown):
    page, heard, theme = shown
    assert heard == []
    state = page.evaluate("window.jaxsat.state()")
    # Attitude, rates, field angle; magnetometer, gyroscope, star tracker with four and three turns, panels.
    assert state["charts"] == 3 + 3 + 3 + (4 + 3) + 8 and state["theme"] == theme
    assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]
    pixels = imread(io.BytesIO(page.locator(".view").first.screenshot()))[..., :3]
    assert pixels.std() > 0.05


def test_held_out_part_is_shaded_and_the_cursor_tells_the_readings(shown):
    page = shown[0]
    plot = page.locator('[data-live="channel-0"] .plot svg').first
    plot.scroll_into_view_if_needed()
    assert plot.locator("rect.held").count() == 2 and plot.locator("path.promised").count() == 1
    page.evaluate("window.jaxsat.seek(15)")
    shown = page.locator('[data-live="channel-0"] output').first.inner_text()
    assert shown.endswith("left out") and "1200000 measured" in shown
    rows = page.locator(".faces tbody tr")
    assert rows.count() == 18 and "left out" in rows.first.inner_text()
    page.evaluate("window.jaxsat.seek(500)")
    assert page.locator(".faces tbody tr").first.inner_text().startswith("mag bx, nT")
    box = plot.bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 40.0)
    assert np.isclose(page.evaluate("window.jaxsat.state().t_s"), 300.0, atol=60.0)
