"""`make shots`: the pictures of README and docs, taken from the real page with simulated servos."""

import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import httpx  # noqa: E402
from playwright.sync_api import Page, sync_playwright  # noqa: E402

from e2e.chromium import find  # noqa: E402
from e2e.servers import running_demo  # noqa: E402

PICTURES = Path(os.environ.get("HORNBILL_PICTURES", Path(__file__).parents[2] / "docs" / "pictures"))
"""Another folder for a preview, which leaves the pictures of the docs."""
LABELS = ("Elevator L", "Antenna arm", "Throttle", "Gripper", "Rudder", "Spare, new")
WIDE, TABLET = {"width": 1440, "height": 900}, {"width": 820, "height": 1180}


def servos(page: Page, url: str, _uid: str) -> None:
    """The list."""
    page.goto(url + "servos")
    page.wait_for_timeout(2500)


def parameters(page: Page, url: str, uid: str) -> None:
    """Limits, some staged and one rejected."""
    page.goto(f"{url}servos/{uid}/parameters#angle_limit_cw")
    for key, text in (("angle_limit_cw", "75"), ("temperature_limit_upper", "70"), ("torque_limit_cw", "120")):
        box = page.get_by_test_id(f"input-{key}")
        box.fill(text)
        box.press("Enter")
    page.keyboard.press("Tab")
    page.wait_for_timeout(9000)


def motion(page: Page, url: str, uid: str) -> None:
    """A jog."""
    page.goto(f"{url}servos/{uid}/motion")
    page.get_by_test_id("enable-motion").click()
    page.wait_for_timeout(4000)
    page.get_by_test_id("jog-value").fill("36")
    page.get_by_test_id("jog-go").click()
    page.wait_for_timeout(3000)


def bus(page: Page, url: str, _uid: str) -> None:
    """Load that rises to its limit while every servo is polled fast, and the monitor."""
    fast = {"channels": ["current_angle", "current_speed", "current_torque"], "rate_hz": 50}
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        uids = [one["uid"] for one in api.get("/servos").json()]
        page.goto(url + "bus")
        page.wait_for_timeout(22_000)
        for each in uids:
            api.put(f"/servos/{each}/telemetry", json=fast)
        page.wait_for_timeout(20_000)
        for each in uids:
            api.put(f"/servos/{each}/telemetry", json={"channels": [], "rate_hz": 1})


def commission(page: Page, url: str, _uid: str) -> None:
    """Identifying new servos: one has its name, the next wiggles."""
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        for _ in range(4 - len(api.get("/commissioning/candidates").json()["servos"])):
            api.post("/sim/servos", json={"model": "BLA21-06U-A0", "firmware": "1.300"})
        page.wait_for_timeout(9000)
    page.goto(url + "commission")
    page.get_by_test_id("find-go").click()
    page.get_by_test_id("label").fill("Elevator L")
    page.get_by_test_id("give").click()
    page.get_by_test_id("label").fill("Aileron L")
    page.get_by_test_id("wiggle").click()
    page.wait_for_timeout(1800)


def records(page: Page, url: str, uid: str) -> None:
    """A snapshot beside the present values."""
    page.wait_for_timeout(6000)  # a wiggle of another scene holds motion control until then
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        number = api.post(f"/servos/{uid}/snapshots", json={"reason": "before the first flight"}).json()["id"]
        for key, value in (("angle_limit_cw", 42.0), ("angle_p_gain", 55), ("temperature_limit_upper", 70)):
            response = api.put(f"/servos/{uid}/parameters/{key}", json={"value": value})
            response.raise_for_status()
    page.goto(f"{url}records#snapshots/{uid}")
    page.get_by_test_id(f"snapshot-{number}").click()
    page.get_by_test_id("differs-angle_limit_cw").get_by_role("checkbox").check()
    page.wait_for_timeout(1000)
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        api.post(f"/servos/{uid}/snapshots/{number}/restore", json={})


def faults(page: Page, url: str, uid: str) -> Callable[[], None]:
    """An active failure and warnings, a cleared fault, and an acknowledged one. Returns a function that clears them."""
    api = httpx.Client(base_url=url + "api/v1", timeout=60)
    first, second = [one["uid"] for one in api.get("/servos").json() if one["uid"] != uid][:2]
    wrong = {first: ["motor_signal"], second: ["sensor_strong", "temperature_high"], uid: ["torque_limit_cw_reached"]}

    def put(on: bool) -> None:
        for each, keys in wrong.items():
            api.patch(f"/sim/servos/{each}", json={"faults": dict.fromkeys(keys, on)})

    put(True)
    page.wait_for_timeout(5000)
    api.patch(f"/sim/servos/{second}", json={"faults": {"sensor_strong": False}})
    api.post(f"/servos/{second}/faults/temperature_high/acknowledge", params={"by": "page-1012"})
    page.wait_for_timeout(4000)
    page.goto(url + "faults")
    page.get_by_test_id("faults-past").wait_for()
    page.wait_for_timeout(1000)

    def end() -> None:
        put(False)
        api.post(f"/servos/{first}/faults/acknowledge", params={"by": "page-1012"})
        api.close()

    return end


