"""Printed pages: the name of the servo, and headings of tables that are buttons on the screen."""

from playwright.sync_api import Page, expect

from e2e.servers import Demo
from e2e.state import uids_of


def test_a_printed_page_names_the_servo_without_buttons(page: Page, demo: Demo) -> None:
    uid = uids_of(demo)[0]
    page.emulate_media(media="print")
    page.goto(f"{demo.url}servos/{uid}/faults")
    expect(page.get_by_test_id("choose-servo")).to_be_visible()
    expect(page.get_by_test_id("wiggle")).to_be_hidden()
    page.goto(f"{demo.url}records")
    expect(page.locator("thead .table-sort").first).to_be_visible()
    expect(page.locator(".bar").first).to_be_hidden()
