"""The page of ``vinl play`` in a real browser: it loads, is clicked and typed at, and the robot does what it is asked.

Needs Chromium (Debian: ``apt-get install chromium``); pictures are drawn by its software renderer.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
]
PATIENCE = 60_000
"""Milliseconds: the browser draws without a GPU, on cores that other tests use too."""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here: the page of vinl play was not tried in a browser"),
]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        profile = tmp_path_factory.mktemp("profile")
        started = playwright.chromium.launch(
            executable_path=CHROMIUM, headless=True, args=FLAGS, env={**os.environ, "HOME": str(profile)}
        )
        yield started
        started.close()


@contextmanager
def served(*options: str) -> Iterator[str]:
    """``vinl play`` in a process of its own, which must not have complained in the end; the address of its page."""
    command = [sys.executable, "-m", "vinl.cli.app", "play", "--port", "0", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        said = []
        try:
            for line in process.stdout:
                said.append(line)
                found = re.search(r"http://localhost:\d+", line)
                if found:
                    yield found[0]
                    return
            raise AssertionError("".join(said))
        finally:
            process.terminate()
            rest = process.stdout.read()
            assert "Traceback" not in rest, rest  # what goes wrong in a thread of the server, no page shows


@contextmanager
def opened(browser: Browser, url: str, width: int = 640, height: int = 400) -> Iterator[Page]:
    """The page, which must not have complained in the end; the smaller it is, the faster it is drawn."""
    page = browser.new_page(viewport={"width": width, "height": height})
    page.set_default_timeout(PATIENCE)
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    try:
        page.goto(url)
        yield page
    finally:
        page.close()
        assert complaints == []  # beside what went wrong in the test itself, if anything did


def number(page: Page, figure: str) -> float:
    """The first number of a figure on the page."""
    found = re.search(r"-?\d+(\.\d+)?", page.inner_text(f"#vinl-{figure}"))
    assert found is not None
    return float(found[0])


def until(page: Page, condition: str) -> None:
    """Wait for a condition in JavaScript on the page."""
    page.wait_for_function(f"() => {{ {_TEXT} return {condition}; }}", timeout=PATIENCE)


_TEXT = """
const text = key => document.getElementById("vinl-" + key).innerText, value = key => parseFloat(text(key));
const images = () => [...document.images].map(image => image.src).join();
"""


def test_robot_walks_to_a_clicked_goal_and_is_driven_by_keys(browser: Browser):
    options = "--plan harbour_flat --loco loco --nav oracle --obstacles none"
    with served(*options.split()) as url, opened(browser, url) as page:
        page.wait_for_selector("#vinl-state")
        assert page.inner_text("#vinl-state") == "standing" and "click the floor" in page.inner_text("#vinl-goal")
        page.evaluate(f"() => {{ {_TEXT} window.before = images(); }}")
        canvas = page.locator("canvas").first.bounding_box()
        assert canvas is not None
        page.mouse.click(canvas["x"] + 0.62 * canvas["width"], canvas["y"] + 0.36 * canvas["height"])
        # the walk of 1.4 m may be over before a page that is slow is looked at again
        until(page, '["walking", "reached"].includes(text("state"))')
        until(page, 'value("distance") > 0.8')
        until(page, "images() !== window.before")
        until(page, 'value("factor") > 0')

        page.keyboard.press("o")
        until(page, 'text("state") === "standing"')
        for _ in range(3):
            page.keyboard.press("i")
        until(page, 'text("state") === "driven" && value("command") > 0.25')

        page.keyboard.press("p")
        until(page, 'text("state").endsWith("paused")')
        time, place = number(page, "time"), page.inner_text("#vinl-place")
        page.wait_for_timeout(500)
        assert number(page, "time") == time and page.inner_text("#vinl-place") == place
        page.keyboard.press("n")
        until(page, f'value("time") > {time}')
        assert number(page, "time") == pytest.approx(time + 0.02)

        page.keyboard.press("r")
        until(page, 'text("state") === "standing" && value("distance") < 0.3')


def test_block_is_dropped_by_a_click_clutter_drawn_by_a_button_and_the_robot_driven_by_a_slider(browser: Browser):
    with (
        served("--plan", "harbour_flat", "--loco", "rough", "--nav", "oracle", "--obstacles", "paper") as url,
        opened(browser, url, 1000, 600) as page,  # where the click meets a free floor
    ):
        page.wait_for_selector("#vinl-state")
        until(page, 'value("blocks") > 10')
        page.get_by_text("Clear", exact=True).click()
        until(page, 'value("blocks") === 0')
        canvas = page.locator("canvas").first.bounding_box()
        assert canvas is not None
        page.keyboard.down("Shift")
        page.mouse.click(canvas["x"] + 0.75 * canvas["width"], canvas["y"] + 0.4 * canvas["height"])
        page.keyboard.up("Shift")
        until(page, 'value("blocks") === 1')
        page.get_by_text("Draw anew", exact=True).click()
        until(page, 'value("blocks") > 10')

        drive = page.locator("input[inputmode=decimal]").nth(2)  # after pace and push: the number beside Forward
        drive.fill("0.4")
        drive.press("Enter")
        until(page, 'text("state") === "driven" && value("command") > 0.35')


def test_recording_is_scrubbed_by_its_slider(browser: Browser, folder: Path):
    with served("--replay", str(folder), "--episode", "1") as url, opened(browser, url) as page:
        page.wait_for_selector("#vinl-state")
        assert page.inner_text("#vinl-state") == "recorded, paused" and number(page, "time") == 0
        page.evaluate(f"() => {{ {_TEXT} window.before = images(); }}")
        time = page.locator("input[inputmode=decimal]").first  # beside the slider
        time.fill("0.8")
        time.press("Enter")
        until(page, 'value("time") === 0.8')
        until(page, "images() !== window.before")


def test_report_shows_where_the_robots_were_at_a_time(browser: Browser, folder: Path):
    with opened(browser, (folder / "report.html").as_uri()) as page:
        slider, map_ = page.locator(".clock input").first, page.locator(".map").first
        robots = map_.locator(".robot")
        assert "timed" not in str(map_.get_attribute("class"))
        slider.fill("0.5")
        assert page.locator(".clock output").first.inner_text() == "0.5 s"
        assert robots.count() == 2 and "timed" in str(map_.get_attribute("class"))
        halfway = [robots.nth(k).get_attribute("cx") for k in range(2)]
        slider.fill("0")
        assert [robots.nth(k).get_attribute("cx") for k in range(2)] != halfway
        page.locator(".clock button").first.click()
        page.wait_for_function(
            "() => !document.querySelector('.map').classList.contains('timed')"
        )  # it played to its end
