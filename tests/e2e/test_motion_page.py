"""The Motion page: hold to run, groups, sweeps, the dial and presets."""

import re
import time
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from e2e.conftest import Watched
from e2e.contexts import page_in
from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.test_technician import wait_for

WIDE: ViewportSize = {"width": 1440, "height": 900}
TABLET: ViewportSize = {"width": 820, "height": 1180}
"""Without the 3D view, because software rendering could delay heartbeats."""


ROM = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}
"""Rows that permit speed commands and disable the servo's own timeout."""


def made(demo: Demo, label: str, servo_id: int) -> str:
    """A ready servo of this test."""
    body = {"model": "BLA21-12U-A0", "firmware": "1.300", "servo_id": servo_id, "node_id": servo_id, "rom": ROM}
    uid = str(demo.api.post("/sim/servos", json=body).json()["uid"])
    wait_for(lambda: state(demo, uid) == "ready", 25, "the new servo is not ready")
    demo.api.patch(f"/servos/{uid}", json={"label": label})
    return uid


def state(demo: Demo, uid: str) -> str | None:
    found = demo.api.get(f"/servos/{uid}")
    return found.json()["state"] if found.is_success else None


@pytest.fixture(scope="module")
def pair(demo: Demo) -> Iterator[tuple[str, str]]:
    """Two servos of this file, removed afterwards."""
    both = made(demo, "Winch", 61), made(demo, "Boom", 62)
    yield both
    for uid in both:
        demo.api.delete(f"/sim/servos/{uid}")
    for uid in both:
        wait_for(lambda uid=uid: demo.api.delete(f"/inventory/{uid}").is_success, 20, "it is not gone")


@pytest.fixture
def winch(pair: tuple[str, str], demo: Demo, page: Page) -> Iterator[str]:
    """The first of them; afterwards no client has motion control and nothing runs."""
    page.set_viewport_size(TABLET)
    yield pair[0]
    page.goto(f"{demo.url}records")
    wait_for(lambda: demo.api.get("/leases").json() == [], 6, "motion control was not given back")
    demo.api.delete("/stop")


def raw(demo: Demo, uid: str, key: str) -> object:
    return demo.api.get(f"/servos/{uid}/parameters/{key}", params={"fresh": "true"}).json()["value"]


def speed(demo: Demo, uid: str) -> float:
    return abs(float(str(raw(demo, uid, "current_speed"))))


def angle(demo: Demo, uid: str) -> float:
    return float(str(raw(demo, uid, "current_angle")))


def begin(page: Page, demo: Demo, uid: str, *tab: str) -> None:
    """Turn motion on."""
    page.goto(f"{demo.url}servos/{uid}/motion")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("jog-pad")).to_be_visible()
    for name in tab:
        page.get_by_role("button", name=name, exact=True).click()


def ready_to_hold(page: Page, demo: Demo, uid: str) -> None:
    begin(page, demo, uid, "Speed")
    expect(page.get_by_test_id("hold-said")).to_contain_text("rotates continuously")
    expect(page.get_by_test_id("hold-cw")).to_be_disabled()
    page.get_by_test_id("hold-free").check()
    page.get_by_test_id("hold-value").fill("30")


def press(page: Page) -> None:
    page.get_by_test_id("hold-cw").hover()
    page.mouse.down()
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "true")


def by_pointer_up(page: Page) -> None:
    page.mouse.up()


def by_lost_focus(page: Page) -> None:
    page.evaluate("window.dispatchEvent(new Event('blur'))")


def by_pointer_cancel(page: Page) -> None:
    page.evaluate("window.dispatchEvent(new PointerEvent('pointercancel', {pointerId: 1}))")


def by_a_lost_capture(page: Page) -> None:
    page.evaluate("document.querySelector('[data-testid=hold-cw]').releasePointerCapture(1)")


def by_another_key(page: Page) -> None:
    page.keyboard.press("a")


RELEASES: tuple[Callable[[Page], None], ...] = (
    by_pointer_up, by_lost_focus, by_pointer_cancel, by_a_lost_capture, by_another_key
)  # fmt: skip


