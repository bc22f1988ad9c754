"""SharedNodeId: frames with our node id that we did not send, and what they tell of the program that sends them."""

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
"""A frame of ours that comes back within this time was returned by the adapter."""

STRAYS: Final = 2
WITHIN_S: Final = 10.0
"""So many frames within that time may be strays; more are a program."""

_SENT: Final = 256
_TYPE: Final = 0x00FF_FF80
_REQUEST: Final = 0x00FF_8080
_NODE_STATUS: Final = NodeStatus.TYPE.id << 8
_ALLOCATION: Final = AllocationMessage.TYPE.id << 8
_GET_SET: Final = GetSetRequest.TYPE.id << 16 | 0x8080
_MAKERS_PRIORITY: Final = 30
_BY_NAME: Final = b"\0\x000x"
"""How a read by index 0 and a register's name begins."""


def _is_known(can_id: int) -> bool:
    if can_id & 0x80:
        return (True, can_id >> 16 & 0xFF) in BY_KEY
    return (False, can_id >> 8 & 0xFFFF) in BY_KEY


class SharedNodeId:
    """What another program says with our node id, frame by frame: its requests to other nodes are no transfers to us.

    Frames that the adapter returns to us are not counted, nor those of data types that no program beside us uses: they
    are noise, and noise must not end the allocator.
    """

    def __init__(self, node_id: int) -> None:
        self.node_id = node_id
        self.frames = 0
        """How many were heard."""
        self.requests = 0
        """How many of them begin a service request to another node."""
        self.heard_at: Instant | None = None
        """When one was last heard."""
        self.allocates = False
        """Whether it gives node ids."""
        self.says_node_status = False
        self.on_heard: Hooks[Instant] = Hooks()
        """Called once for every batch of frames that holds some."""
        self._reads_by_name = False
        self._lately: deque[Instant] = deque(maxlen=STRAYS + 1)
        self._sent: deque[tuple[Instant, Sequence[Frame]]] = deque(maxlen=_SENT)

    @property
    def is_program(self) -> bool:
        """Whether it is more than a stray frame: it gives node ids, or said several things lately."""
        lately = self._lately
        return self.allocates or (len(lately) > STRAYS and lately[-1] - lately[0] <= WITHIN_S)

    @property
    def is_makers_program(self) -> bool:
        """Whether it asks as the maker's configuration program does: GetSet by name at priority 30, no NodeStatus."""
        return self._reads_by_name and not self.says_node_status

    def sent(self, frames: Sequence[Frame], now: Instant) -> None:
        """Frames of our own leave."""
        self._sent.append((now, frames))  # looked into only when something comes back: this runs for every request

    def hear(self, frames: Sequence[Frame], now: Instant) -> None:
        """Frames with our node id came in."""
        mine = {(frame.id, bytes(frame.data)) for at, sent in self._sent if now - at < ECHO_S for frame in sent}
        others = [frame for frame in frames if _is_known(frame.id) and (frame.id, bytes(frame.data)) not in mine]
        if not others:
            return
        for can_id, data, _ in others:
            self._note(can_id, bytes(data))
            self._lately.append(now)
        self.heard_at = now
        self.on_heard.tell(now)

    def _note(self, can_id: int, data: bytes) -> None:
        self.frames += 1
        if can_id & 0x80:
            if can_id & 0x8000 and data and data[-1] & START:
                self.requests += 1
            if can_id & _REQUEST == _GET_SET and can_id >> 24 == _MAKERS_PRIORITY and data.startswith(_BY_NAME):
                self._reads_by_name = True
        elif can_id & _TYPE == _NODE_STATUS:
            self.says_node_status = True
        elif can_id & _TYPE == _ALLOCATION:
            self.allocates = True
