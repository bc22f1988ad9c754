"""The Motion page: hold to run, groups, sweeps, the dial and presets."""

import re
import time
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser, Page, Route, ViewportSize, expect

from e2e.conftest import Watched
from e2e.contexts import page_in
from e2e.looks import complaints, still, too_small
from e2e.servers import Demo
from e2e.state import add, no_lease, read, ready, sim, torque_off, turn, wait_for, write
from e2e.steps import at_rest, box, drawn, jog

WIDE: ViewportSize = {"width": 1440, "height": 900}
TABLET: ViewportSize = {"width": 820, "height": 1180}
"""Without the 3D view, because software rendering could delay heartbeats."""


ROM = {"speed_torque_control": 1, "timeout_action": 0, "soft_start": 0}
"""Rows that permit speed commands and disable the servo's own timeout."""


def made(demo: Demo, label: str, servo_id: int) -> str:
    """A ready servo of this test."""
    (uid,) = add(demo, model="BLA21-12U-A0", servo_id=servo_id, rom=ROM)
    demo.api.patch(f"/servos/{uid}", json={"label": label}).raise_for_status()
    return uid


@pytest.fixture(scope="module")
def pair(demo: Demo) -> Iterator[tuple[str, str]]:
    """Two servos of this file, removed afterwards."""
    both = made(demo, "Winch", 61), made(demo, "Boom", 62)
    yield both
    for uid in both:
        demo.api.delete(f"/sim/servos/{uid}")
    for uid in both:
        wait_for(lambda uid=uid: demo.api.delete(f"/inventory/{uid}").is_success, "it is not gone")


@pytest.fixture
def winch(pair: tuple[str, str], demo: Demo, page: Page) -> Iterator[str]:
    """The first of them; afterwards no client has motion control and nothing runs."""
    page.set_viewport_size(TABLET)
    yield pair[0]
    page.goto(f"{demo.url}records")
    no_lease(demo)
    demo.api.delete("/stop")


def angle(demo: Demo, uid: str) -> float:
    return float(read(demo, uid, "current_angle"))


def stands_at(demo: Demo, uid: str, degrees: float, within: float = 1) -> None:
    wait_for(lambda: abs(angle(demo, uid) - degrees) < within, f"{uid} does not go to {degrees}°")


def stands_still(demo: Demo, uid: str) -> None:
    def still() -> bool:
        before = angle(demo, uid)
        time.sleep(1)
        return abs(angle(demo, uid) - before) < 1.5

    wait_for(still, "the horn goes on")


def speed(demo: Demo, uid: str) -> float:
    return abs(float(read(demo, uid, "current_speed")))


def rests(demo: Demo, uid: str) -> None:
    wait_for(lambda: speed(demo, uid) < 3, "it rotates on")


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
    page.mouse.up()
    page.get_by_test_id("hold-cw").hover()
    page.mouse.down()
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "true")


def rotates(page: Page, demo: Demo, uid: str, hold: Callable[[Page], None] = press, renewals: int = 0) -> None:
    """Hold until the horn rotates and the hold was renewed; again if it was braked, which a busy server may do."""
    page.evaluate("() => { window.sent = []; window.withheld = text => { window.sent.push(text); } }")

    def does() -> bool:
        if page.get_by_test_id("hold").get_attribute("data-running") != "true":
            hold(page)
        renewed = page.evaluate("() => window.sent.filter(text => text.includes('\"renew\":true')).length")
        return renewed > renewals and speed(demo, uid) > 10

    wait_for(does, "it does not rotate")


def released(page: Page) -> None:
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "false")


RELEASES: dict[str, Callable[[Page], None]] = {
    "pointer up": lambda page: page.mouse.up(),
    "lost focus": lambda page: page.evaluate("window.dispatchEvent(new Event('blur'))"),
    "pointer cancelled": lambda page: page.evaluate(
        "window.dispatchEvent(new PointerEvent('pointercancel', {pointerId: 1}))"
    ),
    "lost capture": lambda page: page.evaluate(
        "document.querySelector('[data-testid=hold-cw]').releasePointerCapture(1)"
    ),
    "another key": lambda page: page.keyboard.press("a"),
}