def test_speed_runs_while_the_button_is_held_and_brakes_on_release(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    for number, release in enumerate(RELEASES):
        press(page)
        if number == 0:
            time.sleep(1.5)  # three times as long as the server would wait for a sign
        wait_for(lambda: speed(demo, winch) > 15, 3, f"it does not turn before {release.__name__}")
        release(page)
        expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "false")
        wait_for(lambda: speed(demo, winch) < 3, 2, f"it turns on after {release.__name__}")
        assert [raw(demo, winch, key) for key in ("command_speed", "torque_mode")] == [0, "on"], "it is braked"
        expect(page.get_by_test_id("motion-band")).to_be_visible()
        page.mouse.up()


def test_a_hidden_tab_ends_a_run_and_motion(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    press(page)
    time.sleep(0.5)
    page.evaluate(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )
    wait_for(lambda: raw(demo, winch, "torque_mode") == "off", 2, "torque stayed on")
    wait_for(lambda: speed(demo, winch) < 3, 2, "it turns on")
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("the tab was hidden")


def test_the_server_brakes_when_the_page_freezes_with_the_button_held(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    press(page)
    wait_for(lambda: speed(demo, winch) > 10, 3, "it does not turn")
    # its socket stays open, its lease has three seconds to live: the server ends the run after half a second
    page.evaluate("setTimeout(() => { const end = Date.now() + 2000; while (Date.now() < end); }, 0)")
    wait_for(lambda: raw(demo, winch, "command_speed") == 0, 1.9, "a page that hangs keeps a servo turning")
    assert demo.api.get("/leases").json() != [], "the lease had ended, not the run"
    wait_for(lambda: speed(demo, winch) < 3, 1, "it turns on")
    page.mouse.up()
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "false")
    assert speed(demo, winch) < 3


def test_a_held_key_runs_and_key_repeats_are_ignored(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    page.get_by_test_id("hold-ccw").focus()
    page.keyboard.down("ArrowLeft")
    for _ in range(10):
        page.keyboard.down("ArrowLeft")  # what a held key repeats
        time.sleep(0.08)
    assert raw(demo, winch, "command_speed") == -30
    assert speed(demo, winch) > 10
    page.keyboard.up("ArrowLeft")
    wait_for(lambda: speed(demo, winch) < 3, 2, "it turns on")
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "true")
    page.keyboard.press("Escape")
    wait_for(lambda: raw(demo, winch, "torque_mode") == "off", 2, "Esc is Stop")
    page.keyboard.up("Enter")


def test_speed_control_off_is_shown_with_a_link_to_the_row(page: Page, demo: Demo, winch: str) -> None:
    row = f"/servos/{winch}/parameters/speed_torque_control"
    demo.api.put(row, json={"value": False}).raise_for_status()
    try:
        begin(page, demo, winch, "Torque")
        expect(page.get_by_test_id("hold-no-effect")).to_contain_text("No effect now")
        page.get_by_role("link", name="Go to 0x25").click()
        assert page.url.endswith("/parameters#speed_torque_control")
    finally:
        wait_for(lambda: demo.api.get("/leases").json() == [], 6, "motion control was not given back")
        demo.api.put(row, json={"value": True}).raise_for_status()


def begin_group(page: Page, demo: Demo, pair: tuple[str, str]) -> None:
    page.goto(f"{demo.url}servos/{pair[0]}/motion")
    page.get_by_test_id("group").locator("summary").click()
    page.get_by_test_id(f"group-{pair[1]}").check()
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("members")).to_be_visible()
    band = page.get_by_test_id("motion-band")
    expect(band).to_contain_text("Winch")
    expect(band).to_contain_text("Boom")


def turn(demo: Demo, uid: str, degrees: float) -> None:
    """Turn the horn externally, with torque off."""
    demo.api.post(f"/servos/{uid}/torque", json={"mode": "off"}).raise_for_status()
    demo.api.patch(f"/sim/servos/{uid}", json={"external_angle_deg": degrees}).raise_for_status()
    wait_for(lambda: abs(angle(demo, uid) - degrees) < 1, 5, "it was not turned")


