"""The list of servos: order, filter, selection, and actions on several servos."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.hand import WAYS, hand_of
from e2e.looks import complaints, too_small
from e2e.servers import Demo, ready_demo
from e2e.state import latched, row, sim, uids_of
from e2e.steps import box


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """A demo of this file, in which torque is turned off."""
    with ready_demo(6) as one:
        labels = ("Delta", "Alpha", "Echo", "Bravo", "Foxtrot", "Charlie")
        for servo, label in zip(one.api.get("/servos").json(), labels, strict=True):
            one.api.patch(f"/servos/{servo['uid']}", json={"label": label}).raise_for_status()
        yield one


def test_a_column_heading_sorts_by_pointer_and_keyboard(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "servos")
    links = page.locator(".servo-row .row-link")
    expect(links).to_have_count(6)
    own = links.all_inner_texts()
    ascending = ["Alpha", "Bravo", "Charlie", "Delta", "Echo", "Foxtrot"]
    head = page.get_by_role("columnheader", name="Servo", exact=True)
    expect(head).to_have_attribute("aria-sort", "none")
    page.get_by_test_id("sort-name").focus()
    for sort, names in (("ascending", ascending), ("descending", ascending[::-1]), ("none", own)):
        page.keyboard.press("Enter")
        expect(head).to_have_attribute("aria-sort", sort)
        expect(links).to_have_text(names)


HEIGHTS = "rows => rows.map(one => one.getBoundingClientRect().height)"


@pytest.fixture
def troubled(demo: Demo) -> Iterator[str]:
    """A servo whose name, fault and advice are longer than a row."""
    uid = uids_of(demo)[0]
    patch = {"label": "Left wing / Aileron outboard, behind the third inspection cover"}
    demo.api.patch(f"/servos/{uid}", json=patch).raise_for_status()
    sim(demo, uid, faults={"sensor_weak": True})
    yield uid
    sim(demo, uid, faults={"sensor_weak": False})
    demo.api.patch(f"/servos/{uid}", json={"label": "Delta"}).raise_for_status()


@pytest.mark.parametrize(("view", "height"), [("List", 72), ("Compact", 36)])
def test_rows_have_equal_height_and_tooltips(view: str, height: int, page: Page, demo: Demo, troubled: str) -> None:
    page.goto(demo.url + "servos")
    page.get_by_role("button", name=view, exact=True).click()
    health = page.get_by_test_id(f"servo-row-{troubled}").locator(".c-health")
    expect(health).to_contain_text("Warning")
    assert set(page.locator(".servo-row").evaluate_all(HEIGHTS)) == {height}
    expect(health).to_have_attribute("title", re.compile(r"Warning: angle sensor field weak\. .*magnet"))


def test_compact_shows_twenty_rows_at_900_px_and_is_stored(page: Page, demo: Demo) -> None:
    page.set_viewport_size({"width": 1440, "height": 900})
    page.goto(demo.url + "servos")
    page.get_by_role("button", name="Compact", exact=True).click()
    page.reload()
    expect(page.get_by_role("button", name="Compact", exact=True)).to_have_attribute("aria-pressed", "true")
    first, scroll = box(page.locator(".servo-row").first), box(page.locator(".servos-page > .scroll"))
    assert (scroll["y"] + scroll["height"] - first["y"]) / first["height"] >= 20


def test_touch_rows_are_56_px_high_in_compact(browser: Browser, demo: Demo) -> None:
    with hand_of(browser, "touch") as hand:
        hand.page.goto(demo.url + "servos")
        hand.page.get_by_role("button", name="Compact", exact=True).tap()
        expect(hand.page.locator(".servo-row")).to_have_count(6)
        assert set(hand.page.locator(".servo-row").evaluate_all(HEIGHTS)) == {56}
        assert too_small(hand.page) == []


def test_keys_move_select_and_open_rows(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "servos")
    links = page.locator(".servo-row .row-link")
    expect(links).to_have_count(6)
    for key, at in (("j", 0), ("j", 1), ("ArrowDown", 2), ("k", 1), ("ArrowUp", 0), ("k", 0)):
        page.keyboard.press(key)
        expect(links.nth(at), key).to_be_focused()
    page.keyboard.press("x")
    page.keyboard.press("j")
    page.keyboard.press("x")
    bar = page.get_by_test_id("selection-bar")
    expect(bar).to_contain_text("2 servos selected")
    page.keyboard.press("x")
    expect(bar).to_contain_text("1 servo selected")
    page.get_by_role("searchbox").press_sequentially("jx")
    expect(page.get_by_role("searchbox")).to_have_value("jx")
    expect(bar).to_contain_text("1 servo selected")
    page.get_by_role("searchbox").fill("")
    page.keyboard.press("Escape")
    page.keyboard.press("j")
    uid = page.locator(".servo-row").first.get_attribute("data-testid")
    page.keyboard.press("Enter")
    expect(page).to_have_url(f"{demo.url}servos/{(uid or '').removeprefix('servo-row-')}")
    assert latched(demo) is False


@pytest.fixture
def placed(demo: Demo) -> Iterator[dict[str, list[str]]]:
    """Servos whose labels begin with a group: names by group, in the order of the list."""
    servos = demo.api.get("/servos").json()
    before = {one["uid"]: one["label"] for one in servos}
    names = ("Wing / Flap", "Tail / Rudder", "Wing / Aileron", "Winch", "Tail / Elevator", "Wing / Slat")
    for one, label in zip(servos, names, strict=True):
        demo.api.patch(f"/servos/{one['uid']}", json={"label": label}).raise_for_status()
    yield {"Tail": ["Elevator", "Rudder"], "Wing": ["Aileron", "Flap", "Slat"], "": ["Winch"]}
    for uid, label in before.items():
        demo.api.patch(f"/servos/{uid}", json={"label": label}).raise_for_status()


@pytest.mark.parametrize("way", WAYS)
def test_groups_fold_and_select_their_servos(
    way: str, browser: Browser, demo: Demo, placed: dict[str, list[str]]
) -> None:
    with hand_of(browser, way) as hand:
        page, links = hand.page, hand.page.locator(".servo-row .row-link")
        page.goto(demo.url + "servos?sort=name")
        page.get_by_test_id("group-by").select_option("place")
        expect(page.locator(".servo-group")).to_have_text(["Tail 2", "Wing 3", "Others 1"])
        expect(links).to_have_text([one for each in placed.values() for one in each])
        hand.press("group-Tail")
        expect(page.locator(".servo-row")).to_have_count(4)
        page.reload()
        expect(page.get_by_test_id("group-Tail")).to_have_attribute("aria-expanded", "false")
        expect(links).to_have_text([*placed["Wing"], "Winch"])
        page.get_by_test_id("select-group-Wing").check()
        expect(page.get_by_test_id("selection-bar")).to_contain_text("3 servos selected")
        expect(page.get_by_test_id("select-all")).to_have_js_property("indeterminate", True)
        assert complaints(page) == []
        page.get_by_test_id("group-by").select_option("state")
        expect(page).to_have_url(re.compile(r"group=state(?!.*folded)"))
        expect(page.locator(".servo-group").first).to_be_visible()


def test_selected_servos_are_edited_together_and_turned_off(page: Page, demo: Demo) -> None:
    uids = uids_of(demo)[1:3]
    page.goto(demo.url + "servos")
    for uid in uids:
        page.get_by_test_id(f"select-{uid}").focus()
        page.keyboard.press("Space")
    bar = page.get_by_test_id("selection-bar")
    expect(bar).to_contain_text("2 servos selected")
    assert latched(demo) is False, "Space on a tick is no stop"
    page.get_by_test_id("torque-off-selected").click()
    expect(bar).to_contain_text("Torque is off on 2 servos.")
    for uid in uids:
        assert row(demo, uid, "torque_mode")["value"] == "off"

    page.get_by_test_id("edit-together").click()
    expect(page).to_have_url(re.compile(rf"/servos/matrix\?uids={uids[0]},{uids[1]}"))
    expect(page.get_by_test_id("matrix").get_by_role("columnheader")).to_have_count(3)
    page.go_back()
    expect(bar).to_contain_text("2 servos selected")
    page.get_by_test_id("select-none").click()
    expect(bar).to_have_count(0)
    for uid in uids:
        demo.api.post(f"/servos/{uid}/restart?wait=true").raise_for_status()


def test_a_profile_is_chosen_for_the_selected_servos(page: Page, demo: Demo) -> None:
    one, other = demo.api.get("/servos").json()[:2]
    made = demo.api.put("/profiles/Bench", json={"from_uid": one["uid"]})
    made.raise_for_status()
    page.goto(demo.url + "servos")
    page.get_by_test_id(f"select-{one['uid']}").check()
    page.get_by_test_id("apply-profile").click()
    page.get_by_test_id("profile-Bench").click()
    dialog = page.get_by_test_id("profile-dialog")
    expect(dialog.get_by_test_id(f"apply-{one['uid']}").get_by_role("checkbox")).to_be_checked()
    expect(dialog.get_by_test_id(f"apply-{other['uid']}").get_by_role("checkbox")).not_to_be_checked()


@pytest.mark.scene
def test_the_wall_shows_and_links_each_servo(page: Page, demo: Demo) -> None:
    shown = demo.api.get("/servos").json()
    page.goto(demo.url + "servos")
    expect(page.locator(".servo-row")).to_have_count(6)
    page.get_by_role("button", name="3D", exact=True).click()
    wall = page.get_by_test_id("wall")
    expect(wall).to_have_attribute("data-state", "shown")
    expect(wall.get_by_role("link")).to_have_count(6)
    boxes = [box(page.get_by_test_id(f"wall-{one['uid']}")) for one in shown]
    places = {(round(one["x"]), round(one["y"])) for one in boxes}
    assert len(places) == 6, "each a place of its own"
    (frame,) = [one for one in page.frames if "/viser/" in one.url]
    frame.wait_for_function(
        "() => Object.keys(window.__viserSceneTree?.getState() ?? {}).some(node => node.startsWith('/crowd/horn-far'))"
    )
    model = shown[0]["model"]
    page.get_by_test_id("filter-model").select_option(model)
    expect(wall.get_by_role("link")).to_have_count(sum(one["model"] == model for one in shown))
    page.get_by_test_id("filter-model").select_option("")
    link = page.get_by_test_id(f"wall-{shown[2]['uid']}")
    expect(link).to_have_attribute("aria-label", re.compile(rf"^{shown[2]['label']}, [+−]?\d+\.\d°, "))
    expect(link).to_have_attribute("data-stale", "false")
    link.press("Enter")
    expect(page).to_have_url(re.compile(rf"/servos/{shown[2]['uid']}$"))
