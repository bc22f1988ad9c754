"""Identification of servos from responses to other nodes, for an observer, which cannot request anything."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from hornbill.node.directory import OFFLINE_AFTER_S, Directory
from hornbill.schema.catalog import Catalog
from hornbill.servo.device.fleet import Fleet
from hornbill.servo.device.identification import NodeIdentity, production_date
from hornbill.servo.device.requests import ServoRequests, value_of
from hornbill.servo.runtime.timebase import TimeBase
from hornbill.store.servos import ServoFacts, StoredServo
from hornbill.units import Instant, NodeId, Raw, Uid
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import GetNodeInfoResponse, GetSetResponse
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode

_IDENTITY: Final = ("product", "production")
"""Groups of rows that never change while a servo runs."""


@dataclass(slots=True)
class _Heard:
    """Responses of one node since its start. `boot_count`: NodeRecord.boot_count then."""

    boot_count: int
    identity: dict[str, Raw] = field(default_factory=dict[str, Raw])
    """Rows of _IDENTITY, by key."""
    others: dict[str, tuple[Instant, GetSetResponse]] = field(default_factory=dict[str, tuple[Instant, GetSetResponse]])
    """Other rows, by register name, until the servo is identified."""
    last_at: Instant = float("-inf")


class PassiveIdentification:
    """Identifies servos on one bus from responses to any node, and updates their registers. Sends nothing.

    A servo is identified once GetNodeInfo of its node ID was heard since the node started, and either its model number
    (0x50) was heard too, or the store knows the model of this unique ID. Nothing is concluded from a node ID alone.
    """

    def __init__(
        self,
        catalog: Catalog,
        directory: Directory,
        fleet: Fleet,
        requests: ServoRequests,
        base: TimeBase,
        stored: Callable[[Uid], StoredServo | None],
    ) -> None:
        """`stored` returns what the store knows of a unique ID."""
        self._catalog = catalog
        self._directory = directory
        self._fleet = fleet
        self._requests = requests
        self._base = base
        self._stored = stored
        self._reassembler = Reassembler()
        self._heard: dict[int, _Heard] = {}
        self._rows = {row.name.upper(): row for row in catalog.readable.values()}

    def receive(self, frames: Sequence[Frame], _sent: bool) -> None:
        """Process all frames on the bus."""
        for transfer in self._reassembler.feed(frames):
            if transfer.kind is Kind.RESPONSE and transfer.source:
                self._on_response(transfer)

    def check(self, node: int, *, news: bool = False) -> None:
        """Identify a node if enough is known. Call when it appears or is back, and with `news` of its identity."""
        record = self._directory.records.get(node)
        if record is None or record.info is None:
            return
        uid = Uid(record.info.hardware_version.unique_id.hex())
        servo = self._fleet.find(uid)
        known = servo is not None and servo.online and servo.identified and servo.node_id == node
        if known and not news:
            return
        heard = self._of(node)
        identity = self._identity(uid, record.info, {} if heard is None else heard.identity)
        if identity is None:
            return
        servo = self._fleet.identify_passively(NodeId(node), identity)
        if heard is not None:
            for at, response in heard.others.values():
                self._requests.observe_response(servo, response, at)
            heard.others.clear()

    def _on_response(self, transfer: Transfer) -> None:
        node = transfer.source
        match decode(transfer):
            case GetNodeInfoResponse() as info:
                self._directory.identify(node, info)
                self._fleet.resident(node, Uid(info.hardware_version.unique_id.hex()))
                self.check(node)
            case GetSetResponse() as response:
                self._on_register(node, response)
            case _:
                return

    def _on_register(self, node: int, response: GetSetResponse) -> None:
        heard, row = self._of(node), self._rows.get(response.name.upper())
        if heard is None or row is None:
            return
        now = self._base.now()
        if now - heard.last_at > OFFLINE_AFTER_S and not self._directory.is_online(node, now):
            heard.others.clear()  # others may have written meanwhile
        heard.last_at = now
        raw = value_of(response, row)
        if raw is None:
            return
        news = row.group in _IDENTITY and heard.identity.get(row.key) != raw
        if news:
            heard.identity[row.key] = raw
            self.check(node, news=True)
        servo = self._fleet.online_on(node)
        if servo is not None and servo.identified:
            self._requests.observe_response(servo, response)
        else:
            heard.others[row.name] = now, response

    def _of(self, node: int) -> _Heard | None:
        """Responses of a node since its start. None before its first NodeStatus."""
        record = self._directory.records.get(node)
        if record is None:
            return None
        heard = self._heard.get(node)
        if heard is None or heard.boot_count != record.boot_count:
            heard = self._heard[node] = _Heard(record.boot_count)
        return heard

    def _identity(self, uid: Uid, info: GetNodeInfoResponse, heard: Mapping[str, Raw]) -> NodeIdentity | None:
        """Identity of the servo with this unique ID. None while its model is unknown."""
        stored = self._stored(uid)
        facts = ServoFacts() if stored is None else stored.facts
        model_number = heard.get("model_number", facts.model_number)
        if model_number is None:
            return None
        hardware = heard.get("hardware_version", facts.hardware_version)
        made = production_date(
            [heard.get(key) for key, row in self._catalog.parameters.items() if row.group == "production"]
        )
        return NodeIdentity(
            uid=uid,
            name=info.name,
            model_number=model_number,
            hardware_version=hardware,
            firmware=heard.get("firmware_version", facts.firmware),
            serial_number=heard.get("product_number", facts.serial),
            production_date=made or facts.production_date,
            model=self._catalog.treated_as(model_number, hardware),
        )
