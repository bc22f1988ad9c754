"""What a tool says of a page without looking at it: axe of its access, a ruler of what a finger can hit."""

import json

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

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
"""What a finger cannot hit: everything that takes a touch and is less than 44 px wide or high."""


def complaints(page: Page) -> list[str]:
    """What axe finds wrong: each rule with the first element that breaks it."""
    found = json.loads(json.dumps(Axe().run(page, options={"resultTypes": ["violations"]}).response))["violations"]
    return [f"{one['id']}: {one['nodes'][0]['html'][:200]}" for one in found]


def too_small(page: Page) -> list[str]:
    """What takes a touch on less than 44 x 44 px: width, height and element."""
    return page.evaluate(SMALL)
