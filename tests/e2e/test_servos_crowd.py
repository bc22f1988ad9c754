"""The list of many servos: asked for as one, and never grey while they are well."""

import re
import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo, Server, running

COUNT = 24
PAUSE_S = 0.5
GREY_S = 1.0
"""A busy computer may hold up a row for a moment; nothing stays grey for so long."""

LONGEST_GREY = """async seconds => {
    const since = {}, longest = {};
    const end = performance.now() + seconds * 1000;
    while (performance.now() < end) {
        for (const row of document.querySelectorAll('.servo-row')) {
            const cells = {angle: row.querySelector('.c-angle[data-stale="true"]'),
                           supply: row.querySelector('.c-supply .dim'), age: row.querySelector('.c-age.strong')};
            for (const [cell, grey] of Object.entries(cells)) {
                const key = `${cell} of ${row.dataset.testid}`;
                if (!grey) { delete since[key]; continue; }
                since[key] ??= performance.now();
                longest[key] = Math.max(longest[key] ?? 0, (performance.now() - since[key]) / 1000);
            }
        }
        await new Promise(requestAnimationFrame);
    }
    return longest;
}"""


@pytest.fixture(scope="module")
def own() -> Iterator[Server]:
    """A demo of many servos, all of them ready."""
    with running("demo", "--servos", str(COUNT), "--seed", "1") as server:
        server.ready(COUNT, within_s=60)
        yield server


@pytest.fixture(scope="module")
def demo(own: Server) -> Demo:
    """The same as what the page may ask: nobody else."""
    return Demo(own.url, own.api)


@pytest.fixture
def asked(page: Page) -> list[str]:
    """Paths of what the page asks about servos, as they come."""
    found: list[str] = []

    def hear(url: str) -> None:
        path = url.partition("/api/v1")[2]
        if path.startswith(("/servos/", "/parameters", "/faults")):
            found.append(path)

    page.on("request", lambda request: hear(request.url))
    return found


@pytest.fixture
def shown(page: Page, own: Server, asked: list[str]) -> Page:
    """The list, painted for the first time."""
    page.goto(own.url + "servos")
    expect(page.locator(".servo-row")).to_have_count(COUNT)
    expect(page.locator(".c-supply").filter(has_text=re.compile(r"\d\s?V"))).to_have_count(COUNT)
    page.wait_for_timeout(500)
    return page


def together(asked: list[str], path: str, took_s: float) -> None:
    """Servos that change one after another are asked about twice a second at most, however many there are."""
    assert all(one.startswith(path) for one in asked), asked
    assert 0 < len(asked) <= took_s / PAUSE_S + 1


def test_all_rows_take_one_request_and_none_when_shown_again(shown: Page, own: Server, asked: list[str]) -> None:
    (path,) = asked
    prefix, _, listed = path.partition("=")
    assert (prefix, sorted(listed.split(","))) == ("/parameters?uids", sorted(str(one["uid"]) for one in own.servos()))
    asked.clear()
    rows = shown.locator(".servo-row")
    model = str(own.servos()[0]["model"])
    shown.get_by_test_id("filter-model").select_option(model)
    expect(rows).to_have_count(sum(one["model"] == model for one in own.servos()))
    shown.get_by_test_id("filter-model").select_option("")
    expect(rows).to_have_count(COUNT)
    shown.get_by_role("searchbox").fill("nobody is called so")
    expect(rows).to_have_count(0)
    shown.get_by_role("searchbox").fill("")
    expect(rows).to_have_count(COUNT)
    shown.wait_for_timeout(1000)
    assert asked == []


def test_changes_are_published_and_restarts_read_together(shown: Page, own: Server, asked: list[str]) -> None:
    asked.clear()
    uids = [str(one["uid"]) for one in own.servos()]
    body = {"servos": {uid: {"angle_p_gain": 43} for uid in uids}}
    own.api.patch("/parameters", json=body, timeout=90).raise_for_status()
    changed = sum(one["unsaved"] != [] for one in own.servos())
    assert changed >= COUNT - 1, "of one that lost its ROM nothing is known to compare with"
    expect(shown.locator(".c-rom .half")).to_have_count(changed)
    assert asked == []
    before = time.monotonic()
    for uid in uids:
        own.api.post(f"/servos/{uid}/restart").raise_for_status()
    expect(shown.locator(".c-rom .half")).to_have_count(0, timeout=60_000)
    expect(shown.locator(".servo-row[data-state='ready']")).to_have_count(COUNT, timeout=60_000)
    shown.wait_for_timeout(1500)
    together(asked, "/parameters?uids=", time.monotonic() - before)
    assert {uid for path in asked for uid in path.partition("=")[2].split(",")} == set(uids)


def test_the_faults_of_all_take_one_request(page: Page, own: Server, asked: list[str]) -> None:
    own.ready(COUNT, within_s=60)
    page.goto(own.url + "faults")
    expect(page.get_by_test_id("faults-list")).not_to_contain_text("Reading")
    page.wait_for_timeout(500)
    (path,) = asked
    prefix, _, listed = path.partition("=")
    assert (prefix, sorted(listed.split(","))) == ("/faults?uids", sorted(str(one["uid"]) for one in own.servos()))
    asked.clear()
    before = time.monotonic()
    for one in own.servos():
        own.api.patch(f"/sim/servos/{one['uid']}", json={"faults": {"sensor_weak": True}}).raise_for_status()
    lines = page.get_by_test_id("faults-now").get_by_test_id("fault-sensor_weak")
    expect(lines).to_have_count(COUNT, timeout=30_000)
    together(asked, "/faults?uids=", time.monotonic() - before)


def test_no_healthy_servo_looks_stale(shown: Page, own: Server) -> None:
    own.ready(COUNT, within_s=60)
    longest = shown.evaluate(LONGEST_GREY, 6)
    assert [key for key, seconds in longest.items() if seconds > GREY_S] == []
