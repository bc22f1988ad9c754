"""SharedNodeId: frames with our node ID that we did not send, and what they reveal about their sender."""

import logging
from collections import deque
from collections.abc import Sequence
from typing import Final

from hornbill.node.hooks import Hooks
from hornbill.units import Instant
from hornbill.wire.frame import Frame
from hornbill.wire.messages import AllocationMessage, NodeStatus
from hornbill.wire.services import GetSetRequest
from hornbill.wire.transfer import START
from hornbill.wire.types import BY_KEY

log = logging.getLogger(__name__)

ECHO_S: Final = 1.0
"""One of our frames received within this time is an echo of the adapter."""

STRAYS: Final = 2
WITHIN_S: Final = 10.0
"""Up to this many frames within this time may be strays. More come from a program."""

_SENT: Final = 256
_TYPE: Final = 0x00FF_FF80
_REQUEST: Final = 0x00FF_8080
_NODE_STATUS: Final = NodeStatus.TYPE.id << 8
_ALLOCATION: Final = AllocationMessage.TYPE.id << 8
_GET_SET: Final = GetSetRequest.TYPE.id << 16 | 0x8080
_MAKERS_PRIORITY: Final = 30
_BY_NAME: Final = b"\0\x000x"
"""First payload bytes of a read by index 0 and register name."""


def _is_known(can_id: int) -> bool:
    if can_id & 0x80:
        return (True, can_id >> 16 & 0xFF) in BY_KEY
    return (False, can_id >> 8 & 0xFFFF) in BY_KEY


class SharedNodeId:
    """Traffic of another program under our node ID, by frame: its requests to other nodes are not transfers to us.

    Not counted are echoes of the adapter and frames of unknown data types: they are noise, and noise must not put
    the allocator on standby.
    """

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.frames = 0
        """Number of such frames."""
        self.requests = 0
        """Number of them that start a service request to another node."""
        self.last_seen: Instant | None = None
        """Time of the last of them."""
        self.allocates = False
        """Whether it allocates node IDs."""
        self.sends_node_status = False
        self.on_seen: Hooks[Instant] = Hooks()
        """Called once for every batch that contains such frames."""
        self._reads_by_name = False
        self._recent: deque[Instant] = deque(maxlen=STRAYS + 1)
        self._sent: deque[tuple[Instant, Sequence[Frame]]] = deque(maxlen=_SENT)

    @property
    def is_program(self) -> bool:
        """Whether it is a program rather than a stray frame: it allocates node IDs, or sent several frames recently."""
        recent = self._recent
        return self.allocates or (len(recent) > STRAYS and recent[-1] - recent[0] <= WITHIN_S)

    @property
    def is_makers_program(self) -> bool:
        """Whether it behaves like Futaba's configuration program: GetSet by name at priority 30, no NodeStatus."""
        return self._reads_by_name and not self.sends_node_status

    def sent(self, frames: Sequence[Frame], now: Instant) -> None:
        """Record frames we send."""
        self._sent.append((now, frames))  # evaluated only when something is received: this runs for every request

    def receive(self, frames: Sequence[Frame], now: Instant) -> None:
        """Process received frames with our node ID."""
        mine = {(frame.id, bytes(frame.data)) for at, sent in self._sent if now - at < ECHO_S for frame in sent}
        others = [frame for frame in frames if _is_known(frame.id) and (frame.id, bytes(frame.data)) not in mine]
        if not others:
            return
        for can_id, data, _ in others:
            self._note(can_id, bytes(data))
            self._recent.append(now)
        self.last_seen = now
        self.on_seen.notify(now)

    def _note(self, can_id: int, data: bytes) -> None:
        self.frames += 1
        if can_id & 0x80:
            if can_id & 0x8000 and data and data[-1] & START:
                self.requests += 1
            if can_id & _REQUEST == _GET_SET and can_id >> 24 == _MAKERS_PRIORITY and data.startswith(_BY_NAME):
                self._reads_by_name = True
        elif can_id & _TYPE == _NODE_STATUS:
            self.sends_node_status = True
        elif can_id & _TYPE == _ALLOCATION:
            self.allocates = True
