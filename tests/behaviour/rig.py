"""Host and simulated servos on one embedded bus, on a jumping clock: the base of every behaviour test."""

import asyncio
import sqlite3
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeVar

import httpx
import orjson
from fastapi import FastAPI
from sqlalchemy import create_engine, event
from sqlalchemy.pool import Pool, StaticPool

import jumping_clock as clock
import real_clock
from hornbill.api.http import create_api
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.embedded.memory_port import MemoryPort
from hornbill.bus.listing import Adapters
from hornbill.bus.reopening import ReopeningPort
from hornbill.errors import PortOpenFailed
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.servo import Servo, State
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.runtime.hub import Change, LogEvent
from hornbill.sim.bench.bench import Bench
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.store.migrate import migrate
from hornbill.store.store import Store
from hornbill.units import Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.messages import ArrayCommand
from hornbill.wire.port import CanPort, PortStatistics
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetSetRequest, ValueKind
from hornbill.wire.transfer import Transfer

CATALOG = Catalog.load()
T = TypeVar("T")
Response = httpx.Response

SETTINGS = HostSettings(127, bytes(range(16)), (0, 1))
PLAIN = Recipe("BLA21-06U-A0", "1.300", servo_id=1, node_id=11)


async def until(condition: Callable[[], object], within_s: float = 30.0, every_s: float = 0.01) -> None:
    """Wait until `condition()` is true, checked every `every_s` seconds."""
    async with asyncio.timeout(within_s):
        while not condition():
            await asyncio.sleep(every_s)


class Walls:
    """The computer's clock: it follows the clock of the event loop, and can be set."""

    def __init__(self, true: Callable[[], float]) -> None:
        self._true = true
        self.wrong_s = 0.0

    def __call__(self) -> float:
        return self._true() + self.wrong_s


class Cable:
    """The host's adapter on the bus, which can be unplugged and disturbed."""

    def __init__(self, bus: MemoryBus) -> None:
        self._bus = bus
        self.plugged = True
        self.inner: MemoryPort | None = None
        self.openings = 0

    async def unplug(self) -> None:
        """Unplug the adapter: frames in transit are lost, and it cannot be opened."""
        self.plugged = False
        assert self.inner is not None
        await self.inner.close()

    def plug_in(self) -> None:
        """Plug it in again."""
        self.plugged = True

    def bus_off(self) -> None:
        """Put its controller in bus-off, where it stays."""
        assert self.inner is not None
        self._bus.bus_off(self.inner)

    def deafen(self, pct: float) -> None:
        """Lose a share of the received frames."""
        assert self.inner is not None
        self._bus.loss(pct, port=self.inner)

    def port(self, address: str, bitrate: int) -> ReopeningPort:
        """A port on it, not yet open."""

        async def open_one(statistics: PortStatistics) -> CanPort:
            if not self.plugged:
                raise PortOpenFailed("There is no such adapter. Plug it in.", cause=None, address=address)
            self.inner = self._bus.port(address.removeprefix("memory:"), bitrate=bitrate)
            self.inner.statistics = statistics
            self.openings += 1
            return self.inner

        return ReopeningPort(open_one, address=address, bitrate=bitrate)


