"""Diagnosis of one connection and of this server, in a fixed order: causes without their consequences."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from hornbill.domain.bus import Finding
from hornbill.errors import PortError
from hornbill.node.allocator import Allocator
from hornbill.node.directory import Directory
from hornbill.node.participant import Participant
from hornbill.servo.device.servo import Servo
from hornbill.servo.doctor import adapter, allocation, identity, programs, responses, server, traffic
from hornbill.servo.doctor.record import Record
from hornbill.servo.doctor.server_record import ServerRecord
from hornbill.units import Instant
from hornbill.wire.port import CanPort

Check = Callable[[Record], list[Finding]]

_LINE: Final[Sequence[Check]] = (traffic.silence, adapter.bus_off, adapter.bit_timing)
"""Checks that must pass before checks of single nodes are meaningful."""

_NODES: Final[Sequence[Check]] = (
    identity.own_node_id, identity.node_ids, identity.servo_ids, identity.new_servos, programs.commanders,
    allocation.allocators, allocation.waiting,
    traffic.dropped, traffic.errors_rising, traffic.load, traffic.serial_line,
    responses.silent_nodes, responses.lost_responses, responses.slow_responses, responses.offline_servos,
    traffic.foreign_frames,
)  # fmt: skip

_RECORDED: Final[Sequence[Check]] = (identity.node_ids, identity.servo_ids, traffic.foreign_frames)
"""Checks that apply to a replay, which cannot be queried, may end, and contains frames of the original server."""

_NO_RECEPTION: Final = frozenset(("only_errors", "unacknowledged", "no_traffic", "nothing_received"))

_EXPLAINS: Final[Mapping[str, frozenset[str]]] = {
    "duplicate_node_id": frozenset(("errors_rising", "responses_lost", "responses_slow", "servo_offline")),
    "frames_dropped": frozenset(("responses_lost",)),
    "computer_busy": frozenset(("frames_dropped", "responses_lost", "responses_slow", "servo_offline")),
    "disk_space": frozenset(("database",)),
    "serial_line_full": frozenset(("responses_slow", "responses_lost")),
    "errors_rising": frozenset(("responses_lost", "responses_slow")),
    "load_over_budget": frozenset(("responses_slow", "responses_lost")),
    "responses_slow": frozenset(("responses_lost",)),
    "bus_off": frozenset(("adapter_lost", "errors_rising", "responses_lost", "servo_offline")),
}
"""Consequences of each cause, omitted because they would mislead users."""

_RANK: Final = {"failure": 0, "warning": 1, "notice": 2, "ok": 3}


class Doctor:
    """Collects facts (`follow`, `tick`) and reports findings. Never sends anything."""

    def __init__(
        self, clock: Callable[[], Instant], servos: Callable[[], Sequence[Servo]], of_server: ServerRecord
    ) -> None:
        """`servos` returns the servos of the fleet. `of_server`: facts about this server."""
        self._clock = clock
        self._servos = servos
        self.of_server = of_server
        self._record: Record | None = None
        self._failure: tuple[str, PortError] | None = None

    def could_not_open(self, address: str, error: PortError) -> None:
        """Record that an adapter could not be opened."""
        self._failure = address, error

    def follow(self, port: CanPort, participant: Participant, allocator: Allocator, directory: Directory) -> None:
        """Collect facts on a connected bus."""
        self._failure = None
        self._record = Record(port, participant, allocator, directory, self._servos, self._clock())

    def leave(self) -> None:
        """Forget the connection and an earlier failure."""
        self._record = self._failure = None

    def tick(self, now: Instant) -> None:
        """Sample the counters. Call it several times a second."""
        self.of_server.tick(now)
        if self._record is not None:
            self._record.tick(now)

    def findings(self, *, everything: bool = False) -> list[Finding]:
        """Findings, most severe first, without consequences. `everything`: also checks without finding."""
        found = self.checks()
        hidden: set[str] = set()
        for one in found:
            if one.severity != "ok":
                hidden |= _EXPLAINS.get(one.code, frozenset())
        wrong = [one for one in found if one.severity != "ok" and one.code not in hidden]
        well = [one for one in found if one.severity == "ok"] if everything else []
        return sorted(wrong + well, key=lambda one: _RANK[one.severity])

    def checks(self) -> list[Finding]:
        """Results of all checks, also those without finding and those that are consequences of others."""
        return self._examine() + [one for check in server.CHECKS for one in check(self.of_server)]

    def _examine(self) -> list[Finding]:
        record = self._record
        if record is None:
            return [adapter.no_connection(self._failure)]
        record.tick(self._clock())
        found = adapter.working(record)
        if record.down:
            return (_why_off(record) if record.was_off else []) + found
        if record.recorded:
            return found + [one for check in _RECORDED for one in check(record)]
        for check in _LINE:
            found += check(record)
        if not any(one.code in _NO_RECEPTION and one.severity == "failure" for one in found) and not _is_off(found):
            for check in _NODES:
                found += check(record)
        return found


def _why_off(record: Record) -> list[Finding]:
    """Findings for an adapter that is closed after bus-off and will be reopened."""
    errors = traffic.only_errors(record)
    return ([] if errors is None else [errors]) + adapter.bus_off(record) + adapter.bit_timing(record)


def _is_off(found: Sequence[Finding]) -> bool:
    return any(one.code == "bus_off" and one.severity == "failure" for one in found)
