"""The real server with simulated servos, and Chromium in front of it."""

from collections import Counter
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Error, Page, Request, expect, sync_playwright

from e2e import preloaded
from e2e.chromium import find, keep_priority
from e2e.contexts import TIMEOUT_MS, WIDE, borrowed
from e2e.servers import Demo, ready_demo

expect.set_options(timeout=TIMEOUT_MS)

HERE = Path(__file__).parent
DRIVER = "GL Driver Message"
"""Message of Chromium about its own graphics driver: software rendering reads pictures back."""


FAILED = pytest.StashKey[bool]()

LONG = (
    "test_view_frame", "test_story", "test_motion_page", "test_servo_actions", "test_tune", "test_stop_reach",
    "test_access_deep", "test_access", "test_bus_page", "test_scrub", "test_never_lies_pages", "test_technician",
    "test_commission_failing", "test_output_story",
)  # fmt: skip
"""Files that take longest. They begin first, so that no worker is left with one when the others have finished.

The two with 3D, drawn by the processor, are apart: together they would leave no time for the others.
"""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Long files first, then those with many tests, unless another order is requested."""
    if config.getoption("shuffle") is not None:
        return
    number = Counter(item.path for item in items)

    def place(item: pytest.Item) -> tuple[int, int]:
        name = item.path.stem
        return (LONG.index(name) if name in LONG else len(LONG), -number[item.path])

    mine = [item for item in items if item.path.parent == HERE]
    items[:] = [item for item in items if item.path.parent != HERE] + sorted(mine, key=place)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Note whether a test failed."""
    report = yield
    if report.failed:
        item.stash[FAILED] = True
    return report


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item) -> None:
    """After a failure, end every server and browser, so that a latched stop, for example, fails no other test."""
    if item.stash.get(FAILED, False):
        del item.stash[FAILED]
        item.session._setupstate.teardown_exact(None)  # pyright: ignore[reportPrivateUsage] # pytest offers no other way


@pytest.fixture(scope="module")
def demo(request: pytest.FixtureRequest) -> Iterator[Demo]:
    """The demo of one test file, with SERVOS servos of different models and firmware, or three, ready."""
    with ready_demo(getattr(request.node.obj, "SERVOS", 3)) as one:
        yield one


@pytest.fixture(scope="session")
def chromium() -> Iterator[Callable[..., Browser]]:
    """A function that starts headless Chromium with additional flags."""
    path = find()
    if path is None:
        pytest.skip("no Chromium: 'make chromium' finds or installs one")
    preloaded.prepare()  # servers may raise their priority, as a user's server as root does; Chromium may not
    keep_priority()
    with sync_playwright() as playwright:
        yield lambda *flags: playwright.chromium.launch(executable_path=path, args=["--no-sandbox", *flags])


@pytest.fixture(scope="session")
def browser(chromium: Callable[..., Browser]) -> Iterator[Browser]:
    """A browser without 3D: software rendering would take most of a test's time."""
    launched = chromium("--disable-3d-apis")
    yield launched
    launched.close()


@pytest.fixture(scope="session")
def scene_browser(chromium: Callable[..., Browser]) -> Iterator[Browser]:
    """A browser with 3D in software."""
    launched = chromium()
    yield launched
    launched.close()


@dataclass
class Watched:
    """Requests and complaints of a page."""

    foreign: list[str]
    complaints: list[str]


@pytest.fixture
def context(request: pytest.FixtureRequest) -> Iterator[BrowserContext]:
    """An empty profile with windows of 1440 x 900, with 3D for tests marked `scene`."""
    scene = request.node.get_closest_marker("scene") is not None
    launched: Browser = request.getfixturevalue("scene_browser" if scene else "browser")
    with borrowed(launched, reduced_motion="no-preference" if scene else "reduce") as made:
        yield made


@pytest.fixture
def fresh_page(request: pytest.FixtureRequest) -> Iterator[Page]:
    """An unwatched page in its own context, for tests that replace its scripts."""
    name = "scene_browser" if request.node.get_closest_marker("scene") else "browser"
    launched: Browser = request.getfixturevalue(name)
    made = launched.new_context(viewport=WIDE)
    made.set_default_timeout(TIMEOUT_MS)
    yield made.new_page()
    made.close()


@pytest.fixture
def watched() -> Watched:
    """Filled by the `page` fixture."""
    return Watched([], [])


@pytest.fixture
def page(context: BrowserContext, watched: Watched, demo: Demo) -> Iterator[Page]:
    """A page that must end without a request to another host and without an error or warning in its console."""

    def on_request(request: Request) -> None:
        if not request.url.startswith((demo.url, "data:", "blob:", demo.url.replace("http", "ws", 1))):
            watched.foreign.append(request.url)

    def on_console(message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and DRIVER not in message.text:
            watched.complaints.append(f"{message.text} ({message.location})")

    def on_error(error: Error) -> None:
        watched.complaints.append(error.stack or str(error))

    context.on("request", on_request)
    made = context.new_page()
    made.on("console", on_console)
    made.on("pageerror", on_error)
    yield made
    context.remove_listener("request", on_request)
    assert watched.foreign == []
    assert watched.complaints == []
