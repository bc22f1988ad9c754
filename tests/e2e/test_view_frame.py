"""The 3D view in a real browser, in a frame as the page embeds it, without the rest of the product."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Error, Frame, Page, expect
from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import Route

from e2e.conftest import DRIVER
from e2e.contexts import page_in
from e2e.servers import Demo
from e2e.state import read, uids_of, wait_for
from e2e.steps import at_rest, box
from e2e.test_technician import stands
from hornbill.view.pose import Pose
from hornbill.view.proxy import routes, same_origin
from hornbill.view.viewer import Viewer
from unit.view.servos import Servos, pose
from unit.view.site import serving

pytestmark = pytest.mark.scene

WIDTH, HEIGHT = 480, 300
KEY = "5" * 32


@dataclass
class Shown:
    page: Page
    servos: Servos
    viewer: Viewer
    selected: list[str]

    @property
    def frame(self) -> Frame:
        (found,) = [frame for frame in self.page.frames if "/viser/" in frame.url]
        return found

    def wait_for_scene(self) -> None:
        self.frame.locator("canvas").first.wait_for()
        self.page.wait_for_function("() => frames[0].__viserSceneTree?.getState()['/hero/pivot'] !== undefined")
        self.wait_for_horn(self.servos.now[0].angle_deg or 0)

    def wait_for_horn(self, angle: float) -> None:
        """Wait until the horn is drawn at this angle: models are unpacked, and drawn in software."""
        stands(self.page, angle)
        wait_for(lambda: (self.picture()[60:] > 150).all(axis=2).sum() >= 300, "no horn is drawn")

    def picture(self) -> np.ndarray:
        shot = self.page.locator("iframe").screenshot()
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


def servos() -> tuple[Pose, ...]:
    return pose(0, series="BLA15"), pose(1), pose(2)


@pytest.fixture(scope="module")
def opened(scene_browser: Browser) -> Iterator[Shown]:
    """A page with the frame. It must end without a request to another host and without complaints in its console."""

    async def host(_: Request) -> HTMLResponse:
        source = f"/viser/{KEY}/?darkMode&quality=low&fixedDpr=0.85"
        frame = f'<iframe title="3D view" src="{source}" width="{WIDTH}" height="{HEIGHT}">'
        policy = "default-src 'none'; frame-src 'self'; style-src 'unsafe-inline'; img-src data:"
        head = '<!doctype html><link rel="icon" href="data:,"><style>iframe{border:0}</style>'
        return HTMLResponse(f"{head}{frame}</iframe>", headers={"Content-Security-Policy": policy})

    selected: list[str] = []
    source = Servos(*servos())
    viewer = Viewer(source)
    viewer.on_pick(KEY, selected.append)
    foreign: list[str] = []
    complaints: list[str] = []
    with serving(Route("/", host), *routes(viewer, allowed=same_origin(["127.0.0.1"]))) as port:
        page = scene_browser.new_page(viewport={"width": WIDTH + 40, "height": HEIGHT + 40})
        ours = (f"http://127.0.0.1:{port}/", f"ws://127.0.0.1:{port}/", "data:", "blob:")
        page.on("request", lambda request: None if request.url.startswith(ours) else foreign.append(request.url))

        def on_console(message: ConsoleMessage) -> None:
            if message.type in ("error", "warning") and DRIVER not in message.text:
                complaints.append(message.text)

        def on_error(error: Error) -> None:
            complaints.append(str(error))

        page.on("console", on_console)
        page.on("pageerror", on_error)
        page.goto(f"http://127.0.0.1:{port}/")
        made = Shown(page, source, viewer, selected)
        made.wait_for_scene()
        yield made
        page.close()
        viewer.close()
    assert foreign == []
    assert complaints == []


@pytest.fixture
def shown(opened: Shown) -> Shown:
    """The same, with its servos in the initial state and none selected."""
    opened.servos.now = servos()
    opened.selected.clear()
    opened.wait_for_horn(opened.servos.now[0].angle_deg or 0)
    return opened


PANELS = """() => [...document.querySelectorAll(
    '.mantine-Paper-root, .mantine-Notifications-root, [title="About Viser"], button, input, a')]
    .filter(element => element.getClientRects().length).map(element => element.outerHTML.slice(0, 99))"""


def test_the_frame_shows_a_servo_without_visers_controls(shown: Shown) -> None:
    assert shown.frame.evaluate(PANELS) == []
    picture = shown.picture()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200
    horn = (picture > 150).all(axis=2)
    assert horn.sum() > 300, "the white horn"
    teal = (picture[:, :, 1] > picture[:, :, 0] + 40) & (picture[:, :, 1] > 90)
    assert teal.sum() > 100, "the limit arc"


def test_a_positive_angle_is_clockwise_on_the_screen(shown: Shown) -> None:
    """The camera looks from the front right and above, so clockwise moves from the back over the right side."""
    middles: list[float] = []
    for angle in (0.0, 45.0, 90.0):
        shown.servos.now = (pose(0, series="BLA15", angle_deg=angle, command_deg=None), *shown.servos.now[1:])
        shown.wait_for_horn(angle)
        picture = shown.picture()[60:]
        rows, columns = np.nonzero((picture > 150).all(axis=2))
        middles.append(float(columns.mean()))
        assert len(rows) > 300
    assert middles[0] < middles[1] - 5
    assert middles[0] < middles[2] - 5


def test_a_reload_drops_the_parameter_viser_adds(shown: Shown) -> None:
    assert "websocket=" in shown.frame.url, "viser no longer rewrites its address: the redirect may go"
    shown.frame.evaluate("() => { window.old = true; location.reload(); }")
    shown.page.wait_for_function("() => frames[0].old === undefined")
    shown.wait_for_scene()
    assert shown.viewer.watched


def test_a_click_selects_the_servo_under_it(shown: Shown) -> None:
    at = box(shown.page.locator("iframe"))
    spots = cycle([(x, y) for y in range(4, 70, 24) for x in range(4, WIDTH, 24)])

    def selected() -> bool:
        x, y = next(spots)
        shown.page.mouse.click(at["x"] + x, at["y"] + y)
        shown.page.wait_for_timeout(60)
        return bool(shown.selected)

    wait_for(selected, "no click hit a servo")
    assert shown.selected[0] in {servo.uid for servo in shown.servos.now[1:]}


NODES = "() => Object.keys(window.__viserSceneTree?.getState() ?? {})"


def open_view(page: Page, demo: Demo, uid: str) -> Frame:
    """A servo's parameters with its 3D view."""
    page.goto(f"{demo.url}servos/{uid}/parameters")
    page.locator("[data-testid=view-frame][data-state=shown]").wait_for()
    (frame,) = [one for one in page.frames if "/viser/" in one.url]
    frame.wait_for_function(f"() => ({NODES})().some(node => node.startsWith('/hero/bla'))")
    return frame


