"""The routes in front of viser, served by a real server on a port of its own."""

import json
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass

import httpx
import msgspec
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from hornbill.view import proxy
from hornbill.view.layout import place
from hornbill.view.page import UnknownClient, client
from hornbill.view.viewer import Viewer
from unit.view.onlooker import CAMERA, Onlooker, click, names
from unit.view.servos import Servos, pose
from unit.view.site import serving

KEY = "c" * 32
PAGE = f"/viser/{KEY}/"


@dataclass(frozen=True)
class Site:
    port: int
    viewer: Viewer
    selected: list[str]

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def socket(self) -> str:
        return f"ws://127.0.0.1:{self.port}/viser/{KEY}"

    def onlooker(self, path: str = "") -> Onlooker:
        return Onlooker(self.socket + path, origin=self.origin)


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    selected: list[str] = []
    viewer = Viewer(Servos(pose(0), pose(1), pose(2)))
    viewer.on_pick(KEY, selected.append)
    with serving(*proxy.routes(viewer, allowed=proxy.same_origin(["127.0.0.1", "localhost"]))) as port:
        yield Site(port, viewer, selected)
        viewer.close()


@pytest.fixture
def http(site: Site) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=site.origin, trust_env=False) as made:
        yield made


def test_the_page_comes_with_its_policy_and_is_checked_each_time(http: httpx.Client) -> None:
    answer = http.get(PAGE)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert answer.headers["content-security-policy"] == client().policy
    assert answer.headers["cache-control"] == "no-cache"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert answer.content == client().page(dark=False)
    again = http.get(PAGE, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_opening_the_page_starts_the_view_and_sets_theme_and_quality(http: httpx.Client, site: Site) -> None:
    dark, light = http.get(f"{PAGE}?darkMode&quality=low"), http.get(f"{PAGE}?quality=high")
    assert dark.content == client().page(dark=True)
    assert light.headers["etag"] != dark.headers["etag"]
    assert site.viewer.ready.result(20) == site.viewer.port
    with site.onlooker() as onlooker:
        onlooker.send(CAMERA)
        onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
        http.get(f"{PAGE}?darkMode&quality=low")
        onlooker.read_until(lambda message: message.get("name") == "/hero/bla21-low")
        http.get(f"{PAGE}?quality=highest")
        later = [message for message in onlooker.read_for(0.3) if message["type"] != "RemoveSceneNodeMessage"]
        assert not any("high" in name for name in names(later))


@pytest.mark.parametrize(
    ("path", "target"),
    [
        (PAGE.rstrip("/"), PAGE),
        (f"{PAGE.rstrip('/')}?darkMode", f"{PAGE}?darkMode="),
        (f"{PAGE}?websocket=ws://evil.example/", PAGE),
        (f"{PAGE}?darkMode=&fixedDpr=1&websocket=ws://a/viser", f"{PAGE}?darkMode=&fixedDpr=1"),
        (f"{PAGE}?playbackPath=https://evil.example/x&quality=low", f"{PAGE}?quality=low"),
        (f"{PAGE}?websocket=a&websocket=b", PAGE),
    ],
)
def test_parameters_that_lead_elsewhere_are_stripped_by_a_redirect(http: httpx.Client, path: str, target: str) -> None:
    answer = http.get(path)
    assert (answer.status_code, answer.headers["location"]) == (307, target)
    assert http.get(target).status_code == 200


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", "["])
def test_a_foreign_host_name_gets_no_page(http: httpx.Client, host: str) -> None:
    answer = http.get(PAGE, headers={"Host": host})
    assert answer.status_code == 403
    assert b"script" not in answer.content


def test_a_foreign_page_cannot_fetch_it(http: httpx.Client) -> None:
    assert http.get(PAGE, headers={"Origin": "https://evil.example"}).status_code == 403


@pytest.mark.parametrize("path", ["", "/"])
def test_the_socket_forwards_subprotocol_and_scene(site: Site, path: str) -> None:
    with site.onlooker(path) as onlooker:
        assert onlooker.connection.subprotocol == client().subprotocol
        onlooker.send(CAMERA)
        onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
        assert {"/hero/pivot", "/stage/floor"} <= names(onlooker.messages)


def refused(site: Site, *, origin: str | None, host: str | None = None, subprotocol: str | None = "ours") -> int:
    """The status of a handshake that must fail."""
    offered = {"ours": client().subprotocol, "theirs": "viser-v0.0.1"}.get(subprotocol or "")
    with pytest.raises(InvalidStatus) as failure, socket.create_connection(("127.0.0.1", site.port)) as plain:
        connect(
            f"ws://{host or f'127.0.0.1:{site.port}'}/viser/{KEY}",
            sock=plain,
            origin=None if origin is None else Origin(origin),
            subprotocols=[Subprotocol(offered)] if offered else None,
        )
    return failure.value.response.status_code


def test_a_foreign_page_gets_no_socket(site: Site) -> None:
    assert refused(site, origin="https://evil.example") == 403
    assert refused(site, origin=f"http://127.0.0.1:{site.port + 1}") == 403
    assert refused(site, origin="null") == 403


def test_who_names_no_origin_gets_no_socket(site: Site) -> None:
    assert refused(site, origin=None) == 403


def test_a_foreign_host_name_gets_no_socket(site: Site) -> None:
    """A name of somebody else's that resolves to us: Origin and Host agree, and still it is not ours."""
    assert refused(site, origin="http://evil.example", host="evil.example") == 403


def test_another_viser_or_none_gets_no_socket(site: Site) -> None:
    assert refused(site, origin=site.origin, subprotocol="theirs") == 403
    assert refused(site, origin=site.origin, subprotocol=None) == 403


def test_clicks_pass(site: Site) -> None:
    x, y, _ = place([pose(0), pose(1), pose(2)], pose(0).uid)[1][0].at
    with site.onlooker() as onlooker:
        onlooker.send(CAMERA)
        onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
        onlooker.send(click((x, y, 9.0), (0.0, 0.0, -1.0)))
        end = time.monotonic() + 10
        while not site.selected:
            assert time.monotonic() < end
            time.sleep(0.01)
    assert site.selected == [pose(1).uid]


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "GuiUpdateMessage", "FileTransferStartUpload", "NoSuchMessage"])
def test_other_messages_do_not_reach_viser(site: Site, kind: str) -> None:
    """viser ends a connection that sends it a message it does not know; this one stays."""
    with site.onlooker() as onlooker:
        onlooker.send(CAMERA)
        onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
        onlooker.send({"type": kind, "uuid": 7})
        assert not {"ShareUrlUpdated"} & {message["type"] for message in onlooker.read_for(0.2)}
        onlooker.connection.ping().wait(2)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("text", 1003),
        (b"\xc1 not msgpack", 1007),
        (msgspec.msgpack.encode([1, 2]), 1007),
        (msgspec.msgpack.encode({"type": "ScenePointerMessage", "padding": "x" * 9000}), 1009),
    ],
)
def test_what_no_browser_sends_ends_the_connection(site: Site, message: str | bytes, code: int) -> None:
    with site.onlooker() as onlooker:
        onlooker.connection.send(message)
        with pytest.raises(ConnectionClosed) as closed:
            onlooker.read_for(5)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == code


