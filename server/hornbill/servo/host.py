"""Assembly of the servo layer, and its connection to at most one bus."""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

from hornbill.domain.bench import BenchStatus
from hornbill.domain.note import Note
from hornbill.domain.servo import PositionUnit
from hornbill.errors import BusDisconnected, BusReadOnly, PortError
from hornbill.node.allocator import AllocationMode, Allocator
from hornbill.node.directory import Directory
from hornbill.node.guard import GuardedPort
from hornbill.node.listening import Heard, listen
from hornbill.node.participant import Participant
from hornbill.node.role import ConnectionRole
from hornbill.node.tap import FrameTap
from hornbill.schema.catalog import Catalog
from hornbill.servo.bus_watch import GONE, BusWatch
from hornbill.servo.configuration.changes import Changes
from hornbill.servo.configuration.claims import Claims
from hornbill.servo.configuration.following import RestartFollower
from hornbill.servo.configuration.history import History
from hornbill.servo.configuration.lost_values import LostValues
from hornbill.servo.configuration.restarting import Restarting
from hornbill.servo.device.drift import DriftDetector
from hornbill.servo.device.effects import Effects
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.passive_identification import PassiveIdentification
from hornbill.servo.device.position_unit import PositionUnits
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.rom_knowledge import RomKnowledge
from hornbill.servo.device.services import HostServices
from hornbill.servo.device.servo import Servo
from hornbill.servo.device.temporary_values import OwedValues
from hornbill.servo.device.turn_count import TurnCount
from hornbill.servo.doctor.doctor import Doctor
from hornbill.servo.doctor.server_record import ServerRecord
from hornbill.servo.monitoring.activity import Activities
from hornbill.servo.monitoring.bus_monitor import BusMonitor
from hornbill.servo.monitoring.commanders import Commanders
from hornbill.servo.monitoring.faults import Faults
from hornbill.servo.monitoring.line_budget import LineBudget
from hornbill.servo.monitoring.node_id_table import NodeIdTable
from hornbill.servo.monitoring.polling import BUDGET, GUEST_FPS, READ_FRAMES, Polling
from hornbill.servo.monitoring.telemetry import MINUTES, TelemetryCollector
from hornbill.servo.monitoring.transfer_text import TransferText
from hornbill.servo.monitoring.verify_outputs import VerifyOutputs
from hornbill.servo.motion.bursts import Bursts
from hornbill.servo.motion.holds import Holds
from hornbill.servo.motion.identify import Identify
from hornbill.servo.motion.jogs import Jogs
from hornbill.servo.motion.keeping_alive import TIMEOUT
from hornbill.servo.motion.motion import Motion
from hornbill.servo.motion.motion_control import MotionControl
from hornbill.servo.motion.setpoint_runner import SetpointRunner
from hornbill.servo.motion.streams import Streams
from hornbill.servo.profiles.comparing import Sides
from hornbill.servo.profiles.profiles import Profiles
from hornbill.servo.profiles.restoring import Restoring
from hornbill.servo.recorder.building import RecordingBuilder
from hornbill.servo.recorder.recorder import Recorder
from hornbill.servo.recorder.replaying import RecordedPort, Replaying
from hornbill.servo.runs.apply import ProfileJobs
from hornbill.servo.runs.commission_run import CommissionWriter
from hornbill.servo.runs.commission_steps import CommissionSteps
from hornbill.servo.runs.commissioning import CommissioningJobs
from hornbill.servo.runs.id_parking import IdParking
from hornbill.servo.runs.matrix import Matrix
from hornbill.servo.runs.plan_steps import PlanSteps
from hornbill.servo.runs.plans import PlanJobs
from hornbill.servo.runs.restore_output import RestoreOutputJobs
from hornbill.servo.runtime.audit import Audit
from hornbill.servo.runtime.computing import Compute, inline
from hornbill.servo.runtime.histogram import Counts
from hornbill.servo.runtime.hub import (
    BusChanged,
    Change,
    Hub,
    JobChanged,
    LeaseChanged,
    LogEvent,
    ServoChanged,
    ServoRead,
    ServoSeen,
    StopChanged,
)
from hornbill.servo.runtime.jobs import Jobs, RunningJob, Work
from hornbill.servo.runtime.leases import Leases
from hornbill.servo.runtime.loop_lag import LoopLag
from hornbill.servo.runtime.stored_roles import StoredRoles
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.servo.site import Site
from hornbill.servo.torque_off.retries import TorqueOffRetries
from hornbill.servo.torque_off.stop import StopControl
from hornbill.servo.torque_off.stored import StoredTorqueOff
from hornbill.store.audit import NewAuditEntry
from hornbill.store.servos import StoredServo
from hornbill.store.store import Store
from hornbill.units import Instant, Raw, Uid
from hornbill.wire.messages import ArrayCommand
from hornbill.wire.port import NO_PORT, REPLAYS, CanPort, same_device
from hornbill.wire.services import SoftwareVersion