def test_the_button_does_not_move_when_the_choice_of_servos_is_loaded(fresh_page: Page, demo: Demo, winch: str) -> None:
    held: list[Route] = []
    fresh_page.route("**/moves-*.js", lambda route: held.append(route))
    with fresh_page.expect_request("**/moves-*.js"):
        fresh_page.goto(f"{demo.url}servos/{winch}/motion")
    before = at_rest(fresh_page.get_by_test_id("enable-motion"))
    held[0].continue_()
    expect(fresh_page.get_by_test_id("group")).to_be_visible()
    assert at_rest(fresh_page.get_by_test_id("enable-motion")) == before


def test_the_buttons_of_a_hold_can_be_used_once_its_cautions_are_shown(page: Page, demo: Demo, winch: str) -> None:
    held: list[Route] = []
    page.route("**/cautions?*", lambda route: held.append(route))
    with page.expect_request("**/cautions?*"):
        begin(page, demo, winch, "Speed")
    expect(page.get_by_test_id("hold-free")).to_be_disabled()
    held[0].continue_()
    page.get_by_test_id("hold-free").check()
    expect(page.get_by_test_id("hold-said")).to_contain_text("rotates continuously")
    expect(page.get_by_test_id("hold-cw")).to_be_enabled()


def test_speed_runs_while_the_button_is_held_and_brakes_on_release(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    for number, release in enumerate(RELEASES.values()):
        rotates(page, demo, winch, renewals=12 if number == 0 else 0)  # longer than the server waits for the first
        release(page)
        released(page)
        rests(demo, winch)
        if read(demo, winch, "torque_mode") == "off":  # a busy machine did not acknowledge the brake within 0.4 s
            ready_to_hold(page, demo, winch)
            continue
        assert read(demo, winch, "command_speed") == 0, "it is braked"
        last = page.evaluate("() => window.sent.findLast(text => text.includes('\"command\"'))")
        assert '"value":0,' in last, "the server braked it, not the page"
        expect(page.get_by_test_id("motion-band")).to_be_visible()
        page.mouse.up()


def test_a_hidden_tab_ends_a_run_and_motion(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    rotates(page, demo, winch)
    page.evaluate(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )
    torque_off(demo, winch)
    rests(demo, winch)
    expect(page.get_by_test_id("motion-refusal")).to_contain_text("the tab was hidden")


def test_the_server_brakes_when_renewals_stop_with_the_button_held(page: Page, demo: Demo, winch: str) -> None:
    def braked() -> bool:
        """False if a busy machine did not acknowledge the brake within 0.4 s, so that torque went off."""
        ready_to_hold(page, demo, winch)
        rotates(page, demo, winch)
        # its heartbeats go on: the server ends the run, and neither the lease nor torque
        page.evaluate("() => { window.withheld = text => text.includes('\"command\"') }")
        wait_for(
            lambda: read(demo, winch, "command_speed") == 0 or read(demo, winch, "torque_mode") == "off",
            "a silent page keeps a servo rotating",
        )
        assert demo.api.get("/leases").json() != []
        return read(demo, winch, "torque_mode") == "on"

    wait_for(braked, "torque goes off at the end of every hold, instead of the brake")
    rests(demo, winch)
    page.evaluate("() => { window.withheld = null }")
    page.mouse.up()
    released(page)
    rests(demo, winch)


def test_a_held_key_runs_and_key_repeats_are_ignored(page: Page, demo: Demo, winch: str) -> None:
    ready_to_hold(page, demo, winch)
    page.get_by_test_id("hold-ccw").focus()

    def hold(page: Page) -> None:
        page.keyboard.up("ArrowLeft")
        for _ in range(10):  # what a held key repeats
            page.keyboard.down("ArrowLeft")

    rotates(page, demo, winch, hold)
    assert read(demo, winch, "command_speed") == -30
    page.keyboard.up("ArrowLeft")
    rests(demo, winch)
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("hold")).to_have_attribute("data-running", "true")
    page.keyboard.press("Escape")
    torque_off(demo, winch)
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
        no_lease(demo)
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


def test_a_group_moves_together_or_with_offsets_and_ends(
    page: Page, demo: Demo, pair: tuple[str, str], winch: str
) -> None:
    turn(demo, winch, 0)
    begin_group(page, demo, pair)
    jog(page, 24)
    for uid in pair:
        stands_at(demo, uid, 24, 1.5)
    assert complaints(page) == []

    # one is turned externally meanwhile; the new offset is kept
    page.get_by_test_id("disable-motion").click()
    torque_off(demo, *pair)
    no_lease(demo)
    turn(demo, pair[1], -10)
    begin_group(page, demo, pair)
    page.get_by_role("button", name="Keep offsets").click()
    apart = angle(demo, pair[1]) - angle(demo, pair[0])
    page.get_by_test_id("jog-step-10").click()
    stands_at(demo, pair[0], 34, 2.5)
    wait_for(lambda: abs(angle(demo, pair[1]) - angle(demo, pair[0]) - apart) < 2, "the distance is lost")

    # one that falls silent is named, and the others go nowhere
    sim(demo, pair[1], power="off")
    expect(page.get_by_test_id("group-ended")).to_contain_text("Boom")
    expect(page.get_by_test_id("jog-refusal")).to_contain_text("Boom")
    expect(page.get_by_text("/api/v1"), "advice to programs").to_have_count(0)
    expect(page.get_by_test_id("jog-step--10")).to_be_disabled()
    sim(demo, pair[1], power="on")
    ready(demo, pair[1])
    page.get_by_test_id("group-again").click()
    expect(page.get_by_test_id("group-ended")).to_have_count(0)
    page.get_by_test_id("jog-step--10").click()
    stands_at(demo, pair[0], 24, 2.5)
    page.get_by_test_id("disable-motion").click()
    torque_off(demo, *pair)


def respond(demo: Demo, uid: str, does: bool) -> None:
    """Drop the servo's responses, or not; it receives and sends everything else."""
    sim(demo, uid, drop_responses_pct=0 if does else 100)


@pytest.fixture
def without_response(page: Page, watched: Watched) -> Iterator[None]:
    """Chromium logs every response above 399 as a failed load; these tests cause 504."""
    yield
    page.goto("about:blank")
    watched.complaints[:] = [one for one in watched.complaints if "status of 504" not in one]


def silent_named(page: Page, silent: str, others: str) -> None:
    """The other servos are shown as off; the silent one is named, and not as off."""
    expect(page.get_by_test_id("torque-is-off")).to_contain_text(others)
    expect(page.get_by_test_id("silent-band")).to_contain_text(f"No response: {silent}.")
    expect(page.get_by_test_id("silent-band")).not_to_contain_text(others)
    expect(page.get_by_test_id("torque-is-off")).not_to_contain_text(silent)
    expect(page.get_by_test_id("motion-band")).to_have_count(0)


@pytest.mark.usefixtures("without_response")
def test_a_group_member_silent_at_enabling_is_named(page: Page, demo: Demo, pair: tuple[str, str], winch: str) -> None:
    page.goto(f"{demo.url}servos/{winch}/motion")
    page.get_by_test_id("group").locator("summary").click()
    page.get_by_test_id(f"group-{pair[1]}").check()
    respond(demo, pair[1], False)
    try:
        page.get_by_test_id("enable-motion").click()
        expect(page.get_by_test_id("motion-refusal")).to_contain_text("Boom")
        silent_named(page, "Boom", "Winch")
        assert read(demo, winch, "torque_mode") == "off"
        assert demo.api.get("/leases").json() == []
        # on another page it is no less true
        page.get_by_role("link", name="Records").first.click()
        expect(page.get_by_test_id("silent-band")).to_contain_text("Boom")
    finally:
        respond(demo, pair[1], True)
    expect(page.get_by_test_id("silent-band")).to_have_count(0)
    torque_off(demo, *pair)


@pytest.mark.usefixtures("without_response")
def test_a_group_member_silent_at_torque_off_is_named(
    page: Page, demo: Demo, pair: tuple[str, str], winch: str
) -> None:
    turn(demo, winch, 0)
    begin_group(page, demo, pair)
    respond(demo, pair[1], False)
    try:
        page.get_by_test_id("jog-torque-off").click()
        expect(page.get_by_test_id("jog-refusal")).to_contain_text("Boom")
        expect(page.get_by_test_id("silent-band")).to_contain_text("No response: Boom.")
        assert read(demo, winch, "torque_mode") == "off"
        page.get_by_test_id("disable-motion").click()
        silent_named(page, "Boom", "Winch")
    finally:
        respond(demo, pair[1], True)
    expect(page.get_by_test_id("silent-band")).to_have_count(0)
    for name in ("Winch", "Boom"):
        expect(page.get_by_test_id("torque-is-off"), "the page learns that it is off").to_contain_text(name)
    torque_off(demo, *pair)


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


@pytest.mark.release
def test_a_sweep_counts_cycles_and_completes(page: Page, demo: Demo, winch: str) -> None:
    sweep(page, demo, winch, "2")
    expect(page.get_by_test_id("sweep-result")).to_contain_text("complete: 2 cycles")
    assert abs(angle(demo, winch) + 20) < 2
    page.get_by_test_id("sweep-to").fill("400")
    expect(page.get_by_test_id("sweep-against")).to_be_visible()
    expect(page.get_by_test_id("sweep-start")).to_be_disabled()


SWEEP_ENDS: dict[str, Callable[[Page], None]] = {
    "button": lambda page: page.get_by_test_id("sweep-end").click(),
    "Esc": lambda page: page.keyboard.press("Escape"),
    "leaving": lambda page: page.get_by_role("link", name="Records").click(),
    "closing": lambda page: page.goto("about:blank") and None,
}


def test_a_sweep_ends_with_its_button_with_esc_and_with_the_page(page: Page, demo: Demo, winch: str) -> None:
    for name, end in SWEEP_ENDS.items():
        sweep(page, demo, winch, "100")
        wait_for(lambda: abs(angle(demo, winch)) > 5, "it does not move")
        end(page)
        if name == "button":
            expect(page.get_by_test_id("sweep-result")).to_contain_text("The horn holds its position")
            assert read(demo, winch, "torque_mode") == "on"
        else:
            torque_off(demo, winch)
        stands_still(demo, winch)
        page.goto("about:blank")
        no_lease(demo)
        demo.api.delete("/stop")


def test_the_dial_works_by_keyboard_without_scrolling(page: Page, demo: Demo, winch: str) -> None:
    turn(demo, winch, 0)
    page.set_viewport_size(WIDE)
    page.goto(f"{demo.url}servos/{winch}/motion")
    expect(page.get_by_text(re.compile(r"^Live, "))).to_be_visible()  # the renderer has begun, which takes it seconds
    page.get_by_test_id("enable-motion").click()
    dial = page.get_by_role("slider")
    expect(dial).to_be_focused()
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("ArrowRight")
    expect(dial).to_have_attribute("aria-valuenow", "11")
    stands_at(demo, winch, 11)
    page.keyboard.press("0")
    expect(dial).to_have_attribute("aria-valuenow", "0")
    for size in (WIDE, TABLET):
        page.set_viewport_size(size)
        for tab in ("Speed", "Torque", "Sweep", "Angle"):
            page.get_by_role("button", name=tab, exact=True).click()
            drawn(page)
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


@pytest.mark.parametrize(
    ("size", "least"),
    [
        pytest.param(PHONE, 200, marks=pytest.mark.release),
        (TABLET, 300),
        (WIDE, 360),
        pytest.param(LARGE, 600, marks=pytest.mark.release),
    ],
)
def test_the_layout_does_not_move_with_commands_or_torque(
    size: ViewportSize, least: int, page: Page, demo: Demo, winch: str
) -> None:
    page.set_viewport_size(size)
    begin(page, demo, winch)
    before = page.evaluate(FRAME)
    for tab in ("Speed", "Torque", "Sweep", "Angle"):
        page.get_by_role("button", name=tab, exact=True).click()
        drawn(page)
        assert page.evaluate(FRAME) == before, tab
    page.get_by_test_id("jog-torque-off").click()
    expect(page.get_by_test_id("jog-torque-on")).to_be_visible()
    assert page.evaluate(FRAME) == before, "torque off"
    dial = box(page.get_by_test_id("jog-dial"))
    assert min(dial["width"], dial["height"]) >= least


@pytest.mark.release
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
    stands_at(demo, winch, 0)
    expect(page.get_by_test_id("jog-angle")).to_have_text(AT_ZERO)
    # another one is not lost without a question
    page.get_by_test_id("preset-a-store").click()
    expect(page.get_by_test_id("preset-dialog")).to_contain_text("Nothing moves")
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_test_id("preset-a")).to_have_text(stored)
    page.get_by_test_id("preset-a").click()
    stands_at(demo, winch, 25)
    page.reload()
    expect(page.get_by_test_id("preset-a"), "only under motion control").to_have_count(0)
    assert read(demo, winch, "torque_mode") == "off"
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("preset-a")).to_have_text(stored)
    page.goto(f"{demo.url}servos/{pair[1]}/motion")
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("preset-a"), "another servo has its own").to_contain_text("Set")


