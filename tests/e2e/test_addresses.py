"""Addresses: Back and a reload restore the page, and an unknown address says so."""

import pytest
from playwright.sync_api import Page, expect

from e2e.conftest import Watched
from e2e.hand import Hand
from e2e.servers import Demo
from e2e.state import uids_of, wait_for

SERVOS = 6
UNKNOWN = "f" * 32


def test_back_and_reload_restore_the_list(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "servos")
    rows = page.locator(".servo-row")
    expect(rows).to_have_count(6)
    model = str(demo.api.get("/servos").json()[0]["model"])
    page.get_by_test_id("filter-model").select_option(model)
    page.get_by_test_id("sort-name").dblclick()
    page.get_by_role("searchbox").fill("6")
    wait_for(lambda: 0 < rows.count() < 6, "the list is not filtered")
    names = page.locator(".servo-row .row-link").all_inner_texts()

    def as_it_was() -> None:
        expect(page.get_by_role("searchbox")).to_have_value("6")
        expect(page.get_by_test_id("filter-model")).to_have_value(model)
        expect(page.get_by_role("columnheader", name="Servo", exact=True)).to_have_attribute("aria-sort", "descending")
        expect(page.locator(".servo-row .row-link")).to_have_text(names)

    as_it_was()
    page.reload()
    as_it_was()
    rows.first.locator(".row-link").click()
    expect(page.get_by_test_id("overview-page")).to_be_visible()
    page.go_back()
    as_it_was()
    page.get_by_role("searchbox").fill("nothing is called so")
    page.get_by_role("button", name="Show all", exact=True).click()
    expect(rows).to_have_count(6)
    assert page.url == demo.url + "servos?sort=-name"


def test_back_and_reload_restore_tab_and_filter(page: Page, demo: Demo) -> None:
    one, other = (servo["uid"] for servo in demo.api.get("/servos").json()[:2])
    page.goto(f"{demo.url}servos/{one}/parameters")
    limits = page.get_by_test_id("tab-limit")
    limits.click()
    expect(page.get_by_test_id("row-angle_limit_cw")).to_be_visible()
    page.get_by_test_id("servo-tab-motion").click()
    expect(page.get_by_test_id("enable-motion")).to_be_visible()
    page.go_back()
    expect(limits).to_have_attribute("aria-selected", "true")
    page.reload()
    expect(limits).to_have_attribute("aria-selected", "true")
    Hand(page, "mouse").servo(other)
    expect(page).to_have_url(f"{demo.url}servos/{other}/parameters?tab=limit")
    expect(limits).to_have_attribute("aria-selected", "true")

    page.goto(f"{demo.url}servos/{one}/parameters#angle_limit_cw")
    expect(limits).to_have_attribute("aria-selected", "true")
    page.get_by_role("tab").first.click()
    page.reload()
    expect(page.get_by_role("tab").first).to_have_attribute("aria-selected", "true")
    page.get_by_role("button", name="Changed", exact=False).click()
    page.reload()
    expect(page.get_by_role("button", name="Changed", exact=False)).to_have_attribute("aria-pressed", "true")


@pytest.mark.release
def test_a_reload_restores_the_filters_of_monitor_matrix_and_audit(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "bus#monitor")
    page.get_by_test_id("monitor-filter").fill("type:NodeStatus")
    page.reload()
    expect(page.get_by_test_id("monitor-filter")).to_have_value("type:NodeStatus")

    page.goto(demo.url + "servos/matrix?q=angle")
    expect(page.get_by_role("searchbox")).to_have_value("angle")
    page.get_by_role("searchbox").fill("torque")
    page.reload()
    expect(page.get_by_role("searchbox")).to_have_value("torque")

    page.goto(demo.url + "records#audit")
    uid = uids_of(demo)[0]
    page.get_by_test_id("audit-servo").select_option(uid)
    page.reload()
    expect(page.get_by_test_id("audit-servo")).to_have_value(uid)


PARTS = ("parameters", "motion", "tune", "faults")
PATHS = ("nothing", "servos/12/parameters", f"servos/{UNKNOWN}/nothing")
MISSING = {path: ("missing-page", f"/{path}") for path in PATHS} | {
    f"servos/{UNKNOWN}/{part}": ("missing-servo", UNKNOWN) for part in PARTS
}


def test_an_unknown_address_or_servo_links_back(page: Page, demo: Demo, watched: Watched) -> None:
    for path, (testid, says) in MISSING.items():
        page.goto(demo.url + path)
        expect(page.get_by_test_id(testid)).to_contain_text(says)
        page.get_by_role("button", name="Go to Servos").click()
        expect(page.locator(".servo-row")).to_have_count(6)
    # The browser logs the status of each unknown page.
    logged = [one for one in watched.complaints if "404" in one and any(f"{demo.url}{path}'" in one for path in PATHS)]
    assert len(logged) == len(PATHS)
    watched.complaints[:] = [one for one in watched.complaints if one not in logged]


def test_an_address_with_a_stray_percent_sign_opens(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "bus#50%")
    expect(page.get_by_test_id("bus-page")).to_be_visible()
