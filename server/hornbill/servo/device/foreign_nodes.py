"""Nodes not known as servos: which of them may be one, and when each is asked again."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from hornbill.domain.note import Note
from hornbill.node.directory import OFFLINE_AFTER_S, NodeRecord
from hornbill.servo.device.requests import Patience
from hornbill.units import Instant

POLITE: Final = Patience(priority=24, timeout_s=0.12, tries=3)
CURIOUS: Final = Patience(priority=24, timeout_s=0.12, tries=12)
"""For a node that broadcasts the Status of an actuator, as every servo does ten times a second (table 2-2)."""

_REFUSALS_OF_A_STARTING_SERVO: Final = 4
"""Refusals that may come from a servo busy with its start: the fifth comes after 15 s at the earliest."""

_REFUSALS: Final = 4
"""After so many a node that is no actuator is not asked again until it starts anew."""

_NEVER: Final = float("inf")


@dataclass(slots=True)
class _Stranger:
    """What came of asking one node since it appeared or started anew, in rounds of a few tries each.

    `life` is NodeRecord.lives at that time; `silent` rounds had no answer to GetNodeInfo, `deaf` ones none
    to GetSet, and in `refused` ones it answered that it has no 0x50.
    """

    life: int | None = None
    silent: int = 0
    deaf: int = 0
    refused: int = 0
    again_at: Instant = float("-inf")

    @property
    def rounds(self) -> int:
        return self.silent + self.deaf + self.refused


class ForeignNodes:
    """Asks nothing itself. A node that does not answer, or is no servo, costs a few requests, ever more rarely.

    A node that broadcasts an actuator's Status may be a servo for as long as it did not refuse 0x50 five
    times; any other is taken for foreign at its first refusal, and asked a few times more in case it was
    busy starting.
    """

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self._met: dict[int, _Stranger] = {}
        self._status_at: dict[int, Instant] = {}

    def due(self, record: NodeRecord) -> bool:
        """Whether to ask a node that was just heard."""
        stranger = self._met.get(record.node_id)
        if stranger is None or stranger.life not in (None, record.lives):
            self._met[record.node_id] = _Stranger(record.lives)
            return True
        stranger.life = record.lives
        return self._clock() >= stranger.again_at

    def patience(self, node_id: int) -> Patience:
        """How insistently to ask it."""
        return CURIOUS if self.is_actuator(node_id) else POLITE

    def heard_status(self, node_id: int) -> None:
        """A node broadcast the Status of an actuator."""
        if not self.is_actuator(node_id) and (stranger := self._met.get(node_id)) is not None:
            stranger.again_at = min(stranger.again_at, self._clock())
        self._status_at[node_id] = self._clock()

    def silent(self, node_id: int) -> None:
        """It did not answer GetNodeInfo."""
        self._of(node_id).silent += 1
        self._postpone(node_id)

    def deaf(self, node_id: int) -> None:
        """It did not answer GetSet, although it answered GetNodeInfo."""
        self._of(node_id).deaf += 1
        self._postpone(node_id)

    def refused(self, node_id: int) -> None:
        """It answered that it has no 0x50."""
        self._of(node_id).refused += 1
        self._postpone(node_id)

    def wait(self, node_id: int, until: Instant) -> None:
        """Ask it no earlier, for a reason of ours."""
        self._of(node_id).again_at = until

    def hurry(self, node_id: int) -> None:
        """Somebody needs to know now who it is; what is known to be foreign stays so."""
        if (stranger := self._met.get(node_id)) is not None:
            stranger.again_at = float("-inf")

    def forget(self, node_id: int) -> None:
        """It is known as a servo now."""
        self._met.pop(node_id, None)
        self._status_at.pop(node_id, None)

    def is_actuator(self, node_id: int) -> bool:
        """Whether it broadcasts the Status of an actuator."""
        return self._clock() - self._status_at.get(node_id, float("-inf")) < OFFLINE_AFTER_S

    def is_foreign(self, node_id: int) -> bool:
        """Whether it is known to be no servo of ours."""
        stranger = self._met.get(node_id)
        if stranger is None:
            return False
        if self.is_actuator(node_id):
            return stranger.refused > _REFUSALS_OF_A_STARTING_SERVO
        return stranger.refused > 0 or stranger.deaf > 0

    def suspects(self) -> list[int]:
        """Nodes that broadcast the Status of an actuator and are not known to be foreign, by node id."""
        return sorted(
            node_id for node_id in self._status_at if self.is_actuator(node_id) and not self.is_foreign(node_id)
        )

    def note(self, node_id: int) -> Note | None:
        """Why a node is not taken for a servo, for people; None while it has not been asked."""
        stranger = self._met.get(node_id)
        if stranger is None or not stranger.rounds:
            return None
        if stranger.refused:
            note = Note("It has no model number (0x50), so it is no servo of this family.", "no_model_number")
        elif stranger.deaf:
            text = "It answers GetNodeInfo but not GetSet, so it has no parameters that could be read."
            note = Note(text, "no_parameters")
        else:
            text = f"It does not answer GetNodeInfo; it was asked {stranger.silent} times."
            note = Note(text, "no_info", {"tries": stranger.silent})
        if self.is_actuator(node_id) and not self.is_foreign(node_id):
            also = " It broadcasts an actuator's status, so it may be a servo: stop writes torque off to it, too."
            return Note(note.text + also, note.code, {**note.params, "may_be_servo": True})
        return note

    def _of(self, node_id: int) -> _Stranger:
        return self._met.setdefault(node_id, _Stranger())

    def _postpone(self, node_id: int) -> None:
        stranger = self._of(node_id)
        rounds = min(stranger.rounds, 20) - 1
        if self.is_actuator(node_id):
            delay = min(0.5 * 2**rounds, 300.0 if stranger.refused else 30.0)
        elif stranger.refused >= _REFUSALS:
            delay = _NEVER
        else:
            delay = min(2.0 * 4**rounds, 3600.0)
        stranger.again_at = self._clock() + delay
