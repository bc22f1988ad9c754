"""A session in a browser: select a servo, change limits, apply, save, jog, watch it move, stop."""

import io
import re
from math import atan2, degrees

import httpx
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import BrowserContext, Page, expect

from e2e.servers import Demo, as_in_rom
from e2e.state import latched, read, rows_of, servo, servo_of, wait_for
from e2e.steps import horn_is_free, jog, stage, stop_cleared


def on_the_bus(demo: Demo) -> set[str]:
    return {one["uid"] for one in demo.api.get("/servos").json() if one["state"] != "offline"}


def unconfirmed(demo: Demo) -> set[str]:
    """UIDs that have not confirmed the latched stop."""
    return {one["uid"] for one in demo.api.get("/stop").json()["servos"] if not one["confirmed"]}


def picture(page: Page, testid: str) -> np.ndarray:
    shot = page.get_by_test_id(testid).screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def test_the_list_shows_every_servo_with_a_live_angle(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    page.goto(demo.url)
    expect(page.get_by_test_id("live-state")).to_have_count(1)
    for one in demo.api.get("/servos").json():
        row = page.get_by_test_id(f"servo-row-{one['uid']}")
        expect(row).to_be_visible()
        expect(row).to_contain_text(one["model"])
        expect(row).to_contain_text("°")
    expect(page.get_by_test_id("stop")).to_be_visible()
    page.get_by_test_id(f"servo-row-{uid}").get_by_role("link").first.click()
    expect(page).to_have_url(re.compile(f"/servos/{uid}$"))


@pytest.mark.parametrize("wanted", ["on", "off"])
def test_a_save_keeps_torque_in_rom_unless_off_is_confirmed(
    wanted: str, page: Page, context: BrowserContext, demo: Demo
) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    as_in_rom(demo.api, uid)
    demo.api.post(f"/servos/{uid}/torque", json={"mode": "off"}).raise_for_status()  # as the end of any motion
    row = f"/servos/{uid}/parameters/angle_p_gain"
    gain = demo.api.get(row).json()["value"]
    tab = context.new_page()  # not watched: the console logs the dry run that needs confirmation, as expected
    try:
        if wanted == "off":
            tab.goto(f"{demo.url}servos/{uid}/parameters#torque_mode")
            tab.get_by_test_id("input-torque_mode-off").check(force=True)
        tab.goto(f"{demo.url}servos/{uid}/parameters#angle_p_gain")
        stage(tab, "angle_p_gain", gain - 1)
        tab.get_by_test_id("apply-save").click()
        if wanted == "off":
            dialog = tab.get_by_test_id("save-dialog")
            expect(dialog).to_contain_text("After every start the servo holds nothing")
            expect(tab.get_by_test_id("save-go")).to_have_count(0)
            expect(tab.get_by_test_id("change-again")).to_be_disabled()
            dialog.get_by_label(re.compile("is intended")).check()
            tab.get_by_test_id("change-again").click()
        expect(tab.get_by_test_id("save-go")).to_be_visible()
        expect(tab.get_by_test_id("save-torque_mode")).to_have_count(1 if wanted == "off" else 0)
        horn_is_free(tab)
        tab.get_by_test_id("save-go").click()
        expect(tab.get_by_test_id("step-read_back")).to_have_attribute("data-state", "done")
        held = rows_of(demo, uid)
        assert (held["torque_mode"]["rom"], held["angle_p_gain"]["rom"]) == (wanted, gain - 1)
    finally:
        demo.api.put(row, json={"value": gain}).raise_for_status()
        demo.api.post(f"/servos/{uid}/save", params={"wait": True}, json={"torque_on": True}).raise_for_status()


def test_limits_are_changed_saved_and_loaded_from_rom(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    as_in_rom(demo.api, uid)
    written: list[str] = []
    page.on("request", lambda one: written.append(one.post_data or "") if one.method in ("PUT", "PATCH") else None)
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_limit_cw")

    # two limits, then an illegal third: the field says why, and nothing of it is ever sent
    for key, value in (("angle_limit_cw", 75), ("angle_limit_ccw", -75), ("torque_limit_cw", 120)):
        stage(page, key, value)
    expect(page.get_by_test_id("row-angle_limit_cw")).to_have_attribute("data-state", "staged")
    expect(page.get_by_test_id("message-torque_limit_cw")).to_contain_text("120 % is above this model's limit of 100 %")
    expect(page.get_by_test_id("save-bar")).to_be_visible()
    assert rows_of(demo, uid)["angle_limit_cw"]["value"] == 60.0, "staged is not sent"
    page.get_by_test_id("use-torque_limit_cw").click()

    page.get_by_test_id("apply").click()
    expect(page.get_by_test_id("row-angle_limit_cw")).to_have_attribute("data-state", "applied")
    held = rows_of(demo, uid)
    assert (held["angle_limit_cw"]["value"], held["angle_limit_cw"]["rom"]) == (75.0, 60.0)
    assert not [body for body in written if "120" in body]

    # into ROM: it restarts, is the same servo, and every value was read back
    starts = demo.api.get(f"/sim/servos/{uid}").json()["starts"]
    page.get_by_test_id("apply-save").click()
    expect(page.get_by_test_id("save-dialog")).to_contain_text("The horn stays at 0.0°")
    expect(page.get_by_test_id("horn-free"), "nothing moves").to_have_count(0)
    page.get_by_test_id("save-go").click()
    expect(page.get_by_test_id("job-dialog")).to_be_visible()
    expect(page.get_by_test_id("step-read_back")).to_have_attribute("data-state", "done")
    page.get_by_test_id("change-close").click()
    expect(page.get_by_test_id("row-angle_limit_cw")).to_have_attribute("data-state", "saved")
    held = rows_of(demo, uid)
    assert (held["angle_limit_cw"]["rom"], held["angle_limit_ccw"]["rom"]) == (75.0, -75.0)
    assert servo(demo, uid)["unsaved"] == []
    assert demo.api.get(f"/sim/servos/{uid}").json()["starts"] == starts + 1
    assert page.url.split("#")[0].endswith(f"/servos/{uid}/parameters")


def test_a_jog_moves_plot_and_scene_and_stop_latches(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    page.goto(f"{demo.url}servos/{uid}/motion")
    assert demo.api.get("/leases").json() == [], "opening the page takes nothing"
    page.get_by_test_id("enable-motion").click()
    jog(page, 30)
    expect(page.get_by_test_id("jog-angle")).to_contain_text(re.compile(r"\+(29|30)\.\d°"))
    assert abs(demo.api.get(f"/servos/{uid}").json()["angle_deg"] - 30) < 1.5

    page.keyboard.press("Escape")
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    assert latched(demo)
    # a servo unplugged by other tests cannot respond, and is not confirmed
    wait_for(lambda: not unconfirmed(demo) & on_the_bus(demo), "not all servos on the bus have confirmed")
    expect(page.get_by_test_id("enable-motion")).to_be_disabled()
    expect(page.get_by_test_id("motion-hindrance")).to_contain_text(re.compile("stop", re.IGNORECASE))

    refused = demo.api.post(f"/servos/{uid}/command", json={"type": "angle", "value": 0})
    assert (refused.status_code, refused.json()["code"]) == (423, "stopped")
    stop_cleared(page)
    assert latched(demo) is False
    assert read(demo, uid, "torque_mode") == "off"


HORN = """() => {
    const horn = window.__viserMutable?.nodeRefFromName['/hero/pivot'];
    return horn && horn.visible ? [horn.quaternion.z, horn.quaternion.w] : null;
}"""
"""Half the angle of the horn in front, as sine and cosine; null while no horn is drawn."""


def horn(page: Page) -> float | None:
    """Angle of the horn in the 3D view of this page, degrees, with the servo's sign."""
    (frame,) = [one for one in page.frames if "/viser/" in one.url]
    found = frame.evaluate(HORN)
    return None if found is None else -2 * degrees(atan2(*found))


def stands(page: Page, angle: float) -> None:
    """Wait until the horn is drawn at this angle."""

    def there() -> bool:
        found = horn(page)
        return found is not None and abs(found - angle) < 2

    wait_for(there, f"the horn is not drawn at {angle}°")


@pytest.mark.scene
def test_plot_and_scene_follow_the_horn(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA15-06U-A0")
    page.goto(f"{demo.url}servos/{uid}/parameters")
    frame = page.get_by_test_id("view-frame")
    expect(frame).to_have_attribute("data-state", "shown")
    page.frame_locator("iframe").locator("canvas").first.wait_for()
    stands(page, demo.api.get(f"/servos/{uid}").json()["angle_deg"])
    scene = picture(page, "view-frame")
    wait_for(lambda: 0 < height(page) < 10, "the plot does not show a horn at rest")

    lease = demo.api.post("/leases", json={"holder": "e2e", "ttl_s": 60}).json()["id"]
    move(demo, uid, lease, 60)
    expect(page.get_by_test_id("angle-readout")).to_contain_text(re.compile(r"\+(59|60)\.\d°"))
    stands(page, 60)
    wait_for(lambda: height(page) > 50, "the plot does not show the move")
    wait_for(lambda: changed(scene, picture(page, "view-frame")) > 500, "the horn in the scene has not turned")
    demo.api.delete(f"/leases/{lease}")


def move(demo: Demo, uid: str, lease: str, value: float) -> None:
    headers = {"Lease": lease}
    if read(demo, uid, "torque_mode") != "on":
        assert demo.api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=headers).is_success
    body = {"type": "angle", "value": value, "wait": "settled"}
    response: httpx.Response = demo.api.post(f"/servos/{uid}/command", json=body, headers=headers)
    assert response.is_success, response.text
    assert response.json()["settled"] is True


def height(page: Page) -> int:
    """Height of the curve in the plot of the angle, pixels. It is dark; grid, axes and other curves are not."""
    shot = picture(page, "plot-angle")
    inside = shot[: int(shot.shape[0] * 0.8), int(shot.shape[1] * 0.17) : int(shot.shape[1] * 0.69)]
    return int((inside.max(axis=2) < 90).any(axis=1).sum())


def changed(before: np.ndarray, after: np.ndarray) -> int:
    """Number of pixels that clearly differ."""
    height, width = min(before.shape[0], after.shape[0]), min(before.shape[1], after.shape[1])
    return int((np.abs(before[:height, :width] - after[:height, :width]).max(axis=2) > 40).sum())