def test_a_group_moves_together_or_with_offsets_and_ends(
    page: Page, demo: Demo, pair: tuple[str, str], winch: str
) -> None:
    turn(demo, winch, 0)
    begin_group(page, demo, pair)
    page.get_by_test_id("jog-value").fill("24")
    page.get_by_test_id("jog-go").click()
    for uid in pair:
        wait_for(lambda uid=uid: abs(angle(demo, uid) - 24) < 1.5, 6, f"{uid} did not go there")
    assert complaints(page) == []

    # one is turned externally meanwhile; the new offset is kept
    page.get_by_test_id("disable-motion").click()
    wait_for(lambda: demo.api.get("/leases").json() == [], 6, "motion control was not given back")
    assert [raw(demo, uid, "torque_mode") for uid in pair] == ["off", "off"]
    turn(demo, pair[1], -10)
    begin_group(page, demo, pair)
    page.get_by_role("button", name="Keep offsets").click()
    apart = angle(demo, pair[1]) - angle(demo, pair[0])
    page.get_by_test_id("jog-step-10").click()
    wait_for(lambda: abs(angle(demo, pair[0]) - 34) < 2.5, 6, "the first did not go")
    wait_for(lambda: abs(angle(demo, pair[1]) - angle(demo, pair[0]) - apart) < 2, 6, "the distance is lost")

    # one that falls silent is named, and the others go nowhere
    demo.api.patch(f"/sim/servos/{pair[1]}", json={"power": "off"})
    expect(page.get_by_test_id("group-ended")).to_contain_text("Boom", timeout=10_000)
    expect(page.get_by_test_id("jog-refusal")).to_contain_text("Boom")
    expect(page.get_by_text("/api/v1"), "advice to programs").to_have_count(0)
    expect(page.get_by_test_id("jog-step--10")).to_be_disabled()
    demo.api.patch(f"/sim/servos/{pair[1]}", json={"power": "on"})
    wait_for(lambda: state(demo, pair[1]) == "ready", 25, "it did not come back")
    page.get_by_test_id("group-again").click()
    expect(page.get_by_test_id("group-ended")).to_have_count(0)
    page.get_by_test_id("jog-step--10").click()
    wait_for(lambda: abs(angle(demo, pair[0]) - 24) < 2.5, 6, "they do not go together again")
    page.get_by_test_id("disable-motion").click()
    wait_for(lambda: [raw(demo, uid, "torque_mode") for uid in pair] == ["off", "off"], 3, "torque stayed on")


def respond(demo: Demo, uid: str, does: bool) -> None:
    """Drop the servo's responses, or not; it receives and sends everything else."""
    demo.api.patch(f"/sim/servos/{uid}", json={"drop_responses_pct": 0 if does else 100}).raise_for_status()


@pytest.fixture
def without_response(page: Page, watched: Watched) -> Iterator[None]:
    """Chromium logs every response above 399 as a failed load; these tests cause 504."""
    yield
    page.goto("about:blank")
    watched.complaints[:] = [one for one in watched.complaints if "status of 504" not in one]


def silent_named(page: Page, silent: str, others: str) -> None:
    """The other servos are shown as off; the silent one is named, and not as off."""
    expect(page.get_by_test_id("torque-is-off")).to_contain_text(others, timeout=10_000)
    expect(page.get_by_test_id("silent-band")).to_contain_text(f"No response: {silent}.", timeout=15_000)
    expect(page.get_by_test_id("silent-band")).not_to_contain_text(others)
    expect(page.get_by_test_id("torque-is-off")).not_to_contain_text(silent)
    expect(page.get_by_test_id("motion-band")).to_have_count(0)


def all_known(page: Page, *names: str) -> None:
    """The silent servo has responded: the page shows it automatically."""
    expect(page.get_by_test_id("silent-band")).to_have_count(0, timeout=15_000)
    for name in names:
        expect(page.get_by_test_id("torque-is-off")).to_contain_text(name)


@pytest.mark.usefixtures("without_response")
def test_a_group_member_silent_at_enabling_is_named(page: Page, demo: Demo, pair: tuple[str, str], winch: str) -> None:
    page.goto(f"{demo.url}servos/{winch}/motion")
    page.get_by_test_id("group").locator("summary").click()
    page.get_by_test_id(f"group-{pair[1]}").check()
    respond(demo, pair[1], False)
    try:
        page.get_by_test_id("enable-motion").click()
        expect(page.get_by_test_id("motion-refusal")).to_contain_text("Boom", timeout=15_000)
        silent_named(page, "Boom", "Winch")
        assert raw(demo, winch, "torque_mode") == "off"
        assert demo.api.get("/leases").json() == []
        # on another page it is no less true
        page.get_by_role("link", name="Records").first.click()
        expect(page.get_by_test_id("silent-band")).to_contain_text("Boom")
    finally:
        respond(demo, pair[1], True)
    expect(page.get_by_test_id("silent-band")).to_have_count(0, timeout=15_000)
    assert [raw(demo, uid, "torque_mode") for uid in pair] == ["off", "off"]


