"""The lease of the Motion page: a slow page keeps it, a blocked page loses it and torque."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.conftest import Watched
from e2e.servers import Demo
from e2e.state import no_lease, read, torque_off, wait_for
from e2e.test_motion_page import TABLET, begin, made


@pytest.fixture
def winch(demo: Demo, page: Page) -> Iterator[str]:
    """A servo of this file alone; afterwards no client has motion control."""
    page.set_viewport_size(TABLET)
    uid = made(demo, "Winch", 63)
    yield uid
    page.goto(f"{demo.url}records")
    no_lease(demo)
    demo.api.delete(f"/sim/servos/{uid}")


HANG = """() => void setTimeout(() => {
    const get = new XMLHttpRequest();
    do {
        get.open('GET', '/api/v1/leases', false);
        get.send();
    } while (JSON.parse(get.responseText).length > 0);
}, 0)"""
"""Block the page until no client has motion control; its socket stays open."""

BLOCK = """() => new Promise(done => {
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (data) {
        send.call(this, data);
        if (JSON.parse(data).type !== 'heartbeat') return;
        WebSocket.prototype.send = send;
        const end = performance.now() + 1900;
        while (performance.now() < end);
        done();
    };
})"""
"""Block the page for 1.9 s from its next heartbeat: earlier delays of a busy machine do not count."""


def test_a_page_blocked_shorter_than_its_lease_renews_it(page: Page, demo: Demo, winch: str) -> None:
    begin(page, demo, winch)
    for _ in range(2):
        page.evaluate(BLOCK)
        before = demo.api.get("/leases").json()[0]["expires_at"]
        wait_for(lambda before=before: demo.api.get("/leases").json()[0]["expires_at"] > before, "it is not renewed")
    expect(page.get_by_test_id("motion-band"), "what ended would not be on again").to_be_visible()
    assert read(demo, winch, "torque_mode") == "on"


def test_a_page_blocked_longer_than_its_lease_loses_motion(
    page: Page, demo: Demo, winch: str, watched: Watched
) -> None:
    page.add_init_script("window.hasty = true")
    begin(page, demo, winch)
    page.evaluate(HANG)
    no_lease(demo)
    torque_off(demo, winch)
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("motion control was lost")
    expect(page.get_by_test_id("torque-is-off")).to_contain_text("Winch")
    expect(page.get_by_test_id("enable-motion")).to_be_enabled()
    watched.complaints[:] = [one for one in watched.complaints if "Synchronous XMLHttpRequest" not in one]
