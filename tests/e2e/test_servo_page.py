"""The page of one servo: head, tabs, picker, neighbours and overview, by mouse, keyboard and touch."""

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.conftest import Demo
from e2e.hand import WAYS, hand_of


def listed(demo: Demo) -> list[str]:
    """Unique IDs as the list has them: by servo ID, then by serial."""
    known = demo.api.get("/servos").json()
    return [one["uid"] for one in sorted(known, key=lambda one: (one["servo_id"] or 999, one["serial"]))]


@pytest.mark.parametrize("way", ["mouse", *WAYS])
def test_another_servo_is_picked_and_the_tab_stays(way: str, browser: Browser, demo: Demo) -> None:
    one, other = listed(demo)[:2]
    with hand_of(browser, way) as hand:
        page = hand.page
        page.goto(f"{demo.url}servos/{one}")
        expect(page.get_by_test_id("servo-place")).to_have_text(re.compile("^1 "))
        hand.press("servo-tab-faults")
        expect(page).to_have_url(f"{demo.url}servos/{one}/faults")
        hand.press("choose-servo")
        expect(page.get_by_test_id("choose-search")).to_be_focused()
        found = page.get_by_role("listbox").get_by_role("option")
        expect(found).to_have_count(len(listed(demo)))
        page.get_by_test_id("choose-search").fill(other[:12])
        expect(found).to_have_count(1)
        if way == "keyboard":
            page.keyboard.press("Enter")
        else:
            hand.press(f"choose-{other}")
        expect(page).to_have_url(f"{demo.url}servos/{other}/faults")
        hand.press("servo-before")
        expect(page).to_have_url(f"{demo.url}servos/{one}/faults")


def test_keys_lead_to_the_next_servo_and_not_past_the_ends(page: Page, demo: Demo) -> None:
    uids = listed(demo)
    page.goto(f"{demo.url}servos/{uids[0]}/parameters")
    expect(page.get_by_test_id("servo-before")).to_be_disabled()
    for key, uid in (("j", uids[1]), ("ArrowRight", uids[2]), ("k", uids[1]), ("ArrowLeft", uids[0]), ("k", uids[0])):
        page.keyboard.press(key)
        expect(page).to_have_url(f"{demo.url}servos/{uid}/parameters")
    page.get_by_role("searchbox").fill("jk")
    expect(page).to_have_url(re.compile(uids[0]))


def test_the_overview_says_what_rom_lacks_and_asks_before_it_saves(page: Page, demo: Demo) -> None:
    uid = demo.api.get("/servos").json()[0]["uid"]
    row = f"/servos/{uid}/parameters/angle_p_gain"
    held = demo.api.get(row).json()["value"]
    try:
        demo.api.put(row, json={"value": held + 1}).raise_for_status()
        page.goto(f"{demo.url}servos/{uid}")
        expect(page.get_by_test_id("rom-state")).to_contain_text("1 in RAM only")
        expect(page.get_by_test_id("card-unsaved")).to_contain_text("P gain")
        expect(page.get_by_test_id("card-history")).to_contain_text("P gain")
        page.get_by_test_id("act-save").click()
        dialog = page.get_by_role("dialog")
        expect(dialog).to_contain_text("P gain")
        dialog.get_by_role("button", name="Cancel").click()
        assert demo.api.get(row).json()["rom"] == held
    finally:
        demo.api.put(row, json={"value": held}).raise_for_status()
    expect(page.get_by_test_id("act-saved")).to_be_visible()
    page.get_by_test_id("act-snapshot").click()
    expect(page.get_by_test_id("act-snapshot")).to_contain_text("Snapshot taken")
    expect(page.get_by_test_id("card-snapshots")).not_to_contain_text("No snapshot yet")
