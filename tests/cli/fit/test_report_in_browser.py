"""The report in a real Chromium: it loads in silence, fetches nothing, and the satellite moves."""

import io
import os
import re
import shutil
import time

import numpy as np
import pytest
from made_up_munin import make_munin_result
from matplotlib.image import imread
from scipy.spatial.transform import Rotation

from jaxsat.panel_names import PANEL_COLOURS, PAPER_COLOURS

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = next(filter(None, map(shutil.which, NAMES)), None)
REQUIRED = os.environ.get("JAXSAT_BROWSER") == "required"
"""Set by .ci/run: there a missing browser is a failure."""
FLAGS = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
PATIENCE_S = 120.0

if not REQUIRED:
    pytest.importorskip("playwright", reason="playwright is not installed: no browser can be driven")
pytestmark = pytest.mark.skipif(BROWSER is None and not REQUIRED, reason=f"none of {', '.join(NAMES)} is installed")


@pytest.fixture(scope="module")
def chromium():
    from playwright.sync_api import sync_playwright

    assert BROWSER, f"none of {', '.join(NAMES)} is installed"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def open_page(chromium, fitted_run):
    """Opens the report; what it says on the console and asks for goes to `page.heard`."""
    contexts = []

    def opened(width=1000, height=800, **options):
        contexts.append(chromium.new_context(viewport={"width": width, "height": height}, **options))
        # A busy machine without a graphics card takes its time.
        contexts[-1].set_default_timeout(1e3 * PATIENCE_S)
        page = contexts[-1].new_page()
        page.heard = []
        page.on("console", lambda message: page.heard.append(message.text))
        page.on("pageerror", lambda error: page.heard.append(str(error)))
        page.on("request", lambda request: page.heard.append(request.url))
        page.goto((fitted_run / "report.html").as_uri())
        if options.get("java_script_enabled", True):
            until(page, "window.jaxsat.state().frames > 0")
        return page

    yield opened
    for context in contexts:
        context.close()


@pytest.fixture(scope="module")
def desktop(open_page):
    return open_page()


@pytest.fixture(scope="module")
def phone(open_page):
    return open_page(360, 740, color_scheme="dark", reduced_motion="reduce", has_touch=True)


def state(page) -> dict:
    return page.evaluate("window.jaxsat.state()")


def until(page, condition: str) -> None:
    """Playwright's own waiting evaluates strings in the page, which its policy forbids."""
    end = time.monotonic() + PATIENCE_S
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        time.sleep(0.02)


