"""Controls stay where they are while a page is loaded: a click must not hit what has moved under the pointer."""

import pytest
from playwright.sync_api import Page

from e2e.cases import cases
from e2e.servers import Demo
from e2e.state import servo_of, wait_for
from e2e.test_access import PAGES

TOLERANCE_PX = 22
"""Half the height of a touch target: the middle of a control is still on it."""

LATE = """() => {
    const { fetch } = window;
    const late_ms = [0, 100, 400, 900];
    const addresses = new Set();
    let started = 0;
    window.coming = 0;
    window.fetch = async (...request) => {
        const wait = late_ms[started++ % late_ms.length];
        const address = String(request[0].url ?? request[0]);
        const first = addresses.has(address) ? 0 : 1;
        addresses.add(address);
        window.coming += first;
        try {
            const response = await fetch(...request);
            await new Promise(then => setTimeout(then, wait));
            return response;
        } finally {
            window.coming -= first;
        }
    };
    window.moved = [];
    const seen = new Map();
    let room = '';
    const controls = 'main :is(button, input, select, summary, a[href]):not(:disabled)';
    const look = () => {
        const main = document.querySelector('main')?.getBoundingClientRect();
        if (`${main?.y} ${main?.height}` !== room) seen.clear();  // a notice above the page
        room = `${main?.y} ${main?.height}`;
        for (const one of document.querySelectorAll(controls)) {
            const { x, y, width, height } = one.getBoundingClientRect();
            if (!width || !height) continue;
            const before = seen.get(one);
            const far = before ? Math.max(Math.abs(x - before.x), Math.abs(y - before.y)) : 0;
            if (far > TOLERANCE) window.moved.push(`${Math.round(far)} px: ${one.outerHTML.slice(0, 120)}`);
            seen.set(one, { x, y });
        }
        requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
}""".replace("TOLERANCE", str(TOLERANCE_PX))
"""Responses come up to 0.9 s later, in another order; controls that moved are noted from frame to frame."""
LOADED = """() => {
    if (window.coming > 0) window.last = performance.now();
    return performance.now() - (window.last ?? 0) > 1000;
}"""
"""No request for a second, except of what has been requested before: the page polls."""


@pytest.mark.parametrize("path", cases((*PAGES, "scope"), usual=("servos/{uid}",)))
@pytest.mark.parametrize("size", [(1440, 900), (820, 1180)], ids=str)
def test_no_control_moves_while_a_page_is_loaded(path: str, size: tuple[int, int], page: Page, demo: Demo) -> None:
    # The row of allocation requests leaves the list of nodes 3 s after the last of them.
    wait_for(
        lambda: all(one["node_id"] != 0 or not one["online"] for one in demo.api.get("/nodes").json()),
        "a node has no node ID",
    )
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.add_init_script(f"({LATE})()")
    page.goto(demo.url + path.format(uid=servo_of(demo, "BLA21-12U-A0")))
    page.wait_for_function("() => document.querySelector('main :is(button, a[href])')")
    page.wait_for_function(LOADED, polling=100)
    assert page.evaluate("() => [...new Set(window.moved)]") == []
