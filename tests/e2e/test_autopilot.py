"""Beside an autopilot: who commands, whom Stop reaches, export and live verification. As observer nothing is sent."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import FilePayload, Page, expect

from e2e.conftest import Watched
from e2e.servers import Demo, ready_demo, until

SLOW_MS = 30_000
"""For what the bus decides: a reconnection, a step of three seconds on a busy machine."""


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """Six servos beside an armed ArduPilot that commands servo IDs 1 to 4."""
    with ready_demo(6) as one:
        fly(one)
        role(one, "guest")
        yield one


def fly(demo: Demo, *demanded: int, **changes: object) -> None:
    """The autopilot holds its outputs at neutral, those `demanded` at their positive end."""
    if demo.api.get("/sim/autopilot").status_code != 200:
        demo.api.put("/sim/autopilot", json={"program": "ardupilot", "output_count": 4}).raise_for_status()
    outputs = [{"output": n, "demand": 1.0 if n in demanded else 0.0} for n in range(1, 5)]
    body = {"armed": True, "safety_on": False, "sweep": False, "outputs": outputs, **changes}
    demo.api.patch("/sim/autopilot", json=body).raise_for_status()


def role(demo: Demo, name: str) -> None:
    demo.api.put("/bus/role", json={"role": name}).raise_for_status()


def commanded(demo: Demo) -> dict[int, str]:
    """UIDs by servo ID of the servos that the autopilot commands."""
    return {one["servo_id"]: one["uid"] for one in demo.api.get("/servos").json() if one["commanded_by"]}


def beside(demo: Demo, name: str = "guest") -> dict[int, str]:
    """As this role beside the autopilot, when all servos with an ID up to 4 are commanded and ready."""
    if demo.api.get("/bus").json()["role"] != name:
        role(demo, name)

    def all_known() -> bool:
        known = [one for one in demo.api.get("/servos").json() if one["state"] == "ready"]
        ids = {one["servo_id"] for one in known if 1 <= (one["servo_id"] or 0) <= 4}
        return len(known) == 6 and ids != set() and set(commanded(demo)) == ids

    until(all_known, 60, "the autopilot does not command every servo with an ID up to 4")
    return commanded(demo)


def node_of(demo: Demo) -> int:
    return demo.api.get("/sim/autopilot").json()["node_id"]


def test_the_list_shows_who_commands_each_servo_and_whom_stop_reaches(page: Page, demo: Demo) -> None:
    servos = beside(demo)
    node, n = node_of(demo), len(servos)
    page.goto(demo.url + "servos")
    expect(page.get_by_test_id("role")).to_have_text("Guest")
    band = page.get_by_test_id("role-band")
    expect(band).to_contain_text(f"node {node} commands {n} of 6 servos")
    expect(band).to_contain_text("Stop reaches no servo now.")
    band.get_by_test_id("why-not-all").click()
    expect(band).to_contain_text("the aircraft crashes")
    expect(page.get_by_test_id("stop")).to_contain_text("Reaches 0 of 6, Esc")
    expect(page.get_by_test_id("bar-motion")).to_contain_text(f"Node {node}: {n} servos. You: 0")
    row = page.get_by_test_id(f"servo-row-{servos[1]}")
    expect(row.locator(".c-by")).to_contain_text(re.compile(rf"Node {node}, ArrayCommand\s*\d+\.\d.Hz since \d\d:"))
    expect(row.locator(".c-command")).to_have_text("0.0°")
    expect(row.locator(".c-error")).to_contain_text(re.compile(r"[+−]?\d\.\d°"))
    page.get_by_role("button", name=f"Commanded elsewhere {n}").click()
    expect(page.locator(".servo-row")).to_have_count(n)


def test_a_servo_that_is_commanded_elsewhere_is_not_moved_and_another_one_is(page: Page, demo: Demo) -> None:
    servos = beside(demo)
    node = node_of(demo)
    page.goto(f"{demo.url}servos/{servos[1]}/motion")
    expect(page.get_by_test_id("motion-hindrance")).to_contain_text(f"is commanded by node {node}")
    expect(page.get_by_test_id("enable-motion")).to_be_disabled()
    expect(page.get_by_test_id("wiggle")).to_be_disabled()
    (free, *_) = [one["uid"] for one in demo.api.get("/servos").json() if one["servo_id"] == 5]
    page.goto(f"{demo.url}servos/{free}/motion")
    expect(page.get_by_test_id("enable-motion")).to_be_enabled()
    expect(page.get_by_test_id("motion-hindrance")).to_have_count(0)
    page.get_by_test_id("enable-motion").click()
    expect(page.get_by_test_id("stop")).to_contain_text("Reaches 1 of 6, Esc", timeout=SLOW_MS)
    expect(page.get_by_test_id("bar-motion")).to_contain_text("You: 1")
    page.goto(demo.url + "servos")
    expect(page.get_by_test_id("stop")).to_contain_text("Reaches 0 of 6, Esc", timeout=SLOW_MS)


@pytest.mark.release
def test_an_exported_plan_is_verified_live(page: Page, demo: Demo, watched: Watched) -> None:
    beside(demo)
    demo.api.patch("/sim/autopilot", json={"outputs": [{"output": 3, "reversed": True}]}).raise_for_status()
    page.goto(demo.url + "servos")
    page.get_by_test_id("to-autopilot").click()
    expect(page.get_by_test_id("plan-1")).to_be_visible()
    page.get_by_test_id("plan-high-1").fill("abc")
    expect(page.get_by_test_id("plan-incomplete")).to_contain_text("Output 1:")
    expect(page.get_by_test_id("plan-export")).to_be_disabled()
    page.get_by_test_id("plan-high-1").fill("45")
    with page.expect_download() as download:
        page.get_by_test_id("plan-export").click()
    assert download.value.suggested_filename == "hornbill.param"
    content = download.value.path().read_text(encoding="utf-8")
    assert "SERVO1_MAX,1625" in content
    expect(page.get_by_test_id("plan-advice")).to_contain_text("with the safety switch on")
    page.get_by_test_id("verify-begin").click()
    step = page.get_by_test_id("verify-step")
    expect(step).to_contain_text("centre all controls")
    page.get_by_test_id("verify-measure").click()
    expect(step).to_have_attribute("data-running", "true")
    expect(step).to_contain_text(re.compile(r"\d\.\d of 3\.0.s"))
    first = page.get_by_test_id("verify-1")
    expect(first).to_contain_text("Neutral as exported", timeout=SLOW_MS)
    fly(demo, 1)
    page.get_by_test_id("verify-measure").click()
    expect(first).to_have_attribute("data-result", "matches", timeout=SLOW_MS)
    expect(first).to_contain_text("+45.0°")
    fly(demo, 3)
    page.get_by_test_id("measure-3").click()
    third = page.get_by_test_id("verify-3")
    expect(third).to_have_attribute("data-result", "reversed", timeout=SLOW_MS)
    expect(third).to_contain_text("Set SERVO3_REVERSED to 0, as exported.")
    expect(page.get_by_test_id("verify-5")).to_have_attribute("data-result", "missing")
    expect(page.get_by_test_id("verify-counts")).to_contain_text("1 matches, 2 failed")
    page.reload()
    expect(third).to_have_attribute("data-result", "reversed")
    page.get_by_test_id("verify-cancel").click()
    expect(page.get_by_test_id("verify")).to_have_count(0)
    watched.complaints[:] = [one for one in watched.complaints if "/autopilot/verification" not in one]  # the last poll
    fly(demo, outputs=[{"output": 3, "reversed": False}])


def test_a_file_of_the_autopilot_is_imported(page: Page, demo: Demo, watched: Watched) -> None:
    lines = ["CAN_D1_UC_SRV_BM,4", "CAN_D1_UC_SRV_RT,100", "SERVO3_MIN,1450", "SERVO3_MAX,1550", "SERVO3_TRIM,1500"]
    beside(demo)  # outputs are proposed once, for the servos known then
    page.goto(demo.url + "bus#autopilot")
    page.get_by_test_id("plan-1").wait_for()
    file = FilePayload(name="plane.param", mimeType="text/plain", buffer="\n".join(lines).encode())
    page.get_by_test_id("plan-import").set_input_files(file)
    expect(page.get_by_test_id("plan-note")).to_contain_text("plane.param: 1 output imported.")
    expect(page.get_by_test_id("plan-low-3")).to_have_value("−18.0")
    expect(page.get_by_test_id("plan-rate")).to_have_value("100")
    expect(page.get_by_test_id("plan-1")).to_have_count(0)
    page.get_by_test_id("plan-import").set_input_files(
        FilePayload(name="plane.param", mimeType="text/plain", buffer=b"SERVO3_MIN high")
    )
    expect(page.get_by_test_id("plan-problem")).to_contain_text("SERVO3_MIN high")
    expect(page.get_by_test_id("plan-low-3")).to_have_value("−18.0")
    watched.complaints[:] = [one for one in watched.complaints if "status of 422" not in one]


def test_the_failsafe_of_a_servo_is_confirmed_by_a_gap(page: Page, demo: Demo) -> None:
    servos = beside(demo)
    page.goto(f"{demo.url}servos/{servos[1]}")
    card = page.get_by_test_id("card-failsafe")
    expect(card).to_contain_text("Output off after 1.0")
    fly(demo, safety_on=True)
    until(lambda: commanded(demo) == {}, 20, "the autopilot still commands")
    expect(card).to_contain_text(f"Node {node_of(demo)} has been silent since", timeout=SLOW_MS)
    fly(demo)
    expect(card).to_contain_text("was silent for", timeout=SLOW_MS)


def test_an_observer_sends_nothing_and_says_so(page: Page, demo: Demo) -> None:
    uid = beside(demo)[1]
    role(demo, "observer")
    page.goto(demo.url + "servos")
    expect(page.get_by_test_id("role")).to_have_text("Observer")
    stop = page.get_by_test_id("stop")
    expect(stop).to_have_attribute("data-reach", "none")
    expect(stop).to_contain_text("sends nothing")
    expect(page.get_by_test_id("role-band")).to_contain_text("cut its supply")
    before = demo.api.get("/bus").json()["tx_frames"]
    page.goto(f"{demo.url}servos/{uid}")
    expect(page.get_by_test_id("act-observer")).to_contain_text("Observer: hornbill sends nothing.")
    for absent in ("wiggle", "act-output", "act-restart", "act-save", "act-factory-reset"):
        expect(page.get_by_test_id(absent)).to_have_count(0)
    page.goto(demo.url + "commission")
    expect(page.get_by_test_id("commission-observer")).to_contain_text("Observer: hornbill sends nothing.")
    page.goto(f"{demo.url}servos/matrix?uids={uid}")
    expect(page.get_by_test_id(f"column-{uid}")).to_be_visible()
    expect(page.get_by_test_id(f"copy-{uid}")).to_have_count(0)
    expect(page.get_by_test_id("set-angle_p_gain")).to_be_disabled()
    expect(page.get_by_test_id(f"cell-{uid}-angle_p_gain")).to_have_attribute("aria-disabled", "true")
    page.goto(f"{demo.url}servos/{uid}/motion")
    expect(page.get_by_test_id("motion-hindrance")).to_contain_text("Observer")
    expect(page.get_by_test_id("enable-motion")).to_be_disabled()
    stop.click()
    expect(page.get_by_test_id("stop-band")).to_contain_text("Observer: nothing was sent.")
    assert demo.api.get("/bus").json()["tx_frames"] == before == 0
    demo.api.delete("/stop").raise_for_status()
    page.get_by_test_id("change-role").click()
    page.get_by_test_id("role-guest").check()
    page.get_by_test_id("confirm-role").click()
    expect(page.get_by_test_id("role")).to_have_text("Guest", timeout=SLOW_MS)
