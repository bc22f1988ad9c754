"""The only module that reads, writes and commands servos, with a retry policy per operation."""

import asyncio
from collections import Counter, defaultdict
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeAlias, TypedDict

from hornbill.errors import BusDisconnected, NoResponse, Refused
from hornbill.node.participant import Participant
from hornbill.schema.effect import COMMANDS
from hornbill.schema.parameter import DUMMY, Parameter
from hornbill.servo.device import output
from hornbill.servo.device.permission import check_series, unknown_series
from hornbill.servo.device.servo import Servo
from hornbill.servo.runtime.histogram import Histogram
from hornbill.servo.runtime.hub import Hub, ReadingChanged, Sampled, ServoChanged
from hornbill.servo.runtime.loop_lag import LoopLag
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.units import Instant, Raw
from hornbill.wire.messages import ActuatorCommand, ArrayCommand
from hornbill.wire.services import (
    EMPTY,
    ExecuteOpcodeRequest,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    RestartNodeRequest,
    ValueKind,
    integer,
)


class RequestOptions(TypedDict):
    """Keyword arguments of Participant.request."""

    priority: int
    timeout: float
    tries: int
    urgent: bool


@dataclass(frozen=True)
class RetryPolicy:
    """How a request is sent: CAN priority (0 highest), timeout of each try, and number of tries.

    `kind`: category in the request counters.
    """

    priority: int
    timeout_s: float
    tries: int
    urgent: bool = False
    kind: str = "read"

    @cached_property
    def options(self) -> RequestOptions:
        """Keyword arguments of Participant.request."""
        return {"priority": self.priority, "timeout": self.timeout_s, "tries": self.tries, "urgent": self.urgent}


READ = RetryPolicy(priority=24, timeout_s=0.12, tries=25)
"""A node counts as offline after 3 s of silence; reads are retried until then. With a fifth of all frames lost, 0.41
of the tries of a read by name succeed (one request frame, three response frames): all 25 fail once in 500,000."""
POLL = RetryPolicy(priority=26, timeout_s=0.12, tries=2, kind="poll")
WRITE = RetryPolicy(priority=20, timeout_s=0.12, tries=10, kind="write")
COMMAND = RetryPolicy(priority=17, timeout_s=0.12, tries=1, kind="command")
"""Motion commands are never repeated: a late copy could move the horn after the operator has changed the command. If
the response is missing, the register is read to see whether the command arrived."""
TORQUE = RetryPolicy(priority=16, timeout_s=0.05, tries=4, kind="torque")
STOP = RetryPolicy(priority=16, timeout_s=0.04, tries=10, urgent=True, kind="stop")
"""Torque and stop have the same priority, so both have the same CAN identifier and keep their order on every adapter:
an older "on" can never overtake, or be overtaken by, a newer "off". A response to an earlier try counts: the latency
of an adapter may exceed the timeout of a try."""
ONCE = RetryPolicy(priority=20, timeout_s=0.5, tries=1, kind="action")
"""Save, reset and restart are never repeated: a second copy would reach a servo that is restarting from the first."""

NODE_INFO_READS: Final = 3
"""GetNodeInfo and its response take as many frames as this number of reads: 12 with a name of 20 characters."""

BeforeWrite: TypeAlias = Mapping[str, Callable[[Servo, Raw], Awaitable[None]]]
"""Hooks by parameter key, awaited with the new value before it is written."""

BOUNDS_S = (0.001, 0.002, 0.003, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 3.0)


