"""The servers of the benchmark of requests.

`python -m bench.rest_server`: hornbill with servos whose responses are prepared. `python -m bench.rest_server BYTES`:
bare FastAPI routes that return as much. The bare write carries the same frames on the same simulated bus.
"""

import asyncio
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Annotated

import uvicorn
from fastapi import FastAPI, Header, Response

from bench.configuring import SERVICE, WritableCrowd
from bench.crowd import CrowdPort
from hornbill.api.http import create_api
from hornbill.api.routes.configuration.rows import RowValue
from hornbill.api.security.origin import LOCAL_NAMES, local_policy
from hornbill.app import serving
from hornbill.domain.servo import Reading
from hornbill.schema.catalog import Catalog
from hornbill.servo.host import Host, HostSettings
from hornbill.store.store import Store
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.port import CanPort
from hornbill.wire.services import GetSetRequest
from hornbill.wire.transfer import END, Transfer, split
from hornbill.wire.value import integer

SERVOS = 6
READING = Reading(
    "command_angle", 0, 1.5, 15, "°", 1795710659.123456, 0.0, None, None, None, -180.0, 180.0, True, None, None, False,
)  # fmt: skip


def hornbill() -> FastAPI:
    """As a user starts it, but for its bus and its database in memory."""
    catalog = Catalog.load()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        async def port(_address: str, _bitrate: int) -> CanPort:
            return CrowdPort(WritableCrowd(SERVOS))

        with Store("sqlite://") as store:
            host = app.state.host = Host(catalog, store, port, HostSettings(127, bytes(range(16)), (0, 1)))
            await host.connect("canned:", 1_000_000)
            yield
            await host.close()

    return create_api(catalog, lifespan=lifespan, policy=local_policy(LOCAL_NAMES))


class Exchange:
    """The frames of one write and of its response, without anything else that a host does."""

    def __init__(self) -> None:
        self._port = CrowdPort(WritableCrowd(SERVOS))
        self._port.listen(self._received)
        request = GetSetRequest(0, integer(150), Catalog.load().parameter("command_angle").name)
        sent = Transfer(Kind.REQUEST, request.TYPE.id, 127, 1, 16, 0, request.encode())
        self._frames = split(sent, request.TYPE)
        self._ended: asyncio.Future[None] | None = None

    async def carry(self) -> None:
        """Send the request; return after the last frame of the response."""
        self._ended = asyncio.get_running_loop().create_future()
        self._port.send(self._frames)
        await self._ended

    def _received(self, frames: list[Frame]) -> None:
        for frame in frames:
            last_of_service = frame.id & SERVICE and frame.data[-1] & END
            if last_of_service and self._ended is not None and not self._ended.done():
                self._ended.set_result(None)


def bare(size: int) -> FastAPI:
    """FastAPI as its documentation shows it. `size`: of the list of servos, bytes."""
    content = b"x" * size

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        app.state.exchange = Exchange()
        yield

    app = FastAPI(lifespan=lifespan)

    @app.put("/api/v1/servos/{uid}/parameters/{key}")
    async def set_parameter(
        uid: str, key: str, body: RowValue, lease: Annotated[str | None, Header()] = None
    ) -> Reading:
        await app.state.exchange.carry()
        return READING

    @app.put("/without-exchange/{uid}/parameters/{key}")
    async def set_nothing(uid: str, key: str, body: RowValue, lease: Annotated[str | None, Header()] = None) -> Reading:
        return READING

    @app.get("/api/v1/servos")
    async def list_servos() -> Response:
        return Response(content, media_type="application/json")

    return app


if __name__ == "__main__":
    listening = serving.listen("127.0.0.1", 0)
    if len(sys.argv) == 1:
        asyncio.run(serving.serve(hornbill(), listening, "serving {url}"))
    else:
        config = uvicorn.Config(bare(int(sys.argv[1])), log_level="warning", access_log=False)
        print(f"serving {serving.url_of(listening, 'http')}", flush=True)
        uvicorn.Server(config).run([listening])