@pytest.mark.release
def test_two_browsers_view_different_servos(page: Page, scene_browser: Browser, demo: Demo) -> None:
    shown = {one["model"][:5]: one["uid"] for one in demo.api.get("/servos").json()}
    assert {"BLA15", "BLA21"} <= shown.keys()
    with page_in(scene_browser, color_scheme="dark") as other:
        look_at_different_servos(page, other, demo, shown)


def look_at_different_servos(page: Page, other: Page, demo: Demo, shown: dict[str, str]) -> None:
    first = open_view(page, demo, shown["BLA15"])
    second = open_view(other, demo, shown["BLA21"])
    first.wait_for_function(f"() => ({NODES})().includes('/hero/bla15-low')")
    second.wait_for_function(f"() => ({NODES})().includes('/hero/bla21-low')")
    assert "/hero/bla21-low" not in first.evaluate(NODES)
    assert "/hero/bla15-low" not in second.evaluate(NODES)
    assert ("darkMode" in first.url, "darkMode" in second.url) == (False, True)


@pytest.mark.release
def test_a_click_in_the_scene_opens_the_servo_without_motion(page: Page, demo: Demo) -> None:
    uid = uids_of(demo)[0]
    open_view(page, demo, uid)
    page.get_by_test_id("view-all").click()
    before = {one["uid"]: one["command_deg"] for one in demo.api.get("/servos").json()}
    here = page.url
    at = box(page.locator("[data-testid=view-frame] iframe"))
    spots = cycle([(x, y) for y in range(30, 100, 18) for x in range(10, int(at["width"]), 22)])

    def selected() -> bool:
        x, y = next(spots)
        page.mouse.click(at["x"] + x, at["y"] + y)
        page.wait_for_timeout(100)
        return page.url != here

    wait_for(selected, "no click hit another servo")
    chosen = page.url.split("/servos/")[1].split("/")[0]
    assert chosen in before
    assert chosen != uid
    assert page.url.endswith("/parameters")
    assert {one["uid"]: one["command_deg"] for one in demo.api.get("/servos").json()} == before


