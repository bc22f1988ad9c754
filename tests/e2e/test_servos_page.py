"""The list of servos: order, filter, ticks, and what is done to several at once."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.conftest import Demo, ready_demo


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """A demo of this file's own: torque is turned off in it."""
    with ready_demo(6) as one:
        labels = ("Delta", "Alpha", "Echo", "Bravo", "Foxtrot", "Charlie")
        for servo, label in zip(one.api.get("/servos").json(), labels, strict=True):
            one.api.patch(f"/servos/{servo['uid']}", json={"label": label}).raise_for_status()
        yield one


def names(page: Page) -> list[str]:
    return page.locator(".servo-row .row-link").all_inner_texts()


def test_a_press_on_a_column_sorts_and_says_so_by_keyboard_too(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "servos")
    own = names(page) if page.locator(".servo-row").nth(5).is_visible() else []
    expect(page.locator(".servo-row")).to_have_count(6)
    head = page.get_by_role("columnheader", name="Servo", exact=True)
    expect(head).to_have_attribute("aria-sort", "none")
    page.get_by_test_id("sort-name").focus()
    page.keyboard.press("Enter")
    expect(head).to_have_attribute("aria-sort", "ascending")
    assert names(page) == ["Alpha", "Bravo", "Charlie", "Delta", "Echo", "Foxtrot"]
    page.keyboard.press("Enter")
    expect(head).to_have_attribute("aria-sort", "descending")
    assert names(page) == ["Foxtrot", "Echo", "Delta", "Charlie", "Bravo", "Alpha"]
    page.keyboard.press("Enter")
    expect(head).to_have_attribute("aria-sort", "none")
    assert names(page) != ["Foxtrot", "Echo", "Delta", "Charlie", "Bravo", "Alpha"]
    assert own in ([], names(page))


def test_the_list_is_narrowed_to_a_model_and_nothing_in_a_row_is_cut(page: Page, demo: Demo) -> None:
    page.goto(demo.url + "servos")
    expect(page.locator(".servo-row")).to_have_count(6)
    cut = page.evaluate(
        """() => [...document.querySelectorAll('.servo-row *')].filter(one =>
            getComputedStyle(one).textOverflow === 'ellipsis' && one.scrollWidth > one.clientWidth).length"""
    )
    assert cut == 0
    model = demo.api.get("/servos").json()[0]["model"]
    page.get_by_test_id("filter-model").select_option(model)
    same = [one for one in demo.api.get("/servos").json() if one["model"] == model]
    expect(page.locator(".servo-row")).to_have_count(len(same))


def test_ticked_servos_are_edited_together_and_their_torque_is_turned_off(page: Page, demo: Demo) -> None:
    uids = [one["uid"] for one in demo.api.get("/servos").json()][1:3]
    page.goto(demo.url + "servos")
    for uid in uids:
        page.get_by_test_id(f"select-{uid}").focus()
        page.keyboard.press("Space")
    bar = page.get_by_test_id("selection-bar")
    expect(bar).to_contain_text("2 servos selected")
    assert demo.api.get("/stop").json()["latched"] is False, "Space on a tick is no stop"
    page.get_by_test_id("torque-off-selected").click()
    expect(bar).to_contain_text("Torque is off on 2 of them.")
    for uid in uids:
        assert demo.api.get(f"/servos/{uid}/parameters").json()["parameters"]["torque_mode"]["value"] == "off"

    page.get_by_test_id("edit-together").click()
    expect(page).to_have_url(re.compile(rf"/servos/matrix\?uids={uids[0]},{uids[1]}"))
    expect(page.get_by_test_id("matrix").get_by_role("columnheader")).to_have_count(3)
    page.go_back()
    expect(bar).to_contain_text("2 servos selected")
    page.get_by_test_id("select-none").click()
    expect(bar).to_have_count(0)


def test_a_profile_is_chosen_for_the_ticked_servos(page: Page, demo: Demo) -> None:
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


def test_ticked_servos_are_plotted_together_and_one_more_or_less_is_seen_at_once(page: Page, demo: Demo) -> None:
    shown = demo.api.get("/servos").json()
    page.goto(demo.url + "servos")
    for one in shown[:3]:
        page.get_by_test_id(f"select-{one['uid']}").check()
    page.get_by_test_id("plot-selected").click()
    curves = page.get_by_role("list", name="Curves").get_by_role("listitem")
    expect(curves).to_have_text([one["label"] for one in shown[:3]])
    expect(page.get_by_test_id("plot-many").locator("canvas")).to_be_visible()
    page.get_by_test_id("many-commands").check()
    expect(curves, "a command has the colour of its servo and no line of its own").to_have_count(3)
    page.get_by_test_id(f"select-{shown[0]['uid']}").uncheck()
    expect(curves).to_have_text([one["label"] for one in shown[1:3]])
    page.get_by_test_id(f"select-{shown[4]['uid']}").check()
    expect(curves).to_have_count(3)


@pytest.mark.scene
def test_the_wall_shows_each_servo_found_under_its_name_and_leads_to_it(page: Page, demo: Demo) -> None:
    shown = demo.api.get("/servos").json()
    page.goto(demo.url + "servos")
    expect(page.locator(".servo-row")).to_have_count(6)
    page.get_by_role("button", name="3D", exact=True).click()
    wall = page.get_by_test_id("wall")
    expect(wall).to_have_attribute("data-state", "shown", timeout=40_000)
    expect(wall.get_by_role("link")).to_have_count(6)
    boxes = [page.get_by_test_id(f"wall-{one['uid']}").bounding_box() for one in shown]
    places = {(round(box["x"]), round(box["y"])) for box in boxes if box}
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
