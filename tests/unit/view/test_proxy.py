"""The routes in front of viser, served by a real server on a free port."""

import json
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

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
from unit.view.onlooker import CAMERA, Onlooker, click, eventually, names
from unit.view.servos import Servos, pose
from unit.view.site import serving

KEY = "c" * 32
PAGE = f"/viser/{KEY}/"


@dataclass(frozen=True)
class Site:
    port: int
    viewer: Viewer

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def onlooker(self, path: str = "", *, key: str = KEY) -> Onlooker:
        return Onlooker(f"ws://127.0.0.1:{self.port}/viser/{key}{path}", origin=self.origin)

    def settings(self, *, key: str = KEY, origin: str | None = "ours") -> ClientConnection:
        """The socket for the settings of a frame."""
        address = f"ws://127.0.0.1:{self.port}/viser/{key}/settings"
        return connect(
            address, origin=Origin(self.origin if origin == "ours" else origin) if origin else None, proxy=None
        )


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    viewer = Viewer(Servos(pose(0), pose(1), pose(2)))
    with serving(*proxy.routes(viewer, allowed=proxy.same_origin(["127.0.0.1", "localhost"]))) as port:
        yield Site(port, viewer)
        viewer.close()


def look(onlooker: Onlooker) -> None:
    """Wait until the scene was sent."""
    onlooker.send(CAMERA)
    onlooker.read_until(lambda message: message.get("name") == "/hero/pivot")


@pytest.fixture
def http(site: Site) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=site.origin, trust_env=False) as made:
        yield made


def test_the_page_has_its_policy_and_is_revalidated(http: httpx.Client) -> None:
    response = http.get(PAGE)
    assert response.status_code == 200
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    assert response.headers["content-security-policy"] == client().policy
    assert response.headers["cache-control"] == "no-cache"
    assert response.headers["x-content-type-options"] == "nosniff"
    assert response.content == client().page(dark=False)
    again = http.get(PAGE, headers={"If-None-Match": response.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_opening_the_page_starts_the_view_and_sets_theme_and_quality(http: httpx.Client, site: Site) -> None:
    dark, light = http.get(f"{PAGE}?darkMode&quality=low"), http.get(f"{PAGE}?quality=high")
    assert dark.content == client().page(dark=True)
    assert light.headers["etag"] != dark.headers["etag"]
    assert site.viewer.ready.result(20) == site.viewer.port
    with site.onlooker() as onlooker:
        look(onlooker)
        http.get(f"{PAGE}?darkMode&quality=low")
        onlooker.read_until(lambda message: message.get("name") == "/hero/bla21-low")
        http.get(f"{PAGE}?quality=highest")
        later = onlooker.read_for(0.3)
        shown = [one for one in later if one["type"] != "RemoveSceneNodeMessage" and one.get("visible") is not False]
        assert not any("high" in name for name in names(shown))


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
def test_a_redirect_removes_parameters_with_foreign_addresses(http: httpx.Client, path: str, target: str) -> None:
    response = http.get(path)
    assert (response.status_code, response.headers["location"]) == (307, target)
    assert http.get(target).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [{"Host": host} for host in ("evil.example", "evil.example:8000", "127.0.0.1.evil.example", "[")]
    + [{"Origin": "https://evil.example"}],
)
def test_a_foreign_host_name_or_page_is_rejected(http: httpx.Client, headers: dict[str, str]) -> None:
    response = http.get(PAGE, headers=headers)
    assert response.status_code == 403
    assert b"script" not in response.content


@pytest.mark.parametrize("path", ["", "/"])
def test_the_socket_forwards_subprotocol_and_scene(site: Site, path: str) -> None:
    with site.onlooker(path) as onlooker:
        assert onlooker.connection.subprotocol == client().subprotocol
        look(onlooker)
        assert {"/hero/pivot", "/stage/floor"} <= names(onlooker.messages)


@pytest.mark.parametrize(
    ("origin", "host", "subprotocol"),
    [
        ("https://evil.example", None, "viser"),
        ("another port", None, "viser"),
        ("null", None, "viser"),
        (None, None, "viser"),
        ("http://evil.example", "evil.example", "viser"),  # a foreign name that resolves to this machine
        ("own", None, "viser-v0.0.1"),
        ("own", None, None),
    ],
)
def test_foreign_origins_hosts_and_versions_get_no_socket(
    site: Site, origin: str | None, host: str | None, subprotocol: str | None
) -> None:
    origins = {"own": site.origin, "another port": f"http://127.0.0.1:{site.port + 1}"}
    offered = client().subprotocol if subprotocol == "viser" else subprotocol
    with pytest.raises(InvalidStatus) as failure, socket.create_connection(("127.0.0.1", site.port)) as plain:
        connect(
            f"ws://{host or f'127.0.0.1:{site.port}'}/viser/{KEY}",
            sock=plain,
            origin=None if origin is None else Origin(origins.get(origin, origin)),
            subprotocols=[Subprotocol(offered)] if offered else None,
        )
    assert failure.value.response.status_code == 403


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "GuiUpdateMessage", "FileTransferStartUpload", "NoSuchMessage"])
def test_other_messages_are_not_forwarded(site: Site, kind: str) -> None:
    """viser would close the connection after an unknown message."""
    with site.onlooker() as onlooker:
        look(onlooker)
        onlooker.send({"type": kind, "uuid": 7})
        assert not {"ShareUrlUpdated"} & {message["type"] for message in onlooker.read_for(0.2)}
        onlooker.connection.ping().wait(2)


