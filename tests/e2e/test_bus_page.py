"""The Bus page: doctor, monitor, nodes, node IDs, logs and connecting, in both themes and on a tablet."""

import itertools
import json
import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, WebSocketRoute, expect

from e2e.looks import still, too_small
from e2e.servers import Demo
from e2e.state import wait_for
from e2e.steps import box, chord, drawn

SERVOS = 6
COMMAND = "sudo ip link set can0 up type can bitrate 1000000"
PARAMS = {"cause": "interface_down", "interface": "can0", "command": COMMAND}
ROWS = ".f-row:not([hidden])"
CANDUMP_LINE = re.compile(r"\(\d+\.\d{6}\) \S+ [0-9A-F]{8}#([0-9A-F]{2})*( [RT])?")


def open_bus(page: Page, demo: Demo, part: str = "") -> None:
    page.goto(f"{demo.url}bus{part and '#' + part}")
    expect(page.get_by_test_id("bus-page")).to_be_visible()


def rows(page: Page) -> list[str]:
    return page.locator(ROWS).all_inner_texts()


def only(text: str, page: Page) -> bool:
    return all(text in row for row in rows(page))


def figure(found: Locator, name: str) -> int:
    """A count in a sentence such as "Received 1 024, shown 3, lost 0"."""
    expect(found).to_contain_text(re.compile(rf"{name} \d"))
    match = re.search(rf"{name} ([\d\u202f]+)", found.inner_text())
    assert match is not None, found.inner_text()
    return int(match[1].replace("\u202f", ""))


def traffic(page: Page) -> None:
    """Wait until more frames have been counted."""
    counts = page.get_by_test_id("monitor-counts")
    before = figure(counts, "Received")
    wait_for(lambda: figure(counts, "Received") > before + 20, "nothing is counted")


def test_the_top_bar_links_to_a_healthy_bus(page: Page, demo: Demo) -> None:
    page.goto(demo.url)
    page.get_by_test_id("bar-bus").click()
    expect(page).to_have_url(re.compile(r"/bus$"))
    expect(page.get_by_role("heading", level=1)).to_have_text("Bus demo")
    expect(page.get_by_test_id("bus-facts")).to_contain_text(re.compile(r"Active\. 1.Mbit/s"))
    expect(page.locator(".finding:not([data-code=computer_busy])").first).to_contain_text(
        "without a servo ID move together"
    )
    found = demo.api.get("/bus/doctor", params={"all": True}).json()
    assert [one["code"] for one in found if one["severity"] != "ok" and one["code"] != "computer_busy"] == [
        "servos_without_id"
    ]
    expect(page.locator(".finding")).to_have_count(len(found))
    expect(page.get_by_test_id("bus-badge")).to_have_count(0)
    well = [one for one in found if one["severity"] == "ok"]
    page.route("**/api/v1/bus/doctor*", lambda route: route.fulfill(json=well))
    page.get_by_test_id("doctor-again").click()
    expect(page.get_by_test_id("doctor-well")).to_contain_text("No problems found")
    expect(page.get_by_test_id("bus-counters")).to_contain_text(re.compile(r"\d.frames"))


@pytest.mark.parametrize("width", [820, 390])
def test_an_overload_of_the_server_links_to_its_evidence(page: Page, demo: Demo, width: int) -> None:
    finding: dict[str, Any] = {
        "code": "computer_busy", "severity": "failure", "text": "", "evidence": "", "remedy": None,
        "node_ids": [], "uids": [], "params": {},
    }  # fmt: skip
    page.route("**/api/v1/bus/doctor*", lambda route: route.fulfill(json=[finding]))
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(demo.url)
    link = page.get_by_test_id("server-band").get_by_role("link")
    expect(link).to_contain_text("overloaded")
    still(page)
    assert too_small(page) == []
    link.click()
    expect(page).to_have_url(f"{demo.url}bus")


