"""Stop in every window: fully visible from 320 px on, in any orientation and zoom; and the keys that stop."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.cases import cases
from e2e.contexts import page_in
from e2e.looks import complaints, too_small
from e2e.servers import Demo
from e2e.state import latched, no_lease, servo_of, sim, wait_for
from e2e.steps import box, chord, drawn, motion_on

WINDOWS: dict[str, tuple[int, int]] = {
    "small phone": (320, 568),
    "small phone on its side": (568, 320),
    "phone": (390, 844),
    "phone on its side": (844, 390),
    "half of a tablet": (507, 1180),
    "where it used to be outside": (631, 800),
    "small window": (640, 480),
    "last of the narrow ones": (767, 1024),
    "tablet": (820, 1180),
    "tablet on its side": (1180, 820),
    "laptop": (1440, 900),
    "laptop at 200 %": (720, 450),
    "laptop at 400 %": (360, 225),
    "wide": (1920, 1080),
}

SEEN = """() => {
  const stop = document.querySelector('[data-testid=stop]');
  const box = stop.getBoundingClientRect();
  const view = visualViewport;
  const [left, top] = [view.offsetLeft, view.offsetTop];
  const inside = box.left >= left - 1 && box.top >= top - 1
    && box.right <= left + view.width + 1 && box.bottom <= top + view.height + 1;
  const points = [[.02, .06], [.98, .06], [.5, .5], [.02, .94], [.98, .94]];
  const hit = points.every(([x, y]) =>
    stop.contains(document.elementFromPoint(box.left + x * box.width, box.top + y * box.height)));
  return { inside, hit, width: box.width * view.scale, height: box.height * view.scale,
    cut: stop.scrollWidth > stop.clientWidth };
}"""
"""Stop and the visible part of the page: inside it, uncovered at its corners, its text complete, its size."""

BEYOND = """() => { const { scrollWidth, scrollHeight } = document.scrollingElement;
  return [scrollWidth - innerWidth, scrollHeight - innerHeight]; }"""
"""How far a script or the focus could scroll the window with Stop, px."""


def stop_is_seen(page: Page, where: str) -> None:
    def seen() -> bool:
        found.update(page.evaluate(SEEN))
        complete = (found["inside"], found["hit"], found["cut"]) == (True, True, False)
        return complete and found["width"] >= 170 and found["height"] >= 55

    found: dict[str, Any] = {"where": where}
    wait_for(seen, f"{found}")


@pytest.fixture
def stops(demo: Demo) -> Iterator[None]:
    """No client has motion control and nothing is stopped, before and after."""
    yield
    no_lease(demo)
    demo.api.delete("/stop").raise_for_status()


@pytest.mark.parametrize("language", cases(("en", "ja"), usual=("en",)))
def test_stop_is_fully_visible_on_every_page_and_window(language: str, browser: Browser, demo: Demo) -> None:
    with page_in(browser, has_touch=True) as page:
        page.add_init_script(f"localStorage.setItem('hornbill.language', '{language}')")
        for path in ("servos", f"servos/{servo_of(demo, 'BLA21-12U-A0')}/parameters", "bus"):
            page.goto(demo.url + path)
            expect(page.get_by_test_id("stop")).to_be_visible()
            for window, (width, height) in WINDOWS.items():
                page.set_viewport_size({"width": width, "height": height})
                drawn(page)
                stop_is_seen(page, f"{path}, {window}")


@pytest.mark.usefixtures("stops")
@pytest.mark.parametrize(
    ("language", "windows"),
    [("en", tuple(WINDOWS)), pytest.param("ja", ("small phone", "tablet", "laptop"), marks=pytest.mark.release)],
)
def test_stop_is_fully_visible_while_motion_is_on_and_works_by_touch(
    language: str, windows: tuple[str, ...], browser: Browser, demo: Demo
) -> None:
    with page_in(browser, has_touch=True) as page:
        page.add_init_script(f"localStorage.setItem('hornbill.language', '{language}')")
        page.goto(f"{demo.url}servos/{servo_of(demo, 'BLA21-12U-A0')}/motion")
        for window in windows:
            width, height = WINDOWS[window]
            page.set_viewport_size({"width": width, "height": height})
            drawn(page)
            stops_at_a_touch(page, demo, window)


def stops_at_a_touch(page: Page, demo: Demo, window: str) -> None:
    expect(page.get_by_test_id("stop")).to_be_visible()
    stop_is_seen(page, f"{window}: at rest")
    page.get_by_test_id("enable-motion").tap()
    expect(page.get_by_test_id("motion-band")).to_be_visible()
    stop_is_seen(page, f"{window}: motion")
    page.get_by_test_id("jog-zero").scroll_into_view_if_needed()
    stop_is_seen(page, f"{window}: scrolled")
    assert page.evaluate(BEYOND) == [0, 0], f"{window}: the window itself can be scrolled"
    page.get_by_test_id("stop").tap()
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    stop_is_seen(page, f"{window}: stopped")
    assert latched(demo)
    page.get_by_test_id("clear-stop").tap()
    expect(page.get_by_test_id("clear-dialog")).to_be_visible()
    stop_is_seen(page, f"{window}: under a dialog")
    page.get_by_test_id("confirm-clear").tap()
    expect(page.get_by_test_id("stop-band")).to_have_count(0)


@pytest.mark.usefixtures("stops")
def test_stop_stays_visible_when_the_page_is_zoomed(browser: Browser, demo: Demo) -> None:
    with page_in(browser, {"width": 390, "height": 844}, has_touch=True, is_mobile=True) as page:
        uid = servo_of(demo, "BLA21-12U-A0")
        motion_on(page, demo, uid)
        devtools = page.context.new_cdp_session(page)
        for scale in (2.0, 4.0):
            devtools.send("Emulation.setPageScaleFactor", {"pageScaleFactor": scale})
            wait_for(lambda scale=scale: page.evaluate("visualViewport.scale") > 0.95 * scale, "it was not enlarged")
            stop_is_seen(page, f"enlarged {scale:g} times")
            page.wait_for_timeout(700)  # longer than Stop may be hidden
            expect(page.get_by_test_id("motion-band")).to_have_count(1)


@pytest.mark.usefixtures("stops")
def test_motion_needs_a_fully_visible_stop(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    page.goto(f"{demo.url}servos/{uid}/motion")
    expect(page.get_by_test_id("enable-motion")).to_be_enabled()
    page.set_viewport_size({"width": 390, "height": 40})
    expect(page.get_by_test_id("enable-motion")).to_be_disabled()
    expect(page.get_by_test_id("motion-hindrance")).to_contain_text("Stop is not fully visible in this window.")
    expect(page.get_by_test_id("motion-hindrance")).to_contain_text("Enlarge the window or zoom out")
    page.set_viewport_size({"width": 390, "height": 844})
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("motion-band")).to_be_visible()
    page.set_viewport_size({"width": 390, "height": 40})
    expect(page.get_by_test_id("motion-band")).to_have_count(0)
    page.set_viewport_size({"width": 390, "height": 844})
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("Stop was no longer fully visible")
    mode = f"/servos/{uid}/parameters/torque_mode"
    wait_for(lambda: demo.api.get(mode).json()["value"] == "off", "torque stayed on")


@pytest.mark.usefixtures("stops")
@pytest.mark.parametrize("theme", cases(("light", "dark"), usual=("light",)))
def test_a_phone_shows_motion_without_scrolling_with_large_targets(theme: str, browser: Browser, demo: Demo) -> None:
    with page_in(browser, {"width": 390, "height": 844}, has_touch=True) as page:
        page.add_init_script(f"localStorage.setItem('hornbill.theme', '{theme}')")
        uid = servo_of(demo, "BLA21-12U-A0")
        page.goto(demo.url + "servos")
        expect(page.locator(".servo-row").nth(2)).to_be_visible()
        assert complaints(page) == []
        assert too_small(page) == []
        page.goto(f"{demo.url}servos/{uid}/motion")
        page.get_by_test_id("enable-motion").tap()
        for testid in ("walk-ccw", "walk-cw", "preset-a", "jog-zero", "jog-torque-off", "disable-motion"):
            expect(page.get_by_test_id(testid)).to_be_in_viewport(ratio=1)
        assert complaints(page) == []
        assert too_small(page) == []
        assert box(page.get_by_test_id("stop")) == {"x": 0, "y": 0, "width": 390, "height": 72}
        # under Stop, only what goes the same way may be pressed
        under = "document.elementFromPoint(%d, 100).closest('button, a')?.dataset.testid"
        assert {page.evaluate(under % x) for x in range(5, 390, 20)} <= {None, "disable-motion"}


def test_stop_has_the_first_tab_stop(page: Page, demo: Demo) -> None:
    page.goto(demo.url)
    expect(page.locator(".servo-row").nth(2)).to_be_visible()
    page.keyboard.press("Tab")  # to the content
    page.keyboard.press("Tab")
    expect(page.get_by_test_id("stop")).to_be_focused()


ARMED = """() => {
    window.armed = 0;
    const stop = document.querySelector('[data-testid=stop]');
    new MutationObserver(() => { if (stop.textContent.includes('again')) window.armed += 1; })
        .observe(stop, { subtree: true, childList: true, characterData: true });
}"""
"""Count how often Stop has said that a second Esc stops."""


def esc_once(page: Page) -> None:
    """Press Esc, which arms Stop for a second, and wait until that is over."""
    before = page.evaluate("() => window.armed")
    page.keyboard.press("Escape")
    page.wait_for_function("before => window.armed > before", arg=before)
    expect(page.get_by_test_id("stop")).to_contain_text("Esc twice")


@pytest.mark.usefixtures("stops")
def test_esc_closes_at_rest_and_stops_when_pressed_twice(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    page.goto(f"{demo.url}servos/{uid}/parameters#angle_limit_cw")
    expect(page.get_by_test_id("stop")).to_contain_text("Esc twice")
    page.evaluate(ARMED)
    field = page.get_by_test_id("input-angle_limit_cw")
    expect(field).not_to_have_value("")
    before = field.input_value()
    field.fill("55")
    expect(page.get_by_test_id("apply-save")).to_be_enabled()
    page.keyboard.press("Control+s")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    esc_once(page)
    expect(dialog).to_have_count(0)
    field.focus()
    field.fill("56")
    esc_once(page)
    expect(field, "what was typed is taken back").not_to_have_value("56")
    page.locator("main").focus()
    page.keyboard.press("/")
    page.keyboard.type("gain")
    esc_once(page)
    expect(page.get_by_role("searchbox")).to_have_value("")
    expect(page.locator("main")).to_be_focused()
    assert latched(demo) is False
    chord(page, "Escape", "Escape")
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    assert latched(demo)
    page.get_by_test_id("discard").click()
    expect(field).to_have_value(before)


@pytest.mark.usefixtures("stops")
def test_space_stops_only_while_motion_is_on(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    page.goto(f"{demo.url}servos/{uid}/motion")
    expect(page.get_by_test_id("enable-motion")).to_be_enabled()
    page.locator("main").focus()
    page.keyboard.press("Space")
    assert latched(demo) is False
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("stop")).to_contain_text("Esc or Space")
    page.get_by_role("slider").focus()
    page.keyboard.press("Space")
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    assert latched(demo)


@pytest.mark.usefixtures("stops")
def test_esc_stops_at_once_in_any_tab_while_a_horn_moves(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    page.goto(f"{demo.url}servos")
    expect(page.get_by_test_id("stop")).to_contain_text("Esc twice")
    page.get_by_role("searchbox").focus()
    lease = demo.api.post("/leases", json={"holder": "Rig 3", "ttl_s": 60}).json()["id"]
    expect(page.get_by_test_id("stop")).not_to_contain_text("twice")
    page.keyboard.press("Escape")
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    assert latched(demo)
    demo.api.delete(f"/leases/{lease}")
    demo.api.delete("/stop").raise_for_status()
    expect(page.get_by_test_id("stop")).to_contain_text("Esc twice")
    # no motion control, but it turns: externally, by its PWM input, by another program
    demo.api.post(f"/servos/{uid}/torque", json={"mode": "off"}).raise_for_status()

    def turned() -> bool:
        for angle in (40, 0):
            sim(demo, uid, external_angle_deg=angle)
            page.wait_for_timeout(200)
        return "twice" not in page.get_by_test_id("stop").inner_text()

    wait_for(turned, "a horn that turns is not noticed")
    sim(demo, uid, external_angle_deg=0)


@pytest.mark.usefixtures("stops")
@pytest.mark.parametrize("motion", [False, True], ids=["at rest", "with motion on"])
def test_esc_and_enter_of_an_input_method_are_ignored(motion: bool, page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    name = demo.api.get(f"/servos/{uid}").json()["label"]
    if motion:
        motion_on(page, demo, uid)
        field = page.get_by_test_id("jog-value")
    else:
        page.goto(demo.url + "servos")
        page.get_by_test_id(f"rename-{uid}").click()
        field = page.get_by_test_id(f"nickname-{uid}")
    field.fill("")
    devtools = page.context.new_cdp_session(page)

    def key_event(kind: str, key: str, code: int) -> None:
        event = {"type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code}
        devtools.send("Input.dispatchKeyEvent", event)

    for key, code in (("Escape", 27), ("Enter", 13)):
        compose = {"text": "かぜ", "selectionStart": 2, "selectionEnd": 2}
        devtools.send("Input.imeSetComposition", compose)
        key_event("rawKeyDown", key, code)
        key_event("keyUp", key, code)
        expect(field).to_have_value("かぜ")
        # the last key, as Safari sends it: after the composition, known by its code alone
        devtools.send("Input.imeSetComposition", {"text": "", "selectionStart": 0, "selectionEnd": 0})
        key_event("rawKeyDown", key, 229)
        expect(field).to_be_focused()
    assert latched(demo) is False
    assert demo.api.get(f"/servos/{uid}").json()["label"] == name
    if motion:
        expect(page.get_by_test_id("motion-band")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_test_id("stop-band")).to_be_visible()
