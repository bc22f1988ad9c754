"""Commissioning without a save is not finished: said so, and saved from the report, by mouse, touch and keys alone."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, ViewportSize, expect

from e2e.looks import complaints, too_small
from e2e.servers import Server, running, serving, turn_by_hand, until
from e2e.test_commission_failing import at_report, heading, plugged, saved_ids, sim
from e2e.test_story import press

JOB_MS = 60_000


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


WIDE: ViewportSize = {"width": 1440, "height": 900}
TABLET: ViewportSize = {"width": 820, "height": 1180}


class Hand:
    """Whoever sits there: presses what has a test id."""

    def __init__(self, page: Page, by: str) -> None:
        self._page, self._by = page, by

    def do(self, testid: str, key: str = "Enter") -> None:
        if self._by == "keyboard":
            press(self._page, testid, key)
        elif self._by == "touch":
            self._page.get_by_test_id(testid).tap()
        else:
            self._page.get_by_test_id(testid).click()

    def tick(self, testid: str) -> None:
        self.do(testid, "Space")


def commissioned_in_ram(page: Page, server: Server, hand: Hand) -> None:
    """Everybody gets the next free ID, and nothing is saved."""
    page.goto(server.url + "commission")
    expect(page.get_by_test_id("find-count")).to_contain_text("2 of 2", timeout=25_000)
    hand.do("find-go")
    hand.do("give-rest")
    hand.do("identify-go")
    hand.do("profile-go")
    expect(page.locator('[data-testid^="changes-"]').first).to_be_visible(timeout=30_000)
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Asking", timeout=30_000)
    hand.tick("save")
    expect(page.get_by_test_id("horn-free")).to_have_count(0)
    hand.do("start")
    at_report(page)


@pytest.mark.parametrize("by", ["mouse", "touch", "keyboard"])
def test_values_in_ram_are_not_finished_until_they_are_saved_from_the_report(
    by: str, browser: Browser, server: Server, servos: list[str]
) -> None:
    size = TABLET if by == "touch" else WIDE
    context: BrowserContext = browser.new_context(viewport=size, has_touch=by == "touch")
    context.set_default_timeout(15_000)
    page, report = context.new_page(), "commission-page"
    hand = Hand(page, by)
    commissioned_in_ram(page, server, hand)

    heading(page, "Not finished: 2 servos in RAM only")
    expect(page.get_by_test_id(report)).not_to_contain_text("are commissioned")
    for uid in servos:
        unit = page.get_by_test_id(f"run-{uid}")
        expect(unit).to_have_attribute("data-place", "ram")
        expect(unit).to_contain_text("In RAM only")
    expect(page.get_by_test_id("run-step").locator(".k-ok"), "a green mark").to_have_count(0)
    steps = page.locator(".wizard-steps li.past")
    expect(steps).to_have_count(4)
    assert saved_ids(server, servos) == [0, 0]
    assert complaints(page) == []
    if by == "touch":
        assert too_small(page) == []

    for uid in servos:
        turn_by_hand(server, uid, 30)
    hand.do("report-save")
    expect(page.get_by_test_id("after-save")).to_contain_text("The horn moves: +30.0° to 0.0°")
    expect(page.get_by_test_id("plan-go")).to_be_disabled()
    hand.tick("horn-free")
    hand.do("plan-go")
    for uid in servos:
        expect(page.get_by_test_id(f"result-{uid}")).to_have_attribute("data-state", "ok", timeout=JOB_MS)
    hand.do("plan-close")
    heading(page, "All 2 servos are commissioned")
    heading(page, "Saved, and read back from ROM after the restart.")
    expect(page.get_by_test_id("report-save")).to_have_count(0)
    expect(steps).to_have_count(6)
    ids = saved_ids(server, servos)
    assert len(set(ids)) == 2
    assert 0 not in ids
    page.reload()
    heading(page, "All 2 servos are commissioned")
    context.close()


def test_values_that_a_power_cut_took_are_not_called_commissioned(
    context: BrowserContext, server: Server, servos: list[str]
) -> None:
    page = context.new_page()
    commissioned_in_ram(page, server, Hand(page, "mouse"))
    heading(page, "Not finished: 2 servos in RAM only")
    for uid in servos:
        sim(server, uid, power="off")
    until(lambda: all(not one["online"] for one in server.servos()), 20, "they are still heard")
    for uid in servos:
        sim(server, uid, power="on")
    heading_ms = 40_000
    said = "Not finished: 2 servos do not hold the values any more"
    expect(page.get_by_test_id("commission-page")).to_contain_text(said, timeout=heading_ms)
    expect(page.get_by_test_id("report-save")).to_have_count(0)
    expect(page.get_by_test_id(f"retry-{servos[0]}")).to_be_visible()
