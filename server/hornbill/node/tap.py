"""Every frame of whichever participant is connected now, for whoever listens."""

from collections.abc import Callable, Sequence
from typing import TypeAlias

from hornbill.node.participant import Participant
from hornbill.wire.frame import Frame

Listener: TypeAlias = Callable[[Sequence[Frame], bool], None]
"""Called on the event loop with every batch of frames and whether we sent it. Must return at once."""


class FrameTap:
    """Hands listeners from one participant to the next, so that a log goes on when the bus was lost.

    While nobody listens nothing is hooked to the participant, and so it costs nothing.
    """

    def __init__(self) -> None:
        self._listeners: list[Listener] = []
        self._participant: Participant | None = None

    def attach(self, participant: Participant) -> None:
        """Listen to this participant from now on, and no more to the one before."""
        self.detach()
        self._participant = participant
        participant.on_frames.extend(self._listeners)

    def detach(self) -> None:
        """Listen to nobody. Twice is harmless."""
        participant, self._participant = self._participant, None
        if participant is not None:
            for listener in self._listeners:
                participant.on_frames.remove(listener)

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Hear every frame from now on; the answer ends it, and calling it twice is harmless."""
        self._listeners.append(listener)
        if self._participant is not None:
            self._participant.on_frames.append(listener)

        def forget() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
                if self._participant is not None:
                    self._participant.on_frames.remove(listener)

        return forget