@pytest.mark.usefixtures("without_response")
def test_a_group_member_silent_at_torque_off_is_named(
    page: Page, demo: Demo, pair: tuple[str, str], winch: str
) -> None:
    turn(demo, winch, 0)
    begin_group(page, demo, pair)
    respond(demo, pair[1], False)
    try:
        page.get_by_test_id("jog-torque-off").click()
        expect(page.get_by_test_id("jog-refusal")).to_contain_text("Boom", timeout=15_000)
        expect(page.get_by_test_id("silent-band")).to_contain_text("No response: Boom.")
        assert raw(demo, winch, "torque_mode") == "off"
        page.get_by_test_id("disable-motion").click()
        silent_named(page, "Boom", "Winch")
    finally:
        respond(demo, pair[1], True)
    all_known(page, "Winch", "Boom")
    assert [raw(demo, uid, "torque_mode") for uid in pair] == ["off", "off"]


def sweep(page: Page, demo: Demo, uid: str, count: str) -> None:
    turn(demo, uid, 0)
    begin(page, demo, uid, "Sweep")
    for key, value in {"from": "-20", "to": "20", "speed": "120", "pause": "0", "count": count}.items():
        page.get_by_test_id(f"sweep-{key}").fill(value)
    expect(page.get_by_test_id("sweep-moves")).to_contain_text("Limits")
    expect(page.get_by_test_id("sweep-start")).to_be_disabled()
    page.get_by_test_id("sweep-free").check()
    page.get_by_test_id("sweep-start").click()
    expect(page.get_by_test_id("sweep-progress")).to_contain_text(f"of {count}")


def test_a_sweep_counts_cycles_and_completes(page: Page, demo: Demo, winch: str) -> None:
    sweep(page, demo, winch, "2")
    expect(page.get_by_test_id("sweep-progress")).to_contain_text("1 of 2", timeout=10_000)
    expect(page.get_by_test_id("sweep-result")).to_contain_text("complete: 2 cycles", timeout=10_000)
    assert abs(angle(demo, winch) + 20) < 2
    page.get_by_test_id("sweep-to").fill("400")
    expect(page.get_by_test_id("sweep-against")).to_be_visible()
    expect(page.get_by_test_id("sweep-start")).to_be_disabled()


def still(demo: Demo, uid: str) -> bool:
    before = angle(demo, uid)
    time.sleep(1.0)
    return abs(angle(demo, uid) - before) < 1.5


@pytest.mark.parametrize("end", ["Esc", "leaving", "closing", "button"])
def test_a_sweep_ends_with_esc_or_the_page(end: str, page: Page, demo: Demo, winch: str) -> None:
    sweep(page, demo, winch, "100")
    time.sleep(1)
    if end == "Esc":
        page.keyboard.press("Escape")
    elif end == "leaving":
        page.get_by_role("link", name="Records").click()
    elif end == "closing":
        page.goto("about:blank")
    else:
        page.get_by_test_id("sweep-end").click()
        expect(page.get_by_test_id("sweep-result")).to_contain_text("The horn holds its position")
        time.sleep(0.7)
        wait_for(lambda: still(demo, winch), 6, "it goes on")
        assert raw(demo, winch, "torque_mode") == "on"
        return
    wait_for(lambda: raw(demo, winch, "torque_mode") == "off", 4, "torque stayed on")
    wait_for(lambda: still(demo, winch), 6, "it goes on")


