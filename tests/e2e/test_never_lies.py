"""The page never lies: old values are stale, unavailable controls disabled, and a failure stays in its panel."""

import os
import signal
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.servers import Demo, Server, running
from e2e.state import sim

STATUS_PERIOD_S = 0.1
"""A servo sends its angle ten times per second (the Status message)."""
SILENCE_S = 2.0
"""After this time without a message of the server the link is down."""
SHOWN_S = 0.6
"""The request (0.1 s), batches in transit (0.1 s), the page's clock (0.2 s), and other work (0.2 s)."""

# Notes on the page's own clock when an attribute of an element first becomes what is wanted.
NOTE = """([selector, attribute, wanted]) => {
    window.noted = null;
    const began = performance.now();
    let last = began;
    window.held = 0;
    const look = () => {
        const now = performance.now();
        window.held = Math.max(window.held, now - last);
        last = now;
        const one = document.querySelector(selector);
        const is = attribute === 'disabled' ? one?.disabled : one?.getAttribute(attribute);
        if (one && String(is) === wanted) window.noted = now - began;
        else requestAnimationFrame(look);
    };
    look();
}"""


class Watch:
    """How soon an attribute of an element has a value after an action of the test."""

    def __init__(self, page: Page, selector: str, attribute: str, wanted: str) -> None:
        self.page = page
        self._began = time.monotonic()
        page.evaluate(NOTE, [selector, attribute, wanted])

    def waits(self, within_s: float, since: float) -> None:
        """Wait for it, and compare with `within_s` after the action, which had ended at `since`.

        What delays a busy machine is measured, and added twice: the action itself, and how long the page was blocked
        (before the mark and before the picture that shows it).
        """
        self.page.wait_for_function("() => window.noted !== null")
        took, blocked = (ms / 1000 for ms in self.page.evaluate("() => [window.noted, window.held]"))
        most = within_s + SHOWN_S + 2 * (since - self._began + blocked)
        assert took < most, f"{took:.2f} s of {most:.2f} s"


@contextmanager
def suspended(server: Server) -> Generator[float]:
    """The server hangs during the block. Yields the time since when."""
    os.kill(server.process.pid, signal.SIGSTOP)
    try:
        yield time.monotonic()
    finally:
        os.kill(server.process.pid, signal.SIGCONT)


@contextmanager
def muted(server: Demo | Server, uid: str) -> Generator[float]:
    """A servo sends nothing during the block. Yields the time since when: a busy server hears it a while longer."""
    sim(server, uid, mute=True)
    server.api.get("/servos")
    try:
        yield time.monotonic()
    finally:
        sim(server, uid, mute=False)


@pytest.fixture
def own(context: BrowserContext) -> Iterator[tuple[Server, Page]]:
    """A demo that can be stopped and restarted, and its page."""
    with running("demo", "--servos", "2", "--seed", "3") as server:
        server.ready(2)
        page = context.new_page()
        page.add_init_script("window.hasty = true")
        page.goto(server.url)
        expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
        yield server, page


def test_the_page_reconnects_after_a_server_restart(own: tuple[Server, Page]) -> None:
    server, page = own
    rows = page.locator("[data-testid^=servo-row-]")
    expect(rows).to_have_count(2)
    port = urlsplit(server.url).port or 0
    page.evaluate("() => { window.sameOne = true; }")
    watch = Watch(page, "[data-testid=live-state]", "data-state", "down")
    server.process.kill()
    server.process.wait(timeout=10)
    watch.waits(SILENCE_S, time.monotonic())
    expect(page.locator(".c-angle[data-stale=false]"), "nothing is shown as fresh").to_have_count(0)

    with running("demo", "--servos", "4", "--seed", "3", port=port) as again:
        expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
        again.ready(4)
        expect(rows).to_have_count(4)
        expect(page.locator(".c-angle[data-stale=false]")).to_have_count(4)
        assert page.evaluate("() => window.sameOne") is True, "the page was not loaded again"


def alive(page: Page) -> None:
    """Bar, Stop and rail work, whatever the state of the page."""
    expect(page.get_by_test_id("stop")).to_be_enabled()
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Active")
    expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")


@pytest.mark.parametrize(
    ("endpoint", "where", "says", "works"),
    [
        ("**/api/v1/bus/doctor*", "bus", ".doctor .says-failure", "[data-testid=frames]"),
        ("**/api/v1/inventory", "records", ".note-line.says-failure", "[data-testid=records-page] h1"),
        ("**/api/v1/audit*", "records#audit", ".note-line.says-failure", "[data-testid=audit-servo]"),
        (
            "**/api/v1/commissioning/candidates",
            "commission",
            ".notice-line, .note-line",
            "[data-testid=commission-page]",
        ),
    ],
)
def test_a_failing_endpoint_is_reported_in_place(
    context: BrowserContext, demo: Demo, endpoint: str, where: str, says: str, works: str
) -> None:
    page = context.new_page()
    problem = {"type": "about:blank", "title": "Internal", "status": 500, "code": "internal", "detail": "Disk is full."}
    page.route(endpoint, lambda route: route.fulfill(status=500, json=problem, content_type="application/problem+json"))
    page.goto(demo.url + where)
    expect(page.locator(says).first).to_contain_text("Disk is full.")
    expect(page.locator(works).first).to_be_visible()
    alive(page)
