"""The scope: channels in the address, a single trigger, cursors by pointer and keys, memory, layouts, files."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo
from e2e.state import read, servo_of, wait_for
from e2e.steps import box


@pytest.fixture
def uid(demo: Demo) -> str:
    """A servo that accepts angle commands."""
    return servo_of(demo, "BLA21-12U-A0")


def opened(page: Page, demo: Demo, uid: str, seconds: float = 0) -> None:
    """The scope of a servo, after enough samples."""
    page.goto(f"{demo.url}scope?ch={uid}:current_angle,command_angle,current_voltage")
    page.get_by_test_id("scope-plot").locator("canvas").first.wait_for()
    expect(page.get_by_test_id("scope-channel-A")).to_contain_text(re.compile(r"\d+ of 50"))
    page.wait_for_timeout(1000 * seconds)


def test_a_single_trigger_captures_the_step(page: Page, demo: Demo, uid: str) -> None:
    opened(page, demo, uid)
    lease = {"Lease": demo.api.post("/leases", json={"holder": "Scope", "ttl_s": 60}).json()["id"]}
    try:
        turned = demo.api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=lease)
        assert turned.is_success, turned.text
        demo.api.post(f"/servos/{uid}/command", json={"type": "angle", "value": 0}, headers=lease).raise_for_status()
        wait_for(lambda: abs(read(demo, uid, "current_angle")) < 1, "it does not go to 0°")
        page.get_by_test_id("scope-window").select_option("2")
        page.get_by_test_id("scope-level").fill("10")
        page.get_by_role("button", name="Single").click()
        page.get_by_test_id("scope-source").select_option(f"{uid}/current_angle")
        status = page.get_by_test_id("scope-status")
        expect(status).to_have_attribute("data-state", "waiting")
        demo.api.post(f"/servos/{uid}/command", json={"type": "angle", "value": 20}, headers=lease).raise_for_status()
        expect(status).to_have_attribute("data-state", "triggered")
        expect(status).to_contain_text("Held until the next single shot")
        page.locator("main").focus()
        page.keyboard.press("t")
        expect(status).to_have_attribute("data-state", "waiting")
    finally:
        demo.api.delete(f"/leases/{lease['Lease']}")


@pytest.mark.release
def test_cursors_by_pointer_and_keys_give_statistics_and_a_spectrum(page: Page, demo: Demo, uid: str) -> None:
    opened(page, demo, uid, seconds=2.5)
    face = page.get_by_test_id("scope-plot").locator(".u-over").first
    face.click(position={"x": box(face)["width"] * 0.8, "y": 40})
    page.locator("main").focus()
    page.keyboard.press("2")
    expect(page.get_by_test_id("scope-delta")).to_contain_text("1/Δt")
    expect(page.get_by_test_id("scope-table").locator("tbody tr")).to_have_count(3)
    before = page.get_by_test_id("scope-cursors").inner_text()
    page.keyboard.press("Shift+ArrowLeft")
    wait_for(lambda: page.get_by_test_id("scope-cursors").inner_text() != before, "the cursor does not move")
    expect(page.get_by_test_id("scope-spectrum")).not_to_be_empty()
    page.get_by_test_id("scope-memory").focus()
    page.keyboard.press("ArrowLeft")
    expect(page.get_by_test_id("scope-live")).to_be_visible()
    page.keyboard.press("End")
    expect(page.get_by_test_id("scope-live")).to_have_count(0)


def test_channels_are_added_saved_as_a_layout_and_exported(page: Page, demo: Demo, uid: str) -> None:
    page.goto(f"{demo.url}servos/{uid}/parameters")
    page.get_by_test_id("plot-scope").click()
    expect(page.get_by_test_id("scope-channel-B")).to_be_visible()
    page.get_by_test_id("scope-add-servo").select_option(uid)
    page.get_by_test_id("scope-add-channel").select_option("current_torque")
    page.get_by_test_id("scope-add").click()
    expect(page.get_by_test_id("scope-plot")).to_have_attribute("data-lanes", "2")
    page.get_by_test_id("scope-layout-name").fill("Three")
    page.get_by_test_id("scope-save").click()
    expect(page.get_by_test_id("scope-channel-C")).to_contain_text(re.compile(r"\d+ of 50"))
    with page.expect_download() as kept:
        page.get_by_test_id("scope-csv").click()
    head = Path(kept.value.path()).read_text(encoding="utf-8").splitlines()[0]
    assert "current_torque" in head
    page.goto(demo.url + "scope")
    page.get_by_role("button", name="Three").first.click()
    expect(page.get_by_test_id("scope-channel-C")).to_be_visible()
