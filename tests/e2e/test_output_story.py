"""Output is session state: what Stop or motion turned off never reaches ROM, by touch or keyboard."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from e2e.hand import Hand, hand_of
from e2e.servers import Server, running, serving
from e2e.state import add, row, wait_for
from e2e.steps import JOB_MS


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A bus with two factory-new servos and a configured one."""
    folder: Path = tmp_path_factory.mktemp("output")
    with running(*serving(folder, "--sim-api")) as one:
        yield one


def made(server: Server, servo_id: int = 0, **rom: int) -> str:
    """A ready servo of this test; `rom` has raw values."""
    return add(server, servo_id=servo_id, rom=rom)[0]


def torque(server: Server, uid: str, side: str = "rom") -> object:
    return row(server, uid, "torque_mode")[side]


@pytest.fixture
def hand(request: pytest.FixtureRequest, browser: Browser) -> Iterator[Hand]:
    """A page with one input method."""
    with hand_of(browser, request.param) as one:
        yield one


def by(way: str) -> pytest.MarkDecorator:
    """Input method of a test."""
    return pytest.mark.parametrize("hand", [way], indirect=True)


def confirmed(server: Server, uid: str) -> Callable[[], bool]:
    """Whether this servo has acknowledged the stop."""
    return lambda: any(one["uid"] == uid and one["confirmed"] for one in server.api.get("/stop").json()["servos"])


@pytest.mark.release
@by("keyboard")
def test_servos_commissioned_after_a_stop_keep_torque_in_rom(server: Server, hand: Hand) -> None:
    page, uids = hand.page, [made(server), made(server)]
    page.goto(server.url + "servos")
    expect(page.get_by_test_id(f"servo-row-{uids[0]}")).to_be_visible()
    hand.stop_and_clear()
    for uid in uids:
        row = page.get_by_test_id(f"servo-row-{uid}")
        expect(row).to_contain_text("Output off: stopped by you")
        expect(row, "what Stop did is no unsaved edit").to_contain_text("saved")
        assert server.api.get(f"/servos/{uid}").json()["unsaved"] == []

    page.goto(server.url + "commission")
    expect(page.get_by_test_id(f"pick-{uids[1]}")).to_be_visible()
    for one in server.api.get("/commissioning/candidates").json()["servos"]:
        box = page.get_by_test_id(f"pick-{one['servo']['uid']}").locator("input")
        if box.is_checked() != (one["servo"]["uid"] in uids):
            hand.press(box, "Space")
    hand.press("find-go")
    for _ in uids:
        hand.press("give")
    hand.press("identify-go")
    hand.press("profile-go")
    for uid in uids:
        plan = page.get_by_test_id(f"changes-{uid}")
        expect(plan).to_be_visible()
        keys = plan.locator("li").evaluate_all("all => all.map(one => one.dataset.key)")
        assert "torque_mode" not in keys, keys
        assert "servo_id" in keys, keys
    hand.tick("horn-free")
    hand.press("start")
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "report", timeout=JOB_MS)
    expect(page.locator("[data-verdict=done]")).to_have_count(2)
    assert [torque(server, uid) for uid in uids] == ["on", "on"]
    for uid in uids:
        server.api.delete(f"/sim/servos/{uid}")


@by("touch")
def test_a_save_contains_only_the_changed_values(server: Server, hand: Hand) -> None:
    page, uid = hand.page, made(server, 21)
    page.goto(f"{server.url}servos/{uid}/motion")
    hand.press("enable-motion")
    expect(page.get_by_test_id("motion-band")).to_be_visible()
    hand.press("disable-motion")
    expect(page.get_by_test_id("servo-state")).to_contain_text("Output off")
    page.goto(f"{server.url}servos/{uid}/parameters#angle_p_gain")
    expect(page.get_by_test_id("save-bar"), "motion left nothing to save").to_have_count(0)
    box = page.get_by_test_id("input-angle_p_gain")
    expect(box).to_be_enabled()
    box.fill("44")
    dialog = hand.saves()
    expect(dialog).to_contain_text("Save 1 value to ROM")
    expect(page.get_by_test_id("save-angle_p_gain")).to_be_visible()
    expect(page.get_by_test_id("save-torque_mode")).to_have_count(0)
    expect(dialog).to_contain_text("The horn stays at 0.0°")
    expect(dialog).to_contain_text("Output is off now")
    hand.confirms()
    rows = server.api.get(f"/servos/{uid}/parameters").json()["parameters"]
    assert (rows["angle_p_gain"]["rom"], rows["torque_mode"]["rom"]) == (44, "on")
    server.api.delete(f"/sim/servos/{uid}")


@by("keyboard")
def test_torque_on_is_saved_from_the_parameters_page_without_motion_control(server: Server, hand: Hand) -> None:
    page, uid = hand.page, made(server, 22, torque_mode=1)
    assert torque(server, uid) == "off"
    page.goto(f"{server.url}servos/{uid}/parameters#torque_mode")
    on = page.get_by_test_id("input-torque_mode-on")
    expect(on).to_be_enabled()
    page.get_by_test_id("input-torque_mode-off").focus()
    page.keyboard.press("ArrowLeft")
    dialog = hand.saves()
    expect(page.get_by_test_id("save-torque_mode")).to_contain_text("On")
    expect(dialog).not_to_contain_text("0.0° to 0.0°")
    hand.confirms()
    assert (torque(server, uid), torque(server, uid, "value")) == ("on", "on")
    server.api.delete(f"/sim/servos/{uid}")


@by("touch")
def test_a_rejected_save_opens_no_dialog(server: Server, hand: Hand) -> None:
    page, uid = hand.page, made(server, 23)
    page.goto(f"{server.url}servos/{uid}/parameters#angle_p_gain")
    expect(page.get_by_test_id("input-angle_p_gain")).to_be_enabled()
    page.get_by_test_id("input-angle_p_gain").fill("45")
    server.api.post("/stop").raise_for_status()
    wait_for(confirmed(server, uid), "the stop is not confirmed")
    try:
        hand.press("apply-save")
        expect(page.get_by_test_id("save-bar").get_by_role("alert")).to_contain_text("Clear the stop first")
        expect(page.get_by_role("dialog")).to_have_count(0)
    finally:
        server.api.delete("/stop").raise_for_status()
    hand.press(hand.saves().get_by_role("button", name="Cancel"))
    expect(page.get_by_test_id("save-dialog")).to_have_count(0)
    assert server.api.get(f"/servos/{uid}/parameters/angle_p_gain").json()["value"] != 45
    server.api.delete(f"/sim/servos/{uid}")