def test_findings_are_sorted_by_severity_with_evidence_and_remedy(page: Page, demo: Demo) -> None:
    finding: dict[str, Any] = {"evidence": "9 requests in 3 s, 0 responses.", "node_ids": [], "uids": []}
    findings: list[dict[str, Any]] = [
        {"code": "load", "severity": "ok", "text": "The load is well", "remedy": None, **finding},
        {"code": "second_allocator", "severity": "warning", "text": "Node 9 gives node ids too",
         "remedy": 'Switch ours off with PUT /api/v1/bus/allocator {"mode": "off"}.', **finding, "node_ids": [9],
         "advice": "keep_one_allocator", "params": {"node": 9, "responses": 3}},
        {"code": "interface_down", "severity": "failure", "text": "can0 is down",
         "remedy": f"Bring it up with: {COMMAND}", **finding, "advice": "see_adapter_message", "params": PARAMS},
    ]  # fmt: skip
    page.route("**/api/v1/bus/doctor*", lambda route: route.fulfill(json=findings))
    open_bus(page, demo, "nodes")
    expect(page.locator(".finding")).to_have_count(3)
    severities = page.locator(".finding").evaluate_all("all => all.map(one => one.dataset.severity)")
    assert severities == ["failure", "warning", "ok"]
    expect(page.locator(".finding code")).to_have_text(COMMAND)
    warning = page.locator("[data-code=second_allocator]")
    expect(warning).not_to_contain_text("/api/v1")
    expect(page.get_by_test_id("bus-badge")).to_contain_text("1 failure")
    warning.get_by_role("button", name="Show node IDs").click()
    expect(page).to_have_url(re.compile("/bus#ids$"))
    warning.get_by_role("button", name="Show node 9 in the monitor").click()
    expect(page.get_by_test_id("monitor-filter")).to_have_value("node:9")


def test_the_monitor_shows_and_filters_decoded_transfers(page: Page, demo: Demo) -> None:
    open_bus(page, demo)
    expect(page.locator(ROWS).filter(has_text=re.compile(r"Status\s*servo \d+, .*°")).first).to_be_visible()
    counts = page.get_by_test_id("monitor-counts")
    wait_for(lambda: figure(counts, "Received") > 100, "nothing is counted")
    assert figure(counts, "lost") == 0

    page.get_by_test_id("monitor-filter").fill("type:GetSet kind:request")
    wait_for(lambda: len(rows(page)) > 5 and only("GetSet request", page), "not requests alone are shown")
    wait_for(lambda: 0 < figure(counts, "shown") < figure(counts, "Received"), "the counts are not shown")

    page.get_by_test_id("monitor-filter").fill("type:GetSet node:300")
    expect(page.get_by_test_id("filter-problem")).to_contain_text("Enter 0 to 127")
    traffic(page)
    assert only("GetSet request", page), "what was set before stays in force"

    page.get_by_test_id("monitor-filter").fill("problems")
    expect(page.get_by_test_id("monitor-empty")).to_contain_text(re.compile(r"No match|Nothing received"))
    page.get_by_role("button", name="Clear filter").click()
    expect(page.locator(ROWS).first).to_be_visible()

    page.get_by_role("group", name="Show").get_by_role("button", name="Frames").click()
    expect(page.locator(ROWS).first).to_contain_text(re.compile(r"\d+ → (all|\d+)\s+([0-9a-f]{2} ){3}"))


def test_a_paused_or_selected_row_stays_while_the_counts_go_on(page: Page, demo: Demo) -> None:
    open_bus(page, demo)
    expect(page.locator(ROWS).nth(8)).to_be_visible()
    page.get_by_test_id("monitor-pause").click()
    traffic(page)

    def stands() -> bool:
        before[:] = rows(page)
        traffic(page)
        return rows(page) == before

    before: list[str] = []
    wait_for(stands, "the list goes on while it is paused")  # what had come before is drawn first
    traffic(page)
    assert rows(page) == before
    page.get_by_test_id("monitor-pause").click()
    wait_for(lambda: not set(rows(page)) & set(before), "the list does not go on")

    page.get_by_test_id("frames").click()
    expect(page.get_by_test_id("frame-detail")).to_contain_text("Payload")
    expect(page.get_by_test_id("monitor-held")).to_be_visible()
    page.get_by_test_id("frames").press("ArrowUp")
    expect(page.get_by_test_id("frame-detail")).to_be_visible()
    page.get_by_test_id("detail-close").click()
    expect(page.get_by_test_id("monitor-held")).to_have_count(0)

    page.get_by_test_id("frames").hover()
    page.mouse.wheel(0, -200)
    expect(page.get_by_test_id("monitor-held")).to_be_visible()
    page.mouse.wheel(0, 4000)
    expect(page.get_by_test_id("monitor-held")).to_have_count(0)


