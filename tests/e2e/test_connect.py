"""From a server without a bus to servos in the list: adapters as cards, remedies without an adapter, the demo."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Page, Route, expect

from e2e.looks import complaints, still, too_small
from e2e.servers import Server, running, serving

NOTHING: list[dict[str, Any]] = [
    {"address": "memory:demo", "name": "Simulated servos", "state": "ready", "usable": True, "bitrate": 1_000_000,
     "sample_point": None, "serial_number": None, "baud": None, "reason": None, "remedy": None,
     "cause": None, "params": {}},
]  # fmt: skip
COMMAND = "sudo ip link set can0 up type can bitrate 1000000"
PLUGGED: list[dict[str, Any]] = [
    *NOTHING,
    {"address": "socketcan:can0", "name": "PCAN-USB", "state": "down", "usable": False, "bitrate": None,
     "sample_point": None, "serial_number": None, "baud": None, "reason": "The interface can0 is down.",
     "remedy": f"Bring it up with: {COMMAND}", "cause": "interface_down",
     "params": {"interface": "can0", "command": COMMAND}},
    {"address": "slcan:/dev/ttyACM0", "name": "CANable", "state": "ready", "usable": True, "bitrate": None,
     "sample_point": None, "serial_number": "A1B2", "baud": 1_000_000, "reason": None, "remedy": None,
     "cause": None, "params": {}},
]  # fmt: skip


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with running(*serving(tmp_path)) as one:
        yield one


@pytest.fixture
def plain(context: BrowserContext) -> Page:
    """An unwatched page with its own server."""
    return context.new_page()


def adapters(page: Page, found: list[dict[str, Any]]) -> None:
    def respond(route: Route) -> None:
        route.fulfill(json=found)

    page.route("**/api/v1/bus/adapters", respond)


def test_without_an_adapter_the_page_offers_the_demo(server: Server, plain: Page) -> None:
    adapters(plain, NOTHING)
    plain.goto(server.url)
    expect(plain.get_by_test_id("no-servos")).to_be_visible()
    plain.get_by_test_id("open-connect").click()
    dialog = plain.get_by_test_id("connect-dialog")
    expect(plain.get_by_test_id("no-adapter")).to_contain_text("No adapters found")
    # the list can be acted on: commands to copy, and the doctor's findings with their remedies
    expect(plain.get_by_test_id("no-adapter").locator("code").first).to_have_text("lsusb")
    expect(dialog.locator(".finding[data-severity=failure]")).to_contain_text("No bus is connected")
    assert complaints(plain) == []

    expect(plain.get_by_test_id("adapter-memory:demo").get_by_role("radio")).to_be_checked()
    plain.get_by_test_id("connect").click()
    expect(dialog).to_have_count(0)
    expect(plain.locator("[data-testid^=servo-row-]")).to_have_count(6)
    expect(plain.get_by_test_id("bar-bus")).to_contain_text("Active")
    server.ready(6)


def test_the_choice_is_shown_when_the_search_has_ended(server: Server, plain: Page) -> None:
    searches: list[Route] = []
    plain.route("**/api/v1/bus/adapters", lambda route: searches.append(route))
    plain.goto(server.url + "bus")
    choice = plain.get_by_test_id("connect-here")
    expect(choice.get_by_role("status")).to_have_text("Searching for adapters")
    expect(choice.get_by_role("radio")).to_have_count(0)  # adapters found would push it away from the pointer
    expect(plain.get_by_test_id("connect")).to_be_disabled()
    searches[0].fulfill(json=PLUGGED)
    expect(choice.get_by_role("radio")).to_have_count(4)
    expect(plain.get_by_test_id("connect")).to_be_enabled()


def test_adapters_show_their_state_and_precede_the_demo(server: Server, plain: Page) -> None:
    plain.emulate_media(color_scheme="light", reduced_motion="reduce")
    adapters(plain, PLUGGED)
    plain.goto(server.url + "bus")
    cards = plain.get_by_test_id("adapters").locator("[data-testid^=adapter-][data-usable]")
    expect(cards).to_have_count(3)
    names = [card.get_attribute("data-testid") for card in cards.all()]
    assert names == ["adapter-socketcan:can0", "adapter-slcan:/dev/ttyACM0", "adapter-memory:demo"]
    down = plain.get_by_test_id("adapter-socketcan:can0")
    expect(down.get_by_role("radio")).to_be_disabled()
    expect(down).to_contain_text("The interface can0 is down.")
    expect(down.locator("code")).to_have_text(COMMAND)
    expect(plain.get_by_test_id("adapter-slcan:/dev/ttyACM0").get_by_role("radio")).to_be_checked()
    expect(plain.get_by_test_id("connect")).to_have_text("Connect ttyACM0")
    expect(plain.get_by_test_id("no-adapter")).to_have_count(0)

    expect(plain.get_by_test_id("connect-here")).to_be_visible()
    still(plain)
    assert complaints(plain) == [], "light"
    plain.emulate_media(color_scheme="dark", reduced_motion="reduce")
    assert complaints(plain, "color-contrast") == [], "dark"
    plain.set_viewport_size({"width": 820, "height": 1180})
    assert too_small(plain) == []

    plain.get_by_test_id("connect").click()  # no such thing is plugged into this machine
    expect(plain.get_by_test_id("connect-refused")).to_contain_text(re.compile("ttyACM0"))
    assert server.api.get("/bus").json()["state"] == "disconnected"


def test_leaving_the_demo_needs_confirmation_and_switches_it_off(server: Server, plain: Page, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir(exist_ok=True)
    (tmp_path / "logs" / "short.log").write_text("(1.000000) can0 1E08FF05#0102030405060708\n")
    adapters(plain, PLUGGED)
    server.api.put("/bus", json={"address": "memory:demo"}).raise_for_status()
    server.ready(6)
    plain.goto(server.url + "bus")
    plain.get_by_test_id("bus-change").click()
    plain.get_by_test_id("adapter-memory:demo").get_by_role("radio").check()
    expect(plain.get_by_test_id("switches-off")).to_have_count(0)
    plain.get_by_test_id("adapter-other").check()
    plain.get_by_test_id("adapter-address").fill("file:short.log")
    expect(plain.get_by_test_id("switches-off")).to_contain_text("simulated servos are switched off")
    assert all(one["power"] == "on" for one in server.api.get("/sim/servos").json())
    plain.get_by_test_id("connect").click()
    expect(plain.get_by_test_id("connect-dialog")).to_have_count(0)
    assert [one["power"] for one in server.api.get("/sim/servos").json()] == ["off"] * 6


def test_a_serial_adapter_shows_its_line_notes_and_frame_gap(server: Server, plain: Page) -> None:
    pytest.importorskip("termios", reason="pseudo terminals are a matter of POSIX")
    from unit.bus.adapter import FakeAdapter

    with FakeAdapter(responds="fixed", bus=True, baud=1_000_000) as adapter:
        plain.goto(server.url + "bus")
        plain.get_by_test_id("adapter-other").check()
        plain.get_by_test_id("adapter-address").fill(f"slcan:{adapter.channel}")
        plain.get_by_test_id("adapter-options").locator("summary").click()
        plain.get_by_test_id("adapter-gap").fill("21")
        expect(plain.get_by_test_id("adapter-options")).to_contain_text(
            "21 is not a valid frame gap. Enter 0 to 20 ms."
        )
        expect(plain.get_by_test_id("connect")).to_be_disabled()
        plain.get_by_test_id("adapter-gap").fill("3")
        plain.get_by_test_id("connect").click()
        expect(plain.get_by_test_id("bus-facts")).to_contain_text("Serial line 1\u202f000\u202f000 baud")
        plain.get_by_test_id("bus-change").click()
        facts = plain.get_by_test_id("line-facts")
        expect(facts.get_by_test_id("line-baud")).to_contain_text("1\u202f000\u202f000 bauddetected")
        expect(facts.get_by_test_id("line-budget")).to_contain_text("3\u202f703 frames/s")
        expect(facts.get_by_test_id("line-gap")).to_contain_text("3\u202fms")
        expect(facts.get_by_test_id("line-notes")).to_contain_text("bit rate of the adapter cannot be set")
        assert complaints(plain) == []
        server.api.delete("/bus").raise_for_status()
