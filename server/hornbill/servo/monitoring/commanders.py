"""Commanders: the other nodes that command servos by ArrayCommand, with rate, target and start of each stream."""

import math
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from hornbill.errors import CommandedElsewhere
from hornbill.servo.device.fleet import EVERY_SERVO
from hornbill.servo.device.output import STATES
from hornbill.servo.device.position_unit import to_degrees
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.hub import CommandsBegan, Hub, LogEvent, Sampled, ServoChanged
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Uid
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType, unitless_degrees
from hornbill.wire.transfer import Transfer

ACTIVE_S: Final = 1.0
"""A node commands a servo until it has sent no command for this time."""

FORGET_S: Final = 60.0
"""Streams are kept for this time after their last command, to report a gap longer than the timeout (0x27)."""

PERIODS: Final = 100
"""Maximum number of periods over which the rate is averaged."""

PUBLISH_S: Final = 0.5
"""Interval at which a commanded servo is published, because its target changes with every command."""


@dataclass(slots=True, eq=False)
class CommandStream:
    """Commands of one node for one servo, None if it is not identified.

    `command_type` is a CommandType or any other byte of table 2-21.
    """

    servo: Servo | None
    node_id: int
    command_type: CommandType | int
    value: float
    since: Instant
    times: deque[Instant] = field(default_factory=lambda: deque[Instant](maxlen=PERIODS + 1))
    gap_reported: bool = False

    @property
    def at(self) -> Instant:
        """Time of the last command."""
        return self.times[-1]

    @property
    def rate_hz(self) -> float | None:
        """Average rate over the last PERIODS commands. None for a single command."""
        took = self.times[-1] - self.times[0]
        return (len(self.times) - 1) / took if took > 0 else None

    @property
    def degrees(self) -> float | None:
        """Commanded angle, ° in steps of 0.1° as the servo rounds it. None for speed, torque and unknown types."""
        if not math.isfinite(self.value):
            return None
        match self.command_type:
            case CommandType.UNITLESS:
                return unitless_degrees(self.value)
            case CommandType.POSITION if self.servo is not None:
                return round(to_degrees(self.servo, self.value), 1)
            case _:
                return None


@dataclass(slots=True)
class Gap:
    """A gap of commands longer than the timeout (0x27). `at`: last command before it; `gap_s`: None while it lasts."""

    node_id: int
    at: Instant
    gap_s: float | None = None
    torque_pct: float | None = None
    """Last torque read in the gap after the timeout, %."""


