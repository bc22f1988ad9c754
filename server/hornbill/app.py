"""The composition root: builds store, bus, servo layer, API and view, and takes them down in reverse."""

import asyncio
import tempfile
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import HTTPConnection

from hornbill import __version__, resources
from hornbill.api.http import create_api
from hornbill.api.origin import local_policy
from hornbill.bus.address import open_port
from hornbill.bus.memory import MemoryBus
from hornbill.errors import PortError
from hornbill.schema.catalog import Catalog
from hornbill.schema.scale import to_value
from hornbill.servo.host import Host
from hornbill.servo.servo import Servo
from hornbill.settings import Settings
from hornbill.sim.bench import Bench, demo_fleet
from hornbill.store.store import Store
from hornbill.view.pose import Pose
from hornbill.view.proxy import routes
from hornbill.view.viewer import Viewer
from hornbill.wire.port import CanPort

DEMO_BUS = "memory:demo"
LOCAL_NAMES = frozenset(("127.0.0.1", "localhost", "::1", "testserver"))
POSE_S = 0.04
STALE_S = 0.5
"""An angle is old after twice its period of 100 ms, and a little more for the way here (errata C11)."""


def build(
    settings: Settings, *, demo: bool, log: Callable[[str], None] = lambda _text: None, fast: bool = False
) -> FastAPI:
    """The application, with a lifespan that opens and closes everything.

    With `demo`, simulated servos on the embedded bus and a data folder that ends with the process; `fast` leaves
    out the bus's bit times.
    """
    catalog = Catalog.load()
    poses = Poses()
    viewer = Viewer(poses)
    policy = local_policy(LOCAL_NAMES)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        async with AsyncExitStack() as stack:
            folder = settings.data_dir
            if demo:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hornbill-demo-")))
            store = stack.enter_context(Store(folder))
            embedded = MemoryBus(fast=fast) if demo else None
            host = Host(
                catalog, store, _opener(embedded), node_id=settings.node_id,
                unique_id=store.settings.own_unique_id(), version=_version(),
            )  # fmt: skip
            stack.push_async_callback(host.close)
            app.state.host = host
            poses.follow(host, viewer)
            if embedded is not None:
                app.state.bench = bench = Bench(embedded.port, catalog, settings.seed)
                for recipe in demo_fleet(catalog, settings.servos, settings.seed):
                    bench.add(recipe)
                stack.push_async_callback(bench.close)
                await host.connect(DEMO_BUS, embedded.bitrate)
                await bench.start()
            elif settings.bus is not None:
                try:
                    await host.connect(settings.bus, settings.bitrate)
                except PortError as error:
                    log(f"{error.detail}\nThe page starts all the same; connect from there.")
            drawing = asyncio.create_task(poses.run())
            stack.callback(drawing.cancel)
            stack.callback(viewer.close)
            yield

    return create_api(
        catalog,
        lifespan=lifespan,
        policy=policy,
        page_folder=resources.page,
        mounted=routes(viewer, allowed=_view_policy(policy)) if settings.view else (),
        demo=demo,
    )


class Poses:
    """What the 3D view draws: a snapshot made on the event loop, for the view's own thread to take."""

    def __init__(self) -> None:
        self._snapshot: tuple[Pose, ...] = ()
        self._host: Host | None = None
        self._viewer: Viewer | None = None

    def follow(self, host: Host, viewer: Viewer) -> None:
        """Take the servos from here from now on."""
        self._host, self._viewer = host, viewer

    def poses(self) -> tuple[Pose, ...]:
        """The last snapshot; any thread may ask."""
        return self._snapshot

    async def run(self) -> None:
        """Make a snapshot 25 times a second while somebody looks, else twice."""
        while True:
            host, viewer = self._host, self._viewer
            if host is not None:
                now = host.base.now()
                self._snapshot = tuple(_pose(servo, now) for servo in host.fleet.all())
            await asyncio.sleep(POSE_S if viewer is not None and viewer.watched else 0.5)


def _pose(servo: Servo, now: float) -> Pose:
    def degrees(key: str) -> float | None:
        register = servo.registers.get(key)
        if register is None or register.raw is None:
            return None
        value = to_value(register.parameter, register.raw)
        return float(value) if isinstance(value, int | float) else None

    return Pose(
        uid=servo.uid,
        name=servo.title,
        series=servo.model.series if servo.model else "",  # pyright: ignore[reportArgumentType] - the tables know two
        angle_deg=servo.angle_deg,
        command_deg=degrees("command_angle"),
        limit_cw_deg=degrees("angle_limit_cw"),
        limit_ccw_deg=degrees("angle_limit_ccw"),
        stale=not servo.online or servo.angle_at is None or now - servo.angle_at > STALE_S,
    )


def _opener(embedded: MemoryBus | None) -> Callable[[str, int], Awaitable[CanPort]]:
    async def open_one(address: str, bitrate: int) -> CanPort:
        if embedded is not None and address == DEMO_BUS:
            return embedded.port("demo")
        return await open_port(address, bitrate=bitrate)

    return open_one


def _view_policy(policy: Callable[[HTTPConnection], str | None]) -> Callable[[HTTPConnection], bool]:
    """The same rule for the view's routes, and a socket must bring an Origin: only browsers look at horns."""

    def allowed(connection: HTTPConnection) -> bool:
        needs = connection.scope["type"] == "websocket"
        return policy(connection) is None and (not needs or "origin" in connection.headers)

    return allowed


def _version() -> tuple[int, int]:
    """Major and minor for GetNodeInfo."""
    parts = __version__.split(".")
    return (int(parts[0]), int(parts[1])) if len(parts) > 1 and parts[0].isdigit() and parts[1].isdigit() else (0, 0)
