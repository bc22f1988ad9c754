"""Owns Fleet: every servo by unique id, as they arrive, change node ids, restart and go silent."""

import asyncio
import logging
import math
from collections.abc import Callable
from typing import Literal

from hornbill.errors import HornbillError, NoAnswer, PortError, Unknown
from hornbill.node.directory import OFFLINE_AFTER_S, Directory
from hornbill.node.participant import Participant
from hornbill.schema.catalog import Catalog
from hornbill.servo import identification
from hornbill.servo.asking import Asker
from hornbill.servo.hub import Happened, Hub, ReadingChanged, Sampled, ServoChanged
from hornbill.servo.identification import Identity
from hornbill.servo.servo import SOFT_START_ROWS, Servo
from hornbill.servo.strangers import Strangers
from hornbill.servo.timebase import TimeBase
from hornbill.store.servos import ServoFacts, Servos
from hornbill.units import Instant, NodeId, Uid
from hornbill.wire.messages import ActuatorStatus, Mode, NodeStatus
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)

SOFT_START_LIMIT_S = 20.0
"""A soft start that is not over by then is blocked: 180 degrees at 30 rpm take 1 s."""

RETRY_S = 1.0
FRESH_UPTIME_S = 2
"""A node first heard with at most this uptime has just started, so nobody has written to it yet."""

RESTARTED_UPTIME_S = 5
"""The same for one whose restart was noticed, which was heard until then: some of its messages may have been lost."""

DEGREES_PER_UNIT = 100.0
"""Position of uavcan.equipment.actuator.Status read literally: 0.001 per 0.1 degree (errata B1)."""


