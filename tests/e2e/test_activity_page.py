"""The activity of a servo is the same in list, head and panel: saturation is marked, a speed command is a speed."""

import re
from collections.abc import Generator
from contextlib import contextmanager

from playwright.sync_api import Page, ViewportSize, expect

from e2e.looks import complaints
from e2e.servers import Demo
from e2e.state import add, servo, sim, wait_for

SERVOS = 2
WIDE: ViewportSize = {"width": 1440, "height": 900}


@contextmanager
def added(demo: Demo, **rom: int) -> Generator[str]:
    """A ready servo that keeps its last command; removed afterwards."""
    (uid,) = add(demo, model="BLA21-12U-A0", servo_id=63, rom={"timeout_action": 0, **rom})
    try:
        yield uid
    finally:
        demo.api.delete(f"/sim/servos/{uid}")


def marked(page: Page, demo: Demo, uid: str, says: str | re.Pattern[str]) -> None:
    """Shown as a warning on Servos and in the head of Motion."""
    page.goto(demo.url + "servos")
    row = page.get_by_test_id(f"servo-row-{uid}")
    expect(row).to_have_attribute("data-kind", "warning")
    expect(row).to_contain_text(says)
    page.goto(f"{demo.url}servos/{uid}/motion")
    head = page.get_by_test_id("servo-state")
    expect(head).to_have_attribute("data-kind", "warning")
    expect(head).to_contain_text(says)
    assert complaints(page) == []


def test_a_saturated_servo_is_marked_until_the_load_goes(page: Page, demo: Demo) -> None:
    with added(demo, soft_start=0) as uid:
        sim(demo, uid, load_pct=92.0)
        wait_for(lambda: servo(demo, uid)["activity"]["state"] == "saturated", "the server does not call it saturated")
        marked(page, demo, uid, "saturated, torque")
        sim(demo, uid, load_pct=20.0)
        head = page.get_by_test_id("servo-state")
        expect(head).to_have_attribute("data-kind", "ok")
        expect(head).to_contain_text("Holding")


def test_a_hunting_servo_is_marked(page: Page, demo: Demo) -> None:
    gains = {"speed_torque_control": 1, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0}
    with added(demo, **gains) as uid:
        heavy = {"load_inertia": 3.0, "external_angle_deg": 60.0}
        for change in ({"power": "off"}, heavy, {"power": "on"}):
            demo.api.patch(f"/sim/servos/{uid}", json=change).raise_for_status()
        wait_for(lambda: servo(demo, uid)["activity"]["state"] == "hunting", "the server does not call it hunting")
        marked(page, demo, uid, re.compile(r"hunting( at 1\d Hz)?, \d\.\d° peak to peak"))


def test_head_and_side_panel_agree_during_a_speed_command(page: Page, demo: Demo) -> None:
    with added(demo, speed_torque_control=1, soft_start=0) as uid:
        page.set_viewport_size(WIDE)
        page.goto(f"{demo.url}servos/{uid}/motion")
        page.get_by_test_id("enable-motion").click()
        page.get_by_role("button", name="Speed", exact=True).click()
        page.get_by_test_id("hold-free").check()
        page.get_by_test_id("hold-value").fill("30")
        page.get_by_test_id("hold-cw").hover()
        page.mouse.down()
        expect(page.get_by_test_id("jog-command")).to_contain_text("+30")
        expect(page.get_by_test_id("command-readout")).to_contain_text("+30\u202frpm")
        expect(page.get_by_test_id("servo-state")).to_contain_text("Rotating")
        expect(page.get_by_test_id("servo-state")).not_to_contain_text("Holding")
        page.mouse.up()
        expect(page.get_by_test_id("servo-state")).not_to_contain_text("Rotating")
