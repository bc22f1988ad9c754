"""A phone: from the list to a servo to its dial with one thumb, with Stop always visible."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.cases import cases
from e2e.contexts import page_in
from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.state import no_lease, servo_of
from e2e.steps import box
from e2e.test_servo_actions import MARKS
from e2e.test_stop_reach import SEEN

SERVOS = 6
PHONES = {"smallest": (320, 640), "small": (360, 740), "usual": (390, 844), "last": (767, 1024)}
THEMED = [*(f"{size}-light" for size in PHONES), "usual-dark"]
"""Phone sizes; one is dark, because a theme is only colours."""


@pytest.fixture(params=cases(THEMED, usual=("smallest-light", "usual-dark")))
def phone(request: pytest.FixtureRequest, browser: Browser, demo: Demo) -> Iterator[Page]:
    """A phone of each width."""
    size, theme = request.param.split("-")
    width, height = PHONES[size]
    with page_in(browser, {"width": width, "height": height}, has_touch=True) as page:
        page.add_init_script(f"localStorage.setItem('hornbill.theme', '{theme}')")
        page.goto(f"{demo.url}servos")
        expect(page.locator(".servo-row")).to_have_count(6)
        yield page


def well(page: Page, where: str) -> None:
    """Stop is complete, at the top and full width; nothing is cut off, no target too small."""
    found = page.evaluate(SEEN)
    assert (found["inside"], found["hit"], found["cut"]) == (True, True, False), where
    assert found["width"] == page.evaluate("innerWidth"), where
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), where
    assert complaints(page) == [], where
    assert too_small(page) == [], where


def test_a_phone_navigates_from_the_list_to_the_dial(phone: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    four_pages_and_more_below(phone)
    phone.get_by_role("link", name="Servos").tap()
    expect(phone.locator(".servo-row")).to_have_count(6)
    well(phone, "list")
    row = phone.get_by_test_id(f"servo-row-{uid}")
    size, button = box(row), box(phone.get_by_test_id(f"wiggle-{uid}"))
    assert (round(button["width"]), round(button["height"])) == (56, 56)
    assert size["height"] >= 72
    row.locator("a.row-link").tap()
    expect(phone.get_by_test_id("servo-tab-motion")).to_be_visible()
    well(phone, "servo")
    phone.get_by_test_id("servo-tab-motion").tap()
    phone.get_by_test_id("enable-motion").tap()
    expect(phone.get_by_test_id("walk-cw")).to_be_visible()
    well(phone, "motion")
    expect(phone.get_by_test_id("more"), "Motion has the whole screen").to_be_hidden()
    phone.get_by_test_id("stop").tap()
    expect(phone.get_by_test_id("stop-band")).to_be_visible()
    no_lease(demo)
    demo.api.delete("/stop").raise_for_status()


def four_pages_and_more_below(phone: Page) -> None:
    shown = phone.locator(".rail nav > :visible")
    expect(shown).to_have_count(5)
    for one in shown.all():
        place = box(one)
        assert place["y"] + place["height"] <= phone.evaluate("innerHeight") + 1
        assert place["height"] >= 60
    more = phone.get_by_test_id("more")
    more.tap()
    expect(more).to_have_attribute("aria-expanded", "true")
    well(phone, "more")
    phone.keyboard.press("Escape")
    expect(phone.get_by_test_id("docs")).to_be_hidden()
    expect(more).to_be_focused()
    more.tap()
    phone.get_by_role("link", name="Records").tap()
    expect(phone.get_by_test_id("docs"), "a page that was chosen closes it").to_be_hidden()
    expect(more, "where one is").to_have_attribute("aria-current", "page")
    assert phone.url.endswith("/records")


def test_the_lists_of_the_audit_are_one_line_high_below_each_other(browser: Browser, demo: Demo) -> None:
    with page_in(browser, {"width": 390, "height": 844}, has_touch=True) as page:
        page.goto(f"{demo.url}records#audit")
        for name in ("servo", "key", "action"):
            size = box(page.get_by_test_id(f"audit-{name}"))
            assert (round(size["width"]), round(size["height"])) == (366, 48)


def test_a_phone_wiggles_from_the_list_and_shows_a_rejection(browser: Browser, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")  # one that does not hunt: it returns to its start position
    no_lease(demo)
    with page_in(browser, {"width": 390, "height": 844}, has_touch=True) as page:
        page.goto(f"{demo.url}servos")
        wiggle, row = page.get_by_test_id(f"wiggle-{uid}"), page.get_by_test_id(f"servo-row-{uid}")
        page.evaluate(MARKS)
        wiggle.tap()
        page.wait_for_function("row => window.marks.some(one => one[1] === row)", arg=f"servo-row-{uid}")
        expect(row).to_have_attribute("data-wiggles", "false")
        expect(page.get_by_test_id(f"wiggle-says-{uid}")).to_have_text([])
        assert page.url.endswith("/servos"), "the row stays closed"
        # while another client moves servos it names the client, and moves nothing
        lease = demo.api.post("/leases", json={"holder": "Rig 3", "ttl_s": 60}).json()["id"]
        before = row.bounding_box()
        wiggle.tap()
        expect(page.get_by_test_id(f"wiggle-says-{uid}")).to_contain_text("Rig 3")
        assert row.bounding_box() == before, "the rows stay where they are"
        assert complaints(page) == []
        page.get_by_test_id(f"wiggle-says-{uid}").tap()
        expect(page.get_by_test_id(f"wiggle-says-{uid}")).to_have_count(0)
        demo.api.delete(f"/leases/{lease}")