class Fleet:
    """The servos on the bus and those that were. Feed it messages and the time; it tells the hub."""

    def __init__(
        self,
        catalog: Catalog,
        asker: Asker,
        hub: Hub,
        base: TimeBase,
        inventory: Servos,
    ) -> None:
        self.catalog = catalog
        self._asker = asker
        self._hub = hub
        self._base = base
        self._inventory = inventory
        self._servos: dict[Uid, Servo] = {}
        self._by_node: dict[int, Servo] = {}
        self._asking: dict[int, asyncio.Task[None]] = {}
        self._just_restarted: set[int] = set()
        self._fresh: dict[int, tuple[int, Instant]] = {}
        self._directory = Directory()
        self._strangers = Strangers(base.now)
        self._imposed: dict[int, int] = {}
        self.granted_at: Callable[[int], Instant | None] = lambda _node: None
        """When we gave a node id on this bus, if we did."""
        self.on_sight: Callable[[Servo], None] = lambda _servo: None
        """Called as soon as it is known which servo is on a node id, before its rows are read."""
        self.on_arrival: Callable[[Servo], None] = lambda _servo: None
        """Called when its rows have been read."""
        self.on_suspect: Callable[[int], None] = lambda _node: None
        """Called again and again for every one of `suspects`."""
        for kept in inventory.all():
            self._servos[kept.uid] = Servo(kept.uid, catalog, label=kept.label)

    def all(self) -> list[Servo]:
        """Every servo seen since the start, in the order of first sight; remembered ones only once seen again."""
        return [servo for servo in self._servos.values() if servo.model_number is not None]

    def get(self, uid: str) -> Servo:
        """The servo of that unique id. Raises Unknown(unknown_servo)."""
        servo = self._servos.get(Uid(uid))
        if servo is None or servo.model_number is None:
            raise Unknown("unknown_servo", f"There is no servo {uid!r}. GET /api/v1/servos lists them.", uid=uid)
        return servo

    def knows(self, uid: str) -> bool:
        """Whether `get` would find it."""
        servo = self._servos.get(Uid(uid))
        return servo is not None and servo.model_number is not None

    def attach(self, participant: Participant) -> Directory:
        """Follow this bus from now on; the answer is who lives on it."""
        fixed = (kept.rom.get("node_id", 0) for kept in self._inventory.all())
        self._directory = Directory(remembered=(node for node in fixed if node))
        self._strangers = Strangers(self._base.now)
        self._directory.on_restarted.append(lambda record: self._just_restarted.add(record.node_id))
        self._directory.follow(participant)  # first, so that it knows of a restart before we look
        participant.subscribe(NodeStatus, self._on_node_status)
        participant.subscribe(ActuatorStatus, self._on_actuator_status)
        return self._directory

    def _on_node_status(self, transfer: Transfer, status: NodeStatus) -> None:
        """A NodeStatus (1 Hz a node): presence, restarts, and who is new."""
        node, now = transfer.source, transfer.at
        if not node:
            return
        restarted = node in self._just_restarted
        self._just_restarted.discard(node)
        servo = self._by_node.get(node)
        if servo is not None and servo.online and not restarted:
            before = servo.status
            servo.status, servo.status_at = status, now
            if before is None or (before.health, before.mode) != (status.health, status.mode):
                self._hub.tell(ServoChanged(servo.uid))
            if servo.identified and self._directory.resident(node) is not None:
                return
        # new, restarted, or back from silence: somebody else may sit on this id now, so ask again who it is
        if restarted and servo is not None:
            self._noticed_restart(servo)
        young = status.uptime_sec <= (RESTARTED_UPTIME_S if restarted else FRESH_UPTIME_S)
        if young or self._was_granted(node, now):
            self._fresh.setdefault(node, (status.uptime_sec, now))
        if node not in self._asking and self._strangers.due(self._directory.records[node]):
            self._asking[node] = asyncio.get_running_loop().create_task(self._arrive(NodeId(node)))

    def ask_now(self, node: int) -> None:
        """Somebody needs to know who uses a node id: ask it, however often it stayed silent."""
        self._strangers.hurry(node)
        record = self._directory.records.get(node)
        if record is not None and node not in self._asking and self._strangers.due(record):
            self._asking[node] = asyncio.get_running_loop().create_task(self._arrive(NodeId(node)))

    def _on_actuator_status(self, transfer: Transfer, status: ActuatorStatus) -> None:
        """A Status (10 Hz a servo): the angle. Its force and speed fields are not used by these servos."""
        servo = self._by_node.get(transfer.source)
        if servo is None or not servo.online:
            self._strangers.heard_status(transfer.source)
            return
        if not math.isfinite(status.position):
            return
        servo.angle_deg = round(status.position * DEGREES_PER_UNIT, 2)
        servo.angle_at = transfer.at
        polled = servo.angle_polled_at
        if polled is None or transfer.at - polled > 0.15:
            self._hub.tell(Sampled(servo.uid, "current_angle", transfer.at, servo.angle_deg))
        if servo.soft_start_since is not None and abs(servo.angle_deg) <= 1.0:
            self.soft_start_over(servo)

    def tick(self, now: Instant, *, bus_gone: bool = False) -> None:
        """What silence means; call it several times a second. While the bus is gone nobody is told servo by servo."""
        for node, servo in self._by_node.items():
            if servo.online and not self._directory.is_online(node, now):
                servo.online = False
                self._hub.tell(ServoChanged(servo.uid))
                if servo.busy is None and not bus_gone:
                    self._hub.tell(Happened("warning", "offline", f"{servo.title} went silent.", servo.uid))
            since = servo.soft_start_since
            if since is not None and now - since > SOFT_START_LIMIT_S:
                self.soft_start_over(servo)
        for node in self.suspects():
            self.on_suspect(node)

    def suspects(self) -> list[int]:
        """Node ids that broadcast the Status of an actuator and may be servos: not known as one, nor as foreign."""
        return [node for node in self._strangers.suspects() if self.kind(node) == "unknown"]

    def kind(self, node: int) -> Literal["servo", "foreign", "unknown"]:
        """What is known of who uses a node id now."""
        servo = self._by_node.get(node)
        if servo is not None and servo.online:
            return "servo"
        return "foreign" if self._strangers.is_foreign(node) else "unknown"

    def imposed(self, node: int) -> None:
        """Torque is about to be taken from a node not known as a servo: RAM no longer tells what ROM holds in 0x20."""
        record = self._directory.records.get(node)
        self._imposed[node] = 0 if record is None else record.lives

    def note(self, node: int) -> str | None:
        """Why a node is not taken for a servo, for people."""
        return None if self.kind(node) == "servo" else self._strangers.note(node)

    def bus_lost(self) -> None:
        """Nothing is heard any more; what is heard first when the bus is back may be old."""
        self._directory.go_deaf()

    def bus_back(self) -> None:
        """The bus works again."""
        self._directory.hear_again(self._base.now())

    def soft_start_over(self, servo: Servo) -> None:
        """Soft start ended: near 0 degrees, or another command ended it (section 4.14)."""
        servo.soft_start_since = None
        self._hub.tell(ServoChanged(servo.uid))
        node = servo.node_id
        if node is not None and node not in self._asking:
            self._asking[node] = asyncio.get_running_loop().create_task(self._after_soft_start(servo, node))

    async def detach(self) -> None:
        """The bus went away: nobody is online, and no question waits."""
        tasks = list(self._asking.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        self._asking.clear()
        self._by_node.clear()
        self._fresh.clear()
        self._directory = Directory()
        self._strangers = Strangers(self._base.now)
        for servo in self._servos.values():
            servo.online, servo.node_id, servo.soft_start_since = False, None, None
            if servo.model_number is not None:
                self._hub.tell(ServoChanged(servo.uid))

    def _is_fresh(self, node: int) -> bool:
        """Whether nobody can have written to a node since its start, so that RAM still is what ROM holds.

        A node that had nobody to hear it may first say, all at once, what it said long ago: then its uptime has
        run ahead of our clock since it seemed to start.
        """
        record = self._directory.records.get(node)
        if record is None or node not in self._fresh:
            return False
        uptime, since = self._fresh[node]
        return record.status.uptime_sec - uptime <= self._base.now() - since + 2

    def _was_granted(self, node: int, now: Instant) -> bool:
        granted = self.granted_at(node)
        return granted is not None and now - granted < 2.0

    def _noticed_restart(self, servo: Servo) -> None:
        servo.restarted()
        self._hub.tell(ServoChanged(servo.uid))
        if servo.busy is None:
            text = f"{servo.title} restarted by itself. What was only in RAM is lost; the horn may soft-start to 0°."
            self._hub.tell(Happened("warning", "restarted", text, servo.uid))

    async def _arrive(self, node: NodeId) -> None:
        try:
            identity = await identification.who(
                self._asker, self.catalog, self._directory, self._strangers, node, known=self.kind(node) == "servo"
            )
            if identity is None:
                if self.kind(node) == "servo":  # a known one may be busy with its start
                    self._strangers.wait(node, self._base.now() + RETRY_S)
                return
            servo = self._welcome(node, identity)
            await identification.read_rows(self._asker, servo)
            if self._is_fresh(node):
                soft = servo.raw("soft_start") == 1 and servo.raw("torque_mode") == 0
                servo.soft_start_since = self._base.now() if soft else None
                identification.learn_rom(servo, soft_start=soft)
            else:
                self._recall_rom(servo)
            servo.identified = True
            self._fresh.pop(node, None)
            self._told_all(servo)
            self._hub.tell(Happened("info", "ready", f"{servo.title} is on node {node}.", servo.uid))
            self.on_arrival(servo)
            self.remember(servo)
        except NoAnswer as error:
            log.info("node %d: %s", node, identification.lost(error))
            self._strangers.wait(node, self._base.now() + RETRY_S)
            self._doubt(node)
        except PortError as error:
            log.debug("node %d: %s", node, error.detail)
        except Exception:  # nobody waits for this task: it must say itself what went wrong, and try again
            log.exception("node %d could not be identified", node)
            self._strangers.wait(node, self._base.now() + RETRY_S)
        finally:
            self._asking.pop(node, None)
            resident = self._directory.resident(node)
            self._hand_over(node, None if resident is None else resident.hex())

    def _doubt(self, node: int) -> None:
        """Somebody who only says NodeStatus, where a servo was, is not taken for it; a boot loader's is (B16)."""
        servo, now = self._by_node.get(node), self._base.now()
        if servo is None or self._directory.resident(node) is not None:
            return
        status = self._directory.records[node].status
        broadcasts = servo.angle_at is not None and now - servo.angle_at < OFFLINE_AFTER_S
        if not broadcasts and self._directory.is_online(node, now) and status.mode != Mode.SOFTWARE_UPDATE:
            self._hand_over(node, "")

    def _hand_over(self, node: int, uid: str | None) -> None:
        """A node id is used by `uid` (None: nobody knows): another servo that was there is not any more."""
        servo = self._by_node.get(node)
        if servo is None or uid is None or uid == servo.uid:
            return
        del self._by_node[node]
        if servo.online and servo.busy is None:
            text = f"{servo.title} is gone: another node uses its node id {node}."
            self._hub.tell(Happened("warning", "offline", text, servo.uid))
        servo.node_id, servo.online = None, False
        self._hub.tell(ServoChanged(servo.uid))

    def _welcome(self, node: NodeId, identity: Identity) -> Servo:
        servo = self._servos.setdefault(identity.uid, Servo(identity.uid, self.catalog))
        record = self._directory.records.get(node)
        if servo.node_id is not None and servo.node_id != node:
            self._by_node.pop(servo.node_id, None)
            servo.restarted()
        elif not servo.online:
            servo.identified = False
            servo.forget_readings()
            away = None if record is None or servo.status_at is None else record.heard - servo.status_at
            if record is not None and away is not None and record.status.uptime_sec < away:
                servo.restarted()
        servo.node_id = node
        servo.online = True
        if record is not None:
            servo.status, servo.status_at = record.status, record.heard
        self._hand_over(node, servo.uid)
        self._by_node[node] = servo
        self._strangers.forget(node)
        identification.apply(servo, identity)
        if record is not None and self._imposed.pop(node, None) == record.lives:
            servo.note_write("torque_mode")
        self._hub.tell(ServoChanged(servo.uid))
        self.on_sight(servo)
        return servo

    async def _after_soft_start(self, servo: Servo, node: int) -> None:
        rows = [key for key in SOFT_START_ROWS if key in servo.registers]
        learn = [key for key in rows if servo.registers[key].rom is None]
        try:
            await identification.read_rows(self._asker, servo, rows)
            for key in learn:
                if not servo.registers[key].written and not servo.rom_lost:
                    servo.registers[key].rom = servo.registers[key].raw
            self.remember(servo)
            self._told_all(servo)
        except HornbillError as error:
            log.info("%s: after soft start: %s", servo.title, error.detail)
        finally:
            self._asking.pop(node, None)

    def remember(self, servo: Servo) -> None:
        """Keep what is known of a servo beyond this process: who it is, and what its ROM holds. Never raises."""
        facts = ServoFacts(
            name=servo.name, model=servo.model.name if servo.model else None, model_number=servo.model_number,
            hardware_version=servo.hardware_version, firmware=servo.firmware, serial=servo.serial_number,
            production_date=servo.production_date, node_id=servo.node_id, servo_id=servo.servo_id,
        )  # fmt: skip
        try:
            self._inventory.met(servo.uid, facts)
            self._inventory.keep_rom(servo.uid, servo.rom())
        except Exception:  # a full disk must not keep anybody from watching and stopping this servo
            log.exception("%s could not be kept in the store", servo.title)
            text = f"What is known of {servo.title} could not be stored. Check the data folder and its disk."
            self._hub.tell(Happened("warning", "store_failed", text, servo.uid))

    def _recall_rom(self, servo: Servo) -> None:
        """ROM changes only by a save, and a save restarts the servo: what was known holds while it has run on."""
        kept = self._inventory.get(servo.uid)
        if servo.rom_lost or kept is None or kept.last_seen is None or servo.status is None:
            return
        if servo.status.uptime_sec > self._base.utc_now() - kept.last_seen + 2:
            for key, raw in kept.rom.items():
                if key in servo.registers and servo.registers[key].rom is None:
                    servo.registers[key].rom = raw

    def _told_all(self, servo: Servo) -> None:
        for key in servo.registers:
            self._hub.tell(ReadingChanged(servo.uid, key))
        self._hub.tell(ServoChanged(servo.uid))