def close_code(receive: Callable[[], object]) -> int | None:
    """The code with which the server closed a connection."""
    with pytest.raises(ConnectionClosed) as closed:
        receive()
    return None if closed.value.rcvd is None else closed.value.rcvd.code


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("text", 1003),
        (b"\xc1 not msgpack", 1007),
        (msgspec.msgpack.encode([1, 2]), 1007),
        (msgspec.msgpack.encode({"type": "ScenePointerMessage", "padding": "x" * 9000}), 1009),
    ],
)
def test_an_invalid_message_closes_the_connection(site: Site, message: str | bytes, code: int) -> None:
    with site.onlooker() as onlooker:
        onlooker.connection.send(message)
        assert close_code(lambda: onlooker.read_for(5)) == code


@pytest.mark.parametrize(
    ("message", "code"), [("{", 1007), ('{"torque": 1}', 1007), (b"{}", 1003), (" " * 70_000, 1009)]
)
def test_invalid_settings_close_the_socket(site: Site, message: str | bytes, code: int) -> None:
    with site.settings() as settings:
        settings.send(message)
        assert close_code(lambda: settings.recv(10)) == code


def test_a_closed_connection_is_not_watched(site: Site) -> None:
    with site.onlooker() as onlooker:
        onlooker.send(CAMERA)
        eventually(lambda: site.viewer.watched)
    eventually(lambda: not site.viewer.watched)


def test_an_unknown_version_of_viser_is_not_served(http: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown() -> None:
        raise UnknownClient("unknown viser 9: use viser 1.1.1")

    monkeypatch.setattr(proxy, "client", unknown)
    response = http.get(PAGE)
    assert response.status_code == 503
    assert "use viser 1.1.1" in response.text


def test_closing_the_view_closes_its_sockets() -> None:
    """On a separate site, because the view is closed."""
    viewer = Viewer(Servos(pose()))
    with serving(*proxy.routes(viewer, allowed=lambda _: True)) as port:
        address = f"ws://127.0.0.1:{port}/viser/{KEY}"
        with Onlooker(address) as onlooker:
            look(onlooker)
            viewer.close()
            with pytest.raises(ConnectionClosed):
                onlooker.read_for(5)
        with pytest.raises((InvalidStatus, ConnectionClosed)):
            Onlooker(address)


def test_settings_over_the_socket_change_their_frame_only(site: Site) -> None:
    key = "d" * 32
    with site.onlooker(key=key) as changed, site.onlooker() as other_frame, site.settings(key=key) as settings:
        for onlooker in (changed, other_frame):
            look(onlooker)
            onlooker.read_for(0.3)
        settings.send(json.dumps({"quality": "low", "select": pose(2).uid}))
        changed.read_until(lambda message: message.get("name") == "/hero/bla21-low")
        assert names(other_frame.read_for(0.3)) == set()
    assert site.viewer.settings(key).selected == pose(2).uid


def test_the_socket_reports_projections_and_clicks(site: Site) -> None:
    key = "e" * 32
    x, y, _ = place([pose(0), pose(1), pose(2)], pose(0).uid)[1][1].at
    reports: dict[str, Any] = {}
    with site.settings(key=key) as settings, site.onlooker(key=key) as onlooker:
        settings.send("{}")
        look(onlooker)
        while "projection" not in reports:
            reports |= json.loads(settings.recv(10))
        onlooker.send(click((x, y, 9.0), (0.0, 0.0, -1.0)))
        projection = reports["projection"]
        while "picked" not in reports:
            reports |= json.loads(settings.recv(10))
    assert reports["picked"] == pose(2).uid
    assert [one["uid"] for one in projection["servos"]] == [pose(number).uid for number in (0, 1, 2)], (
        "the selected one first"
    )
    assert np.isclose(np.linalg.norm(projection["ahead"]), 1.0, atol=1e-3)
    assert np.isclose(np.dot(projection["ahead"], projection["right"]), 0.0, atol=1e-3)


def test_alone_shows_only_the_selected_servo(site: Site) -> None:
    key = "f" * 32
    with site.settings(key=key) as settings, site.onlooker(key=key) as onlooker:
        settings.send(json.dumps({"select": pose(1).uid, "alone": True}))
        onlooker.send(CAMERA)
        servos: list[str] = []
        while servos != [pose(1).uid]:
            servos = [one["uid"] for one in json.loads(settings.recv(10))["projection"]["servos"]]


def test_a_foreign_page_cannot_change_settings(site: Site) -> None:
    for key, origin in ((KEY, "https://evil.example"), (KEY, None), ("short", "ours")):
        with pytest.raises(InvalidStatus) as failure:
            site.settings(key=key, origin=origin)
        assert key != KEY or failure.value.response.status_code == 403


def test_a_page_without_a_key_is_redirected_to_a_new_one(http: httpx.Client) -> None:
    targets = [http.get("/viser/?quality=low").headers["location"] for _ in range(2)]
    assert targets[0] != targets[1]
    assert all(target.endswith("/?quality=low") for target in targets)
    assert http.get(targets[0]).status_code == 200
    assert http.get("/viser/nothing/").status_code == 404
