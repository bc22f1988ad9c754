"""The list of many servos: read with one request, and never stale while they are healthy."""

import csv
import re
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo, Server, running
from e2e.state import wait_for

COUNT = 12
PAUSE_S = 0.5
GREY_S = 1.0
"""Nothing stays stale for this time, on a computer that keeps up."""
READ_S = 2.5
"""A value that was read within this time is not stale."""

ARRIVALS = """{
    const { send } = WebSocket.prototype;
    let last = null;
    window.gap = 0;
    const note = () => {
        const now = performance.now() / 1000;
        window.gap = Math.max(window.gap, now - (last ?? now));
        last = now;
    };
    WebSocket.prototype.send = function(data) {
        if (this.known !== true) this.addEventListener('message', note);
        this.known = true;
        send.call(this, data);
    };
}"""
"""Measure the longest time between two messages of the server."""
LONGEST_GREY = """async seconds => {
    const since = {}, longest = {};
    let blocked = 0, before = performance.now();
    window.gap = 0;
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
        blocked = Math.max(blocked, (performance.now() - before) / 1000);
        before = performance.now();
    }
    return [longest, window.gap + blocked];
}"""
"""How long cells were stale, and the longest silence of the server and block of the page, s."""


@pytest.fixture(scope="module")
def own() -> Iterator[Server]:
    """A demo with many servos, all ready."""
    with running("demo", "--servos", str(COUNT), "--seed", "1") as server:
        server.ready(COUNT)
        yield server


@pytest.fixture(scope="module")
def demo(own: Server) -> Demo:
    """The same server, as the page's fixtures expect it."""
    return Demo(own.url, own.api)


@pytest.fixture
def requests(page: Page) -> list[str]:
    """Paths of the page's requests about servos."""
    found: list[str] = []

    def note(url: str) -> None:
        path = url.partition("/api/v1")[2]
        if path.startswith(("/servos/", "/parameters", "/faults")):
            found.append(path)

    page.on("request", lambda request: note(request.url))
    return found


@pytest.fixture
def shown(page: Page, own: Server, requests: list[str]) -> Page:
    """The list, after it was first shown."""
    page.add_init_script(ARRIVALS)
    page.goto(own.url + "servos")
    expect(page.locator(".servo-row")).to_have_count(COUNT)
    expect(page.locator(".c-supply").filter(has_text=re.compile(r"\d\s?V"))).to_have_count(COUNT)
    heard(page, lambda: requests != [])
    return page


def heard(page: Page, what: Callable[[], bool]) -> None:
    """Wait until the page has made these requests, and half a second for more."""

    def made() -> bool:
        page.wait_for_timeout(100)
        return what()

    wait_for(made, "the page makes no request")
    page.wait_for_timeout(500)


def together(requests: list[str], path: str, took_s: float) -> None:
    """Servos that change one after another are read at most twice per second, however many change."""
    assert all(one.startswith(path) for one in requests), requests
    assert 0 < len(requests) <= took_s / PAUSE_S + 1


@pytest.mark.release
def test_all_rows_take_one_request_and_none_when_shown_again(shown: Page, own: Server, requests: list[str]) -> None:
    (path,) = requests
    prefix, _, listed = path.partition("=")
    assert (prefix, sorted(listed.split(","))) == ("/parameters?uids", sorted(str(one["uid"]) for one in own.servos()))
    requests.clear()
    rows = shown.locator(".servo-row")
    model = str(own.servos()[0]["model"])
    shown.get_by_test_id("filter-model").select_option(model)
    expect(rows).to_have_count(sum(one["model"] == model for one in own.servos()))
    shown.get_by_test_id("filter-model").select_option("")
    expect(rows).to_have_count(COUNT)
    shown.get_by_role("searchbox").fill("no such name")
    expect(rows).to_have_count(0)
    shown.get_by_role("searchbox").fill("")
    expect(rows).to_have_count(COUNT)
    shown.wait_for_timeout(1000)
    assert requests == []


@pytest.mark.release
def test_changes_are_published_and_restarts_read_together(shown: Page, own: Server, requests: list[str]) -> None:
    requests.clear()
    uids = [str(one["uid"]) for one in own.servos()]
    body = {"servos": {uid: {"angle_p_gain": 43} for uid in uids}}
    own.api.patch("/parameters", json=body, timeout=90).raise_for_status()
    changed = sum(one["unsaved"] != [] for one in own.servos())
    assert changed >= COUNT - 1, "of one that lost its ROM nothing is known to compare with"
    expect(shown.locator(".c-rom .half")).to_have_count(changed)
    assert requests == []
    before = time.monotonic()
    for uid in uids:
        own.api.post(f"/servos/{uid}/restart").raise_for_status()
    expect(shown.locator(".c-rom .half")).to_have_count(0)
    expect(shown.locator(".servo-row[data-state='ready']")).to_have_count(COUNT)
    heard(shown, lambda: {uid for path in requests for uid in path.partition("=")[2].split(",")} == set(uids))
    together(requests, "/parameters?uids=", time.monotonic() - before)


def test_the_faults_of_all_take_one_request(page: Page, own: Server, requests: list[str]) -> None:
    own.ready(COUNT)
    page.goto(own.url + "faults")
    expect(page.get_by_test_id("faults-list")).not_to_contain_text("Reading")
    heard(page, lambda: requests != [])
    (path,) = requests
    prefix, _, listed = path.partition("=")
    assert (prefix, sorted(listed.split(","))) == ("/faults?uids", sorted(str(one["uid"]) for one in own.servos()))
    requests.clear()
    before = time.monotonic()
    for one in own.servos():
        own.api.patch(f"/sim/servos/{one['uid']}", json={"faults": {"sensor_weak": True}}).raise_for_status()
    lines = page.get_by_test_id("faults-now").get_by_test_id("fault-sensor_weak")
    expect(lines).to_have_count(COUNT)
    together(requests, "/faults?uids=", time.monotonic() - before)


def overdue(own: Server, uid: str) -> float:
    """How much later than usual the server read the supply, s: it may have little time on a busy machine."""
    lines = own.api.get(f"/servos/{uid}/telemetry.csv", params={"seconds": 10}).text.splitlines()
    rows = list(csv.DictReader(lines))
    gaps: list[float] = []
    for channel in ("current_voltage", "current_temperature"):
        times = [float(one["t_s"]) for one in rows if one[channel]] + [float(rows[-1]["t_s"])]
        gaps += [after - before for before, after in pairwise(times)]
    return max(0.0, max(gaps) - READ_S)


def test_no_healthy_servo_looks_stale(shown: Page, own: Server) -> None:
    uids = own.ready(COUNT)
    longest, late = shown.evaluate(LONGEST_GREY, 6)
    most = GREY_S + 2 * late + max(overdue(own, uid) for uid in uids)
    assert {key: seconds for key, seconds in longest.items() if seconds > most} == {}, late
