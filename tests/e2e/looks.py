"""Measurements of a page by tools: axe for accessibility, and the size of touch targets."""

import time
from collections.abc import Generator
from contextlib import contextmanager

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, Request

AXE = """options => axe.run(document.querySelector('[role=dialog]') ?? document, options).then(found =>
    found.violations.map(one => `${one.id}: ${one.nodes[0].html.slice(0, 200)}`))"""

STILL = """() => new Promise(done => {
    const end = () => {
        watch.disconnect();
        const moving = document.getAnimations().filter(one => one.effect.getTiming().iterations !== Infinity);
        Promise.race([Promise.allSettled(moving.map(one => one.finished)), pause(400)]).then(done);
    };
    const pause = ms => new Promise(then => setTimeout(then, ms));
    let quiet = setTimeout(end, 100);
    const watch = new MutationObserver(() => {
        clearTimeout(quiet);
        quiet = setTimeout(end, 100);
    });
    watch.observe(document.documentElement, { childList: true, subtree: true });
    setTimeout(end, 400);
})"""
"""Wait until no element was added or removed for 0.1 s and nothing fades; at most 0.4 s."""
LONGEST_S = 10

SMALL = """() => {
    const targets = 'button, a[href], input, select, textarea, summary, [role=tab], [role=switch], [role=slider]';
    const clipped = one => {  // taken out of sight on purpose: a label or a row stands for it
        const box = one.getBoundingClientRect();
        const style = getComputedStyle(one);
        return box.width <= 1 || style.opacity === '0' || style.visibility === 'hidden' || box.right < 0;
    };
    return [...document.querySelectorAll(targets)]
        .filter(one => one.getClientRects().length && !one.matches('.row-link') && !one.disabled)
        .map(one => {
            const holder = one.matches('input') ? one.closest('label, .box, .search') ?? one : one;
            if (holder === one && clipped(one)) return null;
            const box = holder.getBoundingClientRect();
            return [Math.round(box.width), Math.round(box.height), one.outerHTML.slice(0, 110)];
        })
        .filter(found => found && (found[0] < 44 || found[1] < 44))
        .map(String);
}"""
"""Touch targets less than 44 px wide or high."""


def still(page: Page) -> None:
    """Wait until the content of the page is complete and has faded in."""
    page.evaluate(STILL)


@contextmanager
def loading(page: Page) -> Generator[None]:
    """Wait, after the block, until all requests of the page have finished and are shown."""
    pending: set[Request] = set()

    def on_request(request: Request) -> None:
        pending.add(request)

    def on_end(request: Request) -> None:
        pending.discard(request)

    listeners = (("request", on_request), ("requestfinished", on_end), ("requestfailed", on_end))
    for event, listener in listeners:
        page.on(event, listener)  # pyright: ignore[reportCallIssue, reportArgumentType] - a literal a call there
    try:
        yield
        until = time.monotonic() + LONGEST_S
        still(page)
        while pending and time.monotonic() < until:
            still(page)
    finally:
        for event, listener in listeners:
            page.remove_listener(event, listener)


def complaints(page: Page, *rules: str, without: tuple[str, ...] = ()) -> list[str]:
    """Violations that axe finds in the open dialog, else on the page: of all rules, or of `rules`.

    Each with the first element that breaks the rule.
    """
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(Axe().axe_script)
    chosen = {"runOnly": list(rules)} if rules else {}
    skipped = {"rules": {name: {"enabled": False} for name in without}}
    return page.evaluate(AXE, {"resultTypes": ["violations"], **chosen, **skipped})


def too_small(page: Page) -> list[str]:
    """Touch targets smaller than 44 x 44 px: width, height and element."""
    return page.evaluate(SMALL)
