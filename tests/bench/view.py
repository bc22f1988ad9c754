"""The 3D view of twelve moving servos: frames drawn in software, and the share of a core that the server takes."""

import statistics
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
from playwright.sync_api import Frame, sync_playwright

from bench.line import line
from bench.processes import cpu_s, wait_until_ready
from e2e.chromium import find
from e2e.servers import running_demo
from unit.view.onlooker import CAMERA, Onlooker

SERVOS = 12
ROUNDS = 3
SHOWN_S, EMPTY_S = 5.0, 2.0
FRAME = f"viser/{'0' * 32}/"
SLOWEST_FRAME_MS = 1000 / 30
DRAWN = "window.__viserTestpoints.rendererInfo.render.frame"
SHOWN = "() => Object.keys(window.__viserSceneTree?.getState() ?? {}).some(name => name.startsWith('/crowd/horn-far'))"
HIDE = "() => window.__viserMutable.scene.traverse(one => one.layers.set(1))"
"""Leaves an empty scene: what viser, the canvas and the page around it cost."""


def figures() -> Iterator[dict[str, Any]]:
    """CPU time with a client of viser minus that without, in turn. The servos are simulated in the same process.

    Then the frames that viser renders in low quality, without a graphics card: of the wall, and of an empty scene.
    """
    with running_demo("--servos", str(SERVOS), "--seed", "1") as (process, url):
        wait_until_ready(url, SERVOS)
        over = threading.Event()
        moving = threading.Thread(target=_move, args=(url, over))
        moving.start()
        shares: list[float] = []
        messages = 0
        for _ in range(ROUNDS):
            alone = _share(process.pid, lambda: time.sleep(SHOWN_S))
            httpx.get(url + FRAME, timeout=30).raise_for_status()
            with Onlooker(url.replace("http", "ws", 1) + FRAME, origin=url.rstrip("/")) as onlooker:
                onlooker.send(CAMERA)
                onlooker.read_for(3.0)  # the scene itself is sent once
                onlooker.messages.clear()
                shares.append(_share(process.pid, lambda: onlooker.read_for(SHOWN_S)) - alone)
                messages = len(onlooker.messages)
        frames = _frames(url)
        over.set()
        moving.join()
    assert messages > 0, "nothing was shown"
    found = {"servos": SERVOS, "core_pct": round(100 * statistics.median(shares), 1), "messages": messages}
    yield line("3D view of twelve moving servos: server", found, of="core_pct", must=5, limit="a twentieth of a core")

    name = "3D view of twelve moving servos: a frame drawn in software"
    yield line(name, frames, of="ms", must=SLOWEST_FRAME_MS, limit="two frames of a screen at 60 Hz")


def _frames(url: str) -> dict[str, Any]:
    path = find()
    assert path is not None, "no Chromium: 'make chromium' finds or installs one"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(url + "servos?view=wall")
        page.locator("[data-testid=wall][data-state=shown]").wait_for(timeout=60_000)
        (frame,) = (one for one in page.frames if "/viser/" in one.url)
        frame.wait_for_function(SHOWN, timeout=60_000)
        page.wait_for_timeout(4000)
        wall = _frame_ms(frame, SHOWN_S)
        triangles = frame.evaluate("window.__viserTestpoints.rendererInfo.render.triangles")
        frame.evaluate(HIDE)
        empty = _frame_ms(frame, EMPTY_S)
        browser.close()
    return {"ms": wall, "empty_ms": empty, "frames_per_s": round(1000 / wall, 1), "triangles": triangles}


def _frame_ms(frame: Frame, seconds: float) -> float:
    """Mean time from one rendered frame to the next: frames that the browser does not draw do not count."""
    drawn, began = frame.evaluate(DRAWN), time.monotonic()
    frame.page.wait_for_timeout(seconds * 1000)
    return round(1000 * (time.monotonic() - began) / max(1, frame.evaluate(DRAWN) - drawn), 1)


def _share(pid: int, act: Callable[[], object]) -> float:
    began, cpu = time.monotonic(), cpu_s(pid)
    act()
    return (cpu_s(pid) - cpu) / (time.monotonic() - began)


def _move(url: str, over: threading.Event) -> None:
    """Back and forth, slowly enough that no servo is at rest. A servo with a fault refuses; the others move."""
    with httpx.Client(base_url=url + "api/v1", timeout=60) as api:
        lease = {"Lease": api.post("/leases", json={"holder": "bench", "ttl_s": 60}).json()["id"]}
        uids = [one["uid"] for one in api.get("/servos").json()]
        for uid in uids:
            api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=lease)
        turn = 1
        while not over.is_set():
            gently = {"speed_deg_s": 20, "accel_deg_s2": 100}
            for uid in uids:
                body = {"type": "angle", "value": 40 * turn, "profile": gently}
                api.post(f"/servos/{uid}/command", json=body, headers=lease)
            api.put(f"/leases/{lease['Lease']}")
            turn = -turn
            over.wait(4)
