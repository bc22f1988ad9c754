"""The lease of the Motion page: a slow page keeps it, a blocked page loses it and torque."""

import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo
from e2e.test_motion_page import TABLET, begin, made, raw
from e2e.test_technician import wait_for


@pytest.fixture
def winch(demo: Demo, page: Page) -> Iterator[str]:
    """A servo of this file alone; afterwards no client has motion control."""
    page.set_viewport_size(TABLET)
    uid = made(demo, "Winch", 63)
    yield uid
    page.goto(f"{demo.url}records")
    wait_for(lambda: demo.api.get("/leases").json() == [], 6, "motion control was not given back")
    demo.api.delete(f"/sim/servos/{uid}")


def hang(page: Page, seconds: float) -> None:
    """Block the page for this time; its socket stays open."""
    page.evaluate(
        "ms => void setTimeout(() => { const end = performance.now() + ms; while (performance.now() < end); }, 0)",
        seconds * 1000,
    )


def test_a_page_blocked_shorter_than_its_lease_keeps_motion(page: Page, demo: Demo, winch: str) -> None:
    begin(page, demo, winch)
    for _ in range(2):
        hang(page, 1.9)
        page.wait_for_function("() => true")  # when it runs again
        page.wait_for_timeout(700)
    expect(page.get_by_test_id("motion-band"), "what ended would not be on again").to_be_visible()
    assert raw(demo, winch, "torque_mode") == "on"


def test_a_page_blocked_longer_than_its_lease_loses_motion(page: Page, demo: Demo, winch: str) -> None:
    begin(page, demo, winch)
    hang(page, 6)
    hung = time.monotonic()
    wait_for(lambda: demo.api.get("/leases").json() == [], 4.5, "a page that hangs keeps motion control")
    wait_for(lambda: raw(demo, winch, "torque_mode") == "off", 1, "torque stays on")
    assert time.monotonic() - hung < 6, "the page hangs no more: nothing is proved"
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("motion control was lost", timeout=15_000)
    expect(page.get_by_test_id("torque-is-off")).to_contain_text("Winch", timeout=10_000)
    expect(page.get_by_test_id("enable-motion")).to_be_enabled()
