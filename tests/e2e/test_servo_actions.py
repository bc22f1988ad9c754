"""Wiggle, restart, default and factory reset on the page: by touch and by keyboard; and their rejections."""

import csv
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.contexts import page_in
from e2e.hand import WAYS, Hand, hand_of
from e2e.looks import complaints, too_small
from e2e.servers import Server, running, serving
from e2e.state import add, row, sim, wait_for
from e2e.steps import horn_is_free, motion_on

COUNT = 3
HELD = {"angle_p_gain": 70, "servo_id": 7}
"""ROM of the servo before its reset: one value that is reset, one that stays."""


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """New servos of one model, identical on the page."""
    with running(*serving(tmp_path, "--sim-api")) as one:
        add(one, COUNT)
        yield one


@pytest.fixture(params=WAYS)
def hand(request: pytest.FixtureRequest, browser: Browser) -> Iterator[Hand]:
    """A page with one input method."""
    with hand_of(browser, request.param) as one:
        yield one


def angles(server: Server) -> dict[str, float]:
    """Real horn angles."""
    return {one["uid"]: one["angle_deg"] for one in server.api.get("/sim/servos").json()}


MARKS = """() => {
    window.marks = [];
    const look = () => {
        const marked = [...document.querySelectorAll('[data-wiggles=true]')].map(one => one.dataset.testid).join();
        if (marked !== window.marks.at(-1)?.[1]) window.marks.push([Date.now() / 1000, marked]);
    };
    new MutationObserver(look).observe(document.body, { subtree: true, childList: true, attributes: true });
    look();
}"""
"""Record which rows are marked as wiggling, and since when."""


def moved(server: Server, uid: str, at_rest: float) -> tuple[float, float]:
    """When this horn was away from its rest, by the servo's own messages: from, until."""
    rows = csv.DictReader(server.api.get(f"/servos/{uid}/telemetry.csv", params={"seconds": 300}).text.splitlines())
    angles = [(float(one["t_s"]), float(one["current_angle"])) for one in rows if one["current_angle"]]
    away = [at for at, angle in angles if abs(angle - at_rest) > 2]
    return away[0], away[-1]


def seen_moving(server: Server, page: Page, at_rest: dict[str, float]) -> list[str]:
    """Servos in the order the page marked them during wiggles: one after another, as their horns moved."""
    expect(page.get_by_test_id("selection-says")).to_contain_text(f"{COUNT} servos wiggled", timeout=180_000)
    order = [row.removeprefix("servo-row-") for _, row in page.evaluate("() => window.marks") if row]
    times = [moved(server, uid, at_rest[uid]) for uid in order]
    assert len(set(order)) == COUNT
    assert all(before[1] < after[0] for before, after in pairwise(times)), "two horns move at once, or another one"
    return order


@pytest.mark.release
def test_servos_are_identified_restarted_set_to_default_and_reset(hand: Hand, server: Server) -> None:
    page = hand.page
    errors: list[str] = []
    page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(server.url)
    expect(page.locator("[data-testid^=servo-row-]")).to_have_count(COUNT)

    # which horn is which: all in turn, the row says whose turn it is
    page.evaluate(MARKS)
    at_rest = angles(server)
    hand.press("select-all", "Space")
    if hand.way == "keyboard":
        page.keyboard.press("w")
    else:
        hand.press("wiggle-selected")
    order = seen_moving(server, page, at_rest)
    listed = page.locator("[data-testid^=servo-row-]").evaluate_all("all => all.map(one => one.dataset.testid)")
    assert [f"servo-row-{uid}" for uid in order] == listed
    if hand.way == "touch":
        assert too_small(page) == []

    # a value in RAM only, and the restart that says it is lost
    uid = order[0]
    standard = row(server, uid, "angle_p_gain")["default"]
    hand.press(page.locator(f"[data-testid=servo-row-{uid}] a.row-link"))
    tune_gain(hand, server, uid, 55)
    hand.choose("menu-restart")
    expect(page.get_by_test_id("restart-angle_p_gain")).to_contain_text("55")
    expect(page.get_by_test_id("restart-angle_p_gain")).to_contain_text(str(standard))
    assert row(server, uid, "angle_p_gain")["value"] == 55, "the question changes nothing"
    looks(hand)
    starts = server.api.get(f"/sim/servos/{uid}").json()["starts"]
    agree(hand)
    hand.press("restart-go")
    over(page)
    expect(page.get_by_test_id("step-read_back")).to_have_attribute("data-state", "done")
    assert row(server, uid, "angle_p_gain")["value"] == standard
    assert server.api.get(f"/sim/servos/{uid}").json()["starts"] == starts + 1
    looks(hand)
    hand.press("change-close")

    # one row to its default: staged by one press, sent by Apply
    tune_gain(hand, server, uid, 60)
    hand.press("default-angle_p_gain")
    expect(page.get_by_test_id("row-angle_p_gain")).to_have_attribute("data-state", "staged")
    expect(page.get_by_test_id("input-angle_p_gain")).to_have_value(str(standard))
    assert row(server, uid, "angle_p_gain")["value"] == 60, "staged is not sent"
    apply(hand)
    wait_for(lambda: row(server, uid, "angle_p_gain")["value"] == standard, "the default was not written")

    # everything to its default, but who it is
    uid = order[2]
    saved = server.api.patch(f"/servos/{uid}/parameters", json={"values": HELD, "save": True}).json()
    wait_for(lambda: server.api.get(f"/jobs/{saved['job']}").json()["state"] == "succeeded", "not saved")
    server.api.patch(f"/servos/{uid}", json={"label": "Winch"}).raise_for_status()
    page.goto(f"{server.url}servos/{uid}/motion")
    hand.choose("menu-factory-reset")
    expect(page.get_by_test_id("factory-reset-angle_p_gain")).to_contain_text("70")
    expect(page.get_by_test_id("factory-reset-dialog")).to_contain_text("Keep servo ID 7")
    expect(page.get_by_test_id("factory-reset-go")).to_be_disabled()
    looks(hand)
    agree(hand)
    hand.type("reset-name", "Winch")
    hand.press("factory-reset-go")
    over(page)
    expect(page.get_by_test_id("step-verify")).to_have_attribute("data-state", "done")
    assert (row(server, uid, "angle_p_gain")["rom"], row(server, uid, "servo_id")["rom"]) == (standard, 7)
    hand.press("change-close")
    expect(page.get_by_test_id("job-dialog")).to_have_count(0)
    assert errors == []


