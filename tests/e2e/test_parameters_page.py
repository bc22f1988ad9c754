"""The Parameters page: keys, wheel and slider, help, confirmation of a dangerous limit, and undo."""

import re

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.conftest import Watched
from e2e.servers import Demo
from e2e.state import latched, read, row, sim, uids_of, wait_for, write
from e2e.steps import box, drawn, stage

SERVOS = 1


@pytest.fixture
def uid(demo: Demo) -> str:
    return uids_of(demo)[0]


def test_keys_and_wheel_step_only_the_focused_field(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_limit_cw")
    box = page.get_by_test_id("input-angle_limit_cw")
    expect(box).to_be_focused()
    expect(box).to_have_value("60.0")
    for keys, shown in (("ArrowUp", "61.0"), ("Shift+ArrowUp", "71.0"), ("Alt+ArrowDown", "70.9")):
        box.press(keys)
        expect(box).to_have_value(shown)
    page.mouse.move(*middle(page, "input-angle_limit_cw"))
    page.mouse.wheel(0, -100)
    expect(box).to_have_value("71.9")
    page.mouse.move(*middle(page, "input-angle_limit_ccw"))
    page.mouse.wheel(0, 100)
    drawn(page)
    expect(page.get_by_test_id("input-angle_limit_ccw")).to_have_value("−60.0")
    box.press("Escape")
    expect(box).to_have_value("60.0")
    expect(page.get_by_test_id("save-bar")).to_have_count(0)
    assert latched(demo) is False, "nothing moves: Esc takes back what was typed, no more"


def test_the_caret_stays_and_a_failed_write_stays_visible(context: BrowserContext, demo: Demo, uid: str) -> None:
    page = context.new_page()
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_limit_ccw")
    box = page.get_by_test_id("input-angle_limit_ccw")
    expect(box).to_be_focused()
    box.fill("30")
    box.press("Home")
    box.press("-")
    wait_for(lambda: box.evaluate("box => [box.value, box.selectionStart]") == ["-30", 1], "the caret jumps")
    box.press("Enter")
    expect(box).to_have_value("−30.0")
    problem = {"code": "busy", "status": 409, "title": "Busy", "detail": "The servo is busy."}
    page.route("**/parameters", lambda route: route.fulfill(status=409, json=problem))
    page.get_by_test_id("apply").click()
    message = page.get_by_test_id("message-angle_limit_ccw")
    expect(message).to_contain_text("Not written")
    page.get_by_test_id("tab-control").click()
    expect(box).to_have_count(0)
    page.get_by_test_id("tab-limit").click()
    expect(message).to_contain_text("Not written")
    page.get_by_role("searchbox").fill("angle limit")
    expect(message).to_contain_text("Not written")
    page.get_by_role("heading").first.click()
    page.keyboard.press("Control+z")
    expect(page.get_by_test_id("save-bar")).to_have_count(0)
    page.close()


def middle(page: Page, testid: str) -> tuple[float, float]:
    target = page.get_by_test_id(testid)
    target.scroll_into_view_if_needed()
    at = box(target)
    return at["x"] + at["width"] / 2, at["y"] + at["height"] / 2


def test_dragging_the_range_only_stages(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#torque_limit_cw")
    ruler = page.get_by_test_id("row-torque_limit_cw").locator(".ruler")
    expect(page.get_by_test_id("input-torque_limit_cw")).to_have_value("100")
    at = box(ruler)
    page.mouse.move(at["x"] + 8 + 112, at["y"] + 13)
    page.mouse.down()
    page.mouse.move(at["x"] + 8 + 56, at["y"] + 13, steps=5)
    page.mouse.up()
    expect(page.get_by_test_id("input-torque_limit_cw")).to_have_value("50")
    expect(page.get_by_test_id("row-torque_limit_cw")).to_have_attribute("data-state", "staged")
    assert row(demo, uid, "torque_limit_cw")["value"] == 100
    page.get_by_test_id("discard").click()


def test_row_help_opens_by_keyboard(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_limit_cw")
    page.get_by_test_id("help-angle_limit_cw").focus()
    page.keyboard.press("Enter")
    row = page.get_by_test_id("row-angle_limit_cw")
    expect(row).to_contain_text("Clockwise limit of angle commands")
    expect(row).to_contain_text("0x38 (index 56), section 4.31")
    expect(page.get_by_test_id("raw-angle_limit_cw")).to_have_text("600")


def test_expert_rows_are_folded(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_p_gain")
    expect(page.get_by_test_id("experts")).to_contain_text("Speed P gain")
    expect(page.get_by_test_id("row-speed_p_gain")).to_have_count(0)
    page.get_by_test_id("unfold-expert").click()
    expect(page.get_by_test_id("input-speed_p_gain")).to_be_disabled()
    page.get_by_test_id("unlock-expert").click()
    expect(page.get_by_test_id("input-speed_p_gain")).to_be_enabled()


def test_a_limit_that_could_switch_the_servo_off_is_confirmed_written_and_undone(
    page: Page, demo: Demo, uid: str, watched: Watched
) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#voltage_limit_lower")
    box = page.get_by_test_id("input-voltage_limit_lower")
    expect(box).to_have_value("4.0")
    box.fill("7.2")
    box.press("Enter")
    page.get_by_test_id("apply").click()
    dialog = page.get_by_test_id("apply-dialog")
    expect(dialog).to_contain_text(re.compile(r"could switch the output off immediately: the supply is 7\.\d\sV now"))
    expect(dialog).not_to_contain_text("confirm:")
    expect(page.get_by_test_id("apply-go")).to_be_disabled()

    # no: nothing is written, the value stays staged
    dialog.get_by_role("button", name="Cancel").click()
    expect(page.get_by_test_id("row-voltage_limit_lower")).to_have_attribute("data-state", "staged")
    assert row(demo, uid, "voltage_limit_lower")["value"] == 4.0

    page.get_by_test_id("apply").click()
    dialog.get_by_role("checkbox").check()
    page.get_by_test_id("apply-go").click()
    expect(page.get_by_test_id("row-voltage_limit_lower")).to_have_attribute("data-state", "applied")
    assert row(demo, uid, "voltage_limit_lower")["value"] == 7.2

    page.get_by_test_id("undo").click()
    expect(page.get_by_test_id("undo-voltage_limit_lower")).to_contain_text("4.0")
    page.get_by_test_id("undo-go").click()
    expect(page.get_by_test_id("undo-line")).to_have_count(0)
    assert row(demo, uid, "voltage_limit_lower")["value"] == 4.0
    # The browser itself says of each refused request that it was refused.
    watched.complaints[:] = [one for one in watched.complaints if "409" not in one]


def test_ram_values_lost_by_a_power_cut_are_staged_again(page: Page, demo: Demo, uid: str) -> None:
    before = read(demo, uid, "angle_p_gain")
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_p_gain")
    stage(page, "angle_p_gain", 57)
    page.get_by_test_id("apply").click()
    expect(page.get_by_test_id("row-angle_p_gain")).to_have_attribute("data-state", "applied")
    expect(page.get_by_test_id("undo-line")).to_be_visible()

    sim(demo, uid, power="off")
    expect(page.get_by_test_id("servo-state")).to_have_attribute("data-state", "offline")
    sim(demo, uid, power="on")
    line = page.get_by_test_id("lost-line")
    expect(line).to_contain_text("1 value in RAM was lost")
    expect(line).to_contain_text("Angle P gain")
    expect(page.get_by_test_id("undo-line")).to_have_count(0)
    page.goto(f"{demo.url}servos")
    page.get_by_test_id(f"lost-{uid}").click()
    expect(line).to_be_visible()

    page.get_by_test_id("stage-again").click()
    page.get_by_role("searchbox").fill("angle p gain")
    expect(page.get_by_test_id("input-angle_p_gain")).to_have_value("57")
    assert row(demo, uid, "angle_p_gain")["value"] != 57, "nothing is sent before Apply"
    page.get_by_test_id("apply").click()
    expect(line).to_have_count(0)
    assert row(demo, uid, "angle_p_gain")["value"] == 57
    write(demo, uid, "angle_p_gain", before)


def test_favourites_are_marked_filtered_and_stored(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_p_gain")
    page.get_by_test_id("favourite-angle_p_gain").click()
    page.goto(f"{demo.url}servos/{uid}/parameters?filter=favourites")
    expect(page.locator("[data-testid^=row-]")).to_have_count(1)
    expect(page.get_by_test_id("favourite-angle_p_gain")).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("favourite-angle_p_gain").click()
    expect(page.get_by_text("No favourites yet")).to_be_visible()
