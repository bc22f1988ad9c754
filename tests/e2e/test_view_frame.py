"""The 3D view in a real browser, in a frame as the page embeds it, without the rest of the product."""

import io
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, ConsoleMessage, Error, Frame, Page
from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import Route

from hornbill.view.proxy import routes, same_origin
from hornbill.view.viewer import Viewer
from unit.view.servos import Servos, pose
from unit.view.site import serving

WIDTH, HEIGHT = 480, 300
KNOWN = "'unsafe-eval' is not an allowed source of script"
"""viser's page tries this once at its start, is refused, and goes on without."""


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
        self.frame.locator("canvas").first.wait_for(timeout=30_000)
        self.page.wait_for_function("() => frames[0].__viserSceneTree?.getState()['/hero/pivot'] !== undefined")
        self.page.wait_for_timeout(2500)  # models are unpacked and drawn in software

    def picture(self) -> np.ndarray:
        shot = self.page.locator("iframe").screenshot(timeout=60_000)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


@pytest.fixture
def shown(browser: Browser) -> Iterator[Shown]:
    """A page with the frame in it. It must end without a foreign request and without an unknown complaint."""

    async def host(_: Request) -> HTMLResponse:
        frame = (
            f'<iframe title="3D view" src="/viser/?darkMode&quality=low&fixedDpr=1" width="{WIDTH}" height="{HEIGHT}">'
        )
        policy = "default-src 'none'; frame-src 'self'; style-src 'unsafe-inline'; img-src data:"
        head = '<!doctype html><link rel="icon" href="data:,"><style>iframe{border:0}</style>'
        return HTMLResponse(f"{head}{frame}</iframe>", headers={"Content-Security-Policy": policy})

    selected: list[str] = []
    servos = Servos(pose(0, series="BLA15"), pose(1), pose(2))
    viewer = Viewer(servos, on_select=selected.append)
    foreign: list[str] = []
    complaints: list[str] = []
    with serving(Route("/", host), *routes(viewer, allowed=same_origin(["127.0.0.1"]))) as port:
        page = browser.new_page(viewport={"width": WIDTH + 40, "height": HEIGHT + 40})
        ours = (f"http://127.0.0.1:{port}/", f"ws://127.0.0.1:{port}/", "data:", "blob:")
        page.on("request", lambda request: None if request.url.startswith(ours) else foreign.append(request.url))

        def on_console(message: ConsoleMessage) -> None:
            if message.type == "error" and KNOWN not in message.text:
                complaints.append(message.text)

        def on_error(error: Error) -> None:
            if KNOWN not in str(error):
                complaints.append(str(error))

        page.on("console", on_console)
        page.on("pageerror", on_error)
        page.goto(f"http://127.0.0.1:{port}/")
        made = Shown(page, servos, viewer, selected)
        made.wait_for_scene()
        yield made
        page.close()
        viewer.close()
    assert foreign == []
    assert complaints == []


PANELS = """() => [...document.querySelectorAll(
    '.mantine-Paper-root, .mantine-Notifications-root, [title="About Viser"], button, input, a')]
    .filter(element => element.getClientRects().length).map(element => element.outerHTML.slice(0, 99))"""


def test_the_frame_shows_a_servo_and_nothing_of_visers_own(shown: Shown) -> None:
    assert shown.frame.evaluate(PANELS) == []
    picture = shown.picture()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 200
    horn = (picture > 150).all(axis=2)
    assert horn.sum() > 300, "the white horn"
    teal = (picture[:, :, 1] > picture[:, :, 0] + 40) & (picture[:, :, 1] > 90)
    assert teal.sum() > 100, "the limit arc"


def test_a_positive_angle_turns_the_horn_clockwise_on_the_screen(shown: Shown) -> None:
    """The camera looks from the front right and above, so clockwise sweeps from the back over the right side."""
    middles: list[float] = []
    for angle in (0.0, 45.0, 90.0):
        shown.servos.now = (pose(0, series="BLA15", angle_deg=angle, command_deg=None), *shown.servos.now[1:])
        shown.page.wait_for_timeout(1500)
        picture = shown.picture()[60:]
        rows, columns = np.nonzero((picture > 150).all(axis=2))
        middles.append(float(columns.mean()))
        assert len(rows) > 300
    assert middles[0] < middles[1] - 5
    assert middles[0] < middles[2] - 5


def test_a_reload_comes_back_without_the_parameter_viser_adds(shown: Shown) -> None:
    assert "websocket=" in shown.frame.url, "viser no longer rewrites its address: the redirect may go"
    shown.frame.evaluate("() => location.reload()")
    shown.page.wait_for_timeout(500)
    shown.wait_for_scene()
    assert shown.viewer.watched


def test_a_click_selects_the_servo_under_it(shown: Shown) -> None:
    box = shown.page.locator("iframe").bounding_box()
    assert box is not None
    step = 24
    for y in range(4, 70, step):
        for x in range(4, WIDTH, step):
            shown.page.mouse.click(box["x"] + x, box["y"] + y)
            shown.page.wait_for_timeout(60)
            if shown.selected:
                break
        if shown.selected:
            break
    shown.page.wait_for_timeout(300)
    assert shown.selected
    assert shown.selected[0] in {servo.uid for servo in shown.servos.now[1:]}
