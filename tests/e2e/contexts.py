"""Browser contexts that tests borrow in turn: a new one would compile every script of the page again."""

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit
from weakref import WeakKeyDictionary

from playwright.sync_api import Browser, BrowserContext, CDPSession, Frame, Page, ViewportSize

WIDE: ViewportSize = {"width": 1440, "height": 900}
TIMEOUT_MS = 60_000
"""Time limit of a page on a busy machine; speed is measured elsewhere."""
CALM: dict[str, Any] = {"reduced_motion": "reduce"}
"""Fewer draws and no fading, which take a third of the time of an open page; `fresh_page` and 3D have all of them."""
PARKED = "http://127.0.0.1:1/"
"""Address of a blank page that stays open, so that Chromium keeps the process of its site with compiled scripts."""

PATIENT = r"""(() => {
    const { fetch, WebSocket } = window;
    const patient = text => window.hasty ? text
        : text.replace(/"ttl_s":3(?=[,}])/, '"ttl_s":60').replace('"timeout_s":10', '"timeout_s":60')
            .replace('"for_s":0.5', '"for_s":5');
    window.fetch = (to, options) => fetch(to, typeof options?.body === 'string'
        ? { ...options, body: patient(options.body) } : options);
    const { send } = WebSocket.prototype;
    const heard = socket => () => {
        setInterval(() => { if (!window.hasty && socket.readyState === 1) socket.onmessage?.({ data: '{}' }); }, 400);
    };
    WebSocket.prototype.send = function(data) {
        const first = !this.known && this.url.includes('/api/v1/ws');
        if (first) this.addEventListener('message', heard(this), { once: true });
        this.known = true;
        const text = typeof data === 'string' ? patient(data) : data;
        if (!window.withheld?.(text)) send.call(this, text);
    };
})()"""
"""A slow machine ends no motion: leases and requests of 60 s and holds of 5 s instead of 3 s, 10 s and 0.5 s, and the
link is up although the server is silent for 2 s.

Tests of the real times set `hasty` in the window; a message for which `withheld` is true is not sent.
"""


class _Context:
    """Reset a context between two tests: only the parked page, no cookies, empty storage."""

    def __init__(self, browser: Browser, options: dict[str, Any]) -> None:
        self.context: BrowserContext = browser.new_context(viewport=WIDE, **{**CALM, **options})
        self.context.set_default_timeout(TIMEOUT_MS)
        self.context.add_init_script(PATIENT)
        self._parked = self.context.new_page()
        self._parked.route("**/*", lambda route: route.fulfill(body=""))
        self._parked.goto(PARKED)
        self._devtools: CDPSession = self.context.new_cdp_session(self._parked)
        self._origins: set[str] = set()
        self.context.on("page", lambda page: page.on("framenavigated", self._on_navigation))

    def clean(self) -> None:
        for page in self.context.pages:
            if page is not self._parked:
                page.close()
        self.context.unroute_all()
        self.context.clear_cookies()
        self.context.clear_permissions()
        for origin in self._origins:
            self._devtools.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "all"})
        self._origins.clear()

    def _on_navigation(self, frame: Frame) -> None:
        parts = urlsplit(frame.url)
        if parts.scheme in ("http", "https"):
            self._origins.add(f"{parts.scheme}://{parts.netloc}")


_free: WeakKeyDictionary[Browser, dict[str, list[_Context]]] = WeakKeyDictionary()


@contextmanager
def borrowed(browser: Browser, **options: Any) -> Generator[BrowserContext]:
    """A context with these options of Browser.new_context, cleared.

    Its pages are closed with the block; after an exception, it is closed. Tests that replace a script need their own
    context, because this one's process may keep the script.
    """
    free = _free.setdefault(browser, {}).setdefault(repr(sorted(options.items())), [])
    lent = free.pop() if free else _Context(browser, options)
    try:
        yield lent.context
        lent.clean()
    except BaseException:
        lent.context.close()
        raise
    free.append(lent)


@contextmanager
def page_in(browser: Browser, size: ViewportSize = WIDE, **options: Any) -> Generator[Page]:
    """A page of this size in a borrowed context."""
    with borrowed(browser, **options) as context:
        page = context.new_page()
        if size != WIDE:
            page.set_viewport_size(size)
        yield page
