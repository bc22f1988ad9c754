"""Records: deep links, texts of snapshots and audit, a printed report, a recording replayed to its end."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.conftest import Watched
from e2e.servers import Demo, Server, as_in_rom, running
from e2e.state import add, read, servo_of, wait_for, write


@pytest.mark.release
def test_every_part_has_its_own_address(page: Page, demo: Demo) -> None:
    for part in ("snapshots", "profiles", "reports", "audit"):
        page.goto("about:blank")
        page.goto(f"{demo.url}records#{part}")
        expect(page.get_by_test_id("records-page")).to_have_attribute("data-part", part)


def test_the_records_show_and_undo_the_writes(page: Page, demo: Demo) -> None:
    (uid,) = add(demo)

    def snapshots() -> set[int]:
        return {one["id"] for one in demo.api.get(f"/servos/{uid}/snapshots").json()}

    page.goto(f"{demo.url}records#snapshots/{uid}")
    before = snapshots()
    page.get_by_test_id("take-snapshot").click()
    expect(page.get_by_test_id("compare")).to_be_visible()
    (taken,) = snapshots() - before
    held = read(demo, uid, "angle_limit_cw")
    write(demo, uid, "angle_limit_cw", held - 10)
    page.reload()
    page.get_by_test_id(f"snapshot-{taken}").click()
    page.get_by_test_id("differs-angle_limit_cw").get_by_role("checkbox").check()
    page.get_by_test_id("restore-ticked").click()
    expect(page.get_by_test_id("snapshot-angle_limit_cw")).to_be_visible()
    assert read(demo, uid, "angle_limit_cw") == held - 10, "a preview writes"
    page.get_by_test_id("snapshot-go").click()
    expect(page.get_by_test_id("records-note").first).to_contain_text("written and read back")
    assert read(demo, uid, "angle_limit_cw") == held

    page.goto(demo.url + "records#audit")
    page.get_by_test_id("audit-key").select_option("angle_limit_cw")
    expect(page.get_by_test_id("audit").locator("tbody tr").first).to_contain_text("0x38")
    demo.api.delete(f"/sim/servos/{uid}")


def test_snapshots_and_audit_are_readable(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    rows = demo.api.get(f"/servos/{uid}/parameters").json()["parameters"]
    held = {key: rows[key]["value"] for key in ("angle_limit_cw", "angle_p_gain")}
    changed = {"angle_limit_cw": held["angle_limit_cw"] - 5, "angle_p_gain": held["angle_p_gain"] - 1}
    for values in (changed, held):
        demo.api.patch(f"/servos/{uid}/parameters", json={"values": values}).raise_for_status()
    page.goto(f"{demo.url}records#snapshots/{uid}")
    newest = page.get_by_test_id(re.compile(r"^snapshot-\d+$")).first
    expect(newest).to_contain_text("Before changing")
    expect(newest).not_to_contain_text(re.compile("[a-z]_[a-z]"))
    page.goto(demo.url + "records#audit")
    table = page.get_by_test_id("audit").locator("tbody")
    expect(table).to_contain_text("Write")
    cells = [cell for row in table.locator("tr").all() for cell in row.locator("td").all_inner_texts()[1:2]]
    assert [cell for cell in cells if re.search("[a-z]_[a-z]", cell)] == []


def test_a_report_prints_black_on_white_without_buttons(page: Page, demo: Demo) -> None:
    uid = servo_of(demo, "BLA21-12U-A0")
    as_in_rom(demo.api, uid)
    save = demo.api.post(f"/servos/{uid}/save")
    assert save.is_success, save.text
    job = save.json()["id"]
    wait_for(lambda: demo.api.get(f"/jobs/{job}").json()["state"] == "succeeded", "the save does not end")
    page.goto(f"{demo.url}records#reports")
    page.get_by_test_id(f"job-{job}").get_by_role("button").first.click()
    with page.expect_popup() as opened:
        page.get_by_test_id("report-html").click()
    report = opened.value
    report.emulate_media(media="print", color_scheme="dark")
    one = demo.api.get(f"/servos/{uid}").json()
    for fact in (one["serial"], one["uid"], one["firmware"], one["model"]):
        expect(report.locator("body")).to_contain_text(fact)
    look = report.evaluate("() => [getComputedStyle(document.documentElement).backgroundColor, "
                           "getComputedStyle(document.body).color, "
                           "document.querySelectorAll('button, nav, script').length]")  # fmt: skip
    assert look == ["rgb(255, 255, 255)", "rgb(20, 25, 27)", 0]
    wide = report.evaluate("() => document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    assert wide, "nothing is cut at the right"


@pytest.fixture(scope="module")
def recording() -> Iterator[tuple[Server, str]]:
    """A server, and the name of a short recording, which takes more than ten seconds to make."""
    with running("demo", "--servos", "2", "--seed", "4") as server:
        server.ready(2)
        body = {"reason": "rattled", "before_s": 30}
        made = server.api.post("/recorder/recordings", params={"wait": True}, json=body)
        made.raise_for_status()
        yield server, made.json()["name"]


@pytest.fixture
def recorded(context: BrowserContext, recording: tuple[Server, str]) -> Iterator[tuple[Server, Page, str]]:
    """The same with a page."""
    server, name = recording
    yield server, context.new_page(), name
    server.api.delete("/stop").raise_for_status()


@pytest.mark.release
def test_a_recording_is_replayed_as_a_bus_to_its_end(recorded: tuple[Server, Page, str]) -> None:
    server, page, name = recorded
    page.goto(f"{server.url}recorder#{name}")
    page.get_by_test_id("recording-play").click()
    page.get_by_test_id("play-confirm").click()
    expect(page).to_have_url(re.compile("/servos$"))
    assert server.api.get("/bus").json()["address"] == f"recording:{name}"
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Active")
    expect(page.locator(".c-angle[data-stale=false]").first).to_be_visible()

    wait_for(lambda: server.api.get("/bus").json()["trouble"] is not None, "the recording does not end")
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Recording ended")
    expect(page.locator(".c-angle[data-stale=false]"), "nothing is fresh any more").to_have_count(0)
    page.get_by_test_id("bar-bus").click()
    expect(page.get_by_test_id("bus-trouble")).to_contain_text("Replay it again, or connect a bus.")
    page.get_by_test_id("bus-change").click()
    page.get_by_test_id("adapter-memory:demo").get_by_role("radio").check()
    page.get_by_test_id("connect").click()
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Active")
    server.ready(2)


@pytest.mark.release
def test_the_stop_band_links_to_its_recording(recorded: tuple[Server, Page, str]) -> None:
    server, page, name = recorded
    (stored,) = [one for one in server.api.get("/recorder/recordings").json() if one["name"] == name]
    page.goto(f"{server.url}recorder?from={stored['at']}&to={stored['at']}")
    expect(page.get_by_test_id("recording")).to_be_visible()
    expect(page).to_have_url(f"{server.url}recorder?at={stored['at']}#{name}")
    expect(page.get_by_test_id("scrub")).to_have_attribute("data-at", "0")

    server.api.post("/stop").raise_for_status()
    stopped_at = server.api.get("/stop").json()["at"]
    page.get_by_test_id("stop-band").get_by_test_id("happened-link").click()
    expect(page.get_by_test_id("happened")).to_contain_text("is being written")
    expect(page.get_by_test_id("recording")).to_be_visible()
    at = float(page.url.partition("at=")[2].partition("#")[0])
    assert at == pytest.approx(stopped_at, abs=2)


def test_a_restore_that_could_switch_the_servo_off_needs_confirmation(page: Page, demo: Demo, watched: Watched) -> None:
    uid = servo_of(demo, "BLA21-06U-A0")
    row = f"/servos/{uid}/parameters/voltage_limit_lower"

    def held() -> object:
        return demo.api.get(row).json()["value"]

    before = held()
    supply = demo.api.get(f"/servos/{uid}/parameters/current_voltage").json()["value"]
    danger = round(supply - 0.2, 1)
    demo.api.put(row, json={"value": danger, "confirm": ["supply"]}).raise_for_status()
    try:
        number = demo.api.post(f"/servos/{uid}/snapshots", json={"reason": "too near"}).json()["id"]
        demo.api.put(row, json={"value": before}).raise_for_status()
        page.goto(f"{demo.url}records#snapshots/{uid}")
        page.get_by_test_id(f"snapshot-{number}").click()
        page.get_by_test_id("differs-voltage_limit_lower").get_by_role("checkbox").check()
        page.get_by_test_id("restore-ticked").click()
        dialog = page.get_by_test_id("snapshot-dialog")
        expect(dialog.get_by_role("alert")).to_contain_text("could switch the output off immediately: the supply is")
        expect(dialog).not_to_contain_text("confirm")
        expect(page.get_by_test_id("snapshot-go")).to_have_count(0)
        again = page.get_by_test_id("change-again")
        expect(again).to_be_disabled()
        assert held() == before
        tick = dialog.get_by_role("checkbox", name="I checked the supply")
        tick.check()
        again.click()
        expect(page.get_by_test_id("snapshot-voltage_limit_lower")).to_be_visible()
        assert held() == before
        tick.uncheck()
        expect(page.get_by_test_id("snapshot-go")).to_have_count(0)
        expect(again).to_be_disabled()
        tick.check()
        page.get_by_test_id("snapshot-go").click()
        expect(page.get_by_test_id("records-note").first).to_contain_text("written and read back")
        assert held() == danger
    finally:
        demo.api.put(row, json={"value": before}).raise_for_status()
    # The browser itself says of each refused request that it was refused.
    watched.complaints[:] = [one for one in watched.complaints if "409" not in one]
