"""Plots in the browser: sixteen servos at 50 Hz in one plot, and the memory after an hour."""

import os
import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, cast
from unittest.mock import patch

import httpx
from playwright.sync_api import Browser, CDPSession, Page, sync_playwright

from bench.line import line
from e2e.chromium import find
from e2e.servers import running_demo

SERVOS = 16
HZ = 50
MEASURED_S = 5.0
WARM_S = 3.0
SLOWEST_DRAW_MS = 1000 / 30
SCREEN = "two frames of a screen at 60 Hz"
FLAT_MB = 2.0

ROOM = {"HORNBILL_POLL_BUDGET_PCT": "60"}
"""800 reads a second are 44 % of the bus; polling is limited to 40 % by default."""

WATCHED = """
window.drawn = [];
const clear = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.closest(".plot-lane")) window.drawn.push(performance.now());
  return clear.apply(this, box);
};
const Native = WebSocket;
window.WebSocket = class extends Native {
  constructor(...how) { super(...how); window.socket = this; }
};
"""
"""A plot clears its canvas before each draw; the socket is kept, to send an hour of samples in seconds."""

SEND = """
([uids, hz, from, to]) => {
  for (let s = from; s < to; s++) {
    const t = Array.from({ length: hz }, (_, i) => window.began + s + i / hz);
    for (const uid of uids) {
      const v = t.map(at => Math.round(450 * Math.sin(at)) / 10);
      const message = { type: "telemetry", seq: 0, uid, channels: { current_angle: { t, v } }, dropped: 0 };
      window.socket.onmessage({ data: JSON.stringify(message) });
    }
  }
}
"""

FEED = """
([uids, hz]) => {
  let t = window.began + 3600;
  const start = performance.now() / 1000;
  setInterval(() => {
    const until = window.began + 3600 + performance.now() / 1000 - start;
    const times = [];
    for (; t < until; t += 1 / hz) times.push(t);
    if (times.length === 0) return;
    for (const [place, uid] of uids.entries()) {
      const v = times.map(at => Math.round(450 * Math.sin(at + place / 3)) / 10);
      const message = { type: "telemetry", seq: 0, uid, channels: { current_angle: { t: times, v } }, dropped: 0 };
      window.socket.onmessage({ data: JSON.stringify(message) });
    }
  }, 40);
}
"""
"""As the server: one message per servo every 40 ms."""


def figures() -> Iterator[dict[str, Any]]:
    """Draws of one plot over ten seconds while the server runs; then memory after 10 and after 60 minutes."""
    path = find()
    assert path is not None, "no Chromium: 'make chromium' finds or installs one"
    with (
        patch.dict(os.environ, ROOM),
        running_demo("--servos", str(SERVOS), "--seed", "1") as (_, url),
        httpx.Client(base_url=url + "api/v1", timeout=60) as api,
        sync_playwright() as playwright,
    ):
        uids = ready(api)
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = plotted(browser, url, uids)
        _move(api, uids)
        page.wait_for_timeout(WARM_S * 1000)
        yield _live(page, api, uids)
        yield _hour(page, uids)
        yield _full(page, uids)
        browser.close()


def plotted(browser: Browser, url: str, uids: list[str]) -> Page:
    """A page with one plot of these servos."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.add_init_script(WATCHED)
    page.goto(url + "servos")
    for uid in uids:
        page.get_by_test_id(f"select-{uid}").check()
    page.get_by_test_id("plot-selected").click()
    page.get_by_test_id("plot-many").locator("canvas").wait_for()
    return page


def ready(api: httpx.Client) -> list[str]:
    """UIDs of all servos, once they are ready."""
    until = time.monotonic() + 60
    while True:
        found = [one["uid"] for one in api.get("/servos").json() if one["state"] == "ready"]
        if len(found) == SERVOS:
            return found
        assert time.monotonic() < until, f"only {len(found)} of {SERVOS} servos are ready"
        time.sleep(0.2)


def _move(api: httpx.Client, uids: list[str]) -> None:
    """Slowly, so that curves rise while they are measured."""
    lease = {"Lease": api.post("/leases", json={"holder": "Bench", "ttl_s": 30}).json()["id"]}
    for place, uid in enumerate(uids):
        api.post(f"/servos/{uid}/torque", json={"mode": "on"}, headers=lease)
        gently = {"speed_deg_s": 5, "accel_deg_s2": 50}
        body = {"type": "angle", "value": 40 - 5 * place, "profile": gently}
        api.post(f"/servos/{uid}/command", json=body, headers=lease)


def _draws(page: Page) -> dict[str, float]:
    page.evaluate("window.drawn = []")
    page.wait_for_timeout(MEASURED_S * 1000)
    drawn: list[float] = page.evaluate("window.drawn")
    apart = sorted(after - before for before, after in pairwise(drawn))
    return {
        "draws_per_s": round(1000 * (len(drawn) - 1) / (drawn[-1] - drawn[0]), 1),
        "ms_per_draw": round((drawn[-1] - drawn[0]) / (len(drawn) - 1), 1),
        "p95_ms": round(apart[int(len(apart) * 0.95)], 1),
    }


def _live(page: Page, api: httpx.Client, uids: list[str]) -> dict[str, Any]:
    """With the samples of the server, which runs on the same processors."""
    drawn = _draws(page)
    channels = [api.get(f"/servos/{uid}/telemetry").json()["channels"]["current_angle"] for uid in uids]
    figures = {
        "servos": len(uids),
        "granted_hz": min(one["granted_hz"] for one in channels),
        "samples_per_s": round(sum(one["measured_hz"] for one in channels)),
        **drawn,
    }
    return line("sixteen servos in one plot at 50 Hz", figures, of="ms_per_draw", must=SLOWEST_DRAW_MS, limit=SCREEN)


def _full(page: Page, uids: list[str]) -> dict[str, Any]:
    """With every sample at 50 Hz, independent of the server: the script sends them to the page."""
    page.evaluate(FEED, [uids, HZ])
    page.wait_for_timeout(WARM_S * 1000)
    figures = {"servos": len(uids), "samples_per_s": len(uids) * HZ, **_draws(page)}
    return line("sixteen servos at 50 Hz in one plot", figures, of="ms_per_draw", must=SLOWEST_DRAW_MS, limit=SCREEN)


def _hour(page: Page, uids: list[str]) -> dict[str, Any]:
    """An hour of samples through the handler of the socket, as fast as the page accepts them."""
    session = page.context.new_cdp_session(page)
    page.evaluate("window.began = performance.now() / 1000 + 1e6")

    def send(first: int, last: int) -> None:
        for minute in range(first, last):
            page.evaluate(SEND, [uids, HZ, minute * 60, minute * 60 + 60])

    send(0, 10)
    early = _heap_mb(session)
    send(10, 60)
    late = _heap_mb(session)
    figures = {
        "samples": len(uids) * HZ * 3600, "mb_after_10_min": round(early, 2), "mb_after_60_min": round(late, 2),
        "grown_mb": round(late - early, 2),
    }  # fmt: skip
    return line(
        "an hour of sixteen servos at 50 Hz in the page's memory",
        figures,
        of="grown_mb",
        must=FLAT_MB,
        limit="no growth",
    )


def _heap_mb(session: CDPSession) -> float:
    """Objects and typed arrays in the heap."""
    session.send("HeapProfiler.collectGarbage")
    usage = cast(dict[str, Any], session.send("Runtime.getHeapUsage"))
    return float(usage["usedSize"] + usage.get("backingStorageSize", 0)) / 1e6
