"""Firefox over WebDriver BiDi and WebKit over WebDriver with one interface: open a page, evaluate, click and type."""

import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Protocol, cast

import httpx
from websockets.sync.client import connect
from websockets.sync.connection import Connection

WEBKIT_BROWSERS: Final = "*-linux-gnu*/webkit2gtk-4.*/MiniBrowser"
TIMEOUT_S: Final = 30.0
ESCAPE: Final = "\ue00c"
ENTER: Final = "\ue006"
CONTROL: Final = "\ue009"


class Driver(Protocol):
    """One window of a browser."""

    def go(self, url: str) -> None:
        """Open an address and wait until it is loaded."""

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression in the page."""

    def act(self, device: dict[str, Any]) -> None:
        """Move, press or type: one input source of WebDriver's "Perform Actions"."""


class Firefox:
    """WebDriver BiDi, which Firefox supports."""

    def __init__(self, line: Connection) -> None:
        self._line = line
        self._number = 0
        self._call("session.new", capabilities={})
        self._window = self._call("browsingContext.getTree")["contexts"][0]["context"]
        self._call("browsingContext.setViewport", context=self._window, viewport={"width": 1280, "height": 900})

    def go(self, url: str) -> None:
        self._call("browsingContext.navigate", context=self._window, url=url, wait="complete")

    def evaluate(self, expression: str) -> Any:
        target = {"context": self._window}
        found = self._call(
            "script.evaluate", expression=f"JSON.stringify({expression})", target=target, awaitPromise=True
        )
        assert found["type"] == "success", found
        return json.loads(found["result"].get("value", "null"))

    def act(self, device: dict[str, Any]) -> None:
        self._call("input.performActions", context=self._window, actions=[device])

    def _call(self, method: str, **params: Any) -> dict[str, Any]:
        self._number += 1
        self._line.send(json.dumps({"id": self._number, "method": method, "params": params}))
        while True:
            response = json.loads(self._line.recv(timeout=TIMEOUT_S))
            if response.get("id") == self._number:
                assert response["type"] == "success", response
                return response["result"]


class WebKit:
    """WebDriver over HTTP, which WebKitWebDriver supports."""

    def __init__(self, client: httpx.Client, browser: Path) -> None:
        options = {"binary": str(browser), "args": ["--automation"]}
        self._client = client
        self._session = ""
        made = self._call("", capabilities={"alwaysMatch": {"webkitgtk:browserOptions": options}})
        self._session = f"/{made['sessionId']}"
        self._call("/window/rect", width=1280, height=980)

    def go(self, url: str) -> None:
        self._call("/url", url=url)

    def evaluate(self, expression: str) -> Any:
        return json.loads(self._call("/execute/sync", script=f"return JSON.stringify({expression})", args=[]) or "null")

    def act(self, device: dict[str, Any]) -> None:
        self._call("/actions", actions=[device])

    def _call(self, path: str, **body: Any) -> Any:
        response = self._client.post(f"/session{self._session}{path}", json=body)
        assert response.is_success, response.text
        return response.json()["value"]

    def close(self) -> None:
        self._client.delete(f"/session{self._session}")


