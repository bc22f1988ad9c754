"""Axe on states that pages alone do not show: dialogs, toasts, steps of the wizard, the sign-in, in both themes."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from e2e.conftest import Watched
from e2e.looks import complaints, loading, still
from e2e.servers import Demo
from e2e.state import latched, no_lease, read, servo_of, uids_of, write
from e2e.steps import stage
from e2e.test_access import show

pytestmark = pytest.mark.release

MODEL = "BLA21-12U-A0"

Say = Callable[[str], None]
"""Check the present state, under this name."""


def close(page: Page) -> None:
    """Close with the dialog's own button: Esc would stop every servo."""
    page.get_by_role("dialog").get_by_role("button", name=re.compile("^(Close|Cancel|Keep)")).last.click()
    expect(page.get_by_role("dialog")).to_have_count(0)


def parameters(page: Page, demo: Demo, say: Say) -> None:
    """Staged, compared, before a save, confirmation required, written, and before an undo."""
    uid = servo_of(demo, MODEL)
    # What ROM holds is known then, whatever other tests did to this servo.
    demo.api.post(f"/servos/{uid}/restart?wait=true").raise_for_status()
    before = read(demo, uid, "temperature_limit_upper")
    show(page, demo, "servos/{uid}/parameters#angle_limit_cw")
    page.get_by_test_id("keys").click()
    say("the list of keys")
    close(page)
    stage(page, "angle_limit_cw", "75")
    say("the bar of what is staged")
    page.get_by_test_id("diff").click()
    say("the diff")
    close(page)
    page.get_by_test_id("apply-save").click()
    expect(page.get_by_test_id("save-dialog")).to_be_visible()
    say("the save dialog")
    close(page)
    page.get_by_test_id("discard").click()

    show(page, demo, "servos/{uid}/parameters#voltage_limit_lower")
    stage(page, "voltage_limit_lower", "11.9")
    page.get_by_test_id("apply").click()
    expect(page.get_by_test_id("apply-dialog")).to_be_visible()
    say("confirmation required")
    close(page)
    page.get_by_test_id("discard").click()

    show(page, demo, "servos/{uid}/parameters#temperature_limit_upper")
    stage(page, "temperature_limit_upper", str(before - 1))
    page.get_by_test_id("apply").click()
    expect(page.get_by_test_id("undo")).to_be_visible()
    say("what can be undone")
    page.get_by_test_id("undo").click()
    say("the undo dialog")
    page.get_by_test_id("undo-go").click()
    expect(page.get_by_test_id("undo-line")).to_have_count(0)


def several(page: Page, demo: Demo, say: Say) -> None:
    """Many servos: plotted together, as a wall of horns, side by side, with a plan that needs confirmation."""
    uids = uids_of(demo)[:3]
    show(page, demo, "servos")
    for uid in uids:
        page.get_by_test_id(f"select-{uid}").check()
    page.get_by_test_id("plot-selected").click()
    expect(page.get_by_test_id("plot-many").locator("canvas").first).to_be_visible()
    say("servos in one plot")
    page.get_by_test_id("plot-selected").click()
    page.get_by_role("button", name="3D").click()
    expect(page.get_by_test_id("wall")).to_be_visible()
    say("the wall of horns")
    page.goto(f"{demo.url}servos/matrix?uids={','.join(uids)}#voltage_limit_lower")
    page.get_by_test_id(f"copy-{uids[0]}").click()
    say("a column to be copied")
    close(page)
    page.get_by_test_id("set-voltage_limit_lower").click()
    page.get_by_test_id("set-value").fill("7.2")
    say("a row to be set on all")
    page.get_by_test_id("set-go").click()
    say("the matrix with staged cells")
    page.get_by_test_id("matrix-review").click()
    expect(page.get_by_test_id("change-again")).to_be_visible()
    say("the plan of the matrix")
    close(page)
    page.get_by_test_id("matrix-discard").click()


