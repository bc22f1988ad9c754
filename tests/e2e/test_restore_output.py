"""Restore output after a stop: a dry run, a dialog that names loaded servos, and horns held at their positions."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, expect

from e2e.hand import Hand, hand_of
from e2e.servers import Server, running, serving
from e2e.state import latched, read, sim, wait_for
from e2e.test_output_story import confirmed, made

HOLDS, RELEASES = 0, 1
"""Values of 0x26."""


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A bus with simulated servos."""
    with running(*serving(tmp_path_factory.mktemp("restore"), "--sim-api")) as one:
        yield one


@pytest.fixture
def hand(browser: Browser, server: Server) -> Iterator[Hand]:
    """A page used by keyboard alone; earlier servos are removed."""
    clear(server)
    with hand_of(browser, "keyboard") as one:
        yield one


@pytest.fixture
def mouse(browser: Browser, server: Server) -> Iterator[Hand]:
    """The same by mouse."""
    clear(server)
    with hand_of(browser, "mouse") as one:
        yield one


def clear(server: Server) -> None:
    server.api.delete("/stop")
    uids = [one["uid"] for one in server.api.get("/sim/servos").json()]
    for uid in uids:
        server.api.delete(f"/sim/servos/{uid}")
    for uid in uids:
        wait_for(lambda uid=uid: not server.api.get(f"/servos/{uid}").json()["online"], "it is still there")
        server.api.delete(f"/inventory/{uid}")


def output(server: Server, uid: str) -> str:
    return str(server.api.get(f"/sim/servos/{uid}").json()["output"])


def angle(server: Server, uid: str) -> float:
    return float(read(server, uid, "current_angle"))


def name(server: Server, uid: str, label: str) -> str:
    server.api.patch(f"/servos/{uid}", json={"label": label}).raise_for_status()
    return label


def test_outputs_are_restored_after_a_dialog_names_loaded_servos(server: Server, hand: Hand) -> None:
    page = hand.page
    uids = [made(server, servo_id, timeout_action=HOLDS) for servo_id in (31, 32, 33)]
    rudder, arm, bay = uids
    for uid, label in zip(uids, ("Rudder", "Arm", "Bay door"), strict=True):
        name(server, uid, label)
    page.goto(server.url + "servos")
    expect(page.get_by_test_id(f"servo-row-{bay}")).to_be_visible()
    server.api.post("/stop").raise_for_status()  # by one road: the page uses two, one of them after the brake
    for uid in uids:
        wait_for(confirmed(server, uid), "the stop is not confirmed")
    server.api.post(f"/servos/{arm}/torque", json={"mode": "brake"}).raise_for_status()
    sim(server, rudder, external_angle_deg=25.0)
    wait_for(lambda: abs(angle(server, rudder) - 25.0) < 1, "the horn was not turned")
    stood = [angle(server, uid) for uid in uids]
    assert [output(server, uid) for uid in uids] == ["off", "brake", "off"]

    hand.press("restore-all")
    dialog = page.get_by_test_id("output-dialog")
    expect(dialog).to_contain_text("Restore output of 3 servos?")
    expect(page.get_by_test_id("restore-load")).to_contain_text("Under load: Arm.")
    expect(page.get_by_test_id(f"restore-{arm}")).to_have_attribute("data-load", "true")
    expect(page.get_by_test_id(f"restore-{rudder}")).to_have_attribute("data-load", "false")
    assert [output(server, uid) for uid in uids] == ["off", "brake", "off"], "a look changes nothing"
    assert latched(server)

    hand.press("output-go")
    expect(page.get_by_test_id("change-progress")).to_have_attribute("data-state", "done")
    expect(page.get_by_test_id("job-dialog")).to_contain_text("Output is on: 3 servos")
    hand.press("change-close")
    expect(page.get_by_test_id("stop-band")).to_have_count(0)
    expect(page.get_by_test_id("outputs-off")).to_have_count(0)
    assert [output(server, uid) for uid in uids] == ["on", "on", "on"]
    assert [angle(server, uid) for uid in uids] == [pytest.approx(one, abs=0.5) for one in stood]
    assert server.api.get("/leases").json() == [], "they hold without a lease"


def test_a_servo_with_a_timeout_stays_on_until_motion_is_off(server: Server, mouse: Hand) -> None:
    page, uid = mouse.page, made(server, 34, timeout_action=RELEASES, timeout_time=2000)
    page.goto(server.url + "servos")
    expect(page.get_by_test_id(f"servo-row-{uid}")).to_be_visible()
    mouse.stop_and_clear()
    mouse.press("restore-all")
    expect(page.get_by_test_id("output-dialog")).to_contain_text("this page takes motion control")
    mouse.press("output-go")
    expect(page.get_by_test_id("change-progress")).to_have_attribute("data-state", "done")
    mouse.press("change-close")
    expect(page.get_by_test_id("kept-band")).to_contain_text("Output is on for 1 servo")

    def expires_at() -> float:
        return float(server.api.get("/leases").json()[0]["expires_at"])

    def renewed() -> bool:
        assert output(server, uid) == "on"
        return expires_at() > before + 4

    before = expires_at()
    wait_for(renewed, "the page does not renew its lease")  # for twice the timeout of the servo
    mouse.press("kept-off")
    wait_for(lambda: output(server, uid) == "off", "the output is still on")
    expect(page.get_by_test_id("kept-band")).to_have_count(0)


def test_the_restore_dialog_opens_only_if_the_server_permits(server: Server, mouse: Hand) -> None:
    page, uid = mouse.page, made(server, 35, timeout_action=HOLDS)
    page.goto(server.url + "servos")
    expect(page.get_by_test_id(f"servo-row-{uid}")).to_be_visible()
    mouse.stop()
    wait_for(confirmed(server, uid), "the stop is not confirmed")
    lease = server.api.post("/leases", json={"holder": "Ben", "ttl_s": 60}).json()["id"]
    mouse.press("restore-all")
    expect(page.get_by_test_id("stop-band")).to_contain_text("Ben has motion control")
    expect(page.get_by_role("dialog")).to_have_count(0)
    server.api.delete(f"/leases/{lease}").raise_for_status()
    mouse.press("restore-all")
    expect(page.get_by_test_id("output-dialog")).to_be_visible()
    server.api.post("/stop?by=Ben").raise_for_status()
    expect(page.get_by_test_id("change-refused")).to_contain_text("Stop was pressed again")
    expect(page.get_by_test_id("output-go")).to_be_disabled()
    assert output(server, uid) == "off"