log = logging.getLogger(__name__)

TICK_S = 0.025
"""Interval of checks of leases, silence and soft starts; the maximum delay until an expired lease takes effect."""

MAX_EVENTS = 200


@dataclass(slots=True)
class Connection:
    """The connected bus. Rates are averages over the last second."""

    port: CanPort
    participant: Participant
    allocator: Allocator
    directory: Directory
    role: ConnectionRole = ConnectionRole.HOST
    role_reason: Note | None = None
    """Why guest was chosen automatically. None if the role was requested."""
    load_pct: float = 0.0
    rx_fps: float = 0.0
    tx_fps: float = 0.0
    line_pct: float | None = None
    """Load of the serial line in the receiving direction, %. None if there is no serial limit."""


@dataclass(frozen=True, slots=True)
class HostSettings:
    """Our own node (`node_id` 1 to 127, `unique_id` 16 bytes, `version` major and minor), and site settings.

    `allocator`: its mode, None for the last used. `position_unit`: forced for all servos without their own setting.
    `poll_budget`: share of the bus available to polling, 0 to 1. `telemetry_minutes`: retention per channel.
    `compute` runs long computations. `data_folder`: folder whose disk is watched. `view_error` returns why the 3D
    view does not run, None if it does; without it the view is disabled. `watched` returns whether a client follows
    the servos; if none does and nobody has motion control, polling slows down.
    `url`: address of its page, None if unknown.
    """

    node_id: int
    unique_id: bytes
    version: tuple[int, int]
    allocator: AllocationMode | None = None
    position_unit: PositionUnit | None = None
    poll_budget: float = BUDGET
    telemetry_minutes: float = MINUTES
    compute: Compute = inline
    data_folder: Path | None = None
    view_error: Callable[[], str | None] | None = None
    watched: Callable[[], bool] = lambda: True
    url: str | None = None


async def _nothing(_address: str) -> None:
    pass


class Rates:
    """Rates of a connection, from counters one second apart."""

    def __init__(self) -> None:
        self._port: CanPort | None = None
        self._at: Instant = 0.0
        self._counts = (0, 0, 0.0, 0)

    def measure(self, connection: Connection, now: Instant) -> bool:
        """Update the connection's rates once a second. Returns whether they were updated."""
        if connection.port is not self._port:
            self._port, self._at, self._counts = connection.port, now, _counts(connection.port)
        took = now - self._at
        if took < 1.0:
            return False
        before, self._at, self._counts = self._counts, now, _counts(connection.port)
        rx, tx, busy_s, line_bytes = (
            max(0.0, (new - old) / took) for new, old in zip(self._counts, before, strict=True)
        )
        connection.rx_fps, connection.tx_fps, connection.load_pct = rx, tx, busy_s * 100
        line = connection.port.details.serial_line
        rate = None if line is None else line.bytes_per_s
        connection.line_pct = None if rate is None else min(100.0, line_bytes / rate * 100)
        return True


def _counts(port: CanPort) -> tuple[int, int, float, int]:
    seen = port.statistics
    return seen.rx_frames, seen.tx_frames, seen.busy_s, seen.line_bytes