@dataclass
class Rig:
    """One bus with a host, an API client and a bench; `sent` is every transfer that was on the bus."""

    bus: MemoryBus
    bench: Bench
    host: Host
    app: FastAPI
    http: httpx.AsyncClient
    cable: Cable
    walls: "Walls"
    changes: list[Change] = field(default_factory=list[Change])

    async def ready(self, count: int = 1, within_s: float = 30.0) -> list[Servo]:
        """Wait until that many servos are ready."""
        async with asyncio.timeout(within_s):
            while True:
                found = [one for one in self.host.fleet.all() if one.state is State.READY]
                if len(found) >= count:
                    return found
                await asyncio.sleep(0.05)

    def sim(self, servo: Servo) -> SimulatedServo:
        """The simulated servo behind a servo of the host."""
        return self.bench.servo(Uid(servo.uid))

    async def call(
        self, verb: str, path: str, body: object = None, *, lease: str | None = None, **headers: str
    ) -> Response:
        """One REST call."""
        if lease is not None:
            headers["Lease"] = lease
        return await self.http.request(verb, path, json=body, headers=headers)

    async def lease(self, ttl_s: float = 60.0) -> str:
        """A lease's id."""
        response = await self.call("POST", "/leases", {"holder": "test", "ttl_s": ttl_s})
        assert response.status_code == 201, response.text
        return str(response.json()["id"])

    async def restart_server(self, place: str) -> Store:
        """Close the host and start another on the store at `place`, which the caller closes; servos keep running."""
        await self.host.close()
        store = Store(place, wall=self.walls)

        async def open_port(address: str, bitrate: int, **_options: bool) -> CanPort:
            port = self.cable.port(address, bitrate)
            await port.open()
            return port

        self.host = self.app.state.host = Host(CATALOG, store, open_port, SETTINGS, wall=self.walls)
        self.host.hub.subscribe(self.changes.append)
        return store

    def events(self, code: str) -> list[LogEvent]:
        """Events of one code."""
        return [change for change in self.changes if isinstance(change, LogEvent) and change.code == code]

    def logged(self, code: str) -> list[tuple[str, Uid | None, dict[str, object]]]:
        """Level, servo and values of the events of one code."""
        return [(one.level, one.uid, one.params) for one in self.events(code)]

    def transfers(self, port: str | None = None) -> list[Transfer]:
        """Every transfer that was on the bus, or those one port sent."""
        reassembler = Reassembler()
        frames = [frame for name, frame in self.bus.history if port is None or name == port]
        return reassembler.feed(frames)

    def writes(self) -> list[tuple[int, str, int]]:
        """Every GetSet write on the bus: node, name, raw value."""
        found: list[tuple[int, str, int]] = []
        for transfer in self.transfers("host"):
            if transfer.kind is Kind.REQUEST and transfer.type_id == GetSetRequest.TYPE.id:
                request = GetSetRequest.decode(transfer.payload)
                assert request is not None
                if request.value.kind is not ValueKind.EMPTY:
                    assert isinstance(request.value.value, int)
                    found.append((transfer.destination, request.name, request.value.value))
        return found

    def array_commands(self) -> list[Transfer]:
        """Every ArrayCommand on the bus."""
        return [
            one for one in self.transfers("host") if one.kind is Kind.MESSAGE and one.type_id == ArrayCommand.TYPE.id
        ]


@lru_cache
def _empty_database() -> sqlite3.Connection:
    """A database in memory with all tables: creating them takes a fifth of a scene."""
    engine = create_engine("sqlite://", poolclass=StaticPool)
    with engine.begin() as connection:
        migrate(connection, "bench")
    made = engine.raw_connection().driver_connection
    assert isinstance(made, sqlite3.Connection)
    return made


def _store(place: str, walls: Walls) -> Store:
    """A store at `place`; in memory, with a copy of the tables."""
    if place != "sqlite://":
        return Store(place, wall=walls)

    template = _empty_database()

    def copy_tables(connection: sqlite3.Connection, _record: object) -> None:
        template.backup(connection)

    event.listen(Pool, "connect", copy_tables)
    try:
        return Store(place, wall=walls)
    finally:
        event.remove(Pool, "connect", copy_tables)


@lru_cache
def _api(catalog: Catalog) -> FastAPI:
    """One application for all tests: creating its routes takes longer than most scenes."""
    return create_api(catalog)


