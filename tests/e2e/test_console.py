"""No page has anything to complain of in the browser's console, the 3D view included."""

import contextlib

import pytest
from playwright.sync_api import Page, TimeoutError, expect

from e2e.servers import Demo, until

PARTS = [
    "servos",
    "servos?view=wall",
    "servos/matrix",
    "commission",
    "servos/{uid}",
    "servos/{uid}/parameters",
    "servos/{uid}/motion",
    "servos/{uid}/tune",
    "faults",
    "bus#monitor",
    "bus#nodes",
    "bus#ids",
    "records#snapshots",
    "records#snapshots/{uid}",
    "records#profiles",
    "records#reports",
    "recorder",
    "records#audit",
    "api-page",
    "nothing",
]
DRAWN = """() => [...document.querySelectorAll('iframe')].every(one =>
    one.contentWindow.__viserSceneTree && one.contentDocument.querySelector('canvas'))"""


@pytest.mark.scene
@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_page_leaves_the_console_empty(page: Page, demo: Demo, language: str) -> None:
    """What the `page` fixture has seen by the end of the test fails it: errors, warnings, and errors nobody caught."""
    uid = str(demo.api.get("/servos").json()[0]["uid"])
    page.goto(demo.url)
    page.evaluate("language => localStorage.setItem('hornbill.language', language)", language)
    scenes = 0
    for part in PARTS:
        page.goto("about:blank")
        page.goto(demo.url + part.format(uid=uid))
        expect(page.locator("main h1, main h2").first).to_be_visible()
        with contextlib.suppress(TimeoutError):  # the page asks every second, and a busy machine answers late
            page.wait_for_load_state("networkidle", timeout=5_000)
        if page.locator("iframe").count() > 0:
            scenes += 1
            until(lambda: page.evaluate(DRAWN), 40, f"the 3D view of {part} is not drawn")
            page.wait_for_timeout(1000)
    assert scenes >= 2, "the wall and a servo's own picture"