def test_a_long_press_selects_the_row_it_began_on(page: Page, demo: Demo) -> None:
    open_bus(page, demo)
    expect(page.locator(ROWS).nth(8)).to_be_visible()
    page.get_by_test_id("frames").hover()
    page.mouse.down()
    before = rows(page)
    traffic(page)
    assert rows(page) == before
    page.mouse.up()
    expect(page.get_by_test_id("frame-detail")).to_contain_text("Payload")
    expect(page.locator(".f-row[aria-selected=true]")).to_be_visible()
    assert page.locator(".f-row[aria-selected=true]").inner_text() in before
    page.get_by_test_id("detail-close").click()
    # Pressed elsewhere than it is released: not a selection, and the list goes on.
    page.get_by_test_id("frames").hover()
    page.mouse.down()
    page.mouse.move(2, 2)
    page.mouse.up()
    before = rows(page)
    wait_for(lambda: not set(rows(page)) & set(before), "the list does not go on")
    expect(page.get_by_test_id("frame-detail")).to_have_count(0)


@pytest.mark.release
def test_a_flood_of_frames_makes_no_new_rows(page: Page, demo: Demo) -> None:
    numbers = itertools.count()

    def transfer(number: int) -> dict[str, Any]:
        return {
            "timestamp": 1_700_000_000 + number / 2000, "type": "uavcan.equipment.actuator.Status", "kind": "message",
            "data_type_id": 1011, "source": 1 + number % 120, "destination": None, "priority": 16, "transfer_id": 1,
            "fields": {"actuator_id": 1, "position": 0.1}, "payload": "00112233445566", "sent": False,
            "summary": f"Status servo {number}, 12.4°", "can_id": "1003f30b", "frames": 2,
        }  # fmt: skip

    sockets: list[WebSocketRoute] = []

    def through(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()
        sockets.append(socket)
        server.on_message(lambda text: None if '"type":"frames"' in str(text) else socket.send(text))

    page.route_web_socket("**/api/v1/ws", through)
    open_bus(page, demo)
    page.evaluate("""() => {
        window.added = 0;
        const list = document.querySelector('[data-testid=frames]');
        const elements = one => [...one.addedNodes].filter(node => node.nodeType === Node.ELEMENT_NODE);
        new MutationObserver(all => { window.added += all.flatMap(elements).length; })
            .observe(list, { childList: true, subtree: true });
    }""")
    sent = 0
    for _ in range(120):  # a thirtieth of a second each
        batch = [transfer(next(numbers)) for _ in range(67)]
        sent += len(batch)
        sockets[-1].send(json.dumps({"type": "frames", "seq": 1, "received": sent, "shown": sent, "dropped": 0,
                                     "frames": [], "transfers": batch}))  # fmt: skip
        drawn(page)
    expect(page.locator(ROWS).filter(has_text=f"servo {sent - 1},")).to_be_visible()
    assert page.locator(".f-row").count() < 60
    added = page.evaluate("() => window.added")
    assert added < 1000, f"{added} elements for {sent} frames: rows are used again"


def test_every_node_is_listed(page: Page, demo: Demo) -> None:
    open_bus(page, demo, "nodes")
    nodes = [one for one in demo.api.get("/nodes").json() if one["node_id"] != 0 and one["online"]]
    servos = {one["node_id"]: one for one in demo.api.get("/servos").json()}
    for one in nodes:
        row = page.get_by_test_id(f"node-{one['node_id']}")
        expect(row).to_have_attribute("data-kind", one["kind"])
        if one["kind"] == "servo":
            expect(row).to_contain_text(servos[one["node_id"]]["label"] or servos[one["node_id"]]["serial"])
    assert sorted(one["kind"] for one in nodes) == ["hornbill", *["servo"] * 6]
    uid = next(one["uid"] for one in nodes if one["kind"] == "servo")
    page.get_by_test_id("nodes").get_by_role("link").first.click()
    expect(page).to_have_url(re.compile(r"/servos/[0-9a-f]{32}$"))
    assert uid in page.url


def test_a_node_id_is_pinned_and_released(page: Page, demo: Demo) -> None:
    table = demo.api.get("/allocations").json()["allocations"]
    one, other = table[0], table[1]
    open_bus(page, demo, "ids")
    row = page.get_by_test_id(f"id-{one['uid']}")
    expect(row).to_contain_text("automatic")

    page.get_by_test_id(f"pin-{one['uid']}").click()
    page.get_by_test_id("pin-id").fill(str(other["node_id"]))
    expect(page.get_by_test_id("pin-dialog")).to_contain_text(f"Node ID {other['node_id']} is assigned to")
    expect(page.get_by_test_id("pin-confirm")).to_be_disabled()
    page.get_by_test_id("pin-id").fill("77")
    page.get_by_test_id("pin-confirm").click()
    expect(row).to_contain_text("77")
    expect(row).to_contain_text("pinned")
    expect(page.get_by_test_id("ids-note")).to_contain_text("77")
    kept = {each["uid"]: each for each in demo.api.get("/allocations").json()["allocations"]}
    assert (kept[one["uid"]]["node_id"], kept[one["uid"]]["pinned"]) == (77, True)

    page.get_by_test_id(f"forget-{one['uid']}").click()
    expect(page.get_by_test_id("forget-dialog")).to_contain_text("Its pin is removed")
    page.get_by_test_id("forget-confirm").click()
    expect(row).to_have_count(0)
    assert one["uid"] not in [each["uid"] for each in demo.api.get("/allocations").json()["allocations"]]
    # as it was, for those who come after
    demo.api.put(f"/allocations/{one['uid']}", json={"node_id": one["node_id"]})


def test_turning_off_the_allocator_needs_confirmation(page: Page, demo: Demo) -> None:
    open_bus(page, demo, "ids")
    modes = page.get_by_role("group", name="Node ID allocator")
    modes.get_by_role("button", name="Off").click()
    expect(page.get_by_test_id("allocator-dialog")).to_be_visible()
    assert demo.api.get("/bus").json()["allocator"]["mode"] == "on"
    page.get_by_test_id("allocator-confirm").click()
    expect(page.get_by_test_id("allocator-effect")).to_contain_text("assigns no node IDs")
    assert demo.api.get("/bus").json()["allocator"]["mode"] == "off"
    modes.get_by_role("button", name="On").click()
    expect(page.get_by_test_id("allocator-effect")).to_contain_text("always the same ID")
    assert demo.api.get("/bus").json()["allocator"]["mode"] == "on"


def test_a_log_is_started_stopped_downloaded_and_deleted(page: Page, demo: Demo, tmp_path: Path) -> None:
    open_bus(page, demo)
    page.get_by_test_id("bus-log").click()
    page.get_by_test_id("log-name").fill("bench")
    page.get_by_test_id("log-limit").fill("x")
    expect(page.get_by_test_id("log-start")).to_be_disabled()
    page.get_by_test_id("log-limit").fill("5")
    page.get_by_test_id("log-start").click()
    expect(page.get_by_test_id("log-running")).to_contain_text("Writing bench")
    assert demo.api.get("/bus/log").json()["limit_bytes"] == 5_000_000
    wait_for(lambda: demo.api.get("/bus/log").json()["frames"] > 50, "nothing is written")
    page.get_by_role("button", name="Close").click()
    expect(page.get_by_test_id("bus-log")).to_contain_text("Logging")

    page.get_by_test_id("bus-log").click()
    page.get_by_test_id("log-stop").click()
    expect(page.get_by_test_id("log-dialog")).to_contain_text("is complete")
    name = demo.api.get("/bus/log").json()["name"]
    file = page.get_by_test_id(f"log-{name}")
    with page.expect_download() as download:
        file.get_by_test_id("log-download").click()
    download.value.save_as(tmp_path / "log")
    lines = (tmp_path / "log").read_text(encoding="ascii").splitlines()
    assert len(lines) == demo.api.get("/bus/log").json()["frames"] > 50
    assert [line for line in lines if not CANDUMP_LINE.fullmatch(line)] == []

    file.get_by_test_id("log-remove").click()
    file.get_by_test_id("log-remove-yes").click()
    expect(file).to_have_count(0)
    assert name not in [one["name"] for one in demo.api.get("/bus/logs").json()]


def test_connect_lists_adapters_and_explains_a_failed_address(context: BrowserContext, demo: Demo) -> None:
    page = context.new_page()  # unwatched: Chromium writes every refused request into its console
    open_bus(page, demo)
    page.get_by_test_id("bus-change").click()
    card = page.get_by_test_id("adapter-memory:demo")
    expect(card).to_contain_text("Connected")
    expect(card.get_by_role("radio")).to_be_checked()
    page.get_by_test_id("adapter-other").check()
    expect(page.get_by_test_id("connect")).to_be_disabled()
    page.get_by_test_id("adapter-address").fill("nothing:here")
    page.get_by_test_id("adapter-bitrate").fill("5")
    expect(page.get_by_test_id("connect")).to_be_disabled()
    page.get_by_test_id("adapter-bitrate").fill("1000")
    page.get_by_test_id("connect").click()
    expect(page.get_by_test_id("connect-refused")).to_contain_text("Unknown interface")
    assert demo.api.get("/bus").json()["state"] == "active"


def test_disconnect_warns_and_connect_restores_the_servos(page: Page, demo: Demo) -> None:
    open_bus(page, demo)
    page.get_by_test_id("bus-disconnect").click()
    expect(page.get_by_test_id("disconnect-dialog")).to_contain_text("Torque is turned off first")
    page.get_by_test_id("disconnect-confirm").click()
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Not connected")
    assert demo.api.get("/bus").json()["state"] == "disconnected"
    expect(page.locator(".finding[data-severity=failure]")).to_have_count(1)

    # the same choice from the list of servos, which says why nothing moves there
    page.get_by_role("link", name="Servos").first.click()
    page.get_by_test_id("open-connect").click()
    expect(page.get_by_test_id("adapter-memory:demo").get_by_role("radio")).to_be_checked()
    page.get_by_test_id("connect").click()
    expect(page.get_by_test_id("connect-dialog")).to_have_count(0)
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Active")
    wait_for(
        lambda: sum(one["state"] == "ready" for one in demo.api.get("/servos").json()) == 6, "servos do not return"
    )


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (768, 1024)])
def test_a_lost_adapter_shows_the_next_retry_and_stop_does_not_move(
    page: Page, demo: Demo, width: int, height: int
) -> None:
    lost = {
        "state": "lost", "address": "socketcan:can0", "retry_in_s": 50.0,
        "trouble": f"The interface can0 is down. Bring it up with: {COMMAND}", "trouble_params": PARAMS,
    }  # fmt: skip

    def through(socket: WebSocketRoute) -> None:
        def changed(text: str | bytes) -> None:
            message = json.loads(text)
            if message.get("type") == "bus":
                message["bus"].update(lost)
            socket.send(json.dumps(message))

        socket.connect_to_server().on_message(changed)

    page.route_web_socket("**/api/v1/ws", through)
    page.route("**/api/v1/bus", lambda route: route.fulfill(json={**demo.api.get("/bus").json(), **lost}))
    page.set_viewport_size({"width": width, "height": height})
    open_bus(page, demo)
    trouble = page.get_by_test_id("bus-trouble")
    expect(trouble).to_contain_text("Adapter lost")
    expect(trouble.locator("code")).to_have_text(COMMAND)
    expect(page.get_by_test_id("bus-retry")).to_contain_text(re.compile(r"Next retry in [1-5]\d.s"))
    expect(page.get_by_test_id("bar-bus")).to_contain_text("Adapter lost")
    stop, disconnect = box(page.get_by_test_id("stop")), box(page.get_by_test_id("bus-disconnect"))
    assert stop["x"] + stop["width"] == pytest.approx(width, abs=1)
    assert stop["width"] >= 176
    assert disconnect["x"] + disconnect["width"] < stop["x"], "nothing that disconnects stands under Stop"


def test_the_keyboard_reaches_the_parts_and_the_filter(page: Page, demo: Demo) -> None:
    page.goto(demo.url)
    expect(page.get_by_test_id("live-state")).to_have_count(1)
    chord(page, "g", "b")
    expect(page).to_have_url(re.compile("/bus$"))
    expect(page.get_by_test_id("monitor")).to_be_visible()
    page.keyboard.press("/")
    expect(page.get_by_test_id("monitor-filter")).to_be_focused()
    page.get_by_test_id("part-monitor").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("part-nodes")).to_be_focused()
    expect(page.get_by_test_id("nodes")).to_be_visible()
