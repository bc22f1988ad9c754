"""Another node on the embedded bus, with configurable responses."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field

from hornbill.node.participant import Participant
from hornbill.wire.datatype import Kind, Structure
from hornbill.wire.frame import Frame
from hornbill.wire.messages import Mode, NodeHealth, NodeStatus
from hornbill.wire.port import CanPort
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import EMPTY, GetSetRequest, GetSetResponse, SoftwareVersion, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import BY_KEY, decode

HOST = 127


def participant(port: CanPort, *, node_id: int = HOST) -> Participant:
    """A participant as the product makes one."""
    return Participant(
        port, node_id=node_id, name="org.hornbill", unique_id=bytes(range(16)), software_version=SoftwareVersion(0, 1)
    )


def echo(request: GetSetRequest) -> GetSetResponse:
    """The written value, or the register's own number, under its name."""
    value = integer(int(request.name, 16)) if request.value == EMPTY else request.value
    return GetSetResponse(value, EMPTY, EMPTY, EMPTY, request.name)


@dataclass
class Peer:
    """Node `node_id` on `port`. `reply` makes the response to a request, sent after `delay` seconds.

    `drop` says which of the requests (counted from 0) get no response.
    """

    port: CanPort
    node_id: int
    reply: Callable[[GetSetRequest], GetSetResponse] = echo
    delay: Callable[[int], float] = lambda _: 0.0
    drop: Callable[[int], bool] = lambda _: False
    copies: int = 1
    requests: list[Transfer] = field(default_factory=list[Transfer])
    others: list[Transfer] = field(default_factory=list[Transfer])

    def __post_init__(self) -> None:
        self._reassembler = Reassembler(self.node_id)
        self.port.listen(self._receive)

    @property
    def names(self) -> list[str]:
        """The requested registers, in order of arrival."""
        found = [decode(each) for each in self.requests]
        return [each.name for each in found if isinstance(each, GetSetRequest)]

    def send(self, kind: Kind, structure: Structure, *, destination: int = 0, transfer_id: int = 0) -> None:
        """Any transfer from this node, at priority 24."""
        transfer = Transfer(kind, structure.TYPE.id, self.node_id, destination, 24, transfer_id, structure.encode())
        self.port.send(split(transfer, BY_KEY[structure.TYPE.service, structure.TYPE.id]))

    def say_status(self, uptime: int = 0) -> None:
        """One NodeStatus."""
        self.send(Kind.MESSAGE, NodeStatus(uptime, NodeHealth.OK, Mode.OPERATIONAL), transfer_id=uptime & 31)

    def _receive(self, frames: list[Frame]) -> None:
        for transfer in self._reassembler.feed(frames, asyncio.get_running_loop().time()):
            request = decode(transfer)
            if not isinstance(request, GetSetRequest):
                self.others.append(transfer)
                continue
            number = len(self.requests)
            self.requests.append(transfer)
            if not self.drop(number):
                response = self.reply(request)
                asyncio.get_running_loop().call_later(self.delay(number), self._respond, transfer, response)

    def _respond(self, request: Transfer, response: GetSetResponse) -> None:
        transfer = request._replace(
            kind=Kind.RESPONSE, source=self.node_id, destination=request.source, payload=response.encode()
        )
        for _ in range(self.copies):
            self.port.send(split(transfer, GetSetResponse.TYPE))