def tune(page: Page, url: str, uid: str) -> Callable[[], None]:
    """Overlaid step tests with two P gains. Returns a function that restores the gain and removes the runs."""
    api = httpx.Client(base_url=url + "api/v1", timeout=60)
    page.wait_for_timeout(5000)
    for key, value in (("smoothing", False), ("angle_p_gain", 25)):
        api.put(f"/servos/{uid}/parameters/{key}", json={"value": value}).raise_for_status()
    page.goto(f"{url}servos/{uid}/tune")
    page.get_by_test_id("step-open").click()
    page.get_by_test_id("step-deg").fill("10")
    page.get_by_test_id("step-go").click()
    page.get_by_test_id("legend-A").wait_for()
    page.get_by_test_id("tune-tab-gains").click()
    page.get_by_test_id("input-angle_p_gain").fill("55")
    page.get_by_test_id("input-angle_p_gain").press("Enter")
    page.get_by_test_id("step-again").click()
    page.get_by_test_id("legend-B").wait_for()
    page.get_by_test_id("tune-tab-improve").click()
    page.wait_for_timeout(1500)

    def end() -> None:
        time.sleep(4)  # the page is closed: its motion control expires
        for key, value in (("smoothing", True), ("angle_p_gain", 40)):
            api.put(f"/servos/{uid}/parameters/{key}", json={"value": value})
        for run in api.get("/runs", params={"uid": uid}).json():
            api.delete(f"/runs/{run['id']}")
        api.close()

    return end


def recorder(page: Page, url: str, uid: str) -> Callable[[], None]:
    """A manual recording of a few moves, open. Returns a function that removes it."""
    api = httpx.Client(base_url=url + "api/v1", timeout=60)
    time.sleep(5)  # a scene before may hold motion control until then
    lease = {"Lease": api.post("/leases", json={"holder": "Bench", "ttl_s": 30}).json()["id"]}
    api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=lease).raise_for_status()
    for angle in (30, -45, 10):
        api.post(f"/servos/{uid}/command", json={"type": "angle", "value": angle}, headers=lease).raise_for_status()
        time.sleep(1.5)
    api.post(f"/servos/{uid}/torque", json={"mode": "off"}, headers=lease)
    api.delete(f"/leases/{lease['Lease']}")
    body = {"reason": "The arm rattled on its way back", "before_s": 30}
    name = api.post("/recorder/recordings", params={"wait": True}, json=body).json()["name"]
    page.goto(f"{url}recorder#{name}")
    page.get_by_test_id("recording-servo").select_option(uid)
    page.get_by_test_id("plot-current_angle").scroll_into_view_if_needed()
    page.get_by_test_id("plot-current_angle").locator("canvas").wait_for()
    page.get_by_test_id("recording").evaluate("one => one.scrollTo(0, 0)")
    page.locator("[data-testid=view-replay][data-state=shown]").wait_for(timeout=60_000)
    drawn(page, "/hero/bla")
    page.wait_for_timeout(1500)

    def end() -> None:
        api.delete(f"/recorder/recordings/{name}")
        api.close()

    return end


def scrub(page: Page, url: str, uid: str) -> Callable[[], None]:
    """The recording, scrolled to its plots, between two angles: the horn there, its command ahead."""
    end = recorder(page, url, uid)
    slider = page.get_by_test_id("scrub-slider")
    shown = page.get_by_test_id("replay-angle")
    slider.press("Home")
    for _ in range(4000):
        slider.press("ArrowRight")
        if "command −45" in shown.inner_text():  # the horn is on its way there
            break
    slider.evaluate("one => one.blur()")
    page.get_by_test_id("recording").evaluate("one => one.scrollTo(0, one.querySelector('.rec-split').offsetTop - 190)")
    page.wait_for_timeout(1500)
    return end


