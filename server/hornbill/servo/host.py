"""Owns Host: the servo layer put together, and its connection to at most one bus."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from hornbill.errors import BusDisconnected, PortError
from hornbill.node.allocator import Allocator, AllocatorMode
from hornbill.node.directory import Directory
from hornbill.node.guard import GuardedPort
from hornbill.node.participant import Participant
from hornbill.node.tap import FrameTap
from hornbill.schema.catalog import Catalog
from hornbill.servo.allocating import Allocating
from hornbill.servo.asking import Asker
from hornbill.servo.bus_watch import GONE, BusWatch
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.doctor.doctor import Doctor
from hornbill.servo.fleet import Fleet
from hornbill.servo.hub import BusChanged, Change, Happened, Hub, JobChanged, LeaseChanged, ServoChanged
from hornbill.servo.jobs import Jobs
from hornbill.servo.leases import Leases
from hornbill.servo.monitor import Monitor
from hornbill.servo.motion import Motion
from hornbill.servo.narrating import Narrator
from hornbill.servo.polling import Polling
from hornbill.servo.servo import Servo
from hornbill.servo.stop import Stop
from hornbill.servo.telemetry import Telemetry
from hornbill.servo.timebase import TimeBase
from hornbill.store.store import Store
from hornbill.wire.port import RECORDING, CanPort
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
    directory: Directory
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
        allocator: AllocatorMode | None = None,
    ) -> None:
        """`open_port(address, bitrate)` opens an adapter; `node_id` is our own, 1..127.

        `allocator` is its mode, None for the one chosen last.
        """
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
        self.audit = Audit(store.audit, self.hub)
        self.history = History(store.snapshots, self.audit)
        self.telemetry = Telemetry(self.hub)
        self.fleet = Fleet(catalog, self.asker, self.hub, self.base, store.servos)
        self.allocating = Allocating(
            store, self.hub, self.base, self.fleet.ask_now, own_id=node_id, mode=allocator
        )  # fmt: skip
        self.fleet.granted_at = self.allocating.granted_at
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
        self.watch = BusWatch(self.hub, self.base, self.fleet, self.motion, self.stop, self._bus_back)
        self.polling = Polling(self.asker, self.base)
        self.doctor = Doctor(self.base.now, self.fleet.all)
        self.fleet.on_sight = self.stop.on_arrival
        self.fleet.on_suspect = self.stop.on_suspect
        self.stop.suspects, self.stop.imposing = self.fleet.suspects, self.fleet.imposed
        self.fleet.on_arrival = self.polling.begin
        self.tap = FrameTap()
        """Every frame of whatever bus is connected."""
        self.monitor = Monitor(self.tap, self.base, lambda: Narrator(catalog, self.fleet.all))
        self._switching = asyncio.Lock()
        self._ticker = asyncio.get_running_loop().create_task(self._tick())

    async def connect(self, address: str, bitrate: int) -> Connection:
        """Open an adapter and take part in its bus. Raises PortOpenFailed; the old bus stays until the new one is open.

        The adapter that is connected already is closed first: most cannot be opened twice.
        """
        async with self._switching:
            if self.connection is not None and self.connection.port.address == address:
                await self._leave()
            try:
                port = await self._open_port(address, bitrate)
            except PortError as error:
                self.doctor.could_not_open(address, error)
                raise
            try:
                await self._leave()
            except BaseException:
                await port.close()
                raise
            return self._join(port)

    async def attach(self, port: CanPort) -> Connection:
        """Take part in the bus of a port that is there already, and may be waiting for its adapter."""
        async with self._switching:
            await self._leave()
            return self._join(port)

    def _join(self, port: CanPort) -> Connection:
        node_id, unique_id, version = self._own
        writable = frozenset(row.name for row in self.catalog.parameters.values() if row.writable)
        participant = Participant(
            GuardedPort(port, writable=writable), node_id=node_id, name="org.hornbill",
            unique_id=unique_id, software_version=version,
        )  # fmt: skip
        directory = self.fleet.attach(participant)
        allocator = self.allocating.join(participant, directory, recorded=port.address.startswith(RECORDING))
        self.connection = connection = Connection(port, participant, allocator, directory)
        self.asker.participant = participant
        self.tap.attach(participant)
        self.doctor.follow(port, participant, allocator)
        participant.start()
        self.watch.begin(port)
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
        await self.motion.leave()
        self.connection, self.asker.participant = None, None
        self.doctor.leave()
        self.tap.detach()
        self.motion.leaving = False
        self.watch.end()
        self.allocating.leave()
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
        await self.disconnect()  # before stop ends: a servo that has not answered it yet is written to until then
        await self.stop.close()
        await self.motion.debts.close()
        await asyncio.gather(self._ticker, return_exceptions=True)

    def connected(self) -> Connection:
        """The connection. Raises BusDisconnected when there is none, or the adapter is lost."""
        if self.connection is None:
            raise BusDisconnected("No bus is connected. Connect an adapter: PUT /api/v1/bus.")
        port = self.connection.port
        if port.state in GONE:
            raise BusDisconnected(port.trouble or f"The adapter {port.address} is lost. Check its cable.")
        return self.connection

    def lease_changed(self) -> None:
        """Tell everybody who has motion control."""
        self.hub.tell(LeaseChanged())

    def set_label(self, servo: Servo, label: str) -> None:
        """Give a servo a nickname that outlives the process."""
        servo.label = label.strip()
        self.store.servos.label(servo.uid, servo.label)
        self.hub.tell(ServoChanged(servo.uid))

    def _bus_back(self) -> None:
        """Others may have come meanwhile: listen who is here before a node id is given to anybody new."""
        if self.connection is not None:
            self.connection.allocator.listening_since = self.connection.participant.clock()

    def _note_event(self, change: Change) -> None:
        if isinstance(change, Happened):
            self.events.append((self.base.utc_now(), change))

    async def _tick(self) -> None:
        second, counted = self.base.now(), (0, 0, 0.0)
        while True:
            await asyncio.sleep(TICK_S)
            now = self.base.now()
            for part in (
                self.watch.look,
                self.motion.tick,
                lambda now=now: self.fleet.tick(now, bus_gone=self.watch.gone),
                lambda now=now: self.doctor.tick(now),
                lambda now=now: self.allocating.tick(now),
            ):
                try:
                    part()
                except Exception:  # whatever it is, a lease that lapses must be noticed all the same
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
