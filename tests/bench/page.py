"""The page on a computer four times slower than this one: first paint, first click, and tasks while servos stream."""

import os
import time
from collections.abc import Callable, Iterator
from typing import Any
from unittest.mock import patch

import httpx
from playwright.sync_api import Browser, Page, sync_playwright

from bench.line import line
from bench.plots import FEED, HZ, ROOM, SERVOS, plotted, ready
from e2e.chromium import find
from e2e.servers import running_demo

SLOWER = 4
ROUNDS = 3
STREAMED_S = 6.0
PAINT_MS, CLICK_MS, LONG_MS = 1000, 1500, 50

CLICK = """
const look = () => {
  const box = document.querySelector('[data-testid^="select-"]:not([data-testid="select-all"])');
  if (box === null) return requestAnimationFrame(look);
  box.click();
  const answer = () => {
    if (document.querySelector('[data-testid^="select-"]:checked')) performance.mark("clicked");
    else requestAnimationFrame(answer);
  };
  requestAnimationFrame(answer);
};
requestAnimationFrame(look);
"""
"""Clicks the first check box of the list as soon as there is one; the mark is in the frame that shows it."""

DONE = """() => performance.getEntriesByName('clicked').length > 0
  && performance.getEntriesByName('first-contentful-paint').length > 0"""

Event = dict[str, Any]


def figures() -> Iterator[dict[str, Any]]:
    """Loads with an empty cache, then ten seconds of sixteen servos in one plot.

    Judged is CPU time of the page's main thread times four, which other processes hardly change. `ms_throttled` is the
    best time on the clock with the throttling of the DevTools protocol: it contains the server and what else runs.
    """
    path = find()
    assert path is not None, "no Chromium: 'make chromium' finds or installs one"
    with (
        patch.dict(os.environ, ROOM),
        running_demo("--servos", str(SERVOS), "--seed", "1") as (_, url),
        httpx.Client(base_url=url + "api/v1", timeout=60) as api,
        sync_playwright() as playwright,
    ):
        uids = ready(api)
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-3d-apis"])
        yield from _loading(browser, url)
        yield _streaming(browser, url, uids)
        browser.close()


def _loading(browser: Browser, url: str) -> Iterator[dict[str, Any]]:
    cpu = [_load(browser, url, throttled=False) for _ in range(ROUNDS)]
    throttled = [_load(browser, url, throttled=True) for _ in range(ROUNDS)]
    for at, (name, must) in enumerate((("first paint", PAINT_MS), ("first click on a servo", CLICK_MS))):
        best = min(one[at] for one in cpu)
        figures = {
            "cpu_ms": round(best), "cpu_ms_slower": round(SLOWER * best),
            "ms_throttled": round(min(one[at] for one in throttled)), "load_average": round(os.getloadavg()[0], 1),
        }  # fmt: skip
        limit = "what a person takes for immediate"
        yield line(f"page, CPU {SLOWER} × slower: {name}", figures, of="cpu_ms_slower", must=must, limit=limit)


def _load(browser: Browser, url: str, *, throttled: bool) -> tuple[float, float]:
    """Milliseconds until first paint and first click: on the clock if throttled, else of CPU."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.add_init_script(CLICK)

    def load() -> None:
        page.goto(url)
        page.wait_for_function(DONE, timeout=120_000)

    if throttled:
        session = context.new_cdp_session(page)
        session.send("Emulation.setCPUThrottlingRate", {"rate": SLOWER})
        load()
        times: list[float] = page.evaluate(
            "['first-contentful-paint', 'clicked'].map(name => performance.getEntriesByName(name)[0].startTime)"
        )
        context.close()
        return times[0], times[1]
    events = _trace(page, load)
    context.close()
    began = max(one["ts"] for one in events if one["name"] == "navigationStart")
    ends = [max(one["ts"] for one in events if one["name"] == name) for name in ("firstContentfulPaint", "clicked")]
    tasks = _tasks(events)
    paint, click = (sum(ms for at, ms in tasks if began <= at < end) for end in ends)
    return paint, click


def _streaming(browser: Browser, url: str, uids: list[str]) -> dict[str, Any]:
    page = plotted(browser, url, uids)
    page.locator("[data-loaded=all]").wait_for(timeout=120_000)
    page.evaluate("window.began = performance.now() / 1000 + 1e6")
    page.evaluate(FEED, [uids, HZ])
    page.wait_for_timeout(3000)
    tasks = sorted(ms for _, ms in _tasks(_trace(page, lambda: page.wait_for_timeout(STREAMED_S * 1000))))
    figures = {
        "servos": len(uids), "tasks": len(tasks), "cpu_ms_longest": round(tasks[-1], 1),
        "cpu_ms_p99": round(tasks[int(len(tasks) * 0.99)], 1), "core_pct": round(sum(tasks) / STREAMED_S / 10, 1),
        "cpu_ms_longest_slower": round(SLOWER * tasks[-1]),
    }  # fmt: skip
    name = f"page, CPU {SLOWER} × slower: longest task, sixteen servos plotted at 50 Hz"
    return line(name, figures, of="cpu_ms_longest_slower", must=LONG_MS, limit="a long task by the W3C's definition")


def _trace(page: Page, act: Callable[[], None]) -> list[Event]:
    """Events of the browser while `act` runs."""
    session = page.context.new_cdp_session(page)
    events: list[Event] = []
    over: list[object] = []

    def collect(part: dict[str, list[Event]]) -> None:
        events.extend(part["value"])

    def finish(_: object) -> None:
        over.append(True)

    session.on("Tracing.dataCollected", collect)
    session.on("Tracing.tracingComplete", finish)
    categories = ["toplevel", "devtools.timeline", "loading", "blink.user_timing"]
    session.send("Tracing.start", {"transferMode": "ReportEvents", "traceConfig": {"includedCategories": categories}})
    act()
    session.send("Tracing.end")
    until = time.monotonic() + 60
    while not over:
        assert time.monotonic() < until, "the browser sent no trace"
        page.wait_for_timeout(50)
    return events


def _tasks(events: list[Event]) -> list[tuple[float, float]]:
    """Begin in µs and CPU time in ms of the tasks of the page's main thread: the one that runs most functions."""
    calls = [(one["pid"], one["tid"]) for one in events if one["name"] == "FunctionCall"]
    main = max(set(calls), key=calls.count)
    return [
        (one["ts"], one["tdur"] / 1000)
        for one in events
        if one["name"] == "ThreadControllerImpl::RunTask" and (one["pid"], one["tid"]) == main and "tdur" in one
    ]
