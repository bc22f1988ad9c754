"""The page of one servo: head, tabs, picker, neighbours and overview, by mouse, keyboard and touch."""

import re

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.hand import WAYS, hand_of
from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.state import uids_of


def listed(demo: Demo) -> list[str]:
    """UIDs in the order of the list: by servo ID, then by serial."""
    known = demo.api.get("/servos").json()
    return [one["uid"] for one in sorted(known, key=lambda one: (one["servo_id"] or 999, one["serial"]))]


@pytest.mark.parametrize("way", WAYS)
def test_selecting_another_servo_keeps_the_tab(way: str, browser: Browser, demo: Demo) -> None:
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


def test_keys_select_the_next_servo(page: Page, demo: Demo) -> None:
    uids = listed(demo)
    page.goto(f"{demo.url}servos/{uids[0]}/parameters")
    expect(page.get_by_test_id("servo-before")).to_be_disabled()
    for key, uid in (("j", uids[1]), ("ArrowRight", uids[2]), ("k", uids[1]), ("ArrowLeft", uids[0]), ("k", uids[0])):
        page.keyboard.press(key)
        expect(page).to_have_url(f"{demo.url}servos/{uid}/parameters")
    page.get_by_role("searchbox").fill("jk")
    expect(page).to_have_url(re.compile(uids[0]))


@pytest.mark.parametrize("way", WAYS)
def test_notes_and_name_are_stored(way: str, browser: Browser, demo: Demo) -> None:
    uid = listed(demo)[1]
    before = demo.api.get(f"/inventory/{uid}").json()
    try:
        with hand_of(browser, way) as hand:
            page = hand.page
            page.goto(f"{demo.url}servos/{uid}")
            hand.press("notes-edit")
            expect(page.get_by_test_id("notes-box")).to_be_focused()
            page.get_by_test_id("notes-box").fill("New gears.\nA little play.")
            hand.press("notes-keep")
            expect(page.get_by_test_id("card-notes")).to_contain_text("A little play.")
            hand.press("act-rename")
            page.get_by_test_id("rename-box").fill("Rig arm")
            hand.press("rename-keep")
            expect(page.get_by_test_id("choose-servo")).to_contain_text("Rig arm")
            expect(page.get_by_test_id("card-history")).to_contain_text("Notes")
            page.reload()
            expect(page.get_by_test_id("card-notes")).to_contain_text("New gears.")
            assert complaints(page) == []
            if way == "touch":
                assert too_small(page) == []
        now = demo.api.get(f"/inventory/{uid}").json()
        assert (now["notes"], now["label"]) == ("New gears.\nA little play.", "Rig arm")
    finally:
        patch = {"notes": "", "label": before["label"]}
        demo.api.patch(f"/inventory/{uid}", json=patch).raise_for_status()


def test_the_brake_is_shown(page: Page, demo: Demo) -> None:
    uid = listed(demo)[0]
    page.goto(f"{demo.url}servos/{uid}")
    output = page.get_by_test_id("act-output")
    output.get_by_role("button", name="Brake").click()
    expect(output.get_by_role("button", name="Brake")).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_test_id("overview-actions")).to_contain_text("Brake on")
    assert demo.api.get(f"/servos/{uid}/parameters/torque_mode").json()["value"] == "brake"
    output.get_by_role("button", name="Off").click()
    expect(output.get_by_role("button", name="Off")).to_have_attribute("aria-pressed", "true")


def test_the_overview_shows_the_present_values(page: Page, demo: Demo) -> None:
    page.goto(f"{demo.url}servos/{listed(demo)[1]}")
    readings = page.locator(".o-now .readouts > div")
    expect(readings).to_have_count(8)
    expect(page.get_by_test_id("tracking-readout")).to_have_text(re.compile(r"[+−]?\d+\.\d°"))
    expect(page.get_by_test_id("powered-readout")).to_have_text(re.compile(r"\d+\s?(s|min|h)"))
    expect(page.locator(".o-now .case-outline")).to_be_attached()


def test_the_last_applied_profile_is_named_and_compared(page: Page, demo: Demo) -> None:
    uid = listed(demo)[2]
    row = f"/servos/{uid}/parameters/angle_p_gain"
    held = demo.api.get(row).json()["value"]
    page.goto(f"{demo.url}servos/{uid}")
    expect(page.get_by_test_id("card-profile")).to_contain_text("No profile applied yet")
    demo.api.put("/profiles/Follower", json={"from_uid": uid}).raise_for_status()
    try:
        demo.api.put(row, json={"value": held + 1}).raise_for_status()
        applied = demo.api.post("/profiles/Follower/apply", json={"uids": [uid]}, params={"wait": True}, timeout=60)
        applied.raise_for_status()
        expect(page.get_by_test_id("card-profile")).to_contain_text("Follows Follower")
        expect(page.get_by_test_id("card-profile")).to_contain_text("values match")
    finally:
        demo.api.put(row, json={"value": held}).raise_for_status()


def test_the_overview_shows_what_another_program_records(page: Page, demo: Demo) -> None:
    uid = listed(demo)[0]
    page.goto(f"{demo.url}servos/{uid}")
    card = page.get_by_test_id("card-snapshots")
    expect(card).to_be_visible()
    expect(card.locator(".unseen")).to_have_count(0)  # the list is loaded
    demo.api.post(f"/servos/{uid}/snapshots", json={"reason": "taken by a script"}).raise_for_status()
    expect(card).to_contain_text("taken by a script")


def test_the_overview_shows_unsaved_values_and_confirms_a_save(page: Page, demo: Demo) -> None:
    uid = uids_of(demo)[0]
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
    expect(page.get_by_test_id("card-snapshots")).not_to_contain_text("No snapshots yet")
