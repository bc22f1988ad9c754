"""Connects an Allocator to a Participant. Responses leave in the same loop iteration as their requests arrive."""

import logging
from collections.abc import Callable

from hornbill.errors import BusDisconnected
from hornbill.node.allocator import RESPONSE_PRIORITY, Allocator
from hornbill.node.participant import Participant
from hornbill.wire.messages import AllocationMessage
from hornbill.wire.transfer import Transfer

log = logging.getLogger(__name__)


def serve_allocation(participant: Participant, allocator: Allocator) -> Callable[[], None]:
    """Run `allocator` on the participant's bus. Returns a function that stops it."""
    allocator.listening_since = participant.clock()

    def respond(transfer: Transfer, message: AllocationMessage) -> None:
        response = allocator.handle(message, transfer, participant.clock())
        if response is not None:
            send(response)

    def send(response: AllocationMessage) -> None:
        try:
            participant.broadcast(response, priority=RESPONSE_PRIORITY)
        except BusDisconnected:
            log.debug("allocation response not sent: no bus")

    allocator.on_response.append(send)
    return participant.subscribe(AllocationMessage, respond)
