"""English and Japanese: chosen by the browser or the user, only the chosen one is loaded."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Dialog, Page, expect

from e2e.contexts import page_in
from e2e.hand import Hand
from e2e.looks import loading
from e2e.servers import Demo
from e2e.state import servo_of
from e2e.test_access import PAGES


@pytest.fixture
def japanese(browser: Browser) -> Iterator[Page]:
    """A page in a browser set to Japanese that must end without an error or warning in its console."""
    said: list[str] = []
    with page_in(browser, locale="ja-JP") as page:
        page.on("console", lambda one: said.append(one.text) if one.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        yield page
    assert said == []


def test_the_browser_language_is_the_default_and_a_choice_is_stored(japanese: Page, demo: Demo) -> None:
    japanese.goto(demo.url)
    expect(japanese.locator("html")).to_have_attribute("lang", "ja")
    expect(japanese.get_by_role("heading", level=1)).to_have_text("サーボ")
    japanese.get_by_role("button", name="English").click()
    expect(japanese.get_by_role("heading", level=1)).to_have_text("Servos")
    japanese.reload()
    expect(japanese.locator("html")).to_have_attribute("lang", "en")
    japanese.get_by_role("button", name="日本語").click()
    expect(japanese.get_by_role("heading", level=1)).to_have_text("サーボ")


def test_the_language_of_the_address_applies_to_other_pages(page: Page, demo: Demo) -> None:
    page.goto(f"{demo.url}/?language=ja")
    page.get_by_role("link", name="記録").click()
    expect(page).to_have_url(re.compile("/records"))
    for name, pressed in (("日本語", "true"), ("English", "false")):
        expect(page.get_by_role("button", name=name)).to_have_attribute("aria-pressed", pressed)
    page.get_by_role("button", name="English").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("Records")


def test_staged_values_and_check_boxes_survive_a_language_change(page: Page, demo: Demo) -> None:
    one, other = (str(servo["uid"]) for servo in demo.api.get("/servos").json()[:2])
    dialogs: list[str] = []

    def unexpected(dialog: Dialog) -> None:
        dialogs.append(dialog.type)
        dialog.accept()

    page.on("dialog", unexpected)
    for uid, typed in ((one, "33"), (other, "-5")):
        page.goto(f"{demo.url}servos/{uid}/parameters?tab=limit")
        page.get_by_test_id("input-angle_limit_cw").fill(typed)
        page.get_by_test_id("input-angle_limit_cw").press("Enter")
    page.get_by_role("link", name=re.compile("^Servos")).click()
    page.get_by_test_id(f"select-{one}").check()
    assert dialogs == ["beforeunload"], "an address that is typed leaves the page with staged edits"
    dialogs.clear()

    page.get_by_role("button", name="日本語").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("サーボ")
    expect(page.get_by_test_id(f"select-{one}")).to_be_checked()
    page.get_by_test_id(f"servo-row-{one}").locator(".row-link").click()
    page.get_by_test_id("servo-tab-parameters").click()
    page.get_by_test_id("tab-limit").click()
    expect(page.get_by_test_id("input-angle_limit_cw")).to_have_value("33.0")
    expect(page.get_by_test_id("row-angle_limit_cw")).to_have_attribute("data-state", "staged")
    Hand(page, "mouse").servo(other)
    expect(page.get_by_test_id("message-angle_limit_cw")).to_contain_text("を下回っています")
    page.get_by_role("button", name="English").click()
    expect(page.get_by_test_id("message-angle_limit_cw")).to_contain_text("is below")
    assert dialogs == []


def test_english_pages_load_no_japanese(page: Page, demo: Demo) -> None:
    fetched: list[str] = []
    page.on("response", lambda response: fetched.append(response.text()) if response.url.endswith(".js") else None)
    with loading(page):
        page.goto(demo.url + "bus")
        expect(page.get_by_test_id("bus-page")).to_be_visible()
    assert [len(script) for script in fetched if re.search(r"[\u3040-\u30ff]{4}", script)] == []


ENGLISH = """() => [...document.querySelectorAll('h1, h2, h3, th, button, [role=tab], label, .rail a')]
    .filter(one => one.getClientRects().length && !one.closest('[lang=en], .row, .scroll li, tbody'))
    .map(one => one.innerText.trim().replace(/\\s+/g, ' '))
    .filter(text => /^[A-Za-z][a-z]{3,}( [a-z]+)*[.…]?$/.test(text))"""
"""English in buttons, headings and tabs, except names of servos, files and hosts."""


def test_every_label_is_translated(japanese: Page, demo: Demo) -> None:
    names = {one["label"] for one in demo.api.get("/servos").json()} | {"hornbill", "demo", "curl", "Python"}
    uid = servo_of(demo, "BLA21-12U-A0")
    japanese.goto(demo.url)
    for path in PAGES:
        with loading(japanese):  # without reloading the page
            go = "path => { history.pushState(null, '', path); dispatchEvent(new PopStateEvent('popstate')); }"
            japanese.evaluate(go, "/" + path.format(uid=uid))
            expect(japanese.locator("main h1").first).to_be_visible()
        assert [text for text in japanese.evaluate(ENGLISH) if text not in names] == [], path
