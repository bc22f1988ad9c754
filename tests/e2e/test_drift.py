"""Values saved by another tool while the servo was offline: flagged, shown, restored or accepted."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.looks import complaints
from e2e.servers import Server, running
from e2e.state import row, turn, wait_for

KEYS = ("angle_limit_cw", "speed_limit_cw")


@pytest.fixture
def meddled(context: BrowserContext) -> Iterator[tuple[Server, Page, str]]:
    """A servo whose ROM limits differ from the last known ones, and the list of servos in a browser."""
    with running("demo", "--servos", "1", "--seed", "5") as server:
        known = server.ready(1)[0]
        shown = server.api.get(f"/sim/servos/{known}").json()
        before = server.api.get(f"/servos/{known}/parameters", params={"refresh": "true"}).json()["parameters"]
        wait_for(lambda: row(server, known, "angle_limit_cw")["rom"] is not None, "what ROM holds is not known")
        # it is unplugged, other limits are saved elsewhere, and it is plugged in again
        server.api.delete(f"/sim/servos/{known}").raise_for_status()
        wait_for(lambda: not server.servos()[0]["online"], "it is still on the bus")
        rom = {key: before[key]["raw"] for key in KEYS}
        rom["angle_limit_cw"] -= 150
        again = {
            "model": shown["model"], "firmware": shown["firmware"], "uid": known, "servo_id": shown["servo_id"],
            "node_id": 0, "rom": rom,
        }  # fmt: skip
        server.api.post("/sim/servos", json=again).raise_for_status()
        wait_for(lambda: "angle_limit_cw" in drift_of(server, known), "the change is not noticed")
        page = context.new_page()
        page.goto(server.url)
        yield server, page, known


def drift_of(server: Server, uid: str) -> list[str]:
    return server.api.get(f"/servos/{uid}").json()["drift"]


def limit(server: Server, uid: str) -> float:
    return server.api.get(f"/servos/{uid}/parameters/angle_limit_cw").json()["value"]


def test_drift_is_shown_restored_and_saved(meddled: tuple[Server, Page, str]) -> None:
    server, page, uid = meddled
    found = {row["key"]: row for row in server.api.get(f"/servos/{uid}/drift").json()["rows"]}
    # the horn is off 0°, where the restart turns it
    turn(server, uid, 30)
    page.goto(f"{server.url}servos/{uid}/parameters")
    expect(page.get_by_test_id("drift-line")).to_contain_text("Changed externally")
    page.get_by_test_id("drift-line").get_by_role("button").click()
    dialog = page.get_by_test_id("drift-dialog")
    row = dialog.get_by_test_id("drift-angle_limit_cw")
    expect(row).to_contain_text(f"{found['angle_limit_cw']['was']:.1f}".replace("-", "−"))
    expect(row).to_contain_text(f"{found['angle_limit_cw']['now']:.1f}".replace("-", "−"))
    assert complaints(page) == []
    expect(page.get_by_test_id("change-save"), "a save is optional and off by default").not_to_be_checked()
    page.get_by_test_id("change-save").check()
    expect(dialog.get_by_test_id("after-save")).to_contain_text("restarts")
    expect(page.get_by_test_id("drift-go")).to_be_disabled()
    page.get_by_test_id("horn-free").check()
    page.get_by_test_id("drift-go").click()
    expect(dialog).to_have_count(0)
    assert limit(server, uid) == found["angle_limit_cw"]["was"]
    wait_for(lambda: drift_of(server, uid) == [], "it is still flagged")
    expect(page.get_by_test_id("drift-line")).to_have_count(0)


@pytest.mark.release
def test_drift_is_accepted_from_the_records(meddled: tuple[Server, Page, str]) -> None:
    server, page, uid = meddled
    held = limit(server, uid)
    page.goto(server.url + "records")
    page.get_by_test_id(f"known-{uid}").get_by_role("button", name="Changed externally").click()
    page.get_by_test_id("change-other").click()
    expect(page.get_by_test_id("drift-dialog")).to_have_count(0)
    assert limit(server, uid) == held, "accepting writes nothing"
    assert drift_of(server, uid) == []
