"""Fleet: all servos by unique ID, with arrival, node ID changes, restarts and going offline."""

import asyncio
import contextlib
import logging
import math
from collections.abc import Callable, Iterable
from typing import Literal

from hornbill.domain.note import Note
from hornbill.errors import Busy, HornbillError, NoResponse, PortError, Unknown
from hornbill.node.directory import OFFLINE_AFTER_S, Directory
from hornbill.node.hooks import Hooks
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.servo.device import identification
from hornbill.servo.device.drift import drifted
from hornbill.servo.device.foreign_nodes import ForeignNodes
from hornbill.servo.device.identification import NodeIdentity
from hornbill.servo.device.output import TIMEOUT_TIME
from hornbill.servo.device.position_unit import PositionUnits, to_degrees
from hornbill.servo.device.recent_starts import RecentStarts
from hornbill.servo.device.requests import ServoRequests
from hornbill.servo.device.rom_knowledge import RomKnowledge
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import (
    Hub,
    LogEvent,
    NodeSuspected,
    ReadingChanged,
    Sampled,
    ServoChanged,
    ServoRead,
    ServoSeen,
)
from hornbill.servo.runtime.loop_lag import LAG_S, WINDOW_S, LoopLag
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, NodeId, Uid
from hornbill.wire.messages import ActuatorStatus, ArrayCommand, Mode, NodeStatus
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)

SOFT_START_LIMIT_S = 20.0
"""A soft start that has not ended by then is blocked: 180° at 30 rpm take 1 s."""

SETTLES_S = 0.08
"""A horn near 0° for this long has ended its soft start. The servo detects the end itself, not when we do."""

TIMEOUT_LATE_S = 0.2
"""Delay after the timeout (0x27), and then the interval, of checks of a soft start that has not reached 0°."""

SUSPENDED_S = 3.0
"""Difference by which uptimes in whole seconds show that time passed without our clock."""

WHOLE_SECOND_S = 1.1
"""Tolerance of an uptime: whole seconds, and some jitter of its message."""

RETRY_S = 1.0

EVERY_SERVO = 255
"""Actuator ID that addresses all servos in an ArrayCommand (table 2-20)."""


