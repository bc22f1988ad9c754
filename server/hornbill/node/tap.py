"""All frames of the connected participant, for listeners."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from hornbill.node.participant import Participant
from hornbill.wire.frame import Frame

Listener: TypeAlias = Callable[[Sequence[Frame], bool], None]
"""Called on the event loop with every batch of frames and whether we sent it. Must not block."""


class FrameTap:
    """Moves listeners from one participant to the next, so that a log continues after the bus was lost.

    Without listeners nothing is attached to the participant, so it costs nothing.
    """

    def __init__(self) -> None:
        self._listeners: list[Listener] = []
        self._participant: Participant | None = None

    def attach(self, participant: Participant) -> None:
        """Listen to this participant instead of the previous one."""
        self.detach()
        self._participant = participant
        participant.on_frames.extend(self._listeners)

    def detach(self) -> None:
        """Stop listening to the participant. Idempotent."""
        participant, self._participant = self._participant, None
        if participant is not None:
            for listener in self._listeners:
                participant.on_frames.remove(listener)

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Deliver every frame to `listener`. Returns a function that unsubscribes (idempotent)."""
        self._listeners.append(listener)
        if self._participant is not None:
            self._participant.on_frames.append(listener)

        def remove() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
                if self._participant is not None:
                    self._participant.on_frames.remove(listener)

        return remove