def restored(page: Page, demo: Demo, say: Say) -> None:
    """A different snapshot, and the dialog before its rows are written."""
    uid = servo_of(demo, MODEL)
    before = read(demo, uid, "temperature_limit_upper")
    number = demo.api.post(f"/servos/{uid}/snapshots", json={"reason": "for axe"}).json()["id"]
    write(demo, uid, "temperature_limit_upper", before - 1)
    show(page, demo, "records#snapshots/{uid}")
    page.get_by_test_id(f"snapshot-{number}").click()
    page.get_by_test_id("differs-temperature_limit_upper").get_by_role("checkbox").check()
    say("a snapshot that differs")
    page.get_by_test_id("restore-ticked").click()
    expect(page.get_by_test_id("snapshot-temperature_limit_upper")).to_be_visible()
    say("the restore dialog")
    close(page)
    write(demo, uid, "temperature_limit_upper", before)


def commissioned(page: Page, demo: Demo, say: Say) -> None:
    """Each step of the wizard up to its start."""
    uid = servo_of(demo, MODEL)
    show(page, demo, "commission")
    say("commission: found")
    if page.get_by_test_id("find-others").get_attribute("aria-expanded") == "false":
        page.get_by_test_id("find-others").click()
    ticked = page.locator("[data-testid^=pick-] input:checked")
    while ticked.count() > 0:
        ticked.first.uncheck()
    page.get_by_test_id(f"pick-{uid}").locator("input").check()
    page.get_by_test_id("find-go").click()
    expect(page.get_by_test_id("identify-step")).to_be_visible()
    say("commission: told apart")
    page.get_by_test_id("label").fill("Elevator")
    page.get_by_test_id("give").click()
    page.get_by_test_id("identify-go").click()
    expect(page.get_by_test_id("profile-step")).to_be_visible()
    say("commission: the profile")
    page.get_by_test_id("profile-go").click()
    expect(page.locator('[data-testid^="changes-"]').first).to_be_visible()
    expect(page.get_by_test_id("check-step")).not_to_contain_text("Reading the servo")
    say("commission: checked")


def tuned(page: Page, demo: Demo, say: Say) -> None:
    """A verdict with its run, the parts of the column, and each dialog."""
    uid = servo_of(demo, MODEL)
    show(page, demo, "servos/{uid}/tune")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-deg").fill("90")
    say("a step that is too large")
    page.get_by_test_id("step-deg").fill("5")
    page.get_by_test_id("step-dwell").fill("0.3")
    say("the step dialog")
    page.get_by_test_id("step-go").click()
    expect(page.get_by_test_id("verdict")).to_be_visible()
    say("a verdict")
    page.get_by_test_id("tune-tab-gains").click()
    expect(page.get_by_test_id("step-again")).to_be_enabled()
    say("the gains")
    page.get_by_test_id("tune-tab-mechanics").click()
    say("mechanics")
    page.get_by_test_id("tune-tab-improve").click()
    for opens, what in (
        ("frequency-open", "frequency response"),
        ("set-up-change", "set-up"),
        ("improve-open", "Improve"),
    ):
        page.get_by_test_id(opens).click()
        expect(page.get_by_role("dialog")).to_be_visible()
        say(f"the dialog of {what}")
        close(page)
    page.get_by_test_id("disable-motion").click()
    no_lease(demo)
    for run in demo.api.get("/runs", params={"uid": uid}).json():
        demo.api.delete(f"/runs/{run['id']}")


def recorded(page: Page, demo: Demo, say: Say) -> None:
    """An open recording, and a recording of one servo from disk."""
    uid = servo_of(demo, MODEL)
    body = {"reason": "for axe", "before_s": 20}
    name = demo.api.post("/recorder/recordings", params={"wait": True}, json=body).json()["name"]
    try:
        show(page, demo, f"recorder#{name}")
        page.get_by_test_id("recording-servo").select_option(uid)
        page.get_by_test_id("plot-current_angle").locator("canvas").wait_for()
        say("a recording that is open")
        page.get_by_test_id("scrub-slider").press("Home")
        say("a recording at its beginning")
    finally:
        demo.api.delete(f"/recorder/recordings/{name}").raise_for_status()
    rows = demo.api.get(f"/servos/{uid}/telemetry.csv", params={"seconds": 5}).content
    show(page, demo, "servos/{uid}/parameters")
    page.get_by_test_id("plot-channels").click()
    say("the channels of a plot")
    chosen = page.get_by_test_id("plot-file")
    wrong = b"what,how many\nbread,2\n"
    chosen.set_input_files(files=[{"name": "shopping.csv", "mimeType": "text/csv", "buffer": wrong}])
    expect(page.get_by_test_id("plot-file-problem")).to_be_visible()
    say("a file that is no recording")
    chosen.set_input_files(files=[{"name": "telemetry.csv", "mimeType": "text/csv", "buffer": rows}])
    page.get_by_test_id("plot-recording").locator("canvas").first.wait_for()
    say("a recording from the disk")


