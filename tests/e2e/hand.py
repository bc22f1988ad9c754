"""A user of the page: by mouse, by touch on a tablet, or by keyboard alone."""

from collections.abc import Generator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, Locator, Page, ViewportSize, expect

from e2e.contexts import page_in
from e2e.steps import chord

WAYS = ("touch", pytest.param("keyboard", marks=pytest.mark.release))
"""Touch on a tablet, keys in a wide window, the mouse in the same window as keys."""
TABLET: ViewportSize = {"width": 820, "height": 1180}


class Hand:
    """One input method for a page: "mouse", "touch" or "keyboard"."""

    def __init__(self, page: Page, way: str) -> None:
        self.page = page
        self.way = way

    def press(self, target: str | Locator, key: str = "Enter") -> None:
        """Press the element with this test ID, or this element; by keyboard, Tab to it, then `key`."""
        found = self._find(target)
        expect(found).to_be_enabled()
        if self.way == "keyboard":
            self._tab_to(found)
            self.page.keyboard.press(key)
        elif self.way == "touch":
            found.tap()
        else:
            found.click()

    def tick(self, target: str) -> None:
        """Check a box, if present."""
        box = self._find(target)
        if box.count() and not box.is_checked():
            self.press(box, "Space")

    def servo(self, uid: str) -> None:
        """Select another servo in the head of a servo's pages."""
        self.press("choose-servo")
        self.press(f"choose-{uid}")

    def choose(self, item: str) -> None:
        """Select from the servo's menu, by keyboard with the arrow keys."""
        self.press("servo-menu")
        found = self._find(item)
        if self.way != "keyboard":
            self.press(found)
            return
        while not found.evaluate("one => one === document.activeElement"):
            self.page.keyboard.press("ArrowDown")
        self.page.keyboard.press("Enter")

    def type(self, target: str, text: str) -> None:
        """Enter `text` into a field."""
        found = self._find(target)
        expect(found).to_be_enabled()
        if self.way == "keyboard":
            self._tab_to(found)
            self.page.keyboard.press("Control+a")
            self.page.keyboard.type(text)
        else:
            found.fill(text)
        expect(found, "what was typed stays").to_have_value(text)

    def stop(self) -> None:
        """Stop with Esc twice, or the button."""
        if self.way == "keyboard":
            chord(self.page, "Escape", "Escape")
        else:
            self.press("stop")
        expect(self.page.get_by_test_id("stop-band")).to_be_visible()

    def stop_and_clear(self) -> None:
        """Clear a stop, which turns nothing on."""
        self.stop()
        self.press("clear-stop")
        self.press("confirm-clear")
        expect(self.page.get_by_test_id("stop-band")).to_have_count(0)

    def saves(self) -> Locator:
        """Press save: the dialog."""
        self.press("apply-save")
        dialog = self.page.get_by_test_id("save-dialog")
        expect(dialog).to_be_visible()
        return dialog

    def confirms(self) -> None:
        """Confirm that the horn is free if required, and the dialog; its job then succeeds."""
        self.tick("horn-free")
        self.press("save-go")
        expect(self.page.get_by_test_id("step-read_back")).to_have_attribute("data-state", "done")
        self.press("change-close")

    def _find(self, target: str | Locator) -> Locator:
        return self.page.get_by_test_id(target) if isinstance(target, str) else target

    def _tab_to(self, found: Locator) -> None:
        for _ in range(250):
            if found.evaluate("one => one === document.activeElement || one.contains(document.activeElement)"):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"Tab does not lead to {found}")


@contextmanager
def hand_of(browser: Browser, way: str) -> Generator[Hand]:
    """A new page with one input method."""
    if way == "touch":
        with page_in(browser, TABLET, has_touch=True) as page:
            yield Hand(page, way)
    else:
        with page_in(browser) as page:
            yield Hand(page, way)