def test_a_browser_that_leaves_is_forgotten(site: Site) -> None:
    with site.onlooker() as onlooker:
        onlooker.send(CAMERA)
        end = time.monotonic() + 10
        while not site.viewer.watched:
            assert time.monotonic() < end
            time.sleep(0.01)
    while site.viewer.watched:
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_viser_nobody_knows_is_not_served(http: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> None:
        raise UnknownClient("viser 9 packs its page in a way hornbill does not know: use viser 1.1.1")

    monkeypatch.setattr(proxy, "client", unknown)
    answer = http.get(PAGE)
    assert answer.status_code == 503
    assert "use viser 1.1.1" in answer.text


def test_the_end_of_the_view_ends_its_sockets() -> None:
    """On a site of its own, because the view does not outlive the test."""
    viewer = Viewer(Servos(pose()))
    with serving(*proxy.routes(viewer, allowed=lambda _: True)) as port:
        address = f"ws://127.0.0.1:{port}/viser/{KEY}"
        with Onlooker(address) as onlooker:
            onlooker.send(CAMERA)
            onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
            viewer.close()
            with pytest.raises(ConnectionClosed):
                onlooker.read_for(5)
        with pytest.raises((InvalidStatus, ConnectionClosed)):
            Onlooker(address)


def wish_socket(site: Site, *, key: str = KEY, origin: str | None = "ours") -> ClientConnection:
    address = f"ws://127.0.0.1:{site.port}/viser/{key}/settings"
    return connect(address, origin=Origin(site.origin if origin == "ours" else origin) if origin else None, proxy=None)


def test_a_wish_over_the_socket_changes_its_own_frame_alone(site: Site) -> None:
    other = "d" * 32
    with (
        Onlooker(f"ws://127.0.0.1:{site.port}/viser/{other}", origin=site.origin) as mine,
        site.onlooker() as theirs,
        wish_socket(site, key=other) as told,
    ):
        for onlooker in (mine, theirs):
            onlooker.send(CAMERA)
            onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
            onlooker.read_for(0.3)
        told.send(json.dumps({"quality": "low", "select": pose(2).uid}))
        mine.read_until(lambda message: message.get("name") == "/hero/bla21-low")
        assert names(theirs.read_for(0.3)) == set()
    assert site.viewer.settings(other).selected == pose(2).uid


def test_the_socket_tells_what_was_clicked(site: Site) -> None:
    key = "e" * 32
    x, y, _ = place([pose(0), pose(1), pose(2)], pose(0).uid)[1][1].at
    with (
        wish_socket(site, key=key) as told,
        Onlooker(f"ws://127.0.0.1:{site.port}/viser/{key}", origin=site.origin) as onlooker,
    ):
        told.send("{}")
        onlooker.send(CAMERA)
        onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")
        onlooker.send(click((x, y, 9.0), (0.0, 0.0, -1.0)))
        heard = [json.loads(told.recv(10))]
        while "picked" not in heard[-1]:
            heard.append(json.loads(told.recv(10)))
    assert heard[-1] == {"picked": pose(2).uid}
    projection = heard[0]["projection"]
    assert [one["uid"] for one in projection["servos"]] == [pose(number).uid for number in (0, 1, 2)], (
        "the selected one first"
    )
    assert np.isclose(np.linalg.norm(projection["ahead"]), 1.0, atol=1e-3)
    assert np.isclose(np.dot(projection["ahead"], projection["right"]), 0.0, atol=1e-3)


def test_alone_the_picture_has_the_selected_servo_and_no_other(site: Site) -> None:
    key = "f" * 32
    with (
        wish_socket(site, key=key) as told,
        Onlooker(f"ws://127.0.0.1:{site.port}/viser/{key}", origin=site.origin) as onlooker,
    ):
        told.send(json.dumps({"select": pose(1).uid, "alone": True}))
        onlooker.send(CAMERA)
        servos: list[str] = []
        while servos != [pose(1).uid]:
            servos = [one["uid"] for one in json.loads(told.recv(10))["projection"]["servos"]]


@pytest.mark.parametrize(("said", "code"), [("{", 1007), ('{"torque": 1}', 1007), (b"{}", 1003), (" " * 70_000, 1009)])
def test_what_is_no_wish_ends_the_socket(site: Site, said: str | bytes, code: int) -> None:
    with wish_socket(site) as told:
        told.send(said)
        with pytest.raises(ConnectionClosed) as closed:
            told.recv(10)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == code


def test_a_foreign_page_can_wish_nothing(site: Site) -> None:
    for origin in ("https://evil.example", None):
        with pytest.raises(InvalidStatus) as failure:
            wish_socket(site, origin=origin)
        assert failure.value.response.status_code == 403
    with pytest.raises(InvalidStatus):
        wish_socket(site, key="short")


def test_a_page_without_a_key_gets_one_of_its_own(http: httpx.Client) -> None:
    targets = [http.get("/viser/?quality=low").headers["location"] for _ in range(2)]
    assert targets[0] != targets[1]
    assert all(target.endswith("/?quality=low") for target in targets)
    assert http.get(targets[0]).status_code == 200
    assert http.get("/viser/nothing/").status_code == 404
