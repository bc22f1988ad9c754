"""Steps of a user that many tests take on a page."""

from playwright.sync_api import FloatRect, Locator, Page, expect

from e2e.servers import Demo, Server

JOB_MS = 180_000
"""Maximum duration of a job, which waits for responses, on a busy machine."""

CHORD = """keys => keys.forEach(key => document.activeElement.dispatchEvent(
    new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true })))"""

DRAWN = "() => new Promise(then => requestAnimationFrame(() => requestAnimationFrame(then)))"


def drawn(page: Page) -> None:
    """Wait until the page is drawn as it is now."""
    page.evaluate(DRAWN)


def chord(page: Page, *keys: str) -> None:
    """Press keys at once: between two real ones, a busy machine may need longer than the page waits."""
    page.evaluate(CHORD, keys)


def box(of: Locator) -> FloatRect:
    """Place and size of a visible element."""
    while True:
        expect(of).to_be_visible()
        if (found := of.bounding_box()) is not None:  # it may be hidden between the two
            return found


def at_rest(of: Locator) -> FloatRect:
    """Place and size of a visible element that has not moved for a while."""
    found = box(of)
    while True:
        of.page.wait_for_timeout(300)
        before, found = found, box(of)
        if before == found:
            return found


def stage(page: Page, key: str, value: object) -> None:
    """Type a value into its row, to be sent by Apply."""
    field = page.get_by_test_id(f"input-{key}")
    field.fill(str(value))
    field.press("Enter")


def motion_on(page: Page, server: Demo | Server, uid: str) -> None:
    """Open Motion of a servo and take motion control."""
    page.goto(f"{server.url}servos/{uid}/motion")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("motion-band")).to_be_visible()


def jog(page: Page, degrees: object) -> None:
    """Send the horn to an angle."""
    page.get_by_test_id("jog-value").fill(str(degrees))
    page.get_by_test_id("jog-go").click()


def stop_cleared(page: Page) -> None:
    """Clear the stop, which turns nothing on."""
    page.get_by_test_id("clear-stop").click()
    page.get_by_test_id("confirm-clear").click()
    expect(page.get_by_test_id("stop-band")).to_have_count(0)


def horn_is_free(page: Page) -> None:
    """Confirm that the horn is free, if required."""
    free = page.get_by_test_id("horn-free")
    if free.count():
        free.check()