class ServoRequests:
    """Reads and writes registers through the currently connected participant."""

    def __init__(
        self,
        hub: Hub,
        base: TimeBase,
        participant: Callable[[], Participant | None],
        lag: LoopLag,
        before_write: BeforeWrite,
    ) -> None:
        """`participant` returns our node on the currently connected bus. `lag`: lag of the event loop."""
        self.lag = lag
        self.read_interval_s = 0.0
        """Minimum time between two reads, for a guest. 0: unlimited."""
        self._read_at: Instant = float("-inf")
        self._hub = hub
        self.base = base
        self._participant = participant
        self._before_write = before_write
        self.outcomes: Counter[tuple[str, str]] = Counter()
        """Ended requests by kind and outcome: responded, no_response, failed (cancelled or not sent)."""
        self.refused: Counter[str] = Counter()
        """Responses without the requested value, by kind."""
        self.silent = False
        """As observer: every request is refused, so nothing that repeats by itself should try."""
        self.response_times: defaultdict[str, Histogram] = defaultdict(lambda: Histogram(BOUNDS_S))
        """Time from call to response by kind, including queueing and retries."""

    async def read(self, servo: Servo, parameter: Parameter, policy: RetryPolicy = READ) -> Raw:
        """Read the raw value of one row from RAM and record it. Raises NoResponse, Refused, BusDisconnected.

        If a write of the row is acknowledged meanwhile, the row is read again: a response has the priority of its
        request, so the response to the read may arrive after that to a later, more urgent write.
        """
        while True:
            if self.read_interval_s:
                await self._paced()
            node_id, request, began = _node(servo), GetSetRequest(0, EMPTY, parameter.name), self.base.now()
            try:
                with _Counted(self, node_id, servo, policy):
                    response = await self.connected().request(node_id, request, **policy.options)
            except NoResponse as error:
                error.facts["key"] = parameter.key
                raise
            if not servo.acknowledged_since(parameter.key, began):
                return self._value_of(servo, parameter, response, policy, "read")

    async def write(self, servo: Servo, parameter: Parameter, raw: Raw, policy: RetryPolicy = WRITE) -> Raw:
        """Write one row and return its new value in RAM.

        Raises NoResponse, Refused, BusDisconnected, and NotInThisModel for a servo of an unknown series unless the
        write disables its output.
        """
        if servo.of_unknown_series and not _disables_output(parameter, raw):
            raise unknown_series(servo)
        node_id = _node(servo)  # raises before the write is recorded
        servo.note_write(parameter.key, raw, self.base.now())
        refused = False
        try:
            if (prepare := self._before_write.get(parameter.key)) is not None:
                await prepare(servo, raw)
            with _Counted(self, node_id, servo, policy):
                request = GetSetRequest(0, integer(raw), parameter.name)
                response = await self.connected().request(node_id, request, **policy.options)
            refused = response.value.kind is ValueKind.EMPTY
        except BaseException as error:
            if isinstance(error, NoResponse):
                error.facts["key"] = parameter.key
            self._forget(servo, parameter)  # it may have been carried out anyway
            raise
        finally:
            servo.note_write(parameter.key, raw, self.base.now())  # its last try may have come after a restart
            if not refused and (parameter.key == output.KEY or parameter.key in COMMANDS):
                servo.output.commanded(self.base.now())  # the response may be lost although the command arrived
        return self._value_of(servo, parameter, response, policy, "write")

    async def read_from_node(self, node_id: int, parameter: Parameter, policy: RetryPolicy = READ) -> Raw | None:
        """Read one row of an unidentified node; None if it refuses. Raises NoResponse, BusDisconnected."""
        if self.read_interval_s:
            await self._paced()
        with _Counted(self, node_id, None, policy):
            request = GetSetRequest(0, EMPTY, parameter.name)
            response = await self.connected().request(node_id, request, **policy.options)
        return self._integer_of(response, parameter, policy)

    async def write_to_node(self, node_id: int, parameter: Parameter, raw: Raw, policy: RetryPolicy) -> Raw | None:
        """Write one row of an unidentified node and return its new value; None if it refuses.

        Raises NoResponse, BusDisconnected.
        """
        with _Counted(self, node_id, None, policy):
            request = GetSetRequest(0, integer(raw), parameter.name)
            response = await self.connected().request(node_id, request, **policy.options)
        return self._integer_of(response, parameter, policy)

    async def node_info(self, node_id: int, policy: RetryPolicy = READ) -> GetNodeInfoResponse:
        """Request the identity of a node (uavcan.protocol.GetNodeInfo). Raises NoResponse, BusDisconnected."""
        if self.read_interval_s:
            await self._paced(NODE_INFO_READS)
        with _Counted(self, node_id, None, policy):
            return await self.connected().request(node_id, GetNodeInfoRequest(), **policy.options)

    async def opcode(self, servo: Servo, opcode: int) -> bool:
        """Send SAVE or ERASE once and return the ok flag (table 2-13).

        Raises NoResponse, in which case the servo may have acted anyway, and NotInThisModel for a servo of an unknown
        series.
        """
        check_series(servo)
        node_id = _node(servo)
        with _Counted(self, node_id, servo, ONCE):
            return (await self.connected().request(node_id, ExecuteOpcodeRequest(opcode), **ONCE.options)).ok

    async def restart(self, servo: Servo, magic: int) -> bool:
        """Request a restart once and return the ok flag (table 2-10).

        Raises NoResponse, in which case the servo may have acted anyway, and NotInThisModel for a servo of an unknown
        series.
        """
        check_series(servo)
        node_id = _node(servo)
        with _Counted(self, node_id, servo, ONCE):
            return (await self.connected().request(node_id, RestartNodeRequest(magic), **ONCE.options)).ok

    def burst(self, commands: list[ActuatorCommand], priority: int = COMMAND.priority) -> None:
        """Broadcast one ArrayCommand of at most 15 commands. Raises BusDisconnected."""
        self.connected().broadcast(ArrayCommand(tuple(commands)), priority=priority)

    def observe_response(self, servo: Servo, response: GetSetResponse, at: Instant | None = None) -> None:
        """Record the value from a response to another client, received at `at` (None: now). Never raises."""
        name = response.name.upper()
        rows = (one.parameter for one in servo.registers.values())
        parameter = next((row for row in rows if row.name.upper() == name), None)
        raw = None if parameter is None else value_of(response, parameter)
        if parameter is None or raw is None:
            return
        at = self.base.now() if at is None else at
        self._remember(servo, parameter, raw, at)
        if parameter.key == "current_angle":
            servo.angle_deg, servo.angle_at = raw / parameter.per_unit, at
            servo.angle_polled_at = at

    def _value_of(
        self, servo: Servo, parameter: Parameter, response: GetSetResponse, policy: RetryPolicy, verb: str
    ) -> Raw:
        """The value of a response, which is recorded. Raises Refused if there is none: the row is then unknown."""
        raw = self._integer_of(response, parameter, policy)
        if raw is None:
            self._forget(servo, parameter)  # its last value may no longer be true
            raise Refused(
                f"{servo.title} refused to {verb} {parameter.key} ({parameter.name}): its response has no value. "
                "Try again. If this persists, the servo does not have this parameter.",
                key=parameter.key,
                cause="register_refused",
                servo=servo.title,
                writes=verb == "write",
            )
        self._remember(servo, parameter, raw, self.base.now())
        return raw

    def _forget(self, servo: Servo, parameter: Parameter) -> None:
        """Mark the value of a row in RAM as unknown."""
        register = servo.registers.get(parameter.key)
        if register is None or register.at is None:
            return
        register.at = None
        self._hub.publish(ReadingChanged(servo.uid, parameter.key))
        if parameter.key in output.ROWS:
            self._hub.publish(ServoChanged(servo.uid))

    def _remember(self, servo: Servo, parameter: Parameter, raw: Raw, now: Instant) -> None:
        if parameter.key in output.ROWS:
            register = servo.registers.get(parameter.key)
            known = register is not None and register.at is not None
            if (changed := servo.note(parameter.key, raw, now)) or not known:
                self._hub.publish(ServoChanged(servo.uid))
        else:
            changed = servo.note(parameter.key, raw, now)
        if parameter.kind == "number":
            value = None if parameter.dummy and raw == DUMMY else raw / parameter.per_unit
            self._hub.publish(Sampled(servo.uid, parameter.key, now, value))
        if changed and parameter.group != "status":
            self._hub.publish(ReadingChanged(servo.uid, parameter.key))

    def _integer_of(self, response: GetSetResponse, parameter: Parameter, policy: RetryPolicy) -> Raw | None:
        raw = value_of(response, parameter)
        if raw is None:
            self.refused[policy.kind] += 1
        return raw

    async def _paced(self, reads: int = 1) -> None:
        """Wait for the turn of a request that takes as many frames as `reads` reads."""
        now = self.base.now()
        due = max(now, self._read_at)
        self._read_at = due + reads * self.read_interval_s
        if due > now:
            await asyncio.sleep(due - now)

    def connected(self) -> Participant:
        """Our node on the bus. Raises BusDisconnected if there is none."""
        participant = self._participant()
        if participant is None:
            raise BusDisconnected("No bus is connected. Connect an adapter first.", cause="no_bus")
        return participant

    @property
    def participant(self) -> Participant | None:
        """Our node on the bus, or None."""
        return self._participant()