@pytest.mark.release
def test_the_choice_to_show_all_servos_is_stored(page: Page, demo: Demo) -> None:
    uid = uids_of(demo)[0]
    open_view(page, demo, uid)
    named = page.locator("[data-testid^=view-name-]")
    expect(page.get_by_test_id(f"view-name-{uid}")).to_be_visible()
    expect(named).to_have_count(1)
    page.get_by_test_id("view-all").click()
    expect(named).not_to_have_count(1)
    page.reload()
    expect(page.get_by_test_id("view-all")).to_have_attribute("aria-pressed", "true")


def drag(page: Page, grip: str, x: float, y: float) -> None:
    at = at_rest(page.get_by_test_id(f"grip-{grip}"))
    page.mouse.move(at["x"] + at["width"] / 2, at["y"] + at["height"] / 2)
    page.mouse.down()
    page.mouse.move(at["x"] + at["width"] / 2 + x, at["y"] + at["height"] / 2 + y, steps=6)
    page.mouse.up()


def test_dragging_needs_motion_control_and_only_stages_limits(page: Page, demo: Demo) -> None:
    uid = next(one["uid"] for one in demo.api.get("/servos").json() if one["state"] == "ready")

    def at() -> float:
        return float(read(demo, uid, "current_angle"))

    page.goto(f"{demo.url}servos/{uid}/motion")
    page.locator("[data-testid=view-frame][data-state=shown]").wait_for()
    horn = page.get_by_test_id("grip-horn")
    expect(horn).to_have_attribute("data-live", "false")
    before, held = at(), read(demo, uid, "angle_limit_cw")
    drag(page, "horn", 30, 12)
    expect(page.get_by_test_id("view-notice")).to_contain_text("Motion is off")
    page.wait_for_timeout(800)
    assert abs(at() - before) < 0.5, "no client has motion control"

    drag(page, "cw", -10, -14)
    expect(page.get_by_test_id("view-notice")).to_contain_text("Staged, not sent")
    assert read(demo, uid, "angle_limit_cw") == held

    page.get_by_test_id("enable-motion").click()
    expect(horn).to_have_attribute("data-live", "true")
    drag(page, "horn", 30, 12)
    expect(page.get_by_test_id("jog-command")).not_to_have_text(f"{before:+.1f}°")
    wait_for(lambda: abs(at() - before) > 5, "it does not move")

    page.get_by_test_id("disable-motion").click()
    expect(horn).to_have_attribute("data-live", "false")
    page.wait_for_timeout(800)
    rest = at()
    drag(page, "horn", -30, -12)
    page.wait_for_timeout(800)
    assert abs(at() - rest) < 0.5
    assert demo.api.get("/leases").json() == []


@pytest.mark.release
def test_the_chosen_quality_is_stored(page: Page, demo: Demo) -> None:
    uid = uids_of(demo)[0]
    open_view(page, demo, uid)
    button = page.get_by_test_id("view-quality")
    expect(button, "drawn in software").to_have_text("Quality: auto, low")
    with page.expect_event("framenavigated", lambda frame: "quality=high" in frame.url):
        button.click()
    page.locator("[data-testid=view-frame][data-state=shown]").wait_for()
    expect(button).to_have_text("Quality: high")
    button.click()  # drawn in software, high quality takes a second a picture
    page.reload()
    page.locator("[data-testid=view-frame][data-state=shown]").wait_for()
    expect(button).to_have_text("Quality: low")