class Host:
    """All services for the API, with methods to connect, disconnect and close."""

    def __init__(
        self,
        catalog: Catalog,
        store: Store,
        open_port: Callable[..., Awaitable[CanPort]],
        settings: HostSettings,
        *,
        before_join: Callable[[str], Awaitable[None]] = _nothing,
        wall: Callable[[], float] = time.time,
    ) -> None:
        """`open_port(address, bitrate)` opens an adapter, with `listen_only=True` as observer. `before_join` is awaited
        with the address of a new bus after the previous one was left, for example to pause its simulator. `wall`
        returns seconds since 1970 UTC.
        """
        self.catalog = catalog
        self.store = store
        self.bench = store.bench
        """Name of this bench."""
        self.base = TimeBase(asyncio.get_running_loop().time, wall)
        self.started_at = self.base.now()
        self.roles = StoredRoles(store.settings)
        self.hub = Hub()
        self.events: deque[tuple[float, LogEvent]] = deque(maxlen=MAX_EVENTS)
        """Recent events, each with its time, seconds since 1970 UTC."""
        self.hub.subscribe(self._note_event)
        self.lag = LoopLag()
        self._reaches: frozenset[Uid] = frozenset()
        self.connection: Connection | None = None
        self._open_port = open_port
        self._before_join = before_join
        self._settings = settings
        self.counts = Counts(self.hub)
        self.requests = ServoRequests(
            self.hub, self.base, self._participant, self.lag, before_write={TIMEOUT: self._before_timeout}
        )  # fmt: skip
        self.audit = Audit(store.audit, self.hub)
        self.leases = Leases()
        self.jobs = Jobs(
            lambda job: self.hub.publish(JobChanged(job)), self.base.utc_now, store.jobs,
            {"commissioning": self._resume_commissioning, "plan": self._resume_plan},
        )  # fmt: skip
        self.owed = OwedValues(self.requests, store, self.hub, self.base, lambda uid: self.fleet.find(uid))
        self.compute = settings.compute
        self.services = HostServices(
            self.requests, self.hub, self.base, self.audit, self.leases, self.jobs, self.owed
        )  # fmt: skip
        self.history = History(store, self.audit)
        self.profiles = Profiles(store, catalog, self.audit)
        self.telemetry = TelemetryCollector(
            self.hub, self.base, lambda uid: self.fleet.find(uid), minutes=settings.telemetry_minutes
        )
        self.drift = DriftDetector(store.servos, self.hub, self.audit)
        self.position_units = PositionUnits(
            self.requests, self.hub, self.base, store.settings, self.audit, settings.position_unit
        )  # fmt: skip
        self.fleet = Fleet(
            catalog, self.requests, self.hub, self.base, RomKnowledge(store, self.hub, self.base, self.drift),
            self.position_units, lambda node: self.allocating.granted_at(node),
        )  # fmt: skip
        self.lost_values = LostValues(self.hub, self.base, self.fleet.find, store.settings, self.audit)
        self.effects = Effects(catalog, self.hub, self.fleet.find)
        self.faults = Faults(catalog, store, self.hub, self.base, self.fleet.find, self.audit)
        self.allocating = NodeIdTable(
            store, self.hub, self.base, self.fleet.identify_now, own_id=settings.node_id, mode=settings.allocator
        )  # fmt: skip
        self.torque_off = TorqueOffRetries(self.requests, self.hub, self.base, self.fleet)
        self.stop = StopControl(
            self.services, self.fleet, self.torque_off, lambda: self.role, self._under_command
        )  # fmt: skip
        self.stored_torque_off = StoredTorqueOff(store, self.stop, self.torque_off, self.base, self.hub)
        self.stored_torque_off.restore_stop()
        self.commanders = Commanders(self.hub, self.base, self.fleet.all, self.fleet.actuators)
        self.verify_outputs = VerifyOutputs(self.base.now)
        self.motion = Motion(
            self.services, self.stop, self.torque_off, self.commanders, lambda uid: self.streams.commands(uid)
        )  # fmt: skip
        self.turn_count = TurnCount(self.hub, self.fleet.find)
        self.bursts = Bursts(self.services, self.motion, self.fleet.all)
        self.setpoints = SetpointRunner(self.hub, self.base)
        self.streams = Streams(
            self.services, self.bursts, self.setpoints, lambda: sum(one.online for one in self.fleet.all())
        )
        self.jogs = Jogs(self.services, self.motion, self.setpoints)
        self.holds = Holds(self.services, self.motion, self.setpoints, self.jogs.end)
        self.claims = Claims(
            self.fleet.all, store, lambda: None if self.connection is None else self.connection.directory, self.base,
            own_id=settings.node_id,
        )  # fmt: skip
        follow = RestartFollower(self.services, self.stop, self.fleet)
        self.restarting = Restarting(
            self.services, self.motion, follow, self.history, self.claims, self.stored_torque_off
        )  # fmt: skip
        self.changes = Changes(self.services, self.motion, self.history, self.claims, self.restarting)
        self.profile_jobs = ProfileJobs(self.services, self.profiles, self.changes, self.restarting, self.fleet)
        self.matrix = Matrix(self.services, self.fleet, self.changes, self.restarting)
        self.motion_control = MotionControl(self.services, self.motion)
        self.wiggle = Identify(self.services, self.motion_control, self.motion, self.setpoints)
        self.restore_output_jobs = RestoreOutputJobs(self.services, self.motion, self.stop, self.fleet, follow)
        writer = CommissionWriter(self.services, self.fleet, self.changes, self.restarting)
        parking = IdParking(writer, self.fleet, self.claims, self.allocating, store.allocations)
        steps = CommissionSteps(
            self.services, writer, parking, self.fleet, self.profiles, self.wiggle, self.set_label
        )  # fmt: skip
        self.commissioning_jobs = CommissioningJobs(
            self.services, self.fleet, self.stop, self.profiles, self.claims, writer, steps
        )  # fmt: skip
        planned = PlanSteps(
            self.services, self.motion, self.jogs, self.motion_control, self.profiles, self.changes,
            self.stored_torque_off,
        )  # fmt: skip
        self.plan_jobs = PlanJobs(
            self.services, self.fleet, self.motion, self.motion_control, self.profiles, self.changes, planned
        )  # fmt: skip
        self.sides = Sides(catalog, self.fleet, store, self.profiles)
        self.restoring = Restoring(self.requests, self.changes)
        self.watch = BusWatch(self.hub, self.base, self.fleet, self.motion, self._bus_back)
        self.polling = Polling(self.requests, self.base, settings.poll_budget, LineBudget(self._port), self._watched)
        self.activities = Activities(self.hub, self.base, self.polling, self.fleet.find, self.motion.is_commanded)
        self.doctor = Doctor(
            self.base.now, self.fleet.all,
            ServerRecord(store, self.hub, self.base, self.lag, settings.data_folder, settings.view_error),
        )  # fmt: skip
        self.hub.subscribe(self._on_seen, ServoSeen)
        self.hub.subscribe(lambda read: self.polling.begin(self.fleet.get(read.uid)), ServoRead)
        self.tap = FrameTap()
        """All frames of the connected bus."""
        self.monitor = BusMonitor(self.tap, self.base, lambda: TransferText(catalog, self.fleet.all))
        self.recorder = Recorder(
            self.services, tap=self.tap, fleet=self.fleet, commanders=self.commanders, stop=self.stop, port=self._port,
            builder=RecordingBuilder(self.base, catalog, self.telemetry, settings.node_id),
        )  # fmt: skip
        """Flight recorder. Records after `begin`."""
        self.site = Site(settings.url, store, self.hub, self.base, self.status)
        store.on_changed(self._on_shared_changed)
        self._switching = asyncio.Lock()
        self._ticker = asyncio.get_running_loop().create_task(self._tick())

    @property
    def role(self) -> ConnectionRole:
        """Role on the connected bus; host without one."""
        return ConnectionRole.HOST if self.connection is None else self.connection.role

    def status(self) -> BenchStatus:
        """Condition of this bench, for the other benches of its database."""
        connection, online = self.connection, [one for one in self.fleet.seen() if one.online]
        port = NO_PORT if connection is None else connection.port
        return BenchStatus(
            bus=port.address or None,
            bus_state=port.state.value,
            role=None if connection is None else connection.role.value,
            servos_online=len(online),
            servos_total=len(self.fleet.memory.here()),
            faults=sum(bool(one.raw("fault_warning") or one.raw("fault_failure")) for one in online),
            bus_load_pct=None if connection is None else round(connection.load_pct, 2),
            holder=self.leases.holders(self.base.now()) or None,
            torque_stopped=self.stop.latched,
        )

    async def connect(
        self, address: str, bitrate: int, role: ConnectionRole | None = ConnectionRole.HOST
    ) -> Connection:
        """Open an adapter and join its bus. Raises PortOpenFailed; the old bus stays until the new one is open.

        `role` None: listen first, then join as guest if another node allocates node IDs or commands servos, otherwise
        as host.

        If the adapter is already connected, it is closed first, because most cannot be opened twice.
        """
        async with self._switching:
            if self.connection is not None and same_device(self.connection.port.address, address):
                await self._leave()
            try:
                observing = {"listen_only": True} if role is ConnectionRole.OBSERVER else {}
                port = await self._open_port(address, bitrate, **observing)
            except PortError as error:
                self.doctor.could_not_open(address, error)
                raise
            try:
                await self._leave()
                await self._before_join(address)
            except BaseException:
                await port.close()
                raise
            return await self._join_as(port, role)

    async def attach(self, port: CanPort, role: ConnectionRole | None = ConnectionRole.HOST) -> Connection:
        """Join the bus of an existing port, which may be waiting for its adapter. `role` as for `connect`."""
        async with self._switching:
            try:
                await self._leave()
            except BaseException:
                await port.close()
                raise
            return await self._join_as(port, role)

    async def _join_as(self, port: CanPort, role: ConnectionRole | None) -> Connection:
        """Join with this role, or listen first and decide."""
        if role is not None or port.address.startswith(REPLAYS):
            return await self._join(port, role or ConnectionRole.HOST, None)
        try:
            heard = await listen(port) if port.state not in GONE else Heard()
        except BaseException:
            await port.close()
            raise
        return await self._join(port, heard.role, heard.reason)

    async def _join(self, port: CanPort, role: ConnectionRole, reason: Note | None) -> Connection:
        own = self._settings
        writable = frozenset(row.name for row in self.catalog.parameters.values() if row.writable)
        participant = Participant(
            GuardedPort(port, writable=writable, role=role), node_id=own.node_id, name="org.hornbill",
            unique_id=own.unique_id, software_version=SoftwareVersion(*own.version),
        )  # fmt: skip
        try:
            directory = self.fleet.attach(participant)
            participant.subscribe(ArrayCommand, self.activities.on_array_command)
            participant.subscribe(ArrayCommand, self.commanders.on_array_command)
            participant.subscribe(ArrayCommand, self.verify_outputs.on_array_command)
            serve = role is ConnectionRole.HOST and not port.address.startswith(REPLAYS)
            allocator = self.allocating.join(participant, directory, serve=serve)
            self.requests.read_interval_s = READ_FRAMES / GUEST_FPS if role is ConnectionRole.GUEST else 0.0
            if role is ConnectionRole.OBSERVER:
                self._identify_passively(participant, directory)
            self.connection = connection = Connection(port, participant, allocator, directory, role, reason)
            self.tap.attach(participant)
            if isinstance(port, RecordedPort) and port.about is not None:
                self.telemetry.set_aside()
                replaying = Replaying.of(port.about, self.fleet, self.requests, self.base)
                participant.on_frames.append(replaying.receive)
            self.doctor.follow(port, participant, allocator, directory)
            participant.start()
            self.watch.begin(port)
        except BaseException:
            await self._part(port, participant)
            raise
        return connection

    def _identify_passively(self, participant: Participant, directory: Directory) -> None:
        """Identify servos from responses to other nodes, and request nothing."""
        identification = PassiveIdentification(
            self.catalog, directory, self.fleet, self.requests, self.base, self.store.servos.get
        )  # fmt: skip
        self.requests.silent = True
        self.fleet.on_unidentified.append(identification.check)
        participant.on_frames.append(identification.receive)

    async def _part(self, port: CanPort, participant: Participant) -> None:
        """Undo a complete or partial join, and close the port."""
        self.connection = None
        self.requests.silent, self.requests.read_interval_s = False, 0.0
        try:
            self.doctor.leave()
            self.tap.detach()
            self.watch.end()
            self.allocating.leave()
            self.commanders.leave()
            self.verify_outputs.end()
            await participant.close()
            await self.fleet.detach()
            self.telemetry.restore()
        finally:
            await port.close()

    async def disconnect(self) -> None:
        """Turn torque off on commanded servos, then leave the bus. Idempotent."""
        async with self._switching:
            await self._leave()

    async def _leave(self) -> None:
        connection = self.connection
        if connection is None:
            return
        with self.motion.leaving_bus():
            await self.motion.leave()
            self.connection = None
        await self._part(connection.port, connection.participant)
        self.hub.publish(BusChanged())
        address = connection.port.address
        self.hub.publish(
            LogEvent("notice", "disconnected", f"Disconnected from {address}.", params={"address": address})
        )

    async def close(self) -> None:
        """Turn torque off on commanded servos, then end everything."""
        self._ticker.cancel()
        await self.jobs.close()
        await self.owed.close()
        await self.setpoints.close()
        await self.polling.close()
        await self.position_units.close()
        await self.disconnect()  # before stop ends, which repeats torque off until all servos have acknowledged
        await self.motion_control.close()
        await self.torque_off.close()
        await self.stored_torque_off.close()
        await self.recorder.close()
        await self.audit.close()
        self.doctor.of_server.close()
        await asyncio.gather(self._ticker, return_exceptions=True)

    def _participant(self) -> Participant | None:
        return None if self.connection is None else self.connection.participant

    async def _before_timeout(self, servo: Servo, raw: Raw) -> None:
        await self.motion.keeping_alive.before_timeout(servo, raw)

    def _resume_commissioning(self, job: RunningJob) -> Work:
        return self.commissioning_jobs.resumer(job)

    def _resume_plan(self, job: RunningJob) -> Work:
        return self.plan_jobs.resumer(job)

    def _watched(self) -> bool:
        return self._settings.watched() or bool(self.leases.valid(self.base.now()))

    def _under_command(self) -> set[Uid]:
        return self.motion.own()

    def _port(self) -> CanPort | None:
        return None if self.connection is None else self.connection.port

    def connected(self) -> Connection:
        """The connection. Raises BusDisconnected if there is none or the adapter is lost."""
        if self.connection is None:
            raise BusDisconnected("No bus is connected. Connect an adapter first.", cause="no_bus")
        port = self.connection.port
        if port.state in GONE:
            if port.trouble is not None:
                raise BusDisconnected(port.trouble.detail, **port.trouble.facts)
            text = f"The adapter {port.address} is lost. Check its cable."
            raise BusDisconnected(text, cause="adapter_lost", address=port.address)
        return self.connection

    def lease_changed(self) -> None:
        """Publish a change of motion control."""
        self.hub.publish(LeaseChanged())

    async def set_label(self, servo: Servo, label: str, *, by: str, job: str | None = None) -> None:
        """Set and store the nickname of a servo. `by`: client, for the audit."""
        if servo.recorded:
            raise BusReadOnly(
                f"{servo.title} is part of a recording. Connect its bus to change its label.",
                cause="label_of_recorded_servo",
                servo=servo.title,
            )
        before, label = servo.label, label.strip()
        await self.store.run(self.store.servos.set_label, servo.uid, label)
        servo.label = label
        outcome = "unchanged" if servo.label == before else "applied"
        self.audit.note(
            NewAuditEntry(by, "label", outcome, servo.uid, before=before, requested=label, after=servo.label, job=job)
        )
        self.hub.publish(ServoChanged(servo.uid))

    async def set_notes(self, servo: StoredServo, notes: str, *, by: str) -> None:
        """Set and store the users' notes on a servo. `by`: client, for the audit."""
        notes = notes.strip()
        await self.store.run(self.store.servos.set_notes, servo.uid, notes)
        outcome = "unchanged" if notes == servo.notes else "applied"
        self.audit.note(
            NewAuditEntry(by, "notes", outcome, servo.uid, before=servo.notes, requested=notes, after=notes)
        )

    def _on_seen(self, seen: ServoSeen) -> None:
        """Write a pending torque off before anything is read from the servo."""
        if self.requests.silent:
            return
        servo = self.fleet.get(seen.uid)
        self.stop.on_arrival(servo)
        self.stored_torque_off.on_arrival(servo)

    def _bus_back(self) -> None:
        """Listen again before allocating, because other nodes may have joined while the bus was lost."""
        if self.connection is not None:
            self.connection.allocator.listening_since = self.connection.participant.clock()

    def _on_shared_changed(self, table: str) -> None:
        """Show what another bench changed."""
        if table == "servos":
            self.fleet.refresh_stored()
        elif table == "faults":
            self.faults.refresh_stored()

    def _note_event(self, change: Change) -> None:
        if isinstance(change, LogEvent):
            self.events.append((self.base.utc_now(), change))

    def _follow_clock(self) -> None:
        if (step := self.base.follow()) != 0:
            log.warning("The computer's clock jumped by %+.1f s: it was set, or the computer was suspended", step)

    def _follow_reach(self) -> None:
        """Publish a change of the servos that Stop reaches as guest."""
        reaches = frozenset(self.stop.own()) if self.role is ConnectionRole.GUEST else frozenset[Uid]()
        if reaches != self._reaches:
            self._reaches = reaches
            self.hub.publish(StopChanged())

    async def _tick(self) -> None:
        rates = Rates()
        while True:
            due = self.base.now() + TICK_S
            await asyncio.sleep(TICK_S)
            now = self.base.now()
            self.lag.add(now, now - due)
            for part in (
                self.watch.check,
                self.motion_control.tick,
                self.activities.tick,
                self.commanders.tick,
                self.verify_outputs.tick,
                lambda now=now: self.fleet.tick(now, self.lag, bus_gone=self.watch.gone),
                lambda now=now: self.doctor.tick(now),
                lambda now=now: self.allocating.tick(now),
                self._follow_clock,
                self._follow_reach,
            ):
                try:
                    part()
                except Exception:  # the other parts, above all lease expiry, must run anyway
                    log.exception("Tick failed")
            if self.connection is not None and rates.measure(self.connection, now):
                self.hub.publish(BusChanged())
