"""The page without its server: every page opens, and failed downloads are repeated later."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from e2e.servers import Demo, Server, running
from e2e.test_never_lies import alive

TABS = ("Parameters", "Tune", "Overview")
PAGES = ("Commission", "Matrix", "Motion", *TABS, "Faults", "Bus", "Records", "API", "Servos")


@pytest.fixture
def own() -> Iterator[Server]:
    """A demo that can be killed."""
    with running("demo", "--servos", "2", "--seed", "3") as server:
        server.ready(2)
        yield server


@pytest.fixture
def tab(fresh_page: Page) -> Page:
    """Not watched: the console logs the failures caused here, as expected."""
    return fresh_page


def port_of(server: Server) -> int:
    return int(re.findall(r":(\d+)/", server.url)[0])


def kill(server: Server, page: Page) -> None:
    server.process.kill()
    server.process.wait(timeout=10)
    expect(page.get_by_test_id("live-state")).to_have_attribute("data-state", "down")


def open_page(page: Page, name: str) -> None:
    page.locator("nav").get_by_role("link", name=re.compile(f"^{name}")).first.click()


@pytest.mark.release
def test_every_page_opens_without_the_server(own: Server, tab: Page) -> None:
    tab.goto(own.url)
    expect(tab.locator("html")).to_have_attribute("data-loaded", "all")
    kill(own, tab)
    for name in PAGES:
        open_page(tab, name)
        expect(tab.locator("main .page")).to_be_visible()
        expect(tab.locator("[data-testid=not-loaded], [data-testid=panel-failed]")).to_have_count(0)
    tab.locator("[data-testid^=servo-row-] input[type=checkbox]").first.check()
    tab.get_by_test_id("plot-selected").click()
    expect(tab.locator(".selection-plot canvas").first).to_be_visible()
    tab.get_by_test_id("edit-together").click()
    expect(tab.locator(".matrix")).to_be_visible()
    tab.get_by_test_id("keys").click()
    expect(tab.get_by_role("dialog")).to_be_visible()
    expect(tab.get_by_test_id("not-loaded")).to_have_count(0)
    style = tab.evaluate("() => [...document.styleSheets].every(one => one.cssRules.length > 0)")
    assert style is True


def test_a_page_not_loaded_appears_when_the_link_is_back(own: Server, tab: Page) -> None:
    port = port_of(own)
    tab.route("**/assets/faults-*", lambda route: route.abort())
    with tab.expect_event("requestfailed", lambda one: "/assets/faults-" in one.url):
        tab.goto(own.url)
    expect(tab.locator("[data-testid^=servo-row-]")).to_have_count(2)
    kill(own, tab)
    open_page(tab, "Faults")
    missing = tab.get_by_test_id("not-loaded")
    expect(missing).to_have_attribute("data-cause", "link")
    expect(missing).to_contain_text("hornbill cannot be reached")
    expect(missing.get_by_role("button")).to_have_count(0)
    tab.unroute("**/assets/faults-*")
    with running("demo", "--servos", "2", "--seed", "3", port=port):
        expect(tab.get_by_test_id("faults-page")).to_be_visible()
        expect(tab.get_by_test_id("not-loaded")).to_have_count(0)
        rules = "() => [...document.styleSheets].some(one => /faults-/.test(one.href) && one.cssRules.length > 0)"
        tab.wait_for_function(rules)


def test_an_updated_server_is_named_as_the_cause(tab: Page, demo: Demo) -> None:
    tab.route("**/assets/faults-*", lambda route: route.fulfill(status=404))
    tab.goto(demo.url)
    expect(tab.locator("[data-testid^=servo-row-]").first).to_be_visible()
    newer = tab.context.request.get(demo.url).text().replace("assets/index-", "assets/index-newer-")
    tab.route(demo.url, lambda route: route.fulfill(body=newer, content_type="text/html"))
    open_page(tab, "Faults")
    missing = tab.get_by_test_id("not-loaded")
    expect(missing).to_have_attribute("data-cause", "updated")
    expect(missing.get_by_role("button", name="Reload")).to_be_visible()


def test_an_incomplete_download_is_retried(tab: Page, demo: Demo) -> None:
    tab.route("**/assets/faults-*", lambda route: route.fulfill(status=404))
    tab.goto(demo.url)
    open_page(tab, "Faults")
    expect(tab.get_by_test_id("not-loaded")).to_have_attribute("data-cause", "refused")
    expect(tab.get_by_role("alert").filter(has_text="could not be loaded")).to_be_visible()
    alive(tab)
    open_page(tab, "Bus")
    expect(tab.get_by_test_id("monitor")).to_be_visible()
    open_page(tab, "Faults")
    tab.unroute("**/assets/faults-*")
    expect(tab.get_by_test_id("faults-page")).to_be_visible()


def test_another_language_waits_for_the_server(own: Server, tab: Page) -> None:
    tab.goto(own.url)
    other = tab.get_by_role("button", name="日本語")
    expect(other).to_be_enabled()
    kill(own, tab)
    expect(other).to_be_disabled()
