"""Composition root: builds store, bus, servo layer, API and view, and closes them in reverse order."""

import asyncio
import tempfile
from collections.abc import AsyncGenerator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from fastapi import FastAPI
from starlette.requests import HTTPConnection

from hornbill import __version__, resources
from hornbill.api.http import create_api
from hornbill.api.live.event_log import is_followed
from hornbill.api.security.access import Access
from hornbill.api.security.origin import Policy, local_policy
from hornbill.app.bus_ports import EMBEDDED, BusPorts, StoredBauds, places, with_frame_gap
from hornbill.app.network_policy import NetworkPolicy, decide, may_open
from hornbill.app.settings import Settings
from hornbill.app.view_feed import ViewFeed
from hornbill.bus.embedded.memory import MemoryBus
from hornbill.bus.listing import Adapters
from hornbill.bus.recordings.bus_log import BusLog
from hornbill.bus.recordings.folder import LOGS, RECORDINGS, FileFolder
from hornbill.bus.recordings.recording import RecordingWriter
from hornbill.domain.autopilot import Program
from hornbill.node.allocator import AllocationMode
from hornbill.schema.catalog import Catalog
from hornbill.servo.host import Host, HostSettings
from hornbill.servo.runtime.computing import in_a_process
from hornbill.servo.runtime.hub import LogEvent
from hornbill.sim.bench.autopilot import MAX_OUTPUTS
from hornbill.sim.bench.bench import Bench, demo_fleet
from hornbill.store.data_folder import LOGS_FOLDER, RECORDINGS_FOLDER
from hornbill.store.store import Store
from hornbill.view.proxy import routes
from hornbill.view.viewer import Viewer
from hornbill.virtual_time import VirtualLoop, utc_of
from hornbill.wire.port import split_frame_gap


def build(
    settings: Settings,
    *,
    demo: bool,
    log: Callable[[str], None] = lambda _text: None,
    fast: bool = False,
    exposure: NetworkPolicy | None = None,
    url: str | None = None,
) -> FastAPI:
    """Build the application, with a lifespan that opens and closes everything.

    `demo`: simulated servos and a temporary data folder. The servos are on the embedded bus unless `settings.bus` names
    another, which must not have real servos. `fast` disables the bit timing of the embedded bus. `exposure`: network
    policy, by default that of `decide`, whose errors it raises. `url`: address of the page, for other benches.
    """
    exposed = exposure or decide(settings, demo=demo)
    given = None if settings.token is None else settings.token.get_secret_value()
    access = Access(given=given, required=exposed.required)
    catalog = Catalog.load()
    poses = ViewFeed()
    viewer = Viewer(poses)
    view_error = viewer.error if settings.view else None
    policy = local_policy(exposed.hosts, addresses=exposed.addresses)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        async with AsyncExitStack() as stack:
            folder = settings.data_dir
            if demo:
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="hornbill-demo-")))
            bench_name = "demo" if demo else settings.bench
            utc = utc_of(asyncio.get_running_loop())
            store = stack.enter_context(
                Store(folder if demo else settings.database or folder, bench=bench_name, wall=utc)
            )
            store.begin()
            access.open(store)
            stack.push_async_callback(access.close)
            refreshing = asyncio.create_task(access.keep_fresh())
            stack.callback(refreshing.cancel)
            # Simulated servos are on the embedded bus, or on that of an adapter if configured.
            embedded = MemoryBus(fast=fast) if settings.bus is None else None
            bauds = StoredBauds(store.settings)
            at_once = demo or settings.sim_api
            bench = None
            if at_once or embedded is not None:
                bench = Bench(await places(embedded, settings.bus, bauds, stack), catalog, settings.seed, embedded)
                shown = demo or not settings.sim_api
                for recipe in demo_fleet(catalog, settings.servos, settings.seed) if shown else ():
                    static = recipe.node_id if settings.autopilot is None or not recipe.node_id else recipe.node_id + 10
                    bench.add(replace(recipe, node_id=static))  # 10 is the autopilot's
            if bench is not None:
                stack.push_async_callback(bench.close)  # after the host, so that servos confirm that torque is off
            app.state.bench = bench if at_once else None
            # The embedded bus can be selected on the page. It does not run before that, nor with another bus.
            chosen = None if embedded is None else bench
            ports = BusPorts(
                embedded, folder / LOGS_FOLDER, folder / RECORDINGS_FOLDER, bauds,
                allow=partial(may_open, exposed, None if settings.bus is None else split_frame_gap(settings.bus)[0],
                              virtual=isinstance(asyncio.get_running_loop(), VirtualLoop)),
                before_embedded=partial(_switch_on, app, chosen),
            )  # fmt: skip
            host = Host(
                catalog, store, ports.open,
                replace(
                    _host_settings(settings, store, url), data_folder=folder, view_error=view_error,
                    watched=partial(is_followed, app.state),
                ),
                before_join=partial(_one_bus, chosen),
                wall=utc,
            )  # fmt: skip
            app.state.bus_log = bus_log = bus_log_of(host, folder / LOGS_FOLDER)
            stack.push_async_callback(bus_log.stop)  # after the host, so that the log contains its last frames
            stack.push_async_callback(host.close)
            app.state.host = host
            reporting = asyncio.create_task(host.site.run())
            stack.callback(reporting.cancel)
            app.state.recordings = recordings = FileFolder(folder / RECORDINGS_FOLDER, RECORDINGS)
            recordings.tidy()
            host.recorder.begin(partial(RecordingWriter.begin, recordings), before_s=settings.recording_before_s)
            app.state.adapters = adapters = Adapters(ports.own, memory=bauds)
            stack.callback(adapters.close)
            poses.follow(host, viewer)
            address = EMBEDDED if at_once and embedded is not None else settings.bus
            if address is not None:
                role = ("guest" if settings.autopilot else "host") if demo else settings.role
                await ports.join(host, with_frame_gap(address, settings.frame_gap_ms), settings.bitrate, log, role)
            if at_once and bench is not None:
                await bench.start()
                if demo and settings.autopilot is not None:
                    await _add_autopilot(bench, settings.autopilot)
                if demo and settings.chaos is not None:
                    bench.chaos.start(settings.chaos)
            drawing = asyncio.create_task(poses.run())
            stack.callback(drawing.cancel)
            stack.callback(viewer.close)
            yield

    return create_api(
        catalog,
        lifespan=lifespan,
        policy=policy,
        access=access,
        behind_proxy=settings.behind_proxy,
        root_path=settings.root_path,
        page_folder=resources.page,
        docs_folder=resources.docs,
        mounted=routes(viewer, allowed=_view_policy(policy)) if settings.view else (),
        demo=demo,
    )