def settled(page) -> None:
    """Until what was asked for has been drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def picture(locator) -> np.ndarray:
    return imread(io.BytesIO(locator.screenshot()))[..., :3]


@pytest.mark.slow
def test_page_loads_in_silence_and_fetches_nothing(desktop, phone):
    for page in (desktop, phone):
        assert [line for line in page.heard if not line.endswith("/report.html")] == []
        assert len(page.heard) == 1
        assert state(page)["frames"] > 0 and state(page)["charts"] == 3 + 6 + 2


def test_views_are_not_blank(desktop):
    for number in range(2):
        pixels = picture(desktop.locator(".view").nth(number))
        assert pixels.std() > 0.05 and len(np.unique((32 * pixels).astype(int).reshape(-1, 3), axis=0)) > 50


def test_first_state_is_that_of_the_session(desktop):
    desktop.evaluate("window.jaxsat.seek(0)")
    at_start = state(desktop)
    # Penkov et al. 2009, Table 1.
    np.testing.assert_allclose(at_start["position_km"], [-3504.82, -6809.61, -2881.71], atol=0.1)
    assert at_start["t_s"] == 0.0 and not at_start["in_shadow"] and not at_start["playing"]


def test_slider_moves_the_satellite(desktop):
    slider = desktop.get_by_role("slider", name="Time since the epoch")
    slider.fill("500")
    settled(desktop)
    before, pixels = state(desktop), picture(desktop.locator(".views"))
    box = slider.bounding_box()
    desktop.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + 0.5 * box["height"])
    settled(desktop)
    after = state(desktop)
    assert abs(after["t_s"] - 0.75 * 4480.0) < 60.0 and after["in_shadow"]
    assert np.linalg.norm(np.subtract(after["position_km"], before["position_km"])) > 5000.0
    assert abs(np.dot(after["quaternion_inertial_from_body"], before["quaternion_inertial_from_body"])) < 0.99
    changed = np.abs(picture(desktop.locator(".views")) - pixels).max(axis=2) > 0.1
    # The view of the Earth has three fifths of the width.
    middle = int(0.6 * changed.shape[1])
    assert changed[:, :middle].mean() > 0.01 and changed[:, middle:].mean() > 0.01
    assert "in the Earth's shadow" in slider.get_attribute("aria-valuetext")
    assert "in the Earth's shadow" in desktop.locator(".readouts").inner_text()


def test_motion_between_samples_is_that_of_the_tables(desktop):
    speeds = []
    for t in np.linspace(700.0, 720.0, 3):
        desktop.evaluate(f"window.jaxsat.seek({t})")
        speeds.append(state(desktop)["position_km"])
    speed = np.linalg.norm(np.diff(speeds, axis=0), axis=1) / 10.0
    np.testing.assert_allclose(speed, 7.2, atol=0.8)
    np.testing.assert_allclose(speed[0], speed[1], rtol=1e-2)


def test_keys(desktop):
    desktop.evaluate("window.jaxsat.seek(0)")
    desktop.locator("body").press("ArrowRight")
    desktop.locator("body").press("Shift+ArrowRight")
    assert state(desktop)["t_s"] == 11 * 64.0
    desktop.locator("body").press("ArrowLeft")
    assert state(desktop)["t_s"] == 640.0
    desktop.locator("body").press("End")
    assert state(desktop)["t_s"] == 4480.0
    desktop.get_by_role("slider").press("PageDown")
    assert state(desktop)["t_s"] == 4480.0
    desktop.get_by_role("slider").press("PageUp")
    assert state(desktop)["t_s"] == 4480.0 - 640.0
    desktop.locator("body").press("Home")
    desktop.locator("body").press(" ")
    until(desktop, "window.jaxsat.state().t_s > 5")
    desktop.locator("body").press(" ")
    assert not state(desktop)["playing"]
    # A view that has the focus turns instead.
    before, t = picture(desktop.locator(".view").first), state(desktop)["t_s"]
    desktop.locator(".surface").first.press("ArrowRight")
    settled(desktop)
    assert state(desktop)["t_s"] == t
    assert (np.abs(picture(desktop.locator(".view").first) - before).max(axis=2) > 0.1).mean() > 0.01


def test_everything_that_can_be_pressed_has_a_name_and_an_outline(desktop):
    controls = desktop.locator("button, select, input, summary, [tabindex='0']")
    assert controls.count() > 12
    names = controls.evaluate_all("(all) => all.map((e) => e.ariaLabel || e.textContent.trim())")
    assert all(names)
    desktop.locator(".play").focus()
    desktop.keyboard.press("Tab")
    assert desktop.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_charts_set_the_time_and_show_the_sample(desktop):
    plot = desktop.locator(".plot svg").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    desktop.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 40.0)
    t = state(desktop)["t_s"]
    assert 1700.0 < t < 2700.0
    cursor = float(plot.locator(".cursor").get_attribute("x1"))
    assert abs(cursor - 0.5 * box["width"]) < 1.0
    rows = desktop.locator(".faces tbody tr")
    assert rows.count() == 8 and rows.first.inner_text().startswith("cells +X, mA")
    sample, cells = 64 * round(t / 64), make_munin_result().channels["cells"]
    said = desktop.locator('[data-live="channel-0"] output').first.inner_text()
    assert float(said.split()[0]) == cells.measured[list(cells.t_s).index(sample), 0]


def test_attitude_is_shown_as_one_likes_it(desktop):
    """Angles of the body axes to one direction have squared cosines that sum to one; so has a quaternion's length."""

    def said(view: str, chosen: str = "") -> list[float]:
        desktop.get_by_label("What of the attitude is shown").select_option(view)
        if chosen:
            desktop.get_by_label("Body axis" if view == "angles" else "Axes that the attitude").select_option(chosen)
        settled(desktop)
        text = desktop.locator('[data-live="attitude"] output').inner_text().replace("−", "-")
        return [float(number) for number in re.findall(r"-?\d+\.\d+", text)]

    # At a node of the tables: the last.
    desktop.evaluate("window.jaxsat.seek(0)")
    for toward in range(3):
        cosines = [np.cos(np.radians(said("angles", f"+{axis}")[toward])) for axis in "xyz"]
        assert np.linalg.norm(cosines) == pytest.approx(1.0, abs=3e-3)
    assert said("angles", "-x")[1] == pytest.approx(180.0 - said("angles", "+x")[1], abs=0.11)
    told = state(desktop)["quaternion_inertial_from_body"]
    assert abs(np.dot(said("quaternion", "inertial"), told)) == pytest.approx(1.0, abs=1e-3)
    roll, pitch, yaw = said("euler", "inertial")
    turned = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True)
    assert (turned.inv() * Rotation.from_quat(told, scalar_first=True)).magnitude() < np.radians(0.2)
    # Greenwich is turned about the pole.
    assert said("euler", "earth")[:2] == pytest.approx([roll, pitch], abs=0.11)
    # The nadir lies as far from body z as from z of the orbital axes.
    nadir = said("angles", "+z")[2]
    w, x, y, z = said("quaternion", "orbital")
    assert np.degrees(np.arccos(1.0 - 2.0 * (x * x + y * y))) == pytest.approx(nadir, abs=0.2)
    said("angles", "+x")
    assert desktop.locator('[data-live="attitude"] path.to-field').count() == 1


