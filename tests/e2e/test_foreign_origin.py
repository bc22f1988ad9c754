"""A page of another origin, open in the same browser, neither reads nor moves anything of a running demo.

The demo needs no token, so only the origin of a request protects the servos from that page.
"""

import threading
from collections.abc import Generator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, cast

import pytest
from playwright.sync_api import Browser, Page, expect

from e2e.servers import Demo
from e2e.state import uids_of

PAGE = b"<!doctype html><title>another site</title><h1>Kittens</h1>"

ATTACK = """async ({ url, ws, uid, viser }) => {
  const got = {};
  const settle = promise => Promise.race([promise, new Promise(done => setTimeout(() => done("nothing"), 4000))]);
  const tries = async (name, act) => { got[name] = await settle(act().catch(error => "refused: " + error.name)); };
  const api = url + "api/v1";
  const json = { "Content-Type": "application/json" };
  const read = response => response.text().then(text => "read: " + response.type + " " + text.slice(0, 60));
  await tries("read servos", () => fetch(api + "/servos").then(read));
  await tries("read with cookies", () => fetch(api + "/servos", { credentials: "include" }).then(read));
  await tries("stop by JSON", () => fetch(api + "/stop", { method: "POST", headers: json, body: "{}" }).then(read));
  await tries("lease by JSON", () =>
    fetch(api + "/leases", { method: "POST", headers: json, body: '{"holder":"evil","ttl_s":60}' }).then(read));
  await tries("write", () =>
    fetch(`${api}/servos/${uid}/parameters/smoothing`, { method: "PUT", headers: json, body: '{"value":true}' })
      .then(read));
  const blind = { method: "POST", mode: "no-cors", credentials: "include" };
  const opaque = response => "sent: " + response.type + " " + response.status;
  await tries("stop blind", () => fetch(api + "/stop", blind).then(opaque));
  await tries("stop blind, text", () => fetch(api + "/stop", { ...blind, body: '{"mode":"off"}' }).then(opaque));
  await tries("stop blind, form", () =>
    fetch(api + "/stop", { ...blind, body: new URLSearchParams({ mode: "off" }) }).then(opaque));
  await tries("lease blind", () =>
    fetch(api + "/leases", { ...blind, body: '{"holder":"evil","ttl_s":60}' }).then(opaque));
  navigator.sendBeacon(api + "/stop", '{"mode":"off"}');
  navigator.sendBeacon(api + "/leases", new Blob(['{"holder":"evil","ttl_s":60}'], { type: "text/plain" }));
  const socket = (address, protocol, words) => () => new Promise(done => {
    const made = protocol ? new WebSocket(address, protocol) : new WebSocket(address);
    made.onopen = () => { for (const word of words) made.send(word); setTimeout(() => done("opened"), 500); };
    made.onmessage = event => done("read: " + String(event.data).slice(0, 40));
    made.onerror = () => done("refused");
    made.onclose = () => done("refused");
  });
  const stop = '{"type":"stop","mode":"off","by":"evil","reason":"evil"}';
  await tries("socket", socket(ws + "api/v1/ws", null, [stop]));
  await tries("viser socket", socket(ws + "viser", viser, []));
  await tries("viser socket with a key", socket(ws + "viser/" + "0".repeat(32), viser, []));
  const select = '{"select":"' + uid + '"}';
  await tries("settings socket", socket(ws + "viser/" + "0".repeat(32) + "/settings", null, [select]));
  const element = (tag, source) => () => new Promise(done => {
    const made = document.createElement(tag);
    made.onload = () => done("loaded");
    made.onerror = () => done("refused");
    made[tag === "link" ? "href" : "src"] = source;
    if (tag === "link") made.rel = "stylesheet";
    document.body.append(made);
  });
  await tries("image of a read", element("img", `${api}/servos/${uid}/parameters?refresh=true`));
  await tries("script of a read", element("script", api + "/servos"));
  await tries("style of a read", element("link", api + "/servos"));
  await tries("image of the page", element("img", url + "mark.svg"));
  const frame = source => () => new Promise(done => {
    const made = document.createElement("iframe");
    made.src = source;
    made.onload = () => {
      let inside = "closed";
      try { inside = made.contentDocument ? "open: " + made.contentDocument.title : "closed"; } catch { /* closed */ }
      done(inside);
    };
    document.body.append(made);
  });
  await tries("frame of the page", frame(url));
  await tries("frame of a response", frame(api + "/servos"));
  await tries("frame of the view", frame(url + "viser/?select=" + uid));
  const form = (path, kind, fields) => {
    const made = document.createElement("form");
    const into = document.createElement("iframe");
    into.name = "into" + Math.random();
    made.target = into.name;
    made.method = "POST";
    made.enctype = kind;
    made.action = api + path;
    for (const [name, value] of Object.entries(fields)) {
      const field = document.createElement("input");
      field.name = name;
      field.value = value;
      made.append(field);
    }
    document.body.append(into, made);
    made.submit();
  };
  form("/stop", "application/x-www-form-urlencoded", { mode: "off" });
  form("/stop", "text/plain", { '{"mode":"off","reason":"': '"}' });
  form("/leases", "text/plain", { '{"holder":"evil","ttl_s":60,"x":"': '"}' });
  form("/session", "text/plain", { '{"token":"': '"}' });
  await new Promise(done => setTimeout(done, 1500));
  return got;
}"""


