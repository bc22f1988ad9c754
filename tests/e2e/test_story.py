"""A technician's session: six factory-new servos on a tablet without instructions, then by keyboard alone."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.contexts import page_in
from e2e.hand import TABLET
from e2e.looks import complaints, too_small
from e2e.servers import Server, running, serving
from e2e.state import no_lease, row, servo, wait_for
from e2e.steps import JOB_MS, box, chord, horn_is_free, jog

NAMES = tuple(f"Flap {number}" for number in range(1, 7))
PROFILE = "Flaps"
LIMIT = 40.0
STOP_GAP = 12
GLOVE = 56


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """A bus without servos, and the rig's profile."""
    with running(*serving(tmp_path, "--sim-api")) as one:
        values = {"angle_limit_cw": LIMIT, "angle_limit_ccw": -LIMIT}
        body = {"values": values, "model": "BLA21-06U-A0", "description": "limits of the rig"}
        one.api.put(f"/profiles/{PROFILE}", json=body).raise_for_status()
        yield one


def from_the_bag(server: Server, number: int) -> list[str]:
    """Add factory-new servos. Returns their UIDs."""
    body = {"model": "BLA21-06U-A0", "firmware": "1.300"}
    return [server.api.post("/sim/servos", json=body).json()["uid"] for _ in range(number)]


def commissioned(server: Server, uids: list[str], names: tuple[str, ...]) -> None:
    """Each servo has its own ID, a name, and the profile's limits in ROM."""
    found = [server.api.get(f"/servos/{uid}").json() for uid in uids]
    assert sorted(one["label"] for one in found) == sorted(names)
    ids = [one["servo_id"] for one in found]
    assert len(set(ids)) == len(uids)
    assert 0 not in ids
    for uid in uids:
        rows = server.api.get(f"/servos/{uid}/parameters").json()["parameters"]
        assert (rows["angle_limit_cw"]["rom"], rows["angle_limit_ccw"]["rom"]) == (LIMIT, -LIMIT)


@pytest.mark.release
def test_six_new_servos_are_commissioned_by_touch(browser: Browser, server: Server) -> None:
    with page_in(browser, TABLET, has_touch=True) as page:
        six_servos(page, server)


def gloves(page: Page) -> None:
    """Buttons are large enough for gloves, and none is near Stop."""
    stop = box(page.get_by_test_id("stop"))
    for name in ("wiggle", "skip", "give", "servo-id", "label"):
        at = box(page.get_by_test_id(name))
        assert at["height"] >= GLOVE - 2, f"{name} is {at['height']} px high"
        assert at["y"] > stop["y"] + stop["height"] + STOP_GAP


