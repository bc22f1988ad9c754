"""Commissioning without a save is reported as incomplete, and saved from the report, by touch."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from e2e.hand import Hand, hand_of
from e2e.looks import complaints, too_small
from e2e.servers import Server, running, serving, turn_manually
from e2e.state import sim, wait_for
from e2e.test_commission_failing import at_report, heading, plugged, saved_ids


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running(*serving(tmp_path_factory.mktemp("data"), "--sim-api")) as one:
        yield one


@pytest.fixture
def servos(server: Server) -> Iterator[list[str]]:
    made = plugged(server, 2)
    yield made
    for uid in made:
        server.api.delete(f"/sim/servos/{uid}")


def commissioned_in_ram(server: Server, hand: Hand) -> None:
    """All servos get the next free ID, and nothing is saved."""
    page = hand.page
    page.goto(server.url + "commission")
    expect(page.get_by_test_id("find-count")).to_contain_text("2 of 2")
    hand.press("find-go")
    hand.press("give-rest")
    hand.press("identify-go")
    hand.press("profile-go")
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Reading")
    hand.press("save", "Space")
    expect(page.get_by_test_id("horn-free")).to_have_count(0)
    hand.press("start")
    at_report(page)


def test_ram_values_are_complete_only_after_a_save_from_the_report(
    browser: Browser, server: Server, servos: list[str]
) -> None:
    with hand_of(browser, "touch") as hand:
        saved_from_the_report(hand, server, servos)


def saved_from_the_report(hand: Hand, server: Server, servos: list[str]) -> None:
    page, report = hand.page, "commission-page"
    commissioned_in_ram(server, hand)

    heading(page, "Not complete: 2 servos in RAM only")
    expect(page.get_by_test_id(report)).not_to_contain_text("servos are commissioned")
    for uid in servos:
        unit = page.get_by_test_id(f"run-{uid}")
        expect(unit).to_have_attribute("data-place", "ram")
        expect(unit).to_contain_text("In RAM only")
    expect(page.get_by_test_id("run-step").locator(".k-ok"), "a green mark").to_have_count(0)
    steps = page.locator(".wizard-steps li.past")
    expect(steps).to_have_count(4)
    assert saved_ids(server, servos) == [0, 0]
    assert complaints(page) == []
    if hand.way == "touch":
        assert too_small(page) == []

    for uid in servos:
        turn_manually(server, uid, 30)
    hand.press("report-save")
    expect(page.get_by_test_id("after-save")).to_contain_text("The horn moves: +30.0° to 0.0°")
    expect(page.get_by_test_id("batch-save-go")).to_be_disabled()
    hand.tick("horn-free")
    hand.press("batch-save-go")
    for uid in servos:
        expect(page.get_by_test_id(f"turn-{uid}")).to_have_attribute("data-state", "done")
    hand.press("change-close")
    heading(page, "All 2 servos are commissioned")
    heading(page, "Saved and verified in ROM after the restart.")
    expect(page.get_by_test_id("report-save")).to_have_count(0)
    expect(steps).to_have_count(6)
    ids = saved_ids(server, servos)
    assert len(set(ids)) == 2
    assert 0 not in ids
    page.reload()
    heading(page, "All 2 servos are commissioned")


def test_values_lost_by_a_power_cut_are_not_reported_as_commissioned(
    context: BrowserContext, server: Server, servos: list[str]
) -> None:
    page = context.new_page()
    commissioned_in_ram(server, Hand(page, "mouse"))
    heading(page, "Not complete: 2 servos in RAM only")
    for uid in servos:
        sim(server, uid, power="off")
    wait_for(lambda: all(not one["online"] for one in server.servos()), "they are still online")
    for uid in servos:
        sim(server, uid, power="on")
    said = "Not complete: 2 servos have lost the values"
    expect(page.get_by_test_id("commission-page")).to_contain_text(said)
    expect(page.get_by_test_id("report-save")).to_have_count(0)
    expect(page.get_by_test_id(f"retry-{servos[0]}")).to_be_visible()
