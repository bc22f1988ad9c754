"""Nodes not identified as servos: which may be servos, and when to query each again."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from hornbill.domain.note import Note
from hornbill.node.directory import OFFLINE_AFTER_S, NodeRecord
from hornbill.servo.device.requests import RetryPolicy
from hornbill.units import Instant
from hornbill.wire.messages import ActuatorStatus

UNKNOWN_NODE: Final = RetryPolicy(priority=24, timeout_s=0.12, tries=3)
UNKNOWN_ACTUATOR: Final = RetryPolicy(priority=24, timeout_s=0.12, tries=12)
"""For a node that broadcasts an actuator's Status, as every servo does at 10 Hz (table 2-2)."""

_REFUSALS_OF_A_STARTING_SERVO: Final = 4
"""Refusals that a starting servo may send: the fifth comes after 15 s at the earliest."""

_REFUSALS: Final = 4
"""A node that is not an actuator is not queried again after this many refusals, until it restarts."""

_NEVER: Final = float("inf")
_NEVER_SEEN: Final = float("-inf")


@dataclass(slots=True)
class _Attempts:
    """Results of querying one node since it appeared or restarted, in rounds of a few tries each.

    `boot_count` is NodeRecord.boot_count at that time; `no_info` rounds got no response to GetNodeInfo, `no_get_set`
    rounds none to GetSet, and in `refused` rounds it responded that it has no 0x50.
    """

    boot_count: int | None = None
    no_info: int = 0
    no_get_set: int = 0
    refused: int = 0
    again_at: Instant = float("-inf")

    @property
    def rounds(self) -> int:
        return self.no_info + self.no_get_set + self.refused


class ForeignNodes:
    """Schedule for querying unidentified nodes, with growing intervals. Sends nothing itself.

    A node that broadcasts an actuator's Status may be a servo until it has refused 0x50 five times. Any other node
    counts as foreign after its first refusal and is queried a few more times, in case it was still starting.
    """

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self._attempts: dict[int, _Attempts] = {}
        self._statuses: dict[int, tuple[Instant, ActuatorStatus]] = {}

    def due(self, record: NodeRecord) -> bool:
        """Whether to query a node whose NodeStatus was just received."""
        attempts = self._attempts.get(record.node_id)
        if attempts is None or attempts.boot_count not in (None, record.boot_count):
            self._attempts[record.node_id] = _Attempts(record.boot_count)
            return True
        attempts.boot_count = record.boot_count
        return self._clock() >= attempts.again_at

    def retry_policy(self, node_id: int) -> RetryPolicy:
        """The retry policy for querying a node."""
        return UNKNOWN_ACTUATOR if self.is_actuator(node_id) else UNKNOWN_NODE

    def on_status(self, node_id: int, status: ActuatorStatus) -> None:
        """Note that a node broadcast an actuator's Status."""
        if not self.is_actuator(node_id) and (attempts := self._attempts.get(node_id)) is not None:
            attempts.again_at = min(attempts.again_at, self._clock())
        self._statuses[node_id] = self._clock(), status

    def no_node_info(self, node_id: int) -> None:
        """Note that it did not respond to GetNodeInfo."""
        self._of(node_id).no_info += 1
        self._schedule(node_id)

    def no_parameters(self, node_id: int) -> None:
        """Note that it responded to GetNodeInfo but not to GetSet."""
        self._of(node_id).no_get_set += 1
        self._schedule(node_id)

    def refused(self, node_id: int) -> None:
        """Note that it responded but does not have 0x50."""
        self._of(node_id).refused += 1
        self._schedule(node_id)

    def postpone(self, node_id: int, until: Instant) -> None:
        """Do not query it before `until`."""
        self._of(node_id).again_at = until

    def retry_now(self, node_id: int) -> None:
        """Query it at the next opportunity. A node known to be foreign stays foreign."""
        if (attempts := self._attempts.get(node_id)) is not None:
            attempts.again_at = float("-inf")

    def forget(self, node_id: int) -> None:
        """Drop it: it was identified as a servo."""
        self._attempts.pop(node_id, None)
        self._statuses.pop(node_id, None)

    def is_actuator(self, node_id: int) -> bool:
        """Whether it broadcasts an actuator's Status."""
        return self.actuator(node_id) is not None

    def actuator(self, node_id: int) -> ActuatorStatus | None:
        """The last Status of an actuator. None if it has broadcast none recently."""
        at, status = self._statuses.get(node_id, (_NEVER_SEEN, None))
        return status if self._clock() - at < OFFLINE_AFTER_S else None

    def actuators(self) -> dict[int, int]:
        """Actuator IDs of nodes that have broadcast an actuator's Status, by node ID."""
        return {node_id: status.actuator_id for node_id, (_, status) in self._statuses.items()}

    def is_foreign(self, node_id: int) -> bool:
        """Whether it is known not to be a supported servo."""
        attempts = self._attempts.get(node_id)
        if attempts is None:
            return False
        if self.is_actuator(node_id):
            return attempts.refused > _REFUSALS_OF_A_STARTING_SERVO
        return attempts.refused > 0 or attempts.no_get_set > 0

    def suspects(self) -> list[int]:
        """Sorted IDs of nodes that broadcast an actuator's Status and are not known to be foreign."""
        return sorted(
            node_id for node_id in self._statuses if self.is_actuator(node_id) and not self.is_foreign(node_id)
        )

    def note(self, node_id: int) -> Note | None:
        """Why a node is not listed as a servo, for users. None until it has been queried."""
        attempts = self._attempts.get(node_id)
        if attempts is None or not attempts.rounds:
            return None
        if attempts.refused:
            note = Note("It has no model number (0x50), so it is not a servo of this family.", "no_model_number")
        elif attempts.no_get_set:
            text = "It responds to GetNodeInfo but not to GetSet, so it has no readable parameters."
            note = Note(text, "no_parameters")
        else:
            text = f"It did not respond to GetNodeInfo in {attempts.no_info} attempts."
            note = Note(text, "no_info", {"tries": attempts.no_info})
        if self.is_actuator(node_id) and not self.is_foreign(node_id):
            also = " It broadcasts an actuator's status, so it may be a servo: Stop also writes torque off to it."
            return Note(note.text + also, note.code, {**note.params, "may_be_servo": True})
        return note

    def _of(self, node_id: int) -> _Attempts:
        return self._attempts.setdefault(node_id, _Attempts())

    def _schedule(self, node_id: int) -> None:
        attempts = self._of(node_id)
        rounds = min(attempts.rounds, 20) - 1
        if self.is_actuator(node_id):
            delay = min(0.5 * 2**rounds, 300.0 if attempts.refused else 30.0)
        elif attempts.refused >= _REFUSALS:
            delay = _NEVER
        else:
            delay = min(2.0 * 4**rounds, 3600.0)
        attempts.again_at = self._clock() + delay