class _Counted:
    """Counts the request made in its block and names the servo in a NoResponse.

    A class, because a generator would add 2 % to the time of a read.
    """

    __slots__ = ("_began", "_node_id", "_requests", "_servo", "policy")

    def __init__(self, requests: ServoRequests, node_id: int, servo: Servo | None, policy: RetryPolicy) -> None:
        """`servo` is None for an unidentified node."""
        self._requests, self._node_id, self._servo, self.policy = requests, node_id, servo, policy

    def __enter__(self) -> None:
        self._began = self._requests.base.now()

    def __exit__(self, _kind: object, error: BaseException | None, _trace: object) -> None:
        requests, policy = self._requests, self.policy
        if error is None:
            requests.outcomes[policy.kind, "responded"] += 1
            requests.response_times[policy.kind].add(requests.base.now() - self._began)
            return
        if not isinstance(error, NoResponse):
            requests.outcomes[policy.kind, "failed"] += 1
            return
        requests.outcomes[policy.kind, "no_response"] += 1
        title = f"node {self._node_id}" if self._servo is None else self._servo.title
        tries = "1 try" if policy.tries == 1 else f"{policy.tries} tries"
        lacking = NoResponse(
            f"{title} did not respond in {tries} of {policy.timeout_s * 1000:.0f} ms. Check its supply and the wiring.",
            node_id=self._node_id,
            cause="servo_not_responding",
            servo=title,
        )
        if lag_s := requests.lag.worst_s(self._began):
            text = f" This computer was busy: hornbill ran up to {lag_s:.2f} s late. Reduce its load, then try again."
            lacking.extend(after=text, also="computer_busy", lag_s=round(lag_s, 3))
        raise lacking from None


def _disables_output(parameter: Parameter, raw: Raw) -> bool:
    """Whether a write switches torque off or brakes (0x20)."""
    return parameter.key == output.KEY and raw in (output.MODES["off"], output.MODES["brake"])


def _node(servo: Servo) -> int:
    if servo.node_id is None:
        raise NoResponse(
            f"{servo.title} is offline and has no node ID. Check its supply and the wiring.",
            cause="node_id_missing",
            servo=servo.title,
        )
    return servo.node_id


def value_of(response: GetSetResponse, parameter: Parameter) -> Raw | None:
    """Raw value of a row in a response. None if it has none, or is of another row."""
    name = parameter.name
    if response.value.kind is not ValueKind.INTEGER:
        return None
    if response.name != name and response.name.upper() != name.upper():
        return None
    value = response.value.value
    if not isinstance(value, int):
        return None
    # 0x18..0x1B are 32 bits in an int64; the sign extension of bit 31 is not specified (errata B7)
    return value & 0xFFFF_FFFF if parameter.kind == "bits" else value
