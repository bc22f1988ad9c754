"""The Site page: benches that share a database, and the search over the servos of all of them."""

import os
import re
import signal
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo, Server, running, serving

pytestmark = pytest.mark.release

HERE, THERE = "a0" * 16, "b0" * 16


@pytest.fixture(scope="module")
def benches(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, Server]]:
    """Two servers with one database, each with one servo."""
    words = serving(tmp_path_factory.mktemp("site"), "--sim-api", "--bench")
    with running(*words, "Bench 1") as first, running(*words, "Rig 3") as second:
        for server, uid in ((first, HERE), (second, THERE)):
            server.api.post("/sim/servos", json={"model": "BLA21-06U-A0", "uid": uid}).raise_for_status()
            server.ready(1)
        yield first, second


@pytest.fixture
def demo(benches: tuple[Server, Server]) -> Demo:
    """The bench that the pages show: requests to another host are an error."""
    return Demo(benches[0].url, benches[0].api)


def test_a_servo_is_found_on_the_bench_that_has_it(page: Page, benches: tuple[Server, Server]) -> None:
    first, second = benches
    second.api.patch(f"/servos/{THERE}", json={"label": "Cell arm 7"}).raise_for_status()
    page.goto(first.url)
    expect(page.get_by_test_id("bench-name")).to_have_text("Bench 1", timeout=20_000)
    page.get_by_role("link", name="Site").click()
    expect(page.get_by_test_id("stop")).to_contain_text("Bench 1 only")
    expect(page.get_by_test_id("bench-Bench 1")).to_contain_text("This bench")
    other = page.get_by_test_id("bench-Rig 3")
    expect(other).to_contain_text("Active")
    expect(other.get_by_role("link", name="Open")).to_have_attribute("href", second.url)
    page.get_by_role("searchbox").fill("arm 7")
    row = page.get_by_test_id(f"site-{THERE}")
    expect(row).to_contain_text("Last seen on Rig 3", timeout=20_000)
    expect(row.locator("mark")).to_have_text("arm 7")
    expect(page.get_by_test_id(f"site-{HERE}")).to_have_count(0)
    page.get_by_role("searchbox").fill("")
    page.get_by_test_id(f"site-{HERE}").get_by_role("link").click()
    expect(page).to_have_url(re.compile(f"/servos/{HERE}$"))


def test_a_bench_that_stops_responding_is_shown_as_such(page: Page, benches: tuple[Server, Server]) -> None:
    first, second = benches
    page.goto(first.url + "site")
    expect(page.get_by_test_id("bench-Rig 3")).to_contain_text("Active", timeout=20_000)
    os.kill(second.process.pid, signal.SIGSTOP)
    try:
        silent = page.get_by_test_id("bench-Rig 3")
        expect(silent).to_contain_text("No contact for", timeout=30_000)
        expect(silent).to_contain_text("May still move its servos")
        expect(page.get_by_test_id("site-badge")).to_contain_text("1")
    finally:
        os.kill(second.process.pid, signal.SIGCONT)