class Socket:
    """One WebSocket to the API, without a network: messages in, messages out."""

    def __init__(self, app: FastAPI) -> None:
        self._to_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._from_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        scope: dict[str, Any] = {
            "type": "websocket", "path": "/api/v1/ws", "raw_path": b"/api/v1/ws", "query_string": b"", "headers": [],
            "subprotocols": [], "root_path": "", "scheme": "ws", "client": ("test", 1), "server": ("test", 80),
        }  # fmt: skip
        self._task = asyncio.create_task(app(scope, self._to_app.get, self._from_app.put))  # pyright: ignore[reportArgumentType]
        self._to_app.put_nowait({"type": "websocket.connect"})

    def send(self, **message: object) -> None:
        """Send one message."""
        self._to_app.put_nowait({"type": "websocket.receive", "text": orjson.dumps(message).decode()})

    def send_raw(self, text: str) -> None:
        """Send any text."""
        self._to_app.put_nowait({"type": "websocket.receive", "text": text})

    async def receive(self, kind: str, within_s: float = 10.0) -> dict[str, Any]:
        """The next message of this type; others are skipped."""
        async with asyncio.timeout(within_s):
            while True:
                event = await self._from_app.get()
                if event["type"] == "websocket.send":
                    message: dict[str, Any] = orjson.loads(event["text"])
                    if message["type"] == kind:
                        return message

    async def closed(self, within_s: float = 10.0) -> int:
        """The code with which the server closed the socket; messages before it are skipped."""
        async with asyncio.timeout(within_s):
            while (event := await self._from_app.get())["type"] != "websocket.close":
                pass
            return int(event["code"])

    def received(self) -> list[dict[str, Any]]:
        """All messages received and not yet read."""
        found: list[dict[str, Any]] = []
        while not self._from_app.empty():
            event = self._from_app.get_nowait()
            if event["type"] == "websocket.send":
                found.append(orjson.loads(event["text"]))
        return found

    async def close(self) -> None:
        """Disconnect as a closed page does."""
        self._to_app.put_nowait({"type": "websocket.disconnect", "code": 1001})
        await self._task


def play(
    scene: Callable[[Rig], Awaitable[T]],
    *recipes: Recipe,
    store: str = "sqlite://",
    connect: bool = True,
    fast: bool = False,
    seed: int = 1,
    behind: bool = False,
) -> T:
    """Run `scene` with the servos of `recipes` (one plain servo unless given) on a clock that jumps.

    With `behind` on the real clock, and the store is written by its own thread, as in a server.
    """

    async def run() -> T:
        bus = MemoryBus(history=200_000, fast=fast)
        loop, began, epoch = asyncio.get_running_loop(), asyncio.get_running_loop().time(), time.time()
        walls = Walls(lambda: epoch + loop.time() - began)
        opened = _store(store, walls)
        if behind:
            opened.begin()

        cable = Cable(bus)

        async def open_port(address: str, bitrate: int, **_options: bool) -> CanPort:
            if address == "memory:broken":
                raise PortOpenFailed("The adapter is broken. Take another.", cause=None, address=address)
            port = cable.port(address, bitrate)
            await port.open()
            return port

        host = Host(CATALOG, opened, open_port, SETTINGS, wall=walls)
        app = _api(CATALOG)
        app.state.host, app.state.adapters = host, Adapters(detectors={})
        transport = httpx.ASGITransport(app, raise_app_exceptions=True)
        bench = app.state.bench = Bench(bus.port, CATALOG, seed, bus)
        for recipe in recipes or (PLAIN,):
            bench.add(recipe)
        async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1/api/v1", timeout=None) as client:
            rig = Rig(bus, bench, host, app, client, cable, walls)
            host.hub.subscribe(rig.changes.append)
            try:
                if connect:
                    await host.connect("memory:host", 1_000_000)
                await bench.start()
                return await scene(rig)
            finally:
                await host.close()
                await bench.close()
                opened.close()

    return real_clock.run(run()) if behind else clock.run(run())


def json(response: Response, status: int = 200) -> Any:
    """The body of a response, which must have this status."""
    assert response.status_code == status, f"{response.status_code}: {response.text}"
    return response.json()


def problem(response: Response, code: str, status: int) -> dict[str, Any]:
    """The problem of a response, which must be a rejection with this code."""
    assert response.headers["content-type"] == "application/problem+json", response.text
    found: dict[str, Any] = json(response, status)
    assert found["code"] == code, found
    assert found["status"] == status
    assert len(found["detail"]) > 20
    return found
