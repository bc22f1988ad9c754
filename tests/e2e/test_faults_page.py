"""The Faults page: a fault appears, is acknowledged and clears; in both themes and on a tablet."""

import re

from playwright.sync_api import Page, expect

from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.state import servo_of, sim, wait_for
from e2e.steps import box, chord


def inject(demo: Demo, uid: str, key: str, on: bool) -> None:
    sim(demo, uid, faults={key: on})


def open_faults(demo: Demo) -> int:
    return sum(one["unacknowledged"] for one in demo.api.get("/servos").json())


def test_a_fault_appears_is_acknowledged_and_clears(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    for one in demo.api.get("/servos").json():
        demo.api.post(f"/servos/{one['uid']}/faults/acknowledge", params={"by": "test"}).raise_for_status()
    page.goto(demo.url)
    expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
    expect(page.get_by_test_id("faults-badge")).to_have_count(0)

    inject(demo, uid, "sensor_weak", True)
    expect(page.get_by_test_id("faults-badge")).to_contain_text("1")
    chord(page, "g", "f")
    expect(page).to_have_url(re.compile(r"/faults$"))
    line = page.get_by_test_id("faults-now").locator(f'[data-testid="fault-sensor_weak"][data-uid="{uid}"]')
    expect(line).to_have_attribute("data-active", "true")
    expect(line).to_contain_text("Warning")
    expect(line).to_contain_text("once")
    advice = next(one["advice"] for one in demo.api.get(f"/servos/{uid}/faults").json() if one["key"] == "sensor_weak")
    expect(line).to_contain_text(advice)

    line.get_by_role("button").focus()
    page.keyboard.press("Enter")
    expect(line).to_have_attribute("data-unseen", "false")
    expect(line).to_contain_text(re.compile(r"Acknowledged by Page \d+, \d\d:\d\d:\d\d"))
    expect(page.get_by_test_id("faults-badge")).to_have_count(0)
    expect(line, "acknowledged is not gone").to_have_attribute("data-active", "true")

    inject(demo, uid, "sensor_weak", False)
    over = page.get_by_test_id("faults-past").locator(f'[data-testid="fault-sensor_weak"][data-uid="{uid}"]')
    expect(over).to_contain_text("Cleared")
    expect(line).to_have_count(0)
    assert open_faults(demo) == 0


def test_all_faults_are_acknowledged_at_once_and_filtered_by_servo(page: Page, demo: Demo) -> None:
    first, second = servo_of(demo, "BLA21-12U-A0"), servo_of(demo, "BLA21-06U-A0")
    try:
        inject(demo, first, "motor_signal", True)
        inject(demo, second, "temperature_low", True)
        page.goto(f"{demo.url}servos/{first}/faults")
        now = page.get_by_test_id("faults-now")
        expect(now.get_by_test_id("fault-motor_signal")).to_be_visible()
        expect(page.get_by_test_id("fault-temperature_low")).to_have_count(0)
        page.get_by_test_id("faults-servo").select_option("")
        expect(page).to_have_url(re.compile(r"/faults$"))
        expect(now.get_by_test_id("fault-temperature_low")).to_be_visible()
        expect(now.locator("tbody tr").first, "the worst first").to_have_attribute("data-level", "failure")
        page.get_by_test_id("acknowledge-all").click()
        expect(page.get_by_test_id("acknowledge-all")).to_be_disabled()
        wait_for(lambda: open_faults(demo) == 0, "not all are acknowledged")
    finally:
        inject(demo, first, "motor_signal", False)
        inject(demo, second, "temperature_low", False)


def test_a_servo_without_faults_explains_the_page(page: Page, demo: Demo) -> None:
    lists = {one["uid"]: demo.api.get(f"/servos/{one['uid']}/faults").json() for one in demo.api.get("/servos").json()}
    well = next(uid for uid, found in lists.items() if found == [])
    page.goto(f"{demo.url}servos/{well}/faults")
    expect(page.get_by_test_id("faults-empty")).to_contain_text("their meaning and remedy")
    page.get_by_test_id("faults-empty").get_by_role("button").click()
    expect(page).to_have_url(re.compile(r"/servos$"))


def test_the_faults_page_passes_axe_and_touch_sizes(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    inject(demo, uid, "voltage_high", True)
    try:
        page.emulate_media(color_scheme="light", reduced_motion="reduce")
        page.goto(f"{demo.url}faults")
        expect(page.get_by_test_id("faults-now").get_by_test_id("fault-voltage_high")).to_be_visible()
        assert complaints(page) == []
        page.emulate_media(color_scheme="dark", reduced_motion="reduce")
        assert complaints(page, "color-contrast") == [], "dark"
        page.set_viewport_size({"width": 768, "height": 1024})
        assert too_small(page) == []
        assert page.evaluate("() => document.documentElement.scrollWidth") <= 768
        page.set_viewport_size({"width": 390, "height": 844})
        assert too_small(page) == []
        assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
        text = box(page.get_by_test_id("fault-voltage_high").locator(".fault-what"))
        assert text["width"] > 300, "its text has the full width of a phone"
    finally:
        inject(demo, uid, "voltage_high", False)
