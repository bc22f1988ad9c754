"""The wiring of an Allocator to a Participant: requests in, answers out in the same turn of the loop."""

import logging
from collections.abc import Callable

from hornbill.errors import BusDisconnected
from hornbill.node.allocator import ANSWER_PRIORITY, Allocator
from hornbill.node.participant import Participant
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)


def serve_allocation(participant: Participant, allocator: Allocator) -> Callable[[], None]:
    """Let `allocator` answer on the participant's bus from now on; returns what ends it."""
    allocator.listening_since = participant.clock()

    def answer(transfer: Transfer, message: AllocationMessage) -> None:
        reply = allocator.handle(message, transfer, participant.clock())
        if reply is not None:
            send(reply)

    def send(reply: AllocationMessage) -> None:
        try:
            participant.broadcast(reply, priority=ANSWER_PRIORITY)
        except BusDisconnected:
            log.debug("no bus to answer an allocation request on")

    allocator.on_answer.append(send)
    return participant.subscribe(AllocationMessage, answer)
