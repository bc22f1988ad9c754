"""Failing commissioning: a servo refuses or is silent, the job is cancelled, the server ends."""

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from e2e.servers import Server, running, serving
from e2e.state import add, ready, row, servo, sim, wait_for
from e2e.steps import JOB_MS, horn_is_free


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A bus to which each test adds its own servos."""
    with running(*serving(tmp_path_factory.mktemp("data"), "--sim-api")) as one:
        yield one


@pytest.fixture
def servos(server: Server) -> Iterator[list[str]]:
    """Factory-new servos in the order of commissioning: by serial."""
    made = plugged(server, 3)
    yield made
    for uid in made:
        server.api.delete(f"/sim/servos/{uid}")


def plugged(server: Server, number: int) -> list[str]:
    """New servos in the order of commissioning: by serial."""
    made = add(server, number)
    return sorted(made, key=lambda uid: servo(server, uid)["serial"])


def plugged_again(server: Server, servo_ids: dict[str, object]) -> None:
    """The servos of an earlier server, each with what it had in ROM."""
    for uid, servo_id in servo_ids.items():
        add(server, uid=uid, servo_id=servo_id)


def at_check(page: Page, server: Server, number: int) -> None:
    """All servos are selected with the next free ID, not identified; the last step before a write."""
    page.goto(server.url + "commission")
    expect(page.get_by_test_id("find-count")).to_contain_text(f"{number} of {number}")
    page.get_by_test_id("find-go").click()
    page.get_by_test_id("give-rest").click()
    page.get_by_test_id("identify-go").click()
    page.get_by_test_id("profile-go").click()
    expect(page.locator('[data-testid^="changes-"]')).to_have_count(number)
    horn_is_free(page)


def at_report(page: Page) -> None:
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "report", timeout=JOB_MS)


def verdict(page: Page, uid: str, says: str) -> None:
    expect(page.get_by_test_id(f"run-{uid}")).to_have_attribute("data-verdict", says)


def heading(page: Page, says: str) -> None:
    expect(page.get_by_test_id("commission-page")).to_contain_text(says)


def saved_ids(server: Server, uids: list[str]) -> list[object]:
    """Servo IDs in ROM."""
    return [row(server, uid, "servo_id")["rom"] for uid in uids]


def all_done(page: Page, server: Server, uids: list[str]) -> None:
    heading(page, f"All {len(uids)} servos are commissioned")
    heading(page, "Saved and verified in ROM after the restart.")
    for uid in uids:
        verdict(page, uid, "done")
    expect(page.get_by_test_id("resume")).to_have_count(0)
    ids = saved_ids(server, uids)
    assert len(set(ids)) == len(uids)
    assert 0 not in ids


def test_a_failed_servo_is_named_and_retried_alone(context: BrowserContext, server: Server, servos: list[str]) -> None:
    page = context.new_page()
    first, bad, last = servos
    at_check(page, server, 3)
    sim(server, bad, refuse_keys=["servo_id"])
    page.get_by_role("button", name="Continue with the others").click()
    page.get_by_test_id("start").click()
    at_report(page)
    heading(page, "2 of 3 servos are commissioned")
    heading(page, "1 failed. Resume continues with the remaining servos.")
    for uid, says in ((first, "done"), (bad, "failed"), (last, "done")):
        verdict(page, uid, says)
    alarm = page.get_by_test_id(f"run-{bad}").get_by_role("alert")
    expect(alarm).to_contain_text(re.compile("servo ID|Servo ID|0x2C|servo_id"))
    assert saved_ids(server, [bad]) == [0], "all or nothing"
    starts = {uid: server.api.get(f"/sim/servos/{uid}").json()["starts"] for uid in (first, last)}

    # it still fails: the same error is shown again, and nothing else changes
    page.get_by_test_id(f"retry-{bad}").click()
    expect(page.get_by_role("group", name="Report 2")).to_be_visible()
    at_report(page)
    verdict(page, bad, "failed")

    # a reload keeps the state; without the cause, only this servo is done
    page.reload()
    at_report(page)
    verdict(page, bad, "failed")
    sim(server, bad, refuse_keys=[])
    page.get_by_test_id(f"retry-{bad}").click()
    all_done(page, server, servos)
    now = {uid: server.api.get(f"/sim/servos/{uid}").json()["starts"] for uid in (first, last)}
    assert now == starts, "the others were left alone"


def test_an_id_taken_by_another_client_is_rejected_before_any_write(
    context: BrowserContext, server: Server, servos: list[str]
) -> None:
    page = context.new_page()
    at_check(page, server, 3)
    wanted = int(re.findall(r"→ (\d+)", page.get_by_test_id(f"check-{servos[1]}").inner_text())[0])
    (twin,) = add(server, servo_id=wanted)
    try:
        page.get_by_test_id("start").click()
        refused = page.get_by_test_id("start-refused")
        expect(refused).to_contain_text("Nothing was written.")
        expect(refused).to_contain_text(str(wanted))
        assert saved_ids(server, servos) == [0, 0, 0]
        # what is to be changed is one press away
        page.get_by_test_id("refused-change").click()
        expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", "identify")
        expect(page.get_by_test_id(f"unit-{servos[1]}")).to_have_attribute("data-state", "active")
    finally:
        server.api.delete(f"/sim/servos/{twin}")


@pytest.mark.release
def test_a_cancelled_job_is_resumed_after_a_reload(context: BrowserContext, server: Server, servos: list[str]) -> None:
    page = context.new_page()
    at_check(page, server, 3)
    sim(server, servos[1], restart_delay_s=15)
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id(f"run-{servos[0]}")).to_have_attribute("data-verdict", "done")
    verdict(page, servos[1], "running")
    page.get_by_test_id("cancel-job").click()
    expect(page.get_by_test_id("cancel-dialog")).to_contain_text("Values that are already written stay.")
    page.get_by_test_id("cancel-confirm").click()
    at_report(page)
    heading(page, "1 of 3 servos are commissioned")
    heading(page, "Commissioning was cancelled.")
    verdict(page, servos[0], "done")
    verdict(page, servos[2], "not_tried")

    sim(server, servos[1], restart_delay_s=0)
    ready(server, servos[1])
    page.reload()
    at_report(page)
    heading(page, "Commissioning was cancelled.")
    page.get_by_test_id("resume").click()
    expect(page.get_by_test_id("commission-page")).to_have_attribute("data-step", re.compile("run|report"))
    all_done(page, server, servos)


@pytest.mark.release
def test_a_job_failed_by_a_silent_servo_resumes_on_the_next_server(context: BrowserContext, tmp_path: Path) -> None:
    page = context.new_page()
    with running(*serving(tmp_path, "--sim-api")) as server:
        servos = plugged(server, 3)
        at_check(page, server, 3)
        sim(server, servos[1], drop_responses_pct=100)
        page.get_by_test_id("start").click()
        at_report(page)
        heading(page, "1 of 3 servos are commissioned")
        heading(page, "1 failed, 1 not started.")
        for uid, says in zip(servos, ("done", "failed", "not_tried"), strict=True):
            verdict(page, uid, says)
        expect(page.get_by_test_id(f"run-{servos[1]}").get_by_role("alert")).to_contain_text("respond")
        held = saved_ids(server, servos[:1])[0]
        port = urlsplit(server.url).port or 0
    expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "down")
    expect(page.get_by_test_id("resume")).to_be_disabled()

    # the servos went with the simulation: the same three are plugged in again, each with what it had in ROM
    with running(*serving(tmp_path, "--sim-api"), port=port) as again:
        plugged_again(again, dict(zip(servos, (held, 0, 0), strict=True)))
        expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
        heading(page, "1 of 3 servos are commissioned")
        expect(page.get_by_test_id("resume")).to_be_enabled()
        page.get_by_test_id("resume").click()
        all_done(page, again, servos)
        assert saved_ids(again, servos[:1]) == [held]


@pytest.mark.release
def test_a_job_interrupted_by_a_server_restart_resumes_from_another_browser(
    context: BrowserContext, tmp_path: Path
) -> None:
    with running(*serving(tmp_path, "--sim-api")) as server:
        servos = plugged(server, 2)
        body = {"servos": [{"uid": uid, "servo_id": at, "label": f"Flap {at}"} for at, uid in enumerate(servos, 1)]}
        sim(server, servos[1], restart_delay_s=30)
        job = server.api.post("/commissioning", json={**body, "save": True}).json()["id"]

        def in_the_middle() -> bool:
            units = server.api.get(f"/jobs/{job}").json()["result"]["servos"]
            first_done = units[0]["verdict"] == "done"
            return first_done and server.api.get(f"/sim/servos/{servos[1]}").json()["stage"] != "running"

        wait_for(in_the_middle, "the job does not come so far")
    page = context.new_page()
    with running(*serving(tmp_path, "--sim-api")) as again:
        plugged_again(again, {uid: at for at, uid in enumerate(servos, 1)})
        page.goto(again.url + "commission")
        expect(page.get_by_test_id("unfinished")).to_contain_text("was not completed")
        page.get_by_test_id("look-unfinished").click()
        at_report(page)
        heading(page, "1 of 2 servos are commissioned")
        page.get_by_test_id("resume").click()
        all_done(page, again, servos)