def test_scheme_is_the_safe_one_or_the_papers(desktop):
    def colours() -> list[str]:
        chips = desktop.locator(".faces .chip").evaluate_all(
            "(all) => all.map((e) => getComputedStyle(e).backgroundColor)"
        )
        return ["#" + "".join(f"{int(part):02x}" for part in re.findall(r"\d+", chip)[:3]) for chip in chips[:6]]

    button = desktop.locator(".scheme")
    safe, before = colours(), picture(desktop.locator(".view").nth(1))
    assert safe == list(PANEL_COLOURS.values())
    button.click()
    settled(desktop)
    assert colours() == list(PAPER_COLOURS.values()) and button.inner_text() == "Safe colours"
    assert (np.abs(picture(desktop.locator(".view").nth(1)) - before).max(axis=2) > 0.05).mean() > 0.02
    button.click()
    assert colours() == safe


def test_first_screenful_holds_the_answer_and_no_header_is_cut(desktop):
    desktop.set_viewport_size({"width": 1280, "height": 900})
    for head in ("Key numbers", "What to doubt", "Parameters"):
        assert desktop.get_by_role("heading", name=head, exact=True).bounding_box()["y"] < 600.0
    heads = desktop.locator("th")
    wide = heads.evaluate_all("(all) => all.map((e) => e.scrollWidth - e.clientWidth)")
    frames = desktop.locator(".scroll").evaluate_all("(all) => all.map((e) => e.scrollWidth - e.clientWidth)")
    assert heads.count() > 30 and max(wide) <= 1 and max(frames) <= 1
    targets = desktop.locator("nav.contents a[href^='#']").evaluate_all(
        "(all) => all.map((e) => Boolean(document.getElementById(e.hash.slice(1))))"
    )
    assert len(targets) > 12 and all(targets)
    desktop.set_viewport_size({"width": 1000, "height": 800})


def test_theme_follows_the_system_and_the_button(desktop, phone):
    def brightness(page) -> float:
        """Of the page's own colour, 0 to 1."""
        colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
        return sum(map(int, re.findall(r"\d+", colour)[:3])) / 765.0

    assert (state(desktop)["theme"], state(phone)["theme"]) == ("light", "dark")
    assert brightness(phone) < 0.25 < 0.75 < brightness(desktop)
    before = picture(desktop.locator(".view").first)
    desktop.locator(".theme").click()
    settled(desktop)
    assert state(desktop)["theme"] == "dark" and brightness(desktop) < 0.25
    assert picture(desktop.locator(".view").first).mean() < before.mean() - 0.3
    desktop.locator(".theme").click()
    assert state(desktop)["theme"] == "light" and brightness(desktop) > 0.75


def test_a_phone_never_scrolls_sideways(phone):
    assert phone.evaluate("document.documentElement.scrollWidth") == 360
    view = phone.locator(".view").first.bounding_box()
    assert view["width"] > 300.0 and view["x"] >= 0.0 and view["x"] + view["width"] <= 360.0
    assert picture(phone.locator(".view").first).std() > 0.05


@pytest.mark.slow
def test_less_motion_is_samples_one_after_the_other(phone):
    phone.evaluate("window.jaxsat.seek(0)")
    phone.get_by_role("button", name="Play").click()
    until(phone, "window.jaxsat.state().t_s > 0")
    phone.get_by_role("button", name="Pause").click()
    assert state(phone)["t_s"] % 64.0 == 0.0


@pytest.mark.slow
def test_without_a_script_pictures_and_tables_are_there(open_page):
    page = open_page(360, 740, java_script_enabled=False)
    for name in ("Channel cells", "Parameters", "Provenance", "Motion"):
        assert page.get_by_role("heading", name=name, exact=True).is_visible()
    assert page.locator("details[open] img").count() == 5 and page.locator("details img").first.is_visible()
    assert page.locator(".theme").count() == 0 and len(page.heard) == 1