class Fleet:
    """Servos on the bus now and before. Takes messages and the time; publishes changes on the hub."""

    def __init__(
        self,
        catalog: Catalog,
        requests: ServoRequests,
        hub: Hub,
        base: TimeBase,
        memory: RomKnowledge,
        units: PositionUnits,
        granted_at: Callable[[int], Instant | None],
    ) -> None:
        """`granted_at` returns when we assigned a node ID on this bus, None if we did not."""
        self.catalog = catalog
        self._requests = requests
        self._hub = hub
        self._base = base
        self.memory = memory
        self._units = units
        self._servos: dict[Uid, Servo] = {}
        self._by_node: dict[int, Servo] = {}
        self._identifying: dict[int, asyncio.Task[None]] = {}
        self._soft_starts: set[asyncio.Task[None]] = set()
        self._just_restarted: set[int] = set()
        self.recent_starts = RecentStarts(base.now, granted_at)
        self._directory = Directory()
        self._foreign = ForeignNodes(base.now)
        self._torque_written: dict[int, int] = {}
        self._live: dict[Uid, Servo] | None = None
        self.on_unidentified: Hooks[int] = Hooks()
        """Called as observer with the node ID of a node that is to be identified."""
        for stored in memory.all():
            self._servos[stored.uid] = Servo(stored.uid, catalog, label=stored.label, drift=drifted(stored))

    def all(self) -> list[Servo]:
        """Servos seen since the start, in order of first appearance. Stored servos are included once seen again."""
        return [servo for servo in self._servos.values() if servo.model_number is not None]

    def get(self, uid: str) -> Servo:
        """The servo with this unique ID. Raises Unknown(unknown_servo)."""
        servo = self._servos.get(Uid(uid))
        if servo is None or servo.model_number is None:
            raise Unknown(
                "unknown_servo",
                f"No servo {uid!r} was ever seen.",
                uid=uid,
                cause="servo_never_seen",
            )
        return servo

    def seen(self) -> list[Servo]:
        """Servos seen on a bus of this host, even while those of a recording are shown instead."""
        servos = self._servos if self._live is None else self._live
        return [servo for servo in servos.values() if servo.model_number is not None]

    def show_recorded(self, servos: Iterable[Servo]) -> None:
        """Show these servos instead until the bus is left. They are read-only and not stored."""
        self._live = self._servos
        self._servos = {servo.uid: servo for servo in servos}
        self._by_node = {servo.node_id: servo for servo in self._servos.values() if servo.node_id is not None}
        for servo in (*self._live.values(), *self._servos.values()):
            self._hub.publish(ServoChanged(servo.uid))

    def recorded_on(self, node: int) -> Servo | None:
        """The recorded servo on a node ID."""
        return None if self._live is None else self._by_node.get(node)

    def recorded_moved(self, uid: Uid, node: NodeId) -> None:
        """Note that a recorded servo identified itself on this node ID."""
        servo = None if self._live is None else self._servos.get(uid)
        if servo is None or servo.node_id == node:
            return
        if servo.node_id is not None:
            self._by_node.pop(servo.node_id, None)
        self._assign_node_id(node, uid)
        servo.node_id, self._by_node[node] = node, servo

    def knows(self, uid: str) -> bool:
        """Whether `get` finds it."""
        servo = self.find(Uid(uid))
        return servo is not None and servo.model_number is not None

    def find(self, uid: Uid) -> Servo | None:
        """The servo with this unique ID, even if it has only been restored from the store."""
        return self._servos.get(uid)

    def forget(self, uid: Uid) -> None:
        """Drop an offline servo. Raises Busy if it is online or a job or change is running."""
        servo = self._servos.get(uid)
        if servo is not None and (servo.online or servo.busy is not None or servo.changing.locked()):
            raise Busy(
                f"{servo.title} is online. Switch it off or disconnect it from the bus before removing it.",
                cause="servo_online",
                servo=servo.title,
            )
        if servo is not None:
            servo.reset()
            self._hub.publish(ServoChanged(uid))
        self._units.forget(uid)

    def refresh_stored(self) -> None:
        """Take over names and new servos of other benches."""
        servos = self._servos if self._live is None else self._live
        for stored in self.memory.all():
            servo = servos.get(stored.uid)
            if servo is None:
                servos[stored.uid] = Servo(stored.uid, self.catalog, label=stored.label, drift=drifted(stored))
            elif servo.label != stored.label:
                servo.label = stored.label
                self._hub.publish(ServoChanged(stored.uid))

    def attach(self, participant: Participant) -> Directory:
        """Follow this bus from now on. Returns the directory of its nodes."""
        fixed = (stored.rom.get("node_id", 0) for stored in self.memory.here())
        self._directory = Directory(remembered=(node for node in fixed if node))
        self._foreign = ForeignNodes(self._base.now)
        self._directory.on_restarted.append(lambda record: self._just_restarted.add(record.node_id))
        self._directory.follow(participant)  # first, so that it detects a restart before we process the message
        participant.subscribe(NodeStatus, self._on_node_status)
        participant.subscribe(ActuatorStatus, self._on_actuator_status)
        participant.subscribe(ArrayCommand, self._on_array_command)
        return self._directory

    def _on_node_status(self, transfer: Transfer, status: NodeStatus) -> None:
        """Process a NodeStatus (1 Hz per node): presence, restarts and new nodes."""
        node, now = transfer.source, transfer.at
        if not node:
            return
        servo = self._by_node.get(node)
        restarted = node in self._just_restarted or self._restarted_unseen(servo, status, now)
        self._just_restarted.discard(node)
        if self._live is not None:
            if servo is not None:
                self._on_recorded_status(servo, transfer.at, status, restarted=restarted)
            return
        if servo is not None and servo.online and not restarted:
            before = servo.status
            servo.status, servo.status_at = status, now
            if before is None or (before.health, before.mode) != (status.health, status.mode):
                self._hub.publish(ServoChanged(servo.uid))
            if servo.identified and self._directory.unique_id_at(node) is not None:
                return
        # new, restarted or back online: another node may have this ID now, so identify it again
        if restarted and servo is not None:
            self._on_restart(servo, status, now)
        self.recent_starts.on_status(node, status.uptime_sec, now, restarted=restarted)
        if self._requests.silent:
            self.on_unidentified.notify(node)
        elif node not in self._identifying and self._foreign.due(self._directory.records[node]):
            self._identifying[node] = asyncio.get_running_loop().create_task(self._arrive(NodeId(node)))

    def identify_passively(self, node: NodeId, identity: NodeIdentity) -> Servo:
        """The servo on a node ID, identified from responses to other nodes. Its unread rows stay unknown."""
        servo = self.online_on(node)
        if servo is not None and servo.uid == identity.uid and servo.identified:
            identification.apply(servo, identity)
            self._hub.publish(ServoChanged(servo.uid))
            return servo
        status = self._foreign.actuator(node)
        servo = self._register(node, identity)
        servo.broadcast_id = servo.broadcast_id if status is None else status.actuator_id
        servo.identified = True
        self.memory.recall(servo)
        self.recent_starts.remove(node)
        self._publish_all(servo)
        params: dict[str, object] = {"servo": servo.title, "node_id": node}
        self._hub.publish(LogEvent("info", "ready", f"{servo.title} is on node ID {node}.", servo.uid, params))
        return servo

    def online_on(self, node: int) -> Servo | None:
        """The online servo on a node ID."""
        servo = self._by_node.get(node)
        return servo if servo is not None and servo.online else None

    def resident(self, node: int, uid: Uid) -> None:
        """Note the unique ID that responded on a node ID. Another servo that used it goes offline."""
        self._assign_node_id(node, uid)

    def actuator(self, node: int) -> ActuatorStatus | None:
        """The last Status of an actuator that is not identified. None if it has broadcast none recently."""
        return None if self.kind(node) == "servo" else self._foreign.actuator(node)

    def actuators(self) -> dict[int, int]:
        """Actuator IDs of nodes that broadcast Status and are not identified, by node ID."""
        return self._foreign.actuators()

    def _restarted_unseen(self, servo: Servo | None, status: NodeStatus, at: Instant) -> bool:
        """Whether an uptime ahead of our clock shows that the servo restarted while this computer was suspended."""
        before, since = (None, None) if servo is None else (servo.status, servo.status_at)
        if servo is None or not servo.online or before is None or since is None or self._live is not None:
            return False
        gained = status.uptime_sec - before.uptime_sec
        return gained > at - since + SUSPENDED_S and gained < self._away(since, at) - SUSPENDED_S

    def _restarted_away(self, servo: Servo, status: NodeStatus, at: Instant) -> bool:
        """Whether its uptime is shorter than its absence, so that it restarted while it was offline."""
        before, since = servo.status, servo.status_at
        if before is None or since is None:
            return False
        away = self._away(since, at)
        return status.uptime_sec < away and status.uptime_sec - before.uptime_sec + WHOLE_SECOND_S < away

    def _away(self, since: Instant, until: Instant) -> float:
        """Time between two instants, s, including time in which this computer was suspended."""
        self._base.follow()
        now = self._base.now()
        return max(until - since, self._base.utc(now) - self._base.utc(since) - (now - until))

    def _on_recorded_status(self, servo: Servo, at: Instant, status: NodeStatus, *, restarted: bool) -> None:
        """Process a recorded NodeStatus. Reads after a recorded restart are in the recording, too."""
        if restarted:
            self._on_restart(servo, status, at)
        servo.status, servo.status_at, servo.online, servo.identified = status, at, True, True
        self._hub.publish(ServoChanged(servo.uid))

    def identify_now(self, node: int) -> None:
        """Identify the node on a node ID now, regardless of earlier attempts without a response."""
        self._foreign.retry_now(node)
        record = self._directory.records.get(node)
        if self._requests.silent:
            return
        if record is not None and node not in self._identifying and self._foreign.due(record):
            self._identifying[node] = asyncio.get_running_loop().create_task(self._arrive(NodeId(node)))

    def _on_actuator_status(self, transfer: Transfer, status: ActuatorStatus) -> None:
        """Process a Status (10 Hz per servo): the angle. These servos do not use its force and speed fields."""
        servo = self._by_node.get(transfer.source)
        if servo is None or not servo.online:
            self._foreign.on_status(transfer.source, status)
            return
        servo.broadcast_id = status.actuator_id
        if not math.isfinite(status.position):
            return
        if self._live is None:
            angle = self._units.on_status(servo, status.position, transfer.at)
        else:  # a recorded servo cannot be read
            angle = to_degrees(servo, status.position)
        if angle is not None:
            servo.angle_deg, servo.angle_at = round(angle, 2), transfer.at
            polled = servo.angle_polled_at
            if polled is None or transfer.at - polled > 0.15:
                self._hub.publish(Sampled(servo.uid, "current_angle", transfer.at, servo.angle_deg))
        # until its unit is known, use the last reading of 0x08
        at, near = (transfer.at, angle) if angle is not None else (servo.angle_polled_at, servo.angle_deg)
        since = servo.soft_start_since
        if since is not None and at is not None and near is not None and at >= since and abs(near) <= 1.0:
            self.near_zero(servo, at)

    def _on_array_command(self, transfer: Transfer, message: ArrayCommand) -> None:
        """Process an ArrayCommand of another node: the timeout of the servos it addresses restarts (section 4.19)."""
        ids = {one.actuator_id for one in message.commands}
        for servo in self._by_node.values():
            if servo.servo_id in ids or EVERY_SERVO in ids:
                servo.output.commanded(transfer.at)

    def tick(self, now: Instant, lag: LoopLag, *, bus_gone: bool = False) -> None:
        """Detect offline servos and timeouts. Call several times a second. No servo events while the bus is lost.

        After a lag, servos are not offline before the frames that arrived meanwhile are processed.
        """
        for node, servo in self._by_node.items():
            if servo.online and lag.last_s < LAG_S and not self._directory.is_online(node, now):
                servo.online = False
                self._hub.publish(ServoChanged(servo.uid))
                if servo.busy is None and not bus_gone:
                    self._hub.publish(_offline(servo, lag.worst_s(now - WINDOW_S)))
            row = None if servo.output.commanded_at is None else servo.registers.get(TIMEOUT_TIME)
            timeout_ms = None if row is None or row.at is None else row.raw
            if timeout_ms is not None and servo.output.check_timeout(now, timeout_ms / 1000):
                self._hub.publish(ServoChanged(servo.uid))
            since = servo.soft_start_since
            if since is not None and now - since > SOFT_START_LIMIT_S:
                self.soft_start_over(servo, seen=servo.raw("torque_mode") != 0)
        for node in self.suspects():
            self._hub.publish(NodeSuspected(node))

    def suspects(self) -> list[int]:
        """IDs of nodes that broadcast an actuator's Status and are neither known servos nor known foreign nodes."""
        return [node for node in self._foreign.suspects() if self.kind(node) == "unknown"]

    def kind(self, node: int) -> Literal["servo", "foreign", "unknown"]:
        """What is known of the node on a node ID."""
        servo = self._by_node.get(node)
        if servo is not None and servo.online:
            return "servo"
        return "foreign" if self._foreign.is_foreign(node) else "unknown"

    def torque_written(self, node: int) -> None:
        """Note that torque off is about to be written to an unidentified node: RAM no longer shows ROM in 0x20."""
        record = self._directory.records.get(node)
        self._torque_written[node] = 0 if record is None else record.boot_count

    def note(self, node: int) -> Note | None:
        """Why a node is not listed as a servo, for users."""
        return None if self.kind(node) == "servo" else self._foreign.note(node)

    def bus_lost(self) -> None:
        """Note that the bus was lost. The first messages after it is back may be old."""
        self._directory.reception_lost()

    def bus_restored(self) -> None:
        """Note that the bus is back."""
        self._directory.reception_restored(self._base.now())

    def near_zero(self, servo: Servo, at: Instant) -> None:
        """Note that a horn in soft start is within 1° of 0. The second time, soft start has ended."""
        if servo.near_zero_at is None:
            servo.near_zero_at = at
        elif servo.soft_starting and at - servo.near_zero_at >= SETTLES_S:
            self.soft_start_over(servo)

    def soft_start_over(self, servo: Servo, *, seen: bool = True) -> None:
        """End a soft start: the horn is near 0°, or another command ended it (section 4.14).

        Not `seen`: it should have ended. Its temporary values may still be active and say nothing about ROM.
        """
        servo.soft_start_since = None
        for key in servo.soft_start_rows:
            servo.forget(key)  # their readings were temporary values of soft start
        self._hub.publish(ServoChanged(servo.uid))
        node = servo.node_id
        if node is not None and node not in self._identifying and not self._requests.silent:
            self._identifying[node] = asyncio.get_running_loop().create_task(
                self._after_soft_start(servo, node, seen=seen)
            )

    async def detach(self) -> None:
        """Leave the bus: all servos go offline, and pending requests are cancelled."""
        tasks = [*self._identifying.values(), *self._soft_starts]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._identifying.clear()
        self._by_node.clear()
        self.recent_starts.clear()
        self._directory = Directory()
        self._foreign = ForeignNodes(self._base.now)
        self.on_unidentified.clear()
        for servo in self._servos.values():
            servo.online, servo.node_id, servo.soft_start_since = False, None, None
            if servo.model_number is not None:
                self._hub.publish(ServoChanged(servo.uid))
        if self._live is not None:
            self._servos, self._live = self._live, None
            for servo in self._servos.values():
                self._hub.publish(ServoChanged(servo.uid))

    def _on_restart(self, servo: Servo, status: NodeStatus, at: Instant) -> None:
        servo.restarted(_started(status, at))
        self._hub.publish(ServoChanged(servo.uid))
        if servo.busy is None:
            text = f"{servo.title} restarted unexpectedly. Values only in RAM are lost. The horn may soft-start to 0°."
            self._hub.publish(LogEvent("warning", "restarted", text, servo.uid, {"servo": servo.title}))

    async def _arrive(self, node: NodeId) -> None:
        try:
            identity = await identification.identify(
                self._requests, self.catalog, self._directory, self._foreign, node, known=self.kind(node) == "servo"
            )
            if identity is None:
                if self.kind(node) == "servo":  # a known servo may still be starting
                    self._foreign.postpone(node, self._base.now() + RETRY_S)
                return
            servo = self._register(node, identity)
            await identification.read_rows(self._requests, servo)
            if self.recent_starts.has_just_started(node, self._directory.records.get(node)):
                soft = servo.raw("soft_start") == 1 and servo.raw("torque_mode") == 0
                servo.soft_start_since, servo.near_zero_at = self._base.now() if soft else None, None
                identification.learn_rom(servo, soft_start=soft)
                if soft:
                    watch = asyncio.get_running_loop().create_task(self._watch_timeout(servo))
                    self._soft_starts.add(watch)
                    watch.add_done_callback(self._soft_starts.discard)
            else:
                self.memory.recall(servo)
                if servo.output.commanded_at is None and servo.was_commanded:
                    servo.output.commanded(self._base.now())  # at the latest
            servo.identified = True
            self.recent_starts.remove(node)
            self._publish_all(servo)
            params: dict[str, object] = {"servo": servo.title, "node_id": node}
            self._hub.publish(LogEvent("info", "ready", f"{servo.title} is on node ID {node}.", servo.uid, params))
            self._hub.publish(ServoRead(servo.uid))
            self.remember(servo)
        except NoResponse as error:
            log.info("node %d: %s", node, identification.log_text(error))
            self._foreign.postpone(node, self._base.now() + RETRY_S)
            self._check_replaced(node)
        except PortError as error:
            log.debug("node %d: %s", node, error.detail)
        except Exception:  # nothing awaits this task, so it logs the error and retries
            log.exception("node %d could not be identified", node)
            self._foreign.postpone(node, self._base.now() + RETRY_S)
        finally:
            self._identifying.pop(node, None)
            resident = self._directory.unique_id_at(node)
            self._assign_node_id(node, None if resident is None else resident.hex())

    def _check_replaced(self, node: int) -> None:
        """Drop a servo from its node ID if only NodeStatus is received there, except from a boot loader (B16)."""
        servo, now = self._by_node.get(node), self._base.now()
        if servo is None or self._directory.unique_id_at(node) is not None:
            return
        status = self._directory.records[node].status
        broadcasts = servo.angle_at is not None and now - servo.angle_at < OFFLINE_AFTER_S
        if not broadcasts and self._directory.is_online(node, now) and status.mode != Mode.SOFTWARE_UPDATE:
            self._assign_node_id(node, "")

    def _assign_node_id(self, node: int, uid: str | None) -> None:
        """Assign a node ID to `uid` (None: unknown). Another servo that used it goes offline."""
        servo = self._by_node.get(node)
        if servo is None or uid is None or uid == servo.uid:
            return
        del self._by_node[node]
        if servo.online and servo.busy is None:
            text = f"{servo.title} went offline: another node uses its node ID {node}."
            self._hub.publish(LogEvent("warning", "offline", text, servo.uid, {"servo": servo.title, "node_id": node}))
        servo.node_id, servo.online = None, False
        self._hub.publish(ServoChanged(servo.uid))

    def _register(self, node: NodeId, identity: NodeIdentity) -> Servo:
        servo = self._servos.setdefault(identity.uid, Servo(identity.uid, self.catalog))
        record = self._directory.records.get(node)
        started = float("-inf") if record is None else _started(record.status, record.status_at)
        if servo.node_id is not None and servo.node_id != node:
            self._by_node.pop(servo.node_id, None)
            servo.restarted(started)
        elif not servo.online:
            servo.identified = False
            servo.invalidate_readings()
            if record is not None and self._restarted_away(servo, record.status, record.status_at):
                servo.restarted(started)
        servo.node_id = node
        servo.online = True
        if record is not None:
            servo.status, servo.status_at = record.status, record.status_at
        self._assign_node_id(node, servo.uid)
        self._by_node[node] = servo
        self._foreign.forget(node)
        identification.apply(servo, identity)
        self._units.on_arrival(servo)
        if record is not None and self._torque_written.pop(node, None) == record.boot_count:
            servo.note_write("torque_mode", None, self._base.now())
        self._hub.publish(ServoChanged(servo.uid))
        self._hub.publish(ServoSeen(servo.uid))
        return servo

    async def _watch_timeout(self, servo: Servo) -> None:
        """Detect the end of a soft start by the servo's timeout, which leaves the horn where it is (4.14)."""
        since = servo.soft_start_since
        if not servo.raw("timeout_action"):
            return
        await asyncio.sleep((servo.raw("timeout_time") or 0) / 1000)
        while servo.soft_start_since == since:
            await asyncio.sleep(TIMEOUT_LATE_S)
            with contextlib.suppress(HornbillError):
                over = await identification.soft_start_timed_out(self._requests, servo)
                if over and servo.soft_start_since == since:
                    self.soft_start_over(servo)

    async def _after_soft_start(self, servo: Servo, node: int, *, seen: bool) -> None:
        try:
            await identification.learn_after_soft_start(self._requests, servo, ended=seen)
            self.remember(servo)
            self._publish_all(servo)
        except HornbillError as error:
            log.info("%s: after soft start: %s", servo.title, error.detail)
        finally:
            self._identifying.pop(node, None)

    def remember(self, servo: Servo) -> None:
        """Store what is known of a servo and flag differences from before. Never raises."""
        self.memory.remember(servo)

    def _publish_all(self, servo: Servo) -> None:
        for key in servo.registers:
            self._hub.publish(ReadingChanged(servo.uid, key))
        self._hub.publish(ServoChanged(servo.uid))


def _started(status: NodeStatus, at: Instant) -> Instant:
    """Earliest time at which a node can have started, from its uptime of whole seconds at `at`."""
    return at - status.uptime_sec - 1


def _offline(servo: Servo, lag_s: float) -> LogEvent:
    """Event for a servo that is silent. `lag_s`: recent lag of this computer, s, which may be the reason."""
    text, params = f"{servo.title} went offline.", dict[str, object](servo=servo.title)
    if lag_s:
        text += f" This computer was busy: hornbill ran up to {lag_s:.2f} s late, so it may have missed messages."
        params["lag_s"] = round(lag_s, 3)
    return LogEvent("warning", "offline", text, servo.uid, params)
