"""New servos on a tablet: identified by their horns, named, given IDs, saved, and a report."""

import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from e2e.contexts import borrowed
from e2e.hand import TABLET
from e2e.servers import Demo
from e2e.test_technician import wait_for

STOP_GAP = 12
GLOVE = 56
NAMES = ("Flap L", "Flap R", "Tail")


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """Size of a tablet."""
    with borrowed(browser, has_touch=True) as made:
        yield made


@pytest.fixture
def page(page: Page) -> Page:
    """A tablet in portrait orientation."""
    page.set_viewport_size(TABLET)
    return page


@pytest.fixture
def new_servos(demo: Demo) -> Iterator[list[str]]:
    """Three factory-new servos: servo ID 0, no name."""
    body = {"model": "BLA21-06U-A0", "firmware": "1.300"}
    made = [demo.api.post("/sim/servos", json=body).json()["uid"] for _ in range(3)]
    wait_for(lambda: all(state(demo, uid) == "ready" for uid in made), 20, "the new servos are not ready")
    yield made
    for uid in made:
        demo.api.delete(f"/sim/servos/{uid}")


def state(demo: Demo, uid: str) -> str | None:
    found = demo.api.get(f"/servos/{uid}")
    return found.json()["state"] if found.is_success else None


def test_three_new_servos_are_commissioned_on_a_tablet(page: Page, demo: Demo, new_servos: list[str]) -> None:
    taken = {one["servo_id"] for one in demo.api.get("/servos").json()} - {0}
    page.goto(demo.url + "commission")
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "find")
    choose(page, demo, new_servos)
    page.get_by_test_id("find-go").click()

    # one decision at a time: wiggle, see, name, next; nothing is written on the way
    given: dict[str, tuple[int, str]] = {}
    for place, name in enumerate(NAMES):
        active = page.locator("[data-state=active]")
        uid = (active.get_attribute("data-testid") or "").removeprefix("unit-")
        if place == 0:
            page.get_by_test_id("wiggle").click()
            expect(page.get_by_test_id("wiggle-says")).to_have_attribute("data-phase", "moved", timeout=20_000)
            assert demo.api.get("/leases").json() == [], "motion control was given back"
        gloves(page)
        page.get_by_test_id("label").fill(name)
        given[uid] = (int(page.get_by_test_id("servo-id").input_value()), name)
        page.get_by_test_id("give").click()
        expect(page.get_by_test_id(f"unit-{uid}")).to_have_attribute("data-state", "given")
    ids = [number for number, _ in given.values()]
    assert set(given) == set(new_servos)
    assert len(set(ids)) == 3
    assert not set(ids) & taken
    assert [demo.api.get(f"/servos/{uid}").json()["servo_id"] for uid in new_servos] == [0, 0, 0]

    # the draft outlives a reload
    page.reload()
    expect(page.get_by_test_id("identify-step")).to_contain_text(NAMES[2])
    page.get_by_test_id("identify-go").click()
    page.get_by_test_id("profile-go").click()
    for uid, (number, name) in given.items():
        expect(page.get_by_test_id(f"check-{uid}")).to_contain_text(re.compile(rf"→ {number}\D.*{name}"))
    expect(page.locator('[data-testid^="changes-"]').first).to_be_visible(timeout=20_000)
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Reading", timeout=20_000)
    if page.get_by_test_id("horn-free").count():
        page.get_by_test_id("horn-free").check()
    page.get_by_test_id("start").click()

    # the job runs in the server: leaving and coming back shows it
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", re.compile("run|report"))
    page.goto(demo.url + "servos")
    page.goto(demo.url + "commission")
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "report", timeout=60_000)
    for uid, (number, name) in given.items():
        unit = page.get_by_test_id(f"run-{uid}")
        expect(unit).to_have_attribute("data-verdict", "done")
        expect(unit).to_contain_text(name)
        found = demo.api.get(f"/servos/{uid}").json()
        assert (found["servo_id"], found["label"], found["unsaved"]) == (number, name, [])
        assert demo.api.get(f"/servos/{uid}/parameters").json()["parameters"]["servo_id"]["rom"] == number

    with page.expect_download() as kept:
        page.get_by_test_id("report-csv").click()
    assert kept.value.path().read_text(encoding="utf-8").count("done") >= 3
    page.get_by_test_id("more-servos").click()
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "find")


def choose(page: Page, demo: Demo, uids: list[str]) -> None:
    """Select only these servos, whatever else is new."""
    for one in demo.api.get("/commissioning/candidates").json()["servos"]:
        box = page.get_by_test_id(f"pick-{one['servo']['uid']}").locator("input")
        box.set_checked(one["servo"]["uid"] in uids)


def gloves(page: Page) -> None:
    """Buttons are large enough, and none is near Stop."""
    stop = page.get_by_test_id("stop").bounding_box()
    assert stop is not None
    for name in ("wiggle", "skip", "give", "servo-id", "label"):
        box = page.get_by_test_id(name).bounding_box()
        assert box is not None
        assert box["height"] >= GLOVE - 2, f"{name} is {box['height']} px high"
        assert box["y"] > stop["y"] + stop["height"] + STOP_GAP


def snapshots(demo: Demo, uid: str) -> list[dict[str, Any]]:
    return demo.api.get(f"/servos/{uid}/snapshots").json()


def test_the_records_show_and_undo_the_writes(page: Page, demo: Demo, new_servos: list[str]) -> None:
    uid = new_servos[0]
    page.goto(f"{demo.url}records#snapshots/{uid}")
    before = {one["id"] for one in snapshots(demo, uid)}
    page.get_by_test_id("take-snapshot").click()
    expect(page.get_by_test_id("compare")).to_be_visible()
    (taken,) = {one["id"] for one in snapshots(demo, uid)} - before
    held = demo.api.get(f"/servos/{uid}/parameters/angle_limit_cw").json()["value"]
    demo.api.put(f"/servos/{uid}/parameters/angle_limit_cw", json={"value": held - 10}).raise_for_status()
    page.reload()
    page.get_by_test_id(f"snapshot-{taken}").click()
    page.get_by_test_id("differs-angle_limit_cw").get_by_role("checkbox").check()
    page.get_by_test_id("restore-ticked").click()
    expect(page.get_by_test_id("snapshot-angle_limit_cw")).to_be_visible()
    assert demo.api.get(f"/servos/{uid}/parameters/angle_limit_cw").json()["value"] == held - 10, "a preview writes"
    page.get_by_test_id("snapshot-go").click()
    expect(page.get_by_test_id("records-note").first).to_contain_text("written and read back")
    assert demo.api.get(f"/servos/{uid}/parameters/angle_limit_cw").json()["value"] == held

    page.goto(demo.url + "records#audit")
    page.get_by_test_id("audit-key").select_option("angle_limit_cw")
    expect(page.get_by_test_id("audit").locator("tbody tr").first).to_contain_text("0x38")