def stopped(page: Page, demo: Demo, say: Say) -> None:
    """All servos stopped, and the dialog that clears the stop."""
    show(page, demo, "servos")
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("stop-band")).to_be_visible()
    say("stopped")
    page.get_by_test_id("clear-stop").click()
    expect(page.get_by_test_id("clear-dialog")).to_be_visible()
    say("the clear-stop dialog")
    page.get_by_test_id("confirm-clear").click()
    expect(page.get_by_test_id("stop-band")).to_have_count(0)
    assert not latched(demo)


def without_a_bus(page: Page, demo: Demo, say: Say) -> None:
    """Selecting an adapter beside the doctor's findings."""
    findings: list[dict[str, Any]] = [
        {"code": "no_bus", "severity": "failure", "text": "No bus is connected", "evidence": "The server runs.",
         "remedy": "Choose one of GET /api/v1/bus/adapters, and connect it.", "node_ids": [], "uids": []},
        {"code": "second_allocator", "severity": "warning", "text": "Node 9 gives node ids too", "evidence": "Seen.",
         "remedy": None, "node_ids": [9], "uids": []},
    ]  # fmt: skip
    page.route("**/api/v1/bus/doctor*", lambda route: route.fulfill(json=findings))
    show(page, demo, "bus")
    page.get_by_test_id("bus-change").click()
    with loading(page):
        expect(page.get_by_test_id("connect-dialog")).to_be_visible()
    say("connect, with findings")
    close(page)
    page.unroute("**/api/v1/bus/doctor*")


def signed_out(page: Page, demo: Demo, say: Say) -> None:
    """A server that requires a token, and a rejected token."""
    refusal = {"type": "about:blank", "title": "A token is needed", "status": 401, "code": "unauthorized",
               "detail": "A token is needed."}  # fmt: skip
    anonymous = {"required": True, "role": None, "name": None}

    def respond(route: Route) -> None:
        if route.request.method == "GET":
            route.fulfill(json=anonymous)
        else:
            route.fulfill(status=401, json=refusal)

    page.route("**/api/v1/session", respond)
    page.goto(demo.url)
    expect(page.get_by_test_id("login-token")).to_be_visible()
    say("sign-in")
    page.get_by_test_id("login-token").fill("wrong")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("login-refusal")).to_be_visible()
    say("sign-in refused")


@pytest.mark.parametrize(
    "path",
    [
        parameters,
        pytest.param(several, marks=pytest.mark.scene),
        restored,
        commissioned,
        tuned,
        recorded,
        stopped,
        without_a_bus,
        signed_out,
    ],
    ids=lambda one: one.__name__,
)
def test_dialogs_and_deep_states_pass_axe(
    page: Page, demo: Demo, watched: Watched, path: Callable[[Page, Demo, Say], None]
) -> None:
    found: dict[str, list[str]] = {}

    def say(name: str) -> None:
        still(page)
        page.emulate_media(color_scheme="light")
        wrong = complaints(page)
        page.emulate_media(color_scheme="dark")
        wrong += [f"dark: {one}" for one in complaints(page, "color-contrast")]
        if wrong:
            found[name] = wrong

    page.emulate_media(reduced_motion="reduce")
    path(page, demo, say)
    # The browser itself says of each refused request that it was refused.
    watched.complaints[:] = [one for one in watched.complaints if not re.search(r"\b(401|409)\b", one)]
    assert json.dumps(found, indent=1) == "{}"
