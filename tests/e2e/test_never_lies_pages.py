"""The page never lies, page by page: old values are stale, unavailable controls disabled, both recover, and crashes
stay local."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, Route, expect

from e2e.cases import cases
from e2e.servers import Demo, Server, running
from e2e.state import ready, sim, uids_of, wait_for
from e2e.test_never_lies import SILENCE_S, STATUS_PERIOD_S, Watch, alive, muted, suspended

HEARTBEAT_S = 1.0
OFFLINE_AFTER_S = 3.0
"""Time until a silent servo is offline: three periods of its NodeStatus."""
FAULT = "sensor_weak"
WATCHED_HZ = 10
MAIN = ("servos", "wall", "parameters", "motion", "bus")
"""Pages of most work."""
"""At least; the page asks for twice as much."""


@pytest.fixture(scope="module")
def own() -> Iterator[Server]:
    """A demo that can be suspended: two servos, and a factory-new one."""
    with running("demo", "--servos", "2", "--seed", "3") as server:
        server.api.post("/sim/servos", json={"model": "BLA21-06U-A0", "firmware": "1.300"}).raise_for_status()
        server.ready(3)
        yield server


@pytest.fixture
def tab(context: BrowserContext) -> Page:
    """Not watched: the console logs the failures caused here, as expected."""
    page = context.new_page()
    page.add_init_script("window.hasty = true")
    return page


def named(server: Server) -> str:
    """A servo of the demo with a servo ID."""
    return next(str(one["uid"]) for one in server.servos() if one["servo_id"])


def as_is(page: Page, server: Server, uid: str) -> None:
    """Nothing needs to be done first."""


def as_faulty(page: Page, server: Server, uid: str) -> None:
    """Wait for an active fault: a cleared one of an earlier test never becomes stale."""
    expect(page.locator(f"[data-testid=fault-{FAULT}][data-active=true]")).to_be_visible()


def as_polled(page: Page, server: Server, uid: str) -> None:
    """Wait until the angle is polled as often as the page asks for."""
    channels = f"/servos/{uid}/telemetry"

    def granted() -> bool:
        return (server.api.get(channels).json()["channels"]["current_angle"]["granted_hz"] or 0) >= WATCHED_HZ

    wait_for(granted, "the angle is not polled")


def ticked(page: Page, server: Server, uid: str) -> None:
    page.get_by_test_id(f"select-{uid}").check()


def staged(page: Page, server: Server, uid: str) -> None:
    box = page.get_by_test_id("input-angle_limit_cw")
    box.fill("33")
    box.press("Enter")


def identifying(page: Page, server: Server, uid: str) -> None:
    page.get_by_test_id("find-go").click()


def as_wall(page: Page, server: Server, uid: str) -> None:
    page.get_by_role("button", name="3D", exact=True).click()


@dataclass(frozen=True)
class Case:
    """Page, preparation, and the element that is disabled or false while the server is silent."""

    where: str
    selector: str
    first: Callable[[Page, Server, str], None] = as_is
    attribute: str = "disabled"


CASES = {
    "servos": Case("servos", "[data-testid=torque-off-selected]", ticked),
    "wall": Case("servos", "[data-testid=wall]", as_wall, "data-frozen"),
    "matrix": Case("servos/matrix?uids={uid}", ".below button.link"),
    "motion": Case("servos/{uid}/motion", "[data-testid=enable-motion]"),
    "parameters": Case("servos/{uid}/parameters#angle_limit_cw", "[data-testid=apply]", staged),
    "tune": Case("servos/{uid}/tune", "[data-testid=step-open]"),
    "commission": Case("commission", "[data-testid=wiggle]", identifying),
    "bus": Case("bus#doctor", "[data-testid=doctor-again]"),
    "records": Case("records#snapshots/{uid}", "[data-testid=take-snapshot]"),
    "profiles": Case("records#profiles", "[data-testid=profile-import]"),
    "faults": Case("faults", "[data-testid=acknowledge-all]"),
}


@pytest.mark.parametrize("name", cases(CASES, usual=MAIN, scene=("wall",)))
def test_controls_of_each_page_are_disabled_while_the_server_is_silent(name: str, tab: Page, own: Server) -> None:
    case, uid = CASES[name], named(own)
    sim(own, uid, faults={FAULT: name == "faults"})
    tab.goto(own.url + case.where.format(uid=uid))
    expect(tab.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
    case.first(tab, own, uid)
    one = tab.locator(case.selector)
    shows(one, case.attribute, "false")
    watch = Watch(tab, case.selector, case.attribute, "true")
    with suspended(own) as since:
        watch.waits(SILENCE_S, since)
        expect(tab.get_by_test_id("live-state")).to_have_attribute("data-state", "down")
        expect(tab.get_by_test_id("stop")).to_contain_text("NO LINK")
        expect(tab.get_by_text("No link to hornbill for")).to_be_visible()
        expect(tab.locator("main [data-stale=false]"), "nothing is shown as fresh").to_have_count(0)
    expect(tab.get_by_test_id("live-state")).to_have_attribute("data-state", "up")
    expect(tab.get_by_test_id("stop")).to_contain_text("STOP")
    shows(one, case.attribute, "false")
    sim(own, uid, faults={FAULT: False})


def shows(one: Locator, attribute: str, value: str) -> None:
    """Wait for an attribute, perhaps until all requests were repeated."""
    if attribute == "disabled":
        expect(one).to_be_enabled(enabled=value == "false")
    else:
        expect(one).to_have_attribute(attribute, value)


@dataclass(frozen=True)
class Old:
    """Page with a servo, the element that shows staleness, and its time limit."""

    where: str
    selector: str
    attribute: str
    fresh: str
    old: str
    within_s: float
    first: Callable[[Page, Server, str], None] = as_is


SILENT = {
    "servos": Old(
        "servos", "[data-testid=servo-row-{uid}] .c-angle", "data-stale", "false", "true", 2 * STATUS_PERIOD_S
    ),
    "parameters": Old(
        "servos/{uid}/parameters", ".readouts > div:has([data-testid=angle-readout])", "data-stale", "false", "true",
        2 / WATCHED_HZ, as_polled,
    ),
    "wall": Old("servos", "[data-testid=wall-{uid}]", "data-stale", "false", "true", 2 * STATUS_PERIOD_S, as_wall),
    "matrix": Old(
        "servos/matrix?uids={uid}#smoothing", "[data-testid=cell-{uid}-smoothing]", "data-state", "idle", "stale",
        OFFLINE_AFTER_S,
    ),
    "faults": Old(
        "faults", "[data-testid=fault-{fault}]", "data-stale", "false", "true", OFFLINE_AFTER_S + HEARTBEAT_S, as_faulty
    ),
    "bus": Old(
        "bus#nodes", "[data-testid=node-{node}]", "data-away", "false", "true",
        OFFLINE_AFTER_S + 2 * HEARTBEAT_S,  # the list is polled every two seconds
    ),
    "records": Old(
        "records#snapshots/{uid}", "[data-testid=take-snapshot]", "disabled", "false", "true", OFFLINE_AFTER_S
    ),
    "tune": Old("servos/{uid}/tune", "[data-testid=step-open]", "disabled", "false", "true", OFFLINE_AFTER_S),
}  # fmt: skip


@pytest.mark.parametrize("name", cases(SILENT, usual=MAIN, scene=("wall",)))
def test_values_of_a_silent_servo_become_stale_on_each_page_and_recover(name: str, tab: Page, own: Server) -> None:
    case, uid = SILENT[name], named(own)
    node = next(one["node_id"] for one in own.servos() if one["uid"] == uid)
    sim(own, uid, faults={FAULT: name == "faults"})
    names = {"uid": uid, "node": node, "fault": FAULT}
    tab.goto(own.url + case.where.format(**names))
    case.first(tab, own, uid)
    one = tab.locator(case.selector.format(**names))
    shows(one, case.attribute, case.fresh)
    watch = Watch(tab, case.selector.format(**names), case.attribute, case.old)
    with muted(own, uid) as since:
        watch.waits(case.within_s, since)
    sim(own, uid, faults={FAULT: False})
    if name != "faults":  # that fault is over by now
        shows(one, case.attribute, case.fresh)
    ready(own, uid)


BREAKS = {
    "bus": ("bus", "BusPage"),
    "faults": ("faults", "FaultsPage"),
    "commission": ("commission", "CommissionPage"),
    "records": ("records", "RecordsPage"),
    "tune": ("servos/{uid}/tune", "TunePage"),
    "parameters": ("servos/{uid}/parameters", "ParametersPage"),
    "matrix": ("servos/matrix?uids={uid}", "MatrixPage"),
    "requests": ("api-page", "ApiPage"),
}


@pytest.mark.release
def test_each_crashed_page_leaves_the_frame_and_can_be_retried(fresh_page: Page, demo: Demo) -> None:
    page, uid = fresh_page, uids_of(demo)[0]
    throws = "if (n++ === 0) throw new Error('broken here'); return 'mended';"

    def breaking(component: str) -> Callable[[Route], None]:
        body = f"let n = 0; export function {component}() {{ {throws} }}"
        return lambda route: route.fulfill(body=body, content_type="text/javascript")

    for chunk, (where, component) in BREAKS.items():
        pattern = re.compile(rf"/assets/{chunk}-[\w-]{{8}}\.js$")
        page.route(pattern, breaking(component))
        page.goto("about:blank")
        page.goto(demo.url + where.format(uid=uid))
        failed = page.get_by_test_id("panel-failed")
        expect(failed, chunk).to_contain_text("broken here")
        alive(page)
        failed.get_by_role("button").click()
        expect(page.get_by_role("main"), chunk).to_contain_text("mended")
        page.unroute(pattern)


@pytest.mark.parametrize(
    ("chunk", "component", "where", "works"),
    [
        ("angle-plot", "AnglePlot", "servos/{uid}/parameters#angle_limit_cw", "[data-testid=input-angle_limit_cw]"),
        ("angle-plot", "AnglePlot", "servos/{uid}/motion", "[data-testid=enable-motion]"),
        pytest.param(
            "live",
            "ViewLive",
            "servos/{uid}/parameters#angle_limit_cw",
            "[data-testid=input-angle_limit_cw]",
            marks=pytest.mark.scene,
        ),
    ],
)
def test_a_crashed_plot_or_scene_leaves_the_rest_of_the_page(
    chunk: str, component: str, where: str, works: str, fresh_page: Page, demo: Demo
) -> None:
    broken = f"export function {component}() {{ throw new Error('broken here'); }}"
    pattern = re.compile(rf"/assets/{chunk}-[\w-]{{8}}\.js$")
    fresh_page.route(pattern, lambda route: route.fulfill(body=broken, content_type="text/javascript"))
    uid = uids_of(demo)[0]
    fresh_page.goto(demo.url + where.format(uid=uid))
    expect(fresh_page.get_by_test_id("panel-failed")).to_have_count(1)
    expect(fresh_page.get_by_test_id("panel-failed")).to_contain_text("broken here")
    expect(fresh_page.locator(works)).to_be_enabled()
    expect(fresh_page.get_by_test_id("angle-readout")).to_contain_text("°")
    alive(fresh_page)


def test_a_crashed_plot_of_runs_leaves_step_test_and_gains(fresh_page: Page, demo: Demo) -> None:
    fresh_page.route(re.compile(r"/api/v1/runs\?"), lambda route: route.fulfill(json=[{"id": 1}]))
    uid = uids_of(demo)[0]
    fresh_page.goto(f"{demo.url}servos/{uid}/tune")
    expect(fresh_page.get_by_test_id("panel-failed")).to_have_count(1)
    expect(fresh_page.get_by_test_id("step-open")).to_be_enabled()
    alive(fresh_page)