def test_touch_steps_repeats_and_stores_presets(browser: Browser, demo: Demo, winch: str) -> None:
    turn(demo, winch, 0)
    write(demo, winch, "angle_limit_cw", 170.0)  # a busy machine lets it walk further
    with page_in(browser, PHONE, has_touch=True) as page:
        page.goto(f"{demo.url}servos/{winch}/motion")
        page.get_by_test_id("enable-motion").tap()
        ahead, preset = page.get_by_test_id("walk-cw"), page.get_by_test_id("preset-b")
        at = box(ahead)
        assert at["height"] >= 120
        assert at["y"] > 844 / 2, "in the lower half"
        page.get_by_role("button", name="10°", exact=True).tap()
        ahead.tap()
        stands_at(demo, winch, 10)
        stands_still(demo, winch)
        stands_at(demo, winch, 10)  # one step

        finger = page.context.new_cdp_session(page)

        def touch(kind: str, x: float = 0, y: float = 0) -> None:
            points = [] if kind == "touchEnd" else [{"x": x, "y": y}]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
        begun = time.monotonic()
        touch("touchStart", x, y)
        expect(ahead).to_have_attribute("data-held", "true")
        wait_for(lambda: angle(demo, winch) > 25, "it does not walk")
        touch("touchEnd")
        expect(ahead).to_have_attribute("data-held", "false")
        held_s = time.monotonic() - begun
        stands_still(demo, winch)
        assert angle(demo, winch) < 25 + 60 * held_s, "it walks at 60°/s, and no further"
        assert read(demo, winch, "torque_mode") == "on", "it holds"

        # leaving the button releases it, too
        touch("touchStart", x, y)
        expect(ahead).to_have_attribute("data-held", "true")
        touch("touchMove", x, y - 200)
        expect(ahead).to_have_attribute("data-held", "false")
        touch("touchEnd")

        stands_still(demo, winch)
        preset.tap()
        expect(preset).to_contain_text("°")
        stored = preset.inner_text()
        page.get_by_test_id("jog-zero").tap()
        stands_at(demo, winch, 0)
        expect(page.get_by_test_id("jog-angle")).to_have_text(AT_ZERO)
        at = box(preset)
        touch("touchStart", at["x"] + 40, at["y"] + 20)
        expect(page.get_by_test_id("preset-dialog")).to_be_visible()
        touch("touchEnd")
        assert abs(angle(demo, winch)) < 1, "a long press moves nothing"
        page.get_by_test_id("preset-replace").tap()
        expect(preset).not_to_have_text(stored)
        assert complaints(page) == []
        assert too_small(page) == []
    write(demo, winch, "angle_limit_cw", 60.0)


def test_an_angle_beyond_a_limit_is_rejected(page: Page, demo: Demo, winch: str) -> None:
    write(demo, winch, "angle_limit_cw", 60.0)
    begin(page, demo, winch)
    dial = page.get_by_test_id("jog-dial")
    expect(dial).to_be_focused()
    assert dial.evaluate("one => getComputedStyle(one).outlineStyle") == "none", "a box round the dial"
    assert dial.locator(".dial-focus").evaluate("one => getComputedStyle(one).visibility") == "visible"
    places = """() => [...document.querySelectorAll('.jog-dial, .jog button, .jog input')]
        .map(one => one.getBoundingClientRect().toJSON())"""
    still(page)
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
    no_lease(demo)
    write(demo, winch, "angle_limit_cw", 179.9)


CUT = """() => {
  const main = document.querySelector('.motion-main');
  const seen = main.getBoundingClientRect();
  return [...main.querySelectorAll('button, input')].filter(each => {
    const box = each.getBoundingClientRect();
    return box.width > 0 && (box.bottom > seen.bottom + 0.5 || box.top < seen.top - 0.5);
  }).map(each => each.textContent || each.dataset.testid);
}"""
"""Controls of the pad that need scrolling."""