class _Elsewhere(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(PAGE)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""


@pytest.fixture
def elsewhere() -> Generator[int]:
    """Port of another site on this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Elsewhere) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_port
        finally:
            server.shutdown()
            thread.join(5)


def state(demo: Demo, uid: str) -> dict[str, Any]:
    """State that must not change."""
    get = demo.api.get
    return {
        "stop": get("/stop").json()["latched"],
        "leases": get("/leases").json(),
        "audit": get("/audit").json(),
        "smoothing": get(f"/servos/{uid}/parameters/smoothing").json()["value"],
        "labels": [one["label"] for one in get("/servos").json()],
        "bus": get("/bus").json()["address"],
    }


def angles(demo: Demo) -> list[float]:
    """Horn angles, degrees."""
    return [float(one["angle_deg"]) for one in demo.api.get("/servos").json()]


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_another_origin_can_neither_read_nor_move(browser: Browser, demo: Demo, elsewhere: int, name: str) -> None:
    from hornbill.view.page import client

    uid = uids_of(demo)[0]
    before, stood = state(demo, uid), angles(demo)
    context = browser.new_context()
    try:
        ours: Page = context.new_page()
        ours.goto(demo.url)  # our own page is open beside it, as it would be
        page = context.new_page()
        page.goto(f"http://{name}:{elsewhere}/")
        settings = {"url": demo.url, "ws": demo.url.replace("http", "ws", 1), "uid": uid, "viser": client().subprotocol}
        got = cast(dict[str, str], page.evaluate(ATTACK, settings))
        links = page.context.new_page()
        links.goto(f"http://{name}:{elsewhere}/")
        links.evaluate("url => { location.href = url }", demo.url + "api/v1/bus/logs")
        expect(links.locator("body")).to_contain_text("forbidden_origin")
    finally:
        context.close()
    assert len(got) == 20
    assert not {what for what, came in got.items() if came.startswith(("read", "opened", "loaded", "open:"))}, got
    assert state(demo, uid) == before
    assert angles(demo) == pytest.approx(stood, abs=2.0)  # what a servo measures is never quite still


def test_a_link_from_another_origin_only_opens_the_page(browser: Browser, demo: Demo, elsewhere: int) -> None:
    context = browser.new_context()
    try:
        page = context.new_page()
        page.goto(f"http://localhost:{elsewhere}/")
        page.evaluate("url => { location.href = url }", demo.url)
        page.wait_for_url(demo.url + "**")
        page.locator("[data-testid^=servo-row-]").first.wait_for()
    finally:
        context.close()
