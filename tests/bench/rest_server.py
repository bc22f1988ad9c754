"""The servers of the benchmark of requests.

`python -m bench.rest_server`: hornbill with servos whose responses are prepared. `python -m bench.rest_server BYTES`:
bare FastAPI routes that do nothing and return as much.
"""

import asyncio
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Annotated

import uvicorn
from fastapi import FastAPI, Header, Response

from bench.configuring import WritableCrowd
from bench.crowd import CrowdPort
from hornbill.api.http import create_api
from hornbill.api.routes.configuration.rows import RowValue
from hornbill.api.security.origin import LOCAL_NAMES, local_policy
from hornbill.app import serving
from hornbill.domain.servo import Reading
from hornbill.schema.catalog import Catalog
from hornbill.servo.host import Host, HostSettings
from hornbill.store.store import Store
from hornbill.wire.port import CanPort

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


def bare(size: int) -> FastAPI:
    """FastAPI as its documentation shows it. `size`: of the list of servos, bytes."""
    app, content = FastAPI(), b"x" * size

    @app.put("/api/v1/servos/{uid}/parameters/{key}")
    async def set_parameter(
        uid: str, key: str, body: RowValue, lease: Annotated[str | None, Header()] = None
    ) -> Reading:
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
