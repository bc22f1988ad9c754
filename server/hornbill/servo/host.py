"""Owns Host: the servo layer put together, and its connection to at most one bus."""

import asyncio
import logging
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from hornbill.errors import BusDisconnected, BusReadOnly, PortError
from hornbill.node.allocator import Allocator, AllocatorMode
from hornbill.node.directory import Directory
from hornbill.node.guard import GuardedPort
from hornbill.node.participant import Participant
from hornbill.node.tap import FrameTap
from hornbill.schema.catalog import Catalog
from hornbill.servo.allocating import Allocating
from hornbill.servo.asking import Asker
from hornbill.servo.blackbox import BlackBox
from hornbill.servo.bursts import Bursts
from hornbill.servo.bus_watch import GONE, BusWatch
from hornbill.servo.configuration.applying import Applying
from hornbill.servo.configuration.audit import Audit
from hornbill.servo.configuration.batch import Batch
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.commission_hands import Hands
from hornbill.servo.configuration.commissioning import Commissioning
from hornbill.servo.configuration.commissioning_unit import Crew
from hornbill.servo.configuration.comparing import Sides
from hornbill.servo.configuration.drift import Drift
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.parking import Parking
from hornbill.servo.configuration.profiles import Profiles
from hornbill.servo.configuration.resetting import Resetting
from hornbill.servo.configuration.restoring import Restoring
from hornbill.servo.configuration.saving import Saving
from hornbill.servo.configuration.witness import Witness
from hornbill.servo.counting import Counts
from hornbill.servo.doctor.doctor import Doctor
from hornbill.servo.effects import Effects
from hornbill.servo.faults import Faults
from hornbill.servo.fleet import Fleet
from hornbill.servo.holding import Holds
from hornbill.servo.hub import BusChanged, Change, Happened, Hub, JobChanged, LeaseChanged, ServoChanged
from hornbill.servo.jobs import Jobs
from hornbill.servo.jogging import Jogs
from hornbill.servo.leases import Leases
from hornbill.servo.monitor import Monitor
from hornbill.servo.motion import Motion
from hornbill.servo.narrating import Narrator
from hornbill.servo.polling import BUDGET, Polling
from hornbill.servo.position_estimate import PositionUnit
from hornbill.servo.position_unit import PositionUnits
from hornbill.servo.remembering import Memory
from hornbill.servo.replaying import Bundled, Replaying
from hornbill.servo.servo import Servo
from hornbill.servo.snapshot import Snapshot
from hornbill.servo.stop import Stop
from hornbill.servo.stop_kept import KeptStop
from hornbill.servo.streams import Streams
from hornbill.servo.takeover import TakeOvers
from hornbill.servo.telemetry import MINUTES, Telemetry
from hornbill.servo.timebase import TimeBase
from hornbill.servo.turn_count import TurnCount
from hornbill.servo.wiggle import Wiggle
from hornbill.store.audit import Entry
from hornbill.store.store import Store
from hornbill.wire.port import RECORDINGS, CanPort
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
        position_unit: PositionUnit | None = None,
        poll_budget: float = BUDGET,
        telemetry_minutes: float = MINUTES,
    ) -> None:
        """`open_port(address, bitrate)` opens an adapter; `node_id` is our own, 1..127.

        `allocator` is its mode, None for the one chosen last. `position_unit` is forced on every servo that has
        not been given one of its own. `poll_budget` is the share of the bus polling may take, 0..1;
        `telemetry_minutes` of every channel are kept.
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
        self.before_join: Callable[[str], Awaitable[None]] | None = None
        """Awaited with the address of a new bus, when the one before is left: what was on that may rest."""
        self._own = (node_id, unique_id, SoftwareVersion(*version))
        self.counts = Counts(self.hub)
        self.asker = Asker(self.hub, self.base)
        self.audit = Audit(store.audit, self.hub)
        self.history = History(store.snapshots, self.audit)
        self.profiles = Profiles(store.profiles, catalog, self.audit)
        self.telemetry = Telemetry(self.hub, self.base, lambda uid: self.fleet.find(uid), minutes=telemetry_minutes)
        self.drift = Drift(store.servos, self.hub, self.audit)
        self.position_units = PositionUnits(
            self.asker, self.hub, self.base, store.settings, self.audit, position_unit
        )  # fmt: skip
        self.fleet = Fleet(
            catalog, self.asker, self.hub, self.base, Memory(store.servos, self.hub, self.base, self.drift),
            self.position_units,
        )  # fmt: skip
        self.effects = Effects(catalog, self.hub, self.fleet.find)
        self.faults = Faults(catalog, store.faults, self.hub, self.base, self.fleet.find, self.audit)
        self.allocating = Allocating(
            store, self.hub, self.base, self.fleet.ask_now, own_id=node_id, mode=allocator
        )  # fmt: skip
        self.fleet.fresh.granted_at = self.allocating.granted_at
        self.leases = Leases()
        self.motion = Motion(self.asker, self.hub, self.base, self.leases)
        self.stop = Stop(self.asker, self.hub, self.base, catalog, self.fleet.met, self.motion.quiet)
        self.motion.stop = self.stop
        self.turn_count = TurnCount(self.hub, self.fleet.find)
        self.bursts = Bursts(self.asker, self.base, self.motion, self.fleet.all)
        self.streams = Streams(
            self.asker, self.hub, self.base, self.leases, self.bursts,
            lambda: sum(servo.online for servo in self.fleet.all()),
        )  # fmt: skip
        self.motion.streamed = self.streams.commands
        self.jogs = Jogs(self.asker, self.hub, self.base, self.motion)
        self.holds = Holds(self.hub, self.base, self.motion, self.jogs.end)
        self.jobs = Jobs(lambda job: self.hub.tell(JobChanged(job)), self.base.utc_now, store.jobs)
        self.claims = Claims(
            self.fleet.all, store, lambda: None if self.connection is None else self.connection.directory, self.base,
            own_id=node_id,
        )  # fmt: skip
        self.changes = Changes(
            self.asker, self.hub, self.base, self.leases, self.motion, self.history, self.audit, self.claims
        )
        self.saving = Saving(
            self.asker, self.hub, self.base, self.jobs, self.leases, self.motion, self.stop,
            self.fleet, self.history, self.audit, self.claims,
        )  # fmt: skip
        self.resetting = Resetting(
            self.asker, self.hub, self.base, self.jobs, self.leases, self.motion, self.stop, self.saving,
            self.history, self.audit, self.fleet.memory,
        )  # fmt: skip
        self.applying = Applying(
            self.profiles, self.changes, self.saving, self.jobs, self.leases, self.fleet, self.base
        )  # fmt: skip
        self.batch = Batch(self.asker, self.hub, self.base, self.leases, self.fleet, self.changes, self.saving)
        self.wiggle = Wiggle(
            self.asker, self.hub, self.base, self.jobs, self.leases, self.motion, self.stop, self.audit
        )
        hands = Hands(self.base, self.jobs, self.fleet, self.changes, self.saving)
        parking = Parking(hands, self.fleet, self.claims, self.allocating, store.allocations)
        crew = Crew(
            hands, parking, self.asker, self.base, self.fleet, self.profiles, self.wiggle, self.audit, self.set_label
        )
        self.commissioning = Commissioning(
            self.jobs, self.fleet, self.base, self.leases, self.stop, self.profiles, self.changes, self.saving,
            self.claims, parking, crew,
        )  # fmt: skip
        self.sides = Sides(catalog, self.fleet, store.servos, store.snapshots, self.profiles)
        self.restoring = Restoring(self.asker, self.changes)
        self.witness = Witness(self.audit, self.base, self.stop)
        self.kept_stop = KeptStop(store.settings, self.stop, self.base, self.hub)
        self.kept_stop.restore()
        self.stop.on_pressed, self.stop.on_cleared = self.witness.pressed, self.witness.cleared
        self.motion.on_lease_ended = self.witness.lease_ended
        self.takeovers = TakeOvers(self.leases, self.motion, self.hub, self.base, self.witness)
        self.watch = BusWatch(self.hub, self.base, self.fleet, self.motion, self.stop, self._bus_back)
        self.polling = Polling(self.asker, self.base, poll_budget)
        self.doctor = Doctor(self.base.now, self.fleet.all)
        self.fleet.on_sight = self.stop.on_arrival
        self.fleet.on_suspect = self.stop.on_suspect
        self.stop.suspects, self.stop.imposing = self.fleet.suspects, self.fleet.imposed
        self.fleet.on_arrival = self.polling.begin
        self.tap = FrameTap()
        """Every frame of whatever bus is connected."""
        self.monitor = Monitor(self.tap, self.base, lambda: Narrator(catalog, self.fleet.all))
        self.blackbox = BlackBox(
            base=self.base, hub=self.hub, catalog=catalog, tap=self.tap, telemetry=self.telemetry, stop=self.stop,
            leases=self.leases, port=self._port, find=self.fleet.find, snapshot=self._snapshot, node_id=node_id,
        )  # fmt: skip
        """What happened lately; it begins when it is told where bundles go."""
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
            if self.before_join is not None:
                await self.before_join(address)
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
        allocator = self.allocating.join(participant, directory, recorded=port.address.startswith(RECORDINGS))
        self.connection = connection = Connection(port, participant, allocator, directory)
        self.asker.participant = participant
        self.tap.attach(participant)
        if isinstance(port, Bundled) and port.about is not None:
            self.telemetry.set_aside()
            replaying = Replaying.of(port.about, self.fleet, self.asker, self.base)
            participant.on_frames.append(replaying.hear)
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
        self.telemetry.bring_back()
        await connection.port.close()
        self.hub.tell(BusChanged())
        self.hub.tell(Happened("notice", "disconnected", f"Disconnected from {connection.port.address}."))

    async def close(self) -> None:
        """End everything. What is under command gets torque off first."""
        self._ticker.cancel()
        await self.jobs.close()
        await self.streams.close()
        await self.jogs.close()
        await self.holds.close()
        await self.polling.close()
        await self.position_units.close()
        await self.disconnect()  # before stop ends: a servo that has not answered it yet is written to until then
        await self.stop.close()
        await self.takeovers.close()
        await self.motion.debts.close()
        await self.kept_stop.close()
        await self.blackbox.close()
        await self.witness.close()
        await asyncio.gather(self._ticker, return_exceptions=True)

    def _port(self) -> CanPort | None:
        return None if self.connection is None else self.connection.port

    def _snapshot(self) -> Snapshot:
        port = self._port()
        return Snapshot.of(self.fleet.met(), None if port is None else (port.address, port.bitrate))

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

    def set_label(self, servo: Servo, label: str, *, by: str, job: str | None = None) -> None:
        """Give a servo a nickname that outlives the process. `by` says who, for the audit."""
        if servo.recorded:
            raise BusReadOnly(f"{servo.title} is one of a recording. Connect its bus to give it another label.")
        before, servo.label = servo.label, label.strip()
        self.store.servos.label(servo.uid, servo.label)
        outcome = "unchanged" if servo.label == before else "applied"
        self.audit.note(
            Entry(by, "label", outcome, servo.uid, before=before, requested=label, after=servo.label, job=job)
        )
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
                self.takeovers.tick,
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