def api_page(page: Page, url: str, uid: str) -> Callable[[], None]:
    """The last actions as curl, above all operations. Returns a function that restores the values."""
    api = httpx.Client(base_url=url + "api/v1", timeout=60)
    path = f"/servos/{uid}/parameters/angle_limit_cw"
    before = api.get(path).json()["value"]
    page.goto(f"{url}servos/{uid}/parameters#angle_limit_cw")
    box = page.get_by_test_id("input-angle_limit_cw")
    for value in (before - 5, before - 3):
        box.fill(f"{value:g}")
        box.press("Enter")
        page.locator("[data-testid=row-angle_limit_cw][data-state=staged]").wait_for()
        page.get_by_test_id("apply").click()
        page.locator("[data-testid=row-angle_limit_cw]:is([data-state=applied], [data-state=idle])").wait_for()
    page.get_by_role("link", name="API").click()
    page.get_by_role("main").get_by_role("heading").first.wait_for()
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(500)

    def end() -> None:
        api.put(path, json={"value": before})
        api.close()

    return end


def matrix(page: Page, url: str, uid: str) -> Callable[[], None]:
    """Every servo side by side, one tuned differently. Returns a function that restores it."""
    api = httpx.Client(base_url=url + "api/v1", timeout=60)
    before = api.get(f"/servos/{uid}/parameters").json()["parameters"]
    odd = {"angle_p_gain": 71, "temperature_limit_upper": 65}
    api.patch(f"/servos/{uid}/parameters", json={"values": odd}).raise_for_status()
    page.goto(f"{url}servos/matrix?uids=" + ",".join(one["uid"] for one in api.get("/servos").json()))
    page.get_by_test_id("matrix").get_by_role("columnheader").nth(6).wait_for()
    page.get_by_test_id("matrix").get_by_role("rowheader").nth(8).wait_for()
    line = page.get_by_test_id("line-angle_p_gain")
    line.wait_for()
    line.evaluate("row => row.scrollIntoView({ block: 'center' })")
    page.wait_for_timeout(1500)

    def end() -> None:
        api.patch(f"/servos/{uid}/parameters", json={"values": {key: before[key]["value"] for key in odd}})
        api.close()

    return end


def wall(page: Page, url: str, _uid: str) -> None:
    """All horns."""
    page.goto(url + "servos")
    page.locator(".servo-row").nth(5).wait_for()
    page.get_by_role("button", name="3D", exact=True).click()
    page.locator("[data-testid=wall][data-state=shown]").wait_for(timeout=60_000)
    drawn(page, "/crowd/horn-far")
    page.wait_for_timeout(2000)
    page.wait_for_function("() => document.querySelector('.wall-place[data-stale=true]') === null", timeout=60_000)


def login(page: Page, _url: str, _uid: str) -> Callable[[], None]:
    """The sign-in page."""
    stack = ExitStack()
    _, url = stack.enter_context(running_demo("--servos", "1", "--token", "a-token-for-the-picture"))
    page.goto(url)
    page.get_by_test_id("login").wait_for()
    return stack.close


def drawn(page: Page, beginning: str) -> None:
    """Wait until the 3D view has a node with this prefix."""
    (frame,) = [one for one in page.frames if "/viser/" in one.url]
    frame.wait_for_function(
        "name => Object.keys(window.__viserSceneTree?.getState() ?? {}).some(node => node.startsWith(name))",
        arg=beginning,
        timeout=60_000,
    )


SCENES: tuple[Callable[[Page, str, str], Callable[[], None] | None], ...] = (
    servos, parameters, motion, bus, commission, records, faults, tune, recorder, scrub, api_page, matrix, wall, login,
)  # fmt: skip


def main() -> None:
    """Every page, or those given, in both themes at desktop size, and in one theme on a tablet."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    scenes = [scene for scene in SCENES if scene.__name__ in sys.argv[1:] or not sys.argv[1:]]
    with running_demo("--seed", "1") as (_, url), sync_playwright() as playwright:
        api = httpx.Client(base_url=url + "api/v1")
        while sum(one["state"] == "ready" for one in api.get("/servos").json()) < 6:
            time.sleep(0.2)
        for one, label in zip(api.get("/servos").json(), LABELS, strict=True):
            api.patch(f"/servos/{one['uid']}", json={"label": label})
        uid = next(one["uid"] for one in api.get("/servos").json() if one["label"] == "Elevator L")
        browser = playwright.chromium.launch(executable_path=find(), args=["--no-sandbox"])
        for theme, size, suffix in (("dark", WIDE, ""), ("light", WIDE, ""), ("light", TABLET, "-tablet")):
            for scene in scenes:
                context = browser.new_context(
                    viewport=size,  # pyright: ignore[reportArgumentType]
                    color_scheme=theme,  # pyright: ignore[reportArgumentType]
                    has_touch=size is TABLET,
                )
                page = context.new_page()
                end = scene(page, url, uid)
                name = f"{scene.__name__}-{theme}{suffix}.png"
                page.screenshot(path=PICTURES / name, timeout=60_000)
                sys.stdout.write(f"{PICTURES.name}/{name}\n")
                context.close()
                if end is not None:
                    end()
        browser.close()
        api.close()


if __name__ == "__main__":
    main()