def test_the_dial_works_by_keyboard_without_scrolling(page: Page, demo: Demo, winch: str) -> None:
    turn(demo, winch, 0)
    page.set_viewport_size(WIDE)
    page.goto(f"{demo.url}servos/{winch}/motion")
    expect(page.get_by_text(re.compile(r"^Live, "))).to_be_visible()  # the renderer has begun, which takes it seconds
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("jog-pad")).to_be_visible()
    dial = page.get_by_role("slider")
    expect(dial).to_be_focused()
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowRight")
    expect(dial).to_have_attribute("aria-valuenow", "11")
    wait_for(lambda: abs(angle(demo, winch) - 11) < 1, 4, "the arrows did not move it")
    page.keyboard.press("0")
    expect(dial).to_have_attribute("aria-valuenow", "0")
    for size in (WIDE, TABLET):
        page.set_viewport_size(size)
        for tab in ("Speed", "Torque", "Sweep", "Angle"):
            page.get_by_role("button", name=tab, exact=True).click()
            page.wait_for_timeout(150)
            assert page.evaluate(CUT) == [], f"{tab} at {size}"
            assert complaints(page) == []
            if size is TABLET:
                assert too_small(page) == []


PHONE: ViewportSize = {"width": 390, "height": 844}
LARGE: ViewportSize = {"width": 1920, "height": 1080}

FRAME = """() => ['.jog-dial', '.figures', '.jog-side > .segments', '.jog-torque'].map(one => {
  const { x, y, width, height } = document.querySelector(one).getBoundingClientRect();
  return [one, x, y, width, height].join(' ');
})"""
"""Elements that must not move or resize, whatever is commanded."""


AT_ZERO = re.compile(r"^[+−]?0\.\d°$")


@pytest.mark.parametrize(("size", "least"), [(PHONE, 200), (TABLET, 300), (WIDE, 360), (LARGE, 600)])
def test_the_layout_does_not_move_with_commands_or_torque(
    size: ViewportSize, least: int, page: Page, demo: Demo, winch: str
) -> None:
    page.set_viewport_size(size)
    begin(page, demo, winch)
    before = page.evaluate(FRAME)
    for tab in ("Speed", "Torque", "Sweep", "Angle"):
        page.get_by_role("button", name=tab, exact=True).click()
        page.wait_for_timeout(100)
        assert page.evaluate(FRAME) == before, tab
    page.get_by_test_id("jog-torque-off").click()
    expect(page.get_by_test_id("jog-torque-on")).to_be_visible()
    assert page.evaluate(FRAME) == before, "torque off"
    dial = page.get_by_test_id("jog-dial").bounding_box()
    assert dial is not None
    assert min(dial["width"], dial["height"]) >= least


def test_presets_are_stored_confirmed_applied_and_survive_a_reload(
    page: Page, demo: Demo, winch: str, pair: tuple[str, str]
) -> None:
    turn(demo, winch, 25)
    page.set_viewport_size(WIDE)
    begin(page, demo, winch)
    expect(page.get_by_test_id("jog-angle")).to_have_text(re.compile(r"^\+2[45]\.\d°$"))
    page.get_by_test_id("preset-a").click()
    stored = re.compile(r"^A \+2[45]\.\d°$")
    expect(page.get_by_test_id("preset-a")).to_have_text(stored)
    assert abs(angle(demo, winch) - 25) < 1, "storing moves nothing"
    page.get_by_test_id("jog-zero").click()
    wait_for(lambda: abs(angle(demo, winch)) < 1, 6, "it did not go to 0°")
    expect(page.get_by_test_id("jog-angle")).to_have_text(AT_ZERO)
    # another one is not lost without a question
    page.get_by_test_id("preset-a-store").click()
    expect(page.get_by_test_id("preset-dialog")).to_contain_text("Nothing moves")
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_test_id("preset-a")).to_have_text(stored)
    page.get_by_test_id("preset-a").click()
    wait_for(lambda: abs(angle(demo, winch) - 25) < 1, 6, "it did not go to A")
    page.reload()
    expect(page.get_by_test_id("preset-a"), "only under motion control").to_have_count(0)
    assert raw(demo, winch, "torque_mode") == "off"
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("preset-a")).to_have_text(stored)
    page.goto(f"{demo.url}servos/{pair[1]}/motion")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("preset-a"), "another servo has its own").to_contain_text("Set")


