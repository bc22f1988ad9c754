"""A client of viser that replaces a browser, and keeps the messages it received."""

import struct
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

import msgspec
import websockets.sync.client
import zstandard
from websockets.typing import Origin, Subprotocol

from hornbill.view.page import client

CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [3, -3, 3], "fov": 0.7, "near": 0.1, "far": 100.0,
    "image_height": 600, "image_width": 960, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
}  # fmt: skip


def click(origin: tuple[float, float, float], direction: tuple[float, float, float]) -> dict[str, Any]:
    """A click along a ray of the scene."""
    return {
        "type": "ScenePointerMessage", "event_type": "click", "ray_origin": origin, "ray_direction": direction,
        "screen_pos": [[0.5, 0.5]], "modifier": None,
    }  # fmt: skip


class Onlooker:
    """A connection that speaks viser's protocol: `url` is viser's own or our proxy's."""

    def __init__(self, url: str, *, origin: str | None = None, headers: dict[str, str] | None = None) -> None:
        self.connection = websockets.sync.client.connect(
            url,
            subprotocols=[Subprotocol(client().subprotocol)],
            origin=None if origin is None else Origin(origin),
            additional_headers=headers,
            compression=None,
            max_size=None,
            proxy=None,
        )
        self.messages: list[dict[str, Any]] = []

    def __enter__(self) -> "Onlooker":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.connection.close()

    def send(self, message: dict[str, Any]) -> None:
        self.connection.send(msgspec.msgpack.encode(message))

    def read_for(self, seconds: float) -> list[dict[str, Any]]:
        """The messages received within this time, also added to `messages`."""
        return self._read(lambda _: False, seconds)

    def read_until(self, wanted: Callable[[dict[str, Any]], bool], timeout: float = 10.0) -> list[dict[str, Any]]:
        """The messages up to the frame with the wanted one. Fails if it does not arrive."""
        got = self._read(wanted, timeout)
        assert any(wanted(message) for message in got), f"not among {[message['type'] for message in got]}"
        return got

    def _read(self, wanted: Callable[[dict[str, Any]], bool], seconds: float) -> list[dict[str, Any]]:
        got: list[dict[str, Any]] = []
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and not any(wanted(message) for message in got):
            try:
                frame = self.connection.recv(left)
            except TimeoutError:
                break
            assert isinstance(frame, bytes)
            size, packed = struct.unpack_from("<QQ", frame)
            text = zstandard.ZstdDecompressor().decompress(frame[16 : 16 + packed], max_output_size=size)
            got += msgspec.msgpack.decode(text)["messages"]
        self.messages += got
        return got


def eventually(done: Callable[[], bool]) -> None:
    """Wait for a condition."""
    end = time.monotonic() + 30
    while not done():
        assert time.monotonic() < end
        time.sleep(0.005)


def names(messages: list[dict[str, Any]]) -> set[str]:
    """The scene nodes in these messages."""
    return {message["name"] for message in messages if "name" in message}
