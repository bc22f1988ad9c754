"""Owns Host: the servo layer put together, and its connection to at most one bus."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from hornbill.errors import BusDisconnected
from hornbill.node.allocation import serve_allocation
from hornbill.node.allocator import Allocator
from hornbill.node.guard import GuardedPort
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.servo.asking import Asker
from hornbill.servo.changes import Changes
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import BusChanged, Change, Happened, Hub, JobChanged, LeaseChanged, ServoChanged
from hornbill.servo.jobs import Jobs
from hornbill.servo.leases import Leases
from hornbill.servo.motion import Motion
from hornbill.servo.polling import Polling
from hornbill.servo.saving import Saving
from hornbill.servo.servo import Servo
from hornbill.servo.stop import Stop
from hornbill.servo.telemetry import Telemetry
from hornbill.servo.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.units import Instant
from hornbill.wire.port import CanPort, PortState
from hornbill.wire.services import SoftwareVersion

log = logging.getLogger(__name__)

TICK_S = 0.025
"""How often leases, silence and soft starts are looked at; a lease that lapses is acted on within this."""

EVENTS_KEPT = 200


@dataclass(slots=True)
class Connection:
    """The bus as it is connected now. Rates are per second over the last second."""

    port: CanPort
    participant: Participant
    allocator: Allocator
    granted: dict[int, Instant] = field(default_factory=dict[int, Instant])
    load_pct: float = 0.0
    rx_fps: float = 0.0
    tx_fps: float = 0.0


class Host:
    """Everything the API needs, with one method each to connect, disconnect and close."""

    def __init__(
        self,
        catalog: Catalog,
        store: Store,
        open_port: Callable[[str, int], Awaitable[CanPort]],
        *,
        node_id: int,
        unique_id: bytes,
        version: tuple[int, int],
    ) -> None:
        """`open_port(address, bitrate)` opens an adapter; `node_id` is our own, 1..127."""
        self.catalog = catalog
        self.store = store
        self.base = TimeBase(asyncio.get_running_loop().time)
        self.started_at = self.base.now()
        self.hub = Hub()
        self.events: deque[tuple[float, Happened]] = deque(maxlen=EVENTS_KEPT)
        """The last events, each with its time in seconds since 1970 UTC."""
        self.hub.listen(self._note_event)
        self.connection: Connection | None = None
        self._open_port = open_port
        self._own = (node_id, unique_id, SoftwareVersion(*version))
        self.asker = Asker(catalog, self.hub, self.base)
        self.telemetry = Telemetry(self.hub)
        self.fleet = Fleet(catalog, self.asker, self.hub, self.base, store.servos, self._granted_at)
        self.leases = Leases()
        self.motion = Motion(self.asker, self.hub, self.base, self.leases)
        self.stop = Stop(self.asker, self.hub, self.base, catalog, self.fleet.all, self.motion.quiet)
        self.motion.stop = self.stop
        self.jobs = Jobs(lambda job: self.hub.tell(JobChanged(job)), self.base.utc_now)
        self.changes = Changes(self.asker, self.hub, self.base, self.leases, self.motion)
        self.saving = Saving(
            self.asker, self.hub, self.base, self.jobs, self.leases, self.motion, self.stop,
            self.fleet,
        )  # fmt: skip
        self.polling = Polling(self.asker, self.base)
        self.fleet.on_sight = self.stop.on_arrival
        self.fleet.on_arrival = self.polling.begin
        self._switching = asyncio.Lock()
        self._ticker = asyncio.get_running_loop().create_task(self._tick())

    async def connect(self, address: str, bitrate: int) -> Connection:
        """Open an adapter and take part in its bus. Raises PortOpenFailed; the old bus stays until the new one is open.

        The adapter that is connected already is closed first: most cannot be opened twice.
        """
        async with self._switching:
            if self.connection is not None and self.connection.port.address == address:
                await self._leave()
            port = await self._open_port(address, bitrate)
            await self._leave()
            return self._join(port, address, bitrate)

    def _join(self, port: CanPort, address: str, bitrate: int) -> Connection:
        node_id, unique_id, version = self._own
        writable = frozenset(row.name for row in self.catalog.parameters.values() if row.writable)
        participant = Participant(
            GuardedPort(port, writable=writable), node_id=node_id, name="org.hornbill",
            unique_id=unique_id, software_version=version,
        )  # fmt: skip
        allocator = Allocator(
            self.store.allocations, own_ids=frozenset((node_id,)), residents=self.fleet.attach(participant)
        )
        self.connection = connection = Connection(port, participant, allocator)
        allocator.on_granted.append(lambda uid, granted: self._granted(connection, uid, granted))
        serve_allocation(participant, allocator)
        self.asker.participant = participant
        participant.start()
        self.hub.tell(BusChanged())
        self.hub.tell(Happened("info", "connected", f"Connected to {address} at {bitrate / 1e6:g} Mbit/s."))
        return connection

    async def disconnect(self) -> None:
        """Leave the bus: what is under command is let go with torque off first. Twice is harmless."""
        async with self._switching:
            await self._leave()

    async def _leave(self) -> None:
        connection = self.connection
        if connection is None:
            return
        self.motion.leaving = True
        await self.motion.close()
        self.connection, self.asker.participant = None, None
        self.motion.leaving = False
        await connection.participant.close()
        await self.fleet.detach()
        await connection.port.close()
        self.hub.tell(BusChanged())
        self.hub.tell(Happened("notice", "disconnected", f"Disconnected from {connection.port.address}."))

    async def close(self) -> None:
        """End everything. What is under command gets torque off first."""
        self._ticker.cancel()
        await self.jobs.close()
        await self.polling.close()
        await self.stop.close()
        await self.disconnect()
        await asyncio.gather(self._ticker, return_exceptions=True)

    def connected(self) -> Connection:
        """The connection. Raises BusDisconnected when there is none, or the adapter is lost."""
        if self.connection is None:
            raise BusDisconnected("No bus is connected. Connect an adapter: PUT /api/v1/bus.")
        if self.connection.port.state is PortState.LOST:
            raise BusDisconnected(f"The adapter {self.connection.port.address} is lost. Check its cable.")
        return self.connection

    def lease_changed(self) -> None:
        """Tell everybody who has motion control."""
        self.hub.tell(LeaseChanged())

    def set_label(self, servo: Servo, label: str) -> None:
        """Give a servo a nickname that outlives the process."""
        servo.label = label.strip()
        self.store.servos.label(servo.uid, servo.label)
        self.hub.tell(ServoChanged(servo.uid))

    def _granted_at(self, node_id: int) -> Instant | None:
        return None if self.connection is None else self.connection.granted.get(node_id)

    def _note_event(self, change: Change) -> None:
        if isinstance(change, Happened):
            self.events.append((self.base.utc_now(), change))

    def _granted(self, connection: Connection, uid: str, node_id: int) -> None:
        connection.granted[node_id] = self.base.now()
        self.hub.tell(Happened("info", "allocated", f"Node id {node_id} given to {uid[:8]}…"))

    async def _tick(self) -> None:
        second, counted = self.base.now(), (0, 0, 0.0)
        while True:
            await asyncio.sleep(TICK_S)
            now = self.base.now()
            try:
                self.motion.tick()
                self.fleet.tick(now)
            except Exception:  # a lease that lapses later must be noticed all the same
                log.exception("a tick failed")
            connection = self.connection
            if connection is not None and now - second >= 1.0:
                seen = connection.port.statistics
                took = now - second
                connection.rx_fps = max(0.0, (seen.rx_frames - counted[0]) / took)
                connection.tx_fps = max(0.0, (seen.tx_frames - counted[1]) / took)
                connection.load_pct = max(0.0, (seen.busy_s - counted[2]) / took * 100)
                second, counted = now, (seen.rx_frames, seen.tx_frames, seen.busy_s)
                self.hub.tell(BusChanged())
