"""Tune and the recorder: a gain is changed and measured before and after, and the events are recorded."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, Route, expect

from e2e.servers import Demo, ready_demo
from e2e.state import add, no_lease, read, ready, rows_of, sim, torque_off, wait_for

HEALTHY = {"smoothing": False, "angle_p_gain": 40}


@pytest.fixture(scope="module")
def demo() -> Iterator[Demo]:
    """A demo in virtual time: a busy machine delays it, but loses no readings of a measurement."""
    with ready_demo(1, "--speed", "1") as one:
        yield one


@pytest.fixture
def servo(demo: Demo) -> Iterator[str]:
    """A servo with the newest firmware; its changes and measurements are removed afterwards."""
    (made,) = add(demo)
    demo.api.patch(f"/servos/{made}", json={"label": "Tail"})
    for key, value in HEALTHY.items():
        demo.api.put(f"/servos/{made}/parameters/{key}", json={"value": value}).raise_for_status()
    yield made
    for run in demo.api.get("/runs", params={"uid": made}).json():
        demo.api.delete(f"/runs/{run['id']}")
    demo.api.delete(f"/sim/servos/{made}")


def marks(recording: dict[str, list[dict[str, str]]], text: str) -> bool:
    return any(mark["text"] == text for mark in recording["marks"])


RUNNING = """() => {
    const top = () => document.querySelector('[data-testid=step-plot]').getBoundingClientRect().top;
    window.before = top();
    window.running = [];
    new MutationObserver(() => {
        if (document.querySelector('[data-testid=step-cancel]')) window.running.push(top());
    }).observe(document.body, { subtree: true, childList: true });
}"""
"""Note where the plot is before and during a step test."""


def measured(page: Page, legend: str) -> None:
    """Wait until a step test has ended and its run is shown."""
    expect(page.get_by_test_id(f"legend-{legend}")).to_be_visible()
    expect(page.get_by_test_id("step-open")).to_be_enabled()


@pytest.mark.release
def test_two_gains_are_compared_and_the_first_is_restored(page: Page, demo: Demo, servo: str) -> None:
    page.goto(f"{demo.url}servos/{servo}/tune")
    expect(page.get_by_test_id("no-runs")).to_contain_text("Not measured yet")
    page.get_by_test_id("step-open").click()

    # the move is shown before, and a step beyond the limits cannot be requested
    page.get_by_test_id("step-deg").fill("10")
    expect(page.get_by_test_id("step-moves")).to_contain_text("and back")
    page.get_by_test_id("step-deg").fill("90")
    expect(page.get_by_test_id("step-against")).to_contain_text("45")
    expect(page.get_by_test_id("step-go")).to_be_disabled()
    page.get_by_test_id("step-deg").fill("10")
    page.get_by_test_id("step-dwell").fill("0.6")
    page.get_by_test_id("step-note").fill("bare horn")
    expect(page.get_by_test_id("step-go")).to_contain_text("Enable motion and run step")
    page.get_by_test_id("step-go").click()
    measured(page, "A")
    expect(page.get_by_test_id("step-metrics")).to_contain_text("±")
    first = demo.api.get("/runs", params={"uid": servo}).json()[0]
    expect(page.get_by_test_id("verdict")).to_contain_text(first["verdict"]["text"])

    # a gain is written to RAM while this page holds motion control, then the same step again: type, one press
    page.get_by_test_id("tune-tab-gains").click()
    gain = page.get_by_test_id("input-angle_p_gain")
    gain.fill("20")
    gain.press("Enter")
    again = page.get_by_test_id("step-again")
    expect(again).to_contain_text("Apply and run step")
    page.evaluate(RUNNING)
    again.click()
    page.wait_for_function("() => window.running.length > 0")
    assert page.evaluate("() => window.running.every(top => top === window.before)"), "the page jumps"
    measured(page, "B")
    expect(page.get_by_test_id("row-angle_p_gain")).to_have_attribute("data-state", "applied")
    differs = page.get_by_test_id("differs-angle_p_gain")
    expect(differs).to_contain_text("40")
    expect(differs).to_contain_text("20")
    expect(page.get_by_test_id("step-plot")).to_have_attribute("data-runs", "2")
    runs = demo.api.get("/runs", params={"uid": servo}).json()
    assert [run["parameters"]["angle_p_gain"] for run in runs] == [20, 40]
    assert {run["note"] for run in runs} == {"bare horn"}
    slow, quick = (run["steps"][0]["metrics"]["rise_s"] for run in runs)
    for rise in (slow, quick):
        expect(page.get_by_test_id("metric-rise_s")).to_contain_text(str(round(rise * 1000)))

    # the verdict is that of B, and Back to A writes the gains of A
    expect(page.get_by_test_id("verdict")).to_contain_text(runs[0]["verdict"]["text"])
    expect(page.get_by_test_id("verdict-other")).to_contain_text(runs[1]["verdict"]["text"])
    page.get_by_test_id("back-to-A").click()
    expect(page.get_by_test_id("back-to-A")).to_have_count(0)
    expect(page.get_by_test_id("row-angle_p_gain")).to_have_attribute("data-state", "idle")
    rows = demo.api.get(f"/servos/{servo}/parameters").json()["parameters"]
    assert rows["angle_p_gain"]["value"] == 40

    # a run is deleted, and leaving the page ends motion
    page.get_by_test_id(f"drop-run-{runs[0]['id']}").click()
    page.get_by_test_id("drop-run-confirm").click()
    expect(page.get_by_test_id("legend-B")).to_have_count(0)
    assert len(demo.api.get("/runs", params={"uid": servo}).json()) == 1
    page.get_by_role("link", name="Records").click()
    no_lease(demo)
    # the lease ends first, then torque off is written and read
    torque = f"/servos/{servo}/parameters/torque_mode"
    wait_for(lambda: demo.api.get(torque).json()["value"] == "off", "torque is still on")


def test_typing_starts_no_step_test_and_enter_sends_one_request(page: Page, demo: Demo, servo: str) -> None:
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if request.method == "POST" else None)
    page.goto(f"{demo.url}servos/{servo}/tune")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-dwell").fill("0.3")
    for box in ("step-deg", "step-runs", "step-dwell", "step-note"):
        page.get_by_test_id(box).press("Enter")
    page.get_by_test_id("step-note").fill("bare horn")
    page.get_by_test_id("step-note").press("Enter")
    expect(page.get_by_test_id("step-go")).to_be_enabled()
    assert sent == [], "Enter in a text field took motion control or moved the horn"

    page.get_by_test_id("step-go").press("Enter")
    measured(page, "A")
    assert len([url for url in sent if url.endswith("/step-test")]) == 1
    expect(page.get_by_test_id("step-problem")).to_have_count(0)


def test_a_step_test_is_cancelled(page: Page, demo: Demo, servo: str) -> None:
    page.goto(f"{demo.url}servos/{servo}/tune")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-runs").fill("20")
    page.get_by_test_id("step-go").click()
    page.get_by_test_id("step-cancel").click()
    expect(page.get_by_test_id("tune-job-ended")).to_have_attribute("data-state", "cancelled")
    expect(page.get_by_test_id("job-holds")).to_contain_text("P 40")
    assert demo.api.get("/runs", params={"uid": servo}).json() == []
    page.get_by_test_id("job-close").click()
    expect(page.get_by_test_id("improve-open")).to_be_visible()
    page.get_by_test_id("disable-motion").click()
    no_lease(demo)


@pytest.mark.release
def test_runs_of_different_set_ups_have_no_difference_column(page: Page, demo: Demo, servo: str) -> None:
    page.goto(f"{demo.url}servos/{servo}/tune")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-dwell").fill("0.3")
    page.get_by_test_id("step-go").click()
    measured(page, "A")
    page.get_by_test_id("set-up-change").click()
    page.get_by_test_id("set-up-arm_mm").fill("60")
    page.get_by_test_id("set-up-inertia_gm2").fill("1")
    expect(page.get_by_test_id("set-up-save")).to_be_disabled()
    page.get_by_test_id("set-up-inertia_gm2").fill("")
    page.get_by_test_id("set-up-mass_g").fill("120")
    page.get_by_test_id("set-up-mounting").select_option("vice")
    page.get_by_test_id("set-up-save").click()
    expect(page.get_by_test_id("set-up")).to_contain_text("Arm 60\u202fmm with 120\u202fg at its end, in a vice.")
    expect(page.get_by_test_id("set-up")).to_contain_text("Not that of A.")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-go").click()
    measured(page, "B")
    expect(page.get_by_test_id("not-comparable")).to_be_visible()
    expect(page.get_by_test_id("step-metrics")).not_to_contain_text("B against A")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-go").click()
    expect(page.get_by_test_id("tune-job")).to_be_visible()
    expect(page.get_by_test_id("step-open")).to_be_enabled()
    # the newest two are shown first, because they can be compared
    page.reload()
    expect(page.get_by_test_id("step-metrics")).to_contain_text("B against A")
    expect(page.get_by_test_id("not-comparable")).to_have_count(0)


def test_a_server_without_scipy_names_the_package(page: Page, demo: Demo, servo: str) -> None:
    able = demo.api.get("/tuning").json()
    lacking = {**able, "available": False, "install": "pip install 'hornbill[tune]'"}
    page.route("**/api/v1/tuning", lambda route: route.fulfill(json=lacking))
    page.goto(f"{demo.url}servos/{servo}/tune")
    expect(page.get_by_test_id("package-missing")).to_contain_text("scipy")
    expect(page.get_by_test_id("package-missing")).to_contain_text("pip install 'hornbill[tune]'")
    expect(page.get_by_test_id("improve-open")).to_be_disabled()
    expect(page.get_by_test_id("step-open")).to_be_enabled()


HUNTS = {
    "speed_torque_control": 1, "smoothing": 0, "angle_p_gain": 100, "angle_d_gain": 0, "angle_dead_band": 0,
    "timeout_action": 0,
}  # fmt: skip
"""Raw values with which a horn with a heavy load hunts."""
CLICKS = "() => { window.clicks = 0; addEventListener('click', () => window.clicks++, true); }"


def servo_state(demo: Demo, uid: str) -> str:
    """Activity of a servo."""
    return demo.api.get(f"/servos/{uid}").json()["activity"]["state"]


@pytest.fixture
def hunting(demo: Demo) -> Iterator[str]:
    """A servo that hunts under its load, with torque on; removed afterwards with its runs."""
    (made,) = add(demo, rom=HUNTS)
    for change in ({"power": "off"}, {"load_inertia": 3.0, "external_angle_deg": 20.0}, {"power": "on"}):
        sim(demo, made, **change)
    wait_for(lambda: servo_state(demo, made) == "hunting", "it does not hunt")
    ready(demo, made)
    yield made
    for run in demo.api.get("/runs", params={"uid": made}).json():
        demo.api.delete(f"/runs/{run['id']}")
    demo.api.delete(f"/sim/servos/{made}")


def gains_of(demo: Demo, uid: str) -> dict[str, object]:
    """Present values of the rows that Improve may change."""
    keys = ("angle_p_gain", "angle_d_gain", "angle_dead_band", "angle_boost")
    return {key: read(demo, uid, key) for key in keys}


def improved(page: Page, demo: Demo, uid: str) -> None:
    """Improve a servo from its page on; the page counts the clicks."""
    page.goto(f"{demo.url}servos/{uid}")
    page.evaluate(CLICKS)
    page.get_by_test_id("servo-tab-tune").click()
    page.get_by_test_id("improve-open").click()
    expect(page.get_by_test_id("improve-dialog")).to_contain_text("P 100, D 0")
    expect(page.get_by_test_id("improve-plan")).to_contain_text("steps of up to")
    page.get_by_test_id("improve-go").click()
    expect(page.get_by_test_id("tune-job")).to_have_attribute("data-kind", "improve")
    expect(page.get_by_test_id("job-ending")).to_be_visible(timeout=120_000)


def test_a_hunting_servo_becomes_calm_in_at_most_four_clicks(page: Page, demo: Demo, hunting: str) -> None:
    before = gains_of(demo, hunting)
    plans: list[str] = []
    page.on("request", lambda request: plans.append(request.url) if request.url.endswith("/improve/plan") else None)
    improved(page, demo, hunting)
    assert len(plans) <= 3, "a plan for each new angle of the horn"
    expect(page.get_by_test_id("job-ending")).to_contain_text("hunted and now settles in")
    assert page.evaluate("() => window.clicks") <= 4
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-level", "ok")
    expect(page.get_by_test_id("verdict-other")).to_contain_text("Hunts at")
    expect(page.get_by_test_id("metric-hunting")).to_contain_text("none")

    after = gains_of(demo, hunting)
    assert after != before
    p_gain = rows_of(demo, hunting)["angle_p_gain"]
    assert p_gain["value"] < 100 == p_gain["rom"], "the gains are not in RAM only"
    expect(page.get_by_test_id("job-holds")).to_contain_text(f"P {p_gain['value']}")
    wait_for(lambda: servo_state(demo, hunting) == "holding", "it still hunts")

    # Back to A writes the gains of before
    page.get_by_test_id("job-close").click()
    page.get_by_test_id("back-to-A").click()
    expect(page.get_by_test_id("back-to-A")).to_have_count(0)
    assert gains_of(demo, hunting) == before
    page.get_by_test_id("disable-motion").click()
    no_lease(demo)


def test_a_cancelled_improve_restores_the_gains_and_says_so(page: Page, demo: Demo, hunting: str) -> None:
    before = gains_of(demo, hunting)
    limits = {key: read(demo, hunting, key) for key in ("angle_limit_cw", "angle_limit_ccw", "torque_limit_cw")}
    page.goto(f"{demo.url}servos/{hunting}/tune")
    page.get_by_test_id("improve-torque").fill("60")
    planning: list[Route] = []
    page.route("**/improve/plan", lambda route: planning.append(route))
    page.get_by_test_id("improve-open").click()
    expect(page.get_by_test_id("improve-go"), "the plan is not shown yet").to_be_disabled()
    for one in planning:
        one.continue_()
    page.unroute("**/improve/plan")
    page.get_by_test_id("improve-go").click()
    expect(page.get_by_test_id("step-check")).to_have_attribute("data-state", "done")
    page.get_by_test_id("step-cancel").click()
    expect(page.get_by_test_id("tune-job-ended")).to_have_attribute("data-state", "cancelled")
    expect(page.get_by_test_id("job-holds")).to_contain_text("P 100, D 0")
    assert gains_of(demo, hunting) == before
    assert {key: read(demo, hunting, key) for key in limits} == limits
    torque_off(demo, hunting)
    page.get_by_test_id("disable-motion").click()
    no_lease(demo)


@pytest.mark.release
def test_a_recording_is_saved_opened_without_a_bus_and_deleted(page: Page, demo: Demo, servo: str) -> None:
    page.goto(demo.url + "recorder")
    expect(page.get_by_test_id("recorder-state")).to_contain_text("frames")
    page.get_by_test_id("recording-reason").fill("horn rattled")
    page.get_by_test_id("recording-save").click()
    expect(page.get_by_test_id("recording-pending")).to_contain_text("horn rattled")
    expect(page.get_by_test_id("recordings")).to_contain_text("horn rattled")
    # another test's servo may have gone meanwhile: then this is one mark of several in one recording
    found = [each for each in demo.api.get("/recorder/recordings").json() if marks(each, "horn rattled")]
    name = found[0]["name"]
    page.get_by_test_id(f"recording-{name}").get_by_role("button", name="Open").click()
    expect(page.get_by_test_id("recording-marks")).to_contain_text("horn rattled")
    page.get_by_test_id("recording-servo").select_option(servo)
    expect(page.get_by_test_id("plot-current_angle").locator("canvas")).to_be_visible()
    assert page.url.endswith(f"recorder#{name}")

    # playback needs confirmation; here it is cancelled
    page.get_by_test_id("recording-play").click()
    expect(page.get_by_test_id("play-dialog")).to_contain_text("Nothing can be sent")
    page.get_by_test_id("play-dialog").get_by_role("button", name="Cancel").click()
    assert demo.api.get("/bus").json()["address"] == "memory:demo"

    page.get_by_test_id("recordings-back").click()
    with page.expect_download() as kept:
        page.get_by_test_id(f"recording-{name}").get_by_role("link", name="Download").click()
    copy = kept.value.path().with_name("copy.zip")
    copy.write_bytes(kept.value.path().read_bytes())
    page.get_by_test_id("recording-file").set_input_files(copy)
    expect(page.get_by_test_id("recording-copy.zip")).to_be_visible()
    for one in (name, "copy.zip"):
        page.get_by_test_id(f"drop-{one}").click()
        page.get_by_test_id("drop-recording-confirm").click()
        expect(page.get_by_test_id(f"recording-{one}")).to_have_count(0)
    assert {name, "copy.zip"}.isdisjoint(one["name"] for one in demo.api.get("/recorder/recordings").json())