async def _add_autopilot(bench: Bench, program: Program) -> None:
    """Add an armed autopilot whose outputs are the servos that have a servo ID."""
    ids = {servo.servo_id for servo in bench.servos.values()} - {0}
    await bench.set_autopilot(program, outputs=MAX_OUTPUTS)
    autopilot = bench.autopilot
    assert autopilot is not None
    for index, output in enumerate(autopilot.outputs):
        output.sent = autopilot.actuator_id(index) in ids
    autopilot.armed, autopilot.safety_on = True, False


async def _switch_on(app: FastAPI, bench: Bench | None) -> None:
    if bench is not None:
        app.state.bench = bench
        await bench.start()


async def _one_bus(bench: Bench | None, address: str) -> None:
    """Stop the simulated servos when another bus is connected."""
    if bench is not None and address != EMBEDDED:
        await bench.stop()


def bus_log_of(host: Host, logs: Path) -> BusLog:
    """Log of the connected bus, written to the folder `logs`."""
    return BusLog(
        FileFolder(logs, LOGS),
        listen=host.tap.listen,
        address=lambda: "" if host.connection is None else host.connection.port.address,
        utc=host.base.utc,
        publish=lambda level, code, text, params: host.hub.publish(LogEvent(level, code, text, params={**params})),
    )


def _view_policy(policy: Policy) -> Callable[[HTTPConnection], bool]:
    """The same policy for the routes of the view; sockets must send an Origin, because only browsers use them."""

    def allowed(connection: HTTPConnection) -> bool:
        needs = connection.scope["type"] == "websocket"
        return policy(connection) is None and (not needs or "origin" in connection.headers)

    return allowed


def _host_settings(settings: Settings, store: Store, url: str | None) -> HostSettings:
    return HostSettings(
        settings.node_id,
        store.settings.own_unique_id(),
        _version(),
        None if settings.allocator is None else AllocationMode(settings.allocator),
        settings.position_unit,
        settings.poll_budget_pct / 100,
        settings.telemetry_minutes,
        in_a_process,
        url=url,
    )


def _version() -> tuple[int, int]:
    """Major and minor version for GetNodeInfo."""
    parts = __version__.split(".")
    return (int(parts[0]), int(parts[1])) if len(parts) > 1 and parts[0].isdigit() and parts[1].isdigit() else (0, 0)