def test_touch_steps_repeats_and_stores_presets(browser: Browser, demo: Demo, winch: str) -> None:
    turn(demo, winch, 0)
    with page_in(browser, PHONE, has_touch=True) as page:
        page.goto(f"{demo.url}servos/{winch}/motion")
        page.get_by_test_id("enable-motion").tap()
        ahead = page.get_by_test_id("walk-cw")
        box = ahead.bounding_box()
        assert box is not None
        assert box["height"] >= 120
        assert box["y"] > 844 / 2, "in the lower half"
        page.get_by_role("button", name="10°", exact=True).tap()
        ahead.tap()
        wait_for(lambda: abs(angle(demo, winch) - 10) < 1, 6, "a tap is no step")
        time.sleep(0.5)
        assert abs(angle(demo, winch) - 10) < 1, "one step"

        finger = page.context.new_cdp_session(page)
        spot = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        begun = time.monotonic()
        finger.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [spot]})
        expect(ahead).to_have_attribute("data-held", "true")
        time.sleep(0.8)
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        expect(ahead).to_have_attribute("data-held", "false")
        held_s = time.monotonic() - begun
        wait_for(lambda: still(demo, winch), 4, "it goes on")
        assert 25 < angle(demo, winch) < 25 + 60 * held_s, "it walks at 60°/s, and no further"
        assert raw(demo, winch, "torque_mode") == "on", "it holds"

        # leaving the button releases it, too
        finger.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [spot]})
        expect(ahead).to_have_attribute("data-held", "true")
        away = {"x": spot["x"], "y": spot["y"] - 200}
        finger.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [away]})
        expect(ahead).to_have_attribute("data-held", "false")
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

        wait_for(lambda: still(demo, winch), 4, "it goes on")
        page.get_by_test_id("preset-b").tap()
        stored = page.get_by_test_id("preset-b").inner_text()
        page.get_by_test_id("jog-zero").tap()
        wait_for(lambda: abs(angle(demo, winch)) < 1, 6, "it did not go to 0°")
        expect(page.get_by_test_id("jog-angle")).to_have_text(AT_ZERO)
        held = page.get_by_test_id("preset-b").bounding_box()
        assert held is not None
        spot = {"x": held["x"] + 40, "y": held["y"] + 20}
        finger.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [spot]})
        expect(page.get_by_test_id("preset-dialog")).to_be_visible()
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        assert abs(angle(demo, winch)) < 1, "a long press moves nothing"
        page.get_by_test_id("preset-replace").tap()
        expect(page.get_by_test_id("preset-b")).not_to_have_text(stored)
        assert complaints(page) == []
        assert too_small(page) == []


def test_an_angle_beyond_a_limit_is_rejected(page: Page, demo: Demo, winch: str) -> None:
    demo.api.put(f"/servos/{winch}/parameters/angle_limit_cw", json={"value": 60.0}).raise_for_status()
    begin(page, demo, winch)
    dial = page.get_by_test_id("jog-dial")
    expect(dial).to_be_focused()
    assert dial.evaluate("one => getComputedStyle(one).outlineStyle") == "none", "a box round the dial"
    assert dial.locator(".dial-focus").evaluate("one => getComputedStyle(one).visibility") == "visible"
    places = """() => [...document.querySelectorAll('.jog-dial, .jog button, .jog input')]
        .map(one => one.getBoundingClientRect().toJSON())"""
    before = page.evaluate(places)
    page.get_by_test_id("jog-value").fill("400")
    page.get_by_test_id("jog-value").press("Enter")
    said = page.get_by_test_id("jog-refusal")
    expect(said).to_contain_text("+400.0° is beyond the CW angle limit of +60.0° (0x38).")
    expect(page.get_by_test_id("jog-value")).to_be_focused()
    assert page.evaluate(places) == before, "the layout moved"
    assert page.evaluate(CUT) == []
    page.get_by_test_id("change-limit").click()
    expect(page).to_have_url(re.compile(f"/servos/{winch}/parameters#angle_limit_cw$"))
    wait_for(lambda: demo.api.get("/leases").json() == [], 10, "the page still has motion control")
    demo.api.put(f"/servos/{winch}/parameters/angle_limit_cw", json={"value": 179.9}).raise_for_status()


CUT = """() => {
  const main = document.querySelector('.motion-main');
  const seen = main.getBoundingClientRect();
  return [...main.querySelectorAll('button, input')].filter(each => {
    const box = each.getBoundingClientRect();
    return box.width > 0 && (box.bottom > seen.bottom + 0.5 || box.top < seen.top - 0.5);
  }).map(each => each.textContent || each.dataset.testid);
}"""
"""Controls of the pad that need scrolling."""