def six_servos(page: Page, server: Server) -> None:
    errors: list[str] = []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))

    # an empty list that teaches, until servos are plugged in
    page.goto(server.url)
    expect(page.get_by_test_id("no-servos")).to_contain_text("0 frames/s")
    uids = from_the_bag(server, 6)
    expect(page.locator("[data-testid^=servo-row-]")).to_have_count(6)

    # find
    page.get_by_role("link", name="Commission").tap()
    expect(page.get_by_test_id("find-count")).to_contain_text("6")
    expect(page.locator("[data-testid^=pick-] input:checked")).to_have_count(6)
    assert too_small(page) == []
    server.ready(6)
    page.get_by_test_id("find-go").tap()

    # tell apart and name: one wiggles, all get a name and an id; nothing is written on the way
    given: dict[str, tuple[int, str]] = {}
    for place, name in enumerate(NAMES):
        active = page.locator("[data-state=active]")
        uid = (active.get_attribute("data-testid") or "").removeprefix("unit-")
        if place == 0:
            page.get_by_test_id("wiggle").tap()
            expect(page.get_by_test_id("wiggle-says")).to_have_attribute("data-phase", "moved")
            no_lease(server)
            assert too_small(page) == []
            gloves(page)
        page.get_by_test_id("label").fill(name)
        given[uid] = (int(page.get_by_test_id("servo-id").input_value()), name)
        page.get_by_test_id("give").tap()
        expect(page.get_by_test_id(f"unit-{uid}")).to_have_attribute("data-state", "given")
    assert set(given) == set(uids)
    assert [servo(server, uid)["servo_id"] for uid in uids] == [0] * 6
    page.reload()
    expect(page.get_by_test_id("identify-step"), "the draft survives a reload").to_contain_text(NAMES[-1])
    page.get_by_test_id("identify-go").tap()

    # limits by a profile
    page.get_by_test_id(f"profile-{PROFILE}").tap()
    expect(page.get_by_test_id("profile-step")).to_contain_text("40.0°")
    page.get_by_test_id("profile-go").tap()

    # save: what moves is said first
    expect(page.locator('[data-testid^="changes-"]').first).to_be_visible()
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Reading the servo")
    for uid, (number, name) in given.items():
        expect(page.get_by_test_id(f"check-{uid}")).to_contain_text(re.compile(rf"→ {number}\D.*{name}"))
    horn_is_free(page)
    page.get_by_test_id("start").tap()
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", re.compile("run|report"))

    # it goes on without the page, and is found again by another browser
    page.goto(server.url + "servos")
    other = page.context.new_page()
    other.goto(server.url + "commission")
    expect(other.get_by_test_id("commission-page")).to_have_attribute("data-step", re.compile("run|report"))
    other.close()
    page.get_by_role("link", name="Commission").tap()
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "report", timeout=JOB_MS)
    expect(page.locator("[data-verdict=done]")).to_have_count(6)
    commissioned(server, uids, NAMES)
    for uid, (number, name) in given.items():
        expect(page.get_by_test_id(f"run-{uid}")).to_contain_text(name)
        assert (servo(server, uid)["servo_id"], servo(server, uid)["unsaved"]) == (number, [])
        assert row(server, uid, "servo_id")["rom"] == number
    assert complaints(page) == []

    # report
    with page.expect_download() as kept:
        page.get_by_test_id("report-csv").tap()
    table = kept.value.path().read_text(encoding="utf-8")
    assert [name for name in NAMES if name not in table] == []

    # a move to see that it is well
    page.get_by_role("link", name="Servos").first.tap()
    page.locator(f"[data-testid=servo-row-{uids[0]}] a.row-link").tap()
    page.get_by_test_id("servo-tab-motion").tap()
    page.get_by_test_id("enable-motion").tap()
    jog(page, 30)
    wait_for(lambda: abs(server.api.get(f"/sim/servos/{uids[0]}").json()["angle_deg"] - 30) < 1.5, "it does not move")
    page.get_by_test_id("disable-motion").tap()
    no_lease(server)

    assert errors == []


def tab_to(page: Page, testid: str) -> None:
    """Press Tab until the focus is on, or in, the element with this test ID."""
    here = f"""() => {{
        const at = document.activeElement;
        const found = document.querySelector('[data-testid="{testid}"]');
        return !!found && (found === at || found.contains(at));
    }}"""
    for _ in range(150):
        if page.evaluate(here):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"Tab does not lead to {testid}")


def press(page: Page, testid: str, key: str = "Enter") -> None:
    """Tab to an element and press a key on it."""
    tab_to(page, testid)
    expect(page.get_by_test_id(testid)).to_be_enabled()
    page.keyboard.press(key)


@pytest.mark.release
def test_the_wizard_works_by_keyboard(page_of: Page, server: Server) -> None:
    page, names = page_of, NAMES[:4]
    uids = from_the_bag(server, 4)
    page.goto(server.url)
    expect(page.locator("[data-testid^=servo-row-]")).to_have_count(4)
    chord(page, "g", "c")
    expect(page.get_by_test_id("find-count")).to_contain_text("4")
    server.ready(4)
    press(page, "find-go")
    for place, name in enumerate(names):
        uid = (page.locator("[data-state=active]").get_attribute("data-testid") or "").removeprefix("unit-")
        if place == 0:
            press(page, "wiggle")
            expect(page.get_by_test_id("wiggle-says")).to_have_attribute("data-phase", "moved")
        page.get_by_test_id("label").evaluate("one => one.ownerDocument.body.focus()")
        tab_to(page, "label")
        page.keyboard.type(name)
        page.keyboard.press("Enter")
        expect(page.get_by_test_id(f"unit-{uid}")).to_have_attribute("data-state", "given")
    press(page, "identify-go")
    expect(page.get_by_test_id(f"profile-{PROFILE}")).to_be_visible()
    tab_to(page, "profile-step")
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowDown")
    expect(page.get_by_test_id(f"profile-{PROFILE}").get_by_role("radio")).to_be_checked()
    press(page, "profile-go")
    expect(page.locator('[data-testid^="changes-"]').first).to_be_visible()
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Reading the servo")
    if page.get_by_test_id("horn-free").count():
        press(page, "horn-free", "Space")
    press(page, "start")
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "report", timeout=JOB_MS)
    commissioned(server, uids, names)
    press(page, "more-servos")
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "find")


@pytest.fixture
def page_of(browser: Browser) -> Iterator[Page]:
    """A page without a mouse."""
    with page_in(browser) as page:
        yield page
