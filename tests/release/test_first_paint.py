"""Time to first paint, on a machine that runs nothing else."""

import pytest
from playwright.sync_api import expect, sync_playwright

from e2e.chromium import find
from e2e.servers import ready_demo

FIRST_PAINT_MS = 1000


@pytest.mark.parametrize("locale", ["en-GB", "ja-JP"])
def test_the_first_paint_comes_within_a_second(locale: str) -> None:
    path = find()
    if path is None:
        pytest.skip("no Chromium: 'make chromium' finds or installs one")
    with ready_demo(6) as demo, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-3d-apis"])
        page = browser.new_context(locale=locale).new_page()
        painted: list[float] = []
        for _ in range(3):  # the best of three, to exclude other work of the machine
            page.goto("about:blank")
            page.goto(demo.url)
            expect(page.get_by_role("heading", level=1)).to_be_visible()
            page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length > 0")
            found = page.evaluate("() => performance.getEntriesByName('first-contentful-paint')[0].startTime")
            painted.append(float(found))
        browser.close()
    assert min(painted) <= FIRST_PAINT_MS, painted