class Window:
    """A window with the methods of the browser tests; elements are named by their data-testid."""

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._complaints: list[str] = []
        self.evaluate = driver.evaluate

    def go(self, url: str) -> None:
        """Open an address, and collect the errors of its page once it is loaded."""
        self._complaints = self.complaints()
        self._driver.go(url)
        self.evaluate(
            "(self.complaints = [], addEventListener('error', event => complaints.push(event.message)),"
            " addEventListener('unhandledrejection', event => complaints.push(String(event.reason))), 0)"
        )

    def complaints(self) -> list[str]:
        """The errors of all pages so far, and the parts of the present one that failed."""
        failed = "[...document.querySelectorAll('[data-testid=panel-failed]')].map(one => one.textContent)"
        return [*self._complaints, *self.evaluate(f"[...(self.complaints ?? []), ...{failed}]")]

    def find(self, testid: str, condition: str = "true") -> dict[str, float]:
        """Wait until the element can be clicked and meets a condition (JavaScript of `one`); its centre."""
        expression = f"""(() => {{
            const one = document.querySelector('[data-testid="{testid}"]');
            if (!one || one.disabled || !({condition})) return null;
            one.scrollIntoView({{block: "center"}});
            const box = one.getBoundingClientRect();
            const at = {{x: Math.round(box.left + box.width / 2), y: Math.round(box.top + box.height / 2)}};
            const hit = document.elementFromPoint(at.x, at.y);
            return hit && (one === hit || one.contains(hit) || hit.closest("label")?.contains(one)) ? at : null;
        }})()"""
        return cast("dict[str, float]", self.wait(expression, f"{testid} with {condition}"))

    def wait(self, expression: str, what: str = "") -> Any:
        """Wait until a JavaScript expression is true; its value."""
        end = time.monotonic() + TIMEOUT_S
        while not (value := self.evaluate(expression)):
            assert time.monotonic() < end, f"{what or expression} did not occur in {self.evaluate('location.href')}"
            time.sleep(0.05)
        return value

    def text(self, testid: str, words: str) -> None:
        """Wait until the element contains these words."""
        expression = f"document.querySelector('[data-testid=\"{testid}\"]')?.textContent.includes({json.dumps(words)})"
        self.wait(expression, f"{words!r} in {testid}")

    def click(self, testid: str) -> None:
        """Click the middle of the element."""
        before, at = None, self.find(testid)
        while at != before:  # it has stopped moving
            time.sleep(0.1)
            before, at = at, self.find(testid)
        moved = {"type": "pointerMove", **at, "duration": 0, "origin": "viewport"}
        pressed = [{"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        self._driver.act(
            {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [moved, *pressed]}
        )

    def fill(self, testid: str, words: str) -> None:
        """Replace the text of a field, and press Enter."""
        self.click(testid)
        every = [{"type": "keyDown", "value": CONTROL}, *_typed("a"), {"type": "keyUp", "value": CONTROL}]
        self._driver.act({"type": "key", "id": "keys", "actions": [*every, *_typed(words), *_typed(ENTER)]})

    def press(self, key: str) -> None:
        """Press one key."""
        self._driver.act({"type": "key", "id": "keys", "actions": _typed(key)})


def _typed(words: str) -> list[dict[str, str]]:
    return [{"type": kind, "value": letter} for letter in words for kind in ("keyDown", "keyUp")]


def missing(name: str) -> str | None:
    """Why this browser cannot be driven here; None when it can."""
    if name == "firefox":
        return None if _firefox() else "no Firefox: install firefox-esr"
    wanted = {"WebKitWebDriver": "webkit2gtk-driver", "Xvfb": "xvfb"}
    lacking = [package for program, package in wanted.items() if shutil.which(program) is None]
    return f"no WebKit: install {' '.join(lacking)}" if lacking else None


@contextmanager
def opened(name: str) -> Generator[Window]:
    """A window of "firefox" or "webkit"; the browser ends with the block."""
    with (
        TemporaryDirectory(prefix=f"hornbill-{name}-") as folder,
        (_firefoxes if name == "firefox" else _webkits)(Path(folder)) as driver,
    ):
        yield Window(driver)


def _firefox() -> str | None:
    return shutil.which("firefox-esr") or shutil.which("firefox")


@contextmanager
def _firefoxes(folder: Path) -> Generator[Driver]:
    command = [str(_firefox()), "--headless", "--no-remote", "--profile", str(folder), "--remote-debugging-port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            said = next(line for line in process.stdout if "WebDriver BiDi listening on" in line)
            with connect(f"{said.split()[-1]}/session", max_size=None) as line:
                yield Firefox(line)
        finally:
            process.kill()


@contextmanager
def _webkits(_folder: Path) -> Generator[Driver]:
    with _screen() as display:
        environment = {**os.environ, "DISPLAY": display, "GDK_BACKEND": "x11"}
        with subprocess.Popen(["WebKitWebDriver", f"--port={(port := _free_port())}"], env=environment) as process:
            try:
                with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=TIMEOUT_S) as client:
                    _until_ready(client)
                    driver = WebKit(client, next(Path("/usr/lib").glob(WEBKIT_BROWSERS)))
                    yield driver
                    driver.close()
            finally:
                process.terminate()


@contextmanager
def _screen() -> Generator[str]:
    """An X server that draws into memory; its display."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24", "-nolisten", "tcp"]
    with subprocess.Popen(command, pass_fds=(write,), stderr=subprocess.DEVNULL) as process:
        os.close(write)
        try:
            with os.fdopen(read) as numbers:
                yield f":{numbers.readline().strip()}"
        finally:
            process.terminate()


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def _until_ready(client: httpx.Client) -> None:
    end = time.monotonic() + TIMEOUT_S
    while True:
        with suppress(httpx.TransportError):
            if client.get("/status").json()["value"]["ready"]:
                return
        assert time.monotonic() < end, "WebKitWebDriver does not respond"
        time.sleep(0.1)