def tune_gain(hand: Hand, server: Server, uid: str, value: int) -> None:
    """Write to RAM through the page."""
    if "#angle_p_gain" not in hand.page.url:
        hand.page.goto(f"{server.url}servos/{uid}/parameters#angle_p_gain")
    hand.type("input-angle_p_gain", str(value))
    apply(hand)
    wait_for(lambda: row(server, uid, "angle_p_gain")["value"] == value, f"{value} was not written")
    expect(hand.page.get_by_test_id("row-angle_p_gain")).to_have_attribute("data-state", "applied")


def apply(hand: Hand) -> None:
    expect(hand.page.get_by_test_id("apply")).to_be_enabled()
    if hand.way == "keyboard":
        hand.page.keyboard.press("Control+Enter")
    else:
        hand.press("apply")


def agree(hand: Hand) -> None:
    """Confirm that the horn is free, if required."""
    if hand.page.get_by_test_id("horn-free").count():
        hand.press("horn-free", "Space")


def over(page: Page) -> None:
    expect(page.get_by_test_id("change-progress")).to_have_attribute("data-state", "done")


def looks(hand: Hand) -> None:
    if hand.way == "touch":  # by keyboard, the same dialogs open
        assert complaints(hand.page) == []
        assert too_small(hand.page) == []


@pytest.fixture
def mouse(browser: Browser) -> Iterator[Page]:
    """A page whose console logs rejections, as expected."""
    with page_in(browser) as page:
        yield page


def test_a_rejection_is_shown_beside_the_button_without_a_dialog(mouse: Page, server: Server) -> None:
    uid = server.ready(COUNT)[0]
    mouse.goto(f"{server.url}servos/{uid}/parameters")
    says = mouse.get_by_test_id("servo-says")

    def each(why: str) -> None:
        for item, words in (("menu-restart", "Not restarted"), ("menu-factory-reset", "Not reset")):
            mouse.get_by_test_id("servo-menu").click()
            mouse.get_by_test_id(item).click()
            expect(says).to_contain_text(f"{words}. ")
            expect(says).to_contain_text(why)
            expect(mouse.get_by_role("dialog")).to_have_count(0)
        mouse.get_by_test_id("wiggle").click()
        expect(says).to_contain_text("Not wiggled. ")
        expect(says).to_contain_text(why)

    lease = server.api.post("/leases", json={"holder": "Rig 3", "ttl_s": 60}).json()["id"]
    each("Rig 3")
    server.api.delete(f"/leases/{lease}")
    server.api.post("/stop")
    each("Stopped")
    server.api.delete("/stop")
    assert server.api.get("/jobs").json() == []

    # motion that is on here: turn it off first
    motion_on(mouse, server, uid)
    mouse.get_by_test_id("servo-menu").click()
    mouse.get_by_test_id("menu-restart").click()
    expect(says).to_contain_text("under motion control")
    expect(mouse.get_by_role("dialog")).to_have_count(0)


def test_several_servos_restart_in_turn_without_the_offline_one(mouse: Page, server: Server) -> None:
    known = {str(one["uid"]): str(one["serial"]) for one in server.servos()}
    uids = sorted(known, key=lambda uid: known[uid])  # as the list has servos without an ID
    server.api.patch(f"/servos/{uids[0]}/parameters", json={"values": {"angle_p_gain": 55}}).raise_for_status()
    sim(server, uids[1], power="off")
    wait_for(lambda: server.api.get(f"/servos/{uids[1]}").json()["state"] == "offline", "it is still there")
    mouse.goto(server.url)
    for uid in uids[:3]:
        mouse.get_by_test_id(f"select-{uid}").check()
    mouse.get_by_test_id("restart-selected").click()
    dialog = mouse.get_by_test_id("restart-dialog")
    expect(dialog).to_contain_text("Restart 2 servos?")
    expect(mouse.get_by_test_id(f"restart-{uids[0]}")).to_contain_text("P gain")
    expect(dialog).to_contain_text("is offline")
    expect(mouse.get_by_test_id("selection-refusals")).to_contain_text("is offline")
    horn_is_free(mouse)
    mouse.get_by_test_id("restart-go").click()
    over(mouse)
    for uid in (uids[0], uids[2]):
        expect(mouse.get_by_test_id(f"turn-{uid}")).to_have_attribute("data-state", "done")
    jobs = [one for one in server.api.get("/jobs", params={"kind": "restart"}).json() if one["state"] == "succeeded"]
    first, second = sorted(jobs, key=lambda job: job["created_at"])
    assert [first["uid"], second["uid"]] == [uids[0], uids[2]]
    assert second["created_at"] >= first["ended_at"], "one after the other"
    assert server.api.get(f"/servos/{uids[0]}").json()["unsaved"] == []