class Commanders:
    """Follows every ArrayCommand of other nodes. Reads and sends nothing."""

    def __init__(
        self,
        hub: Hub,
        base: TimeBase,
        servos: Callable[[], Iterable[Servo]],
        unidentified: Callable[[], Mapping[int, int]] = dict,
    ) -> None:
        """`servos` returns the servos of the connected bus; `unidentified`, actuator IDs of other nodes by node ID."""
        self._hub = hub
        self._base = base
        self._servos = servos
        self._unidentified = unidentified
        self._streams: defaultdict[Uid | int, dict[int, CommandStream]] = defaultdict(dict)
        """By unique ID, or node ID of an unidentified actuator, then by the node that commands it."""
        self._gaps: dict[Uid, Gap] = {}
        self.gaps: Counter[Uid] = Counter()
        """Number of gaps longer than the timeout (0x27) since the start, by servo."""
        self._publish_at: Instant = base.now()
        hub.subscribe(self._on_sample, Sampled)

    def last_gap(self, uid: Uid) -> Gap | None:
        """The last gap of commands for a servo that was longer than its timeout. None if there was none."""
        return self._gaps.get(uid)

    def of(self, which: Uid | int) -> list[CommandStream]:
        """Streams that command a servo, or an unidentified actuator by its node ID, now, oldest first."""
        now = self._base.now()
        return [one for one in self._streams.get(which, {}).values() if now - one.at <= ACTIVE_S]

    def check(self, servo: Servo) -> None:
        """Raises CommandedElsewhere while another node commands a servo."""
        for one in self.of(servo.uid):
            rate = "" if one.rate_hz is None else f" at {one.rate_hz:.0f} Hz"
            raise CommandedElsewhere(
                f"{servo.title} is commanded by node {one.node_id}{rate}. Stop its commands first.",
                cause="commanded_elsewhere",
                servo=servo.title,
                node_id=one.node_id,
                rate_hz=round(one.rate_hz or 0.0, 1),
            )

    def on_array_command(self, transfer: Transfer, message: ArrayCommand) -> None:
        """Process an ArrayCommand of another node."""
        entries = {one.actuator_id: one for one in message.commands}
        everyone = entries.get(EVERY_SERVO)
        for servo in self._servos():
            entry = entries.get(servo.servo_id or 0, everyone)
            if entry is None or not servo.online or servo.recorded:
                continue
            self._feed(servo.uid, servo, transfer, entry)
        for node, actuator_id in self._unidentified().items():
            entry = entries.get(actuator_id, everyone)
            if entry is not None:
                self._feed(node, None, transfer, entry)

    def _feed(self, which: Uid | int, servo: Servo | None, transfer: Transfer, entry: ActuatorCommand) -> None:
        """Add one command to its stream, or begin a stream."""
        streams = self._streams[which]
        stream = streams.get(transfer.source)
        if stream is not None and transfer.at - stream.at <= ACTIVE_S:
            stream.command_type, stream.value = entry.command_type, entry.command_value
            stream.times.append(transfer.at)
            return
        streams[transfer.source] = stream = CommandStream(
            servo, transfer.source, entry.command_type, entry.command_value, transfer.at
        )
        if servo is None:
            stream.times.append(transfer.at)
            return
        # from before it was identified
        before = self._streams[servo.node_id or 0].pop(transfer.source, None)
        if before is not None and transfer.at - before.at <= ACTIVE_S:
            stream.since, stream.times = before.since, before.times
        stream.times.append(transfer.at)
        gap = self._gaps.get(servo.uid)
        if gap is not None and gap.gap_s is None:
            gap.gap_s = transfer.at - gap.at
        self._begin(stream, servo)

    def tick(self) -> None:
        """Detect ended streams and gaps. Call several times a second."""
        now = self._base.now()
        changed = now >= self._publish_at
        if changed:
            self._publish_at = now + PUBLISH_S
        for streams in self._streams.values():
            for one in list(streams.values()):
                silent = now - one.at
                if one.servo is not None:
                    if not one.gap_reported:
                        self._check_gap(one, one.servo, silent)
                    if silent <= ACTIVE_S + PUBLISH_S and changed:
                        self._hub.publish(ServoChanged(one.servo.uid))
                if silent > FORGET_S:
                    del streams[one.node_id]

    def leave(self) -> None:
        """Forget all streams of the bus that is being left."""
        self._streams.clear()

    def _begin(self, stream: CommandStream, servo: Servo) -> None:
        title = servo.title
        params: dict[str, object] = {"servo": title, "node_id": stream.node_id}
        text = f"Node {stream.node_id} commands {title}."
        self._hub.publish(LogEvent("info", "commanded_elsewhere", text, servo.uid, params))
        self._hub.publish(CommandsBegan(servo.uid, stream.node_id))
        self._hub.publish(ServoChanged(servo.uid))

    def _on_sample(self, sample: Sampled) -> None:
        gap = self._gaps.get(sample.uid) if sample.key == "current_torque" else None
        if gap is not None and gap.gap_s is None:
            gap.torque_pct = sample.value

    def _check_gap(self, stream: CommandStream, servo: Servo, silent_s: float) -> None:
        """Report a gap longer than the timeout (0x27), and what the servo does then (0x26)."""
        timeout_ms, action = servo.raw("timeout_time"), servo.raw("timeout_action")
        if timeout_ms is None or action is None or silent_s <= timeout_ms / 1000 or not servo.online:
            return
        stream.gap_reported = True
        if any(one is not stream and self._base.now() - one.at <= timeout_ms / 1000 for one in self.of(servo.uid)):
            return  # another node still commands it
        self.gaps[servo.uid] += 1
        self._gaps[servo.uid] = Gap(stream.node_id, stream.at)
        does = {0: "The servo holds its last command", 1: "The servo switches its output off", 2: "The servo brakes"}
        text = (
            f"Node {stream.node_id} stopped commanding {servo.title} for longer than its timeout (0x27) of "
            f"{timeout_ms / 1000:g} s. {does.get(action, 'The servo acts as set')} (0x26)."
        )
        params: dict[str, object] = {
            "servo": servo.title, "node_id": stream.node_id, "timeout_s": timeout_ms / 1000,
            "action": STATES.get(action, "unknown"),
        }  # fmt: skip
        self._hub.publish(LogEvent("warning", "command_lost", text, servo.uid, params))
