"""Search of recorded frames for writes by hornbill: parameters, commands, opcodes and restarts."""

from collections.abc import Iterable, Iterator
from typing import Final

from hornbill.domain.recording import RecordedWrite
from hornbill.schema.catalog import Catalog
from hornbill.wire.frame import LoggedFrame
from hornbill.wire.messages import ArrayCommand, CommandType
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import ExecuteOpcodeRequest, GetSetRequest, RestartNodeRequest, ValueKind
from hornbill.wire.transfer import Transfer
from hornbill.wire.types import decode


class WriteFinder:
    """Finds writes, commands, opcodes and restarts that hornbill sent (table 2-3). Frames must be in order."""

    _TYPES: Final = frozenset((GetSetRequest.TYPE.id, ExecuteOpcodeRequest.TYPE.id, RestartNodeRequest.TYPE.id))

    def __init__(self, catalog: Catalog, uid_of: dict[int, str]) -> None:
        """`uid_of`: servo of each node ID."""
        self._rows = {row.name: row for row in catalog.parameters.values()}
        self._uid_of = uid_of
        self._reassembler = Reassembler()

    def find(self, frames: Iterable[LoggedFrame]) -> list[RecordedWrite]:
        """Writes completed by these frames, which follow those of the previous call."""
        ours = [frame for frame, _, sent in frames if sent and self._may_write(frame.id)]
        return [write for transfer in self._reassembler.feed(ours) for write in self._writes_of(transfer)]

    def _may_write(self, number: int) -> bool:
        if number & 0x80:
            return bool(number & 0x8000) and (number >> 16 & 0xFF) in self._TYPES
        return (number >> 8 & 0xFFFF) == ArrayCommand.TYPE.id

    def _writes_of(self, transfer: Transfer) -> Iterator[RecordedWrite]:
        at, node_id = transfer.at, transfer.destination or None
        uid = self._uid_of.get(transfer.destination, "")
        match decode(transfer):
            case GetSetRequest(_, value, name) if value.kind is not ValueKind.EMPTY:
                row = self._rows.get(name.upper().replace("0X", "0x"))
                raw = value.value
                shown = raw / row.per_unit if row is not None and row.kind == "number" and isinstance(raw, int) else raw
                key = "" if row is None else row.key
                yield RecordedWrite(at, node_id, uid, "parameter", key, name[:16], raw, shown)
            case ExecuteOpcodeRequest(opcode, argument):
                yield RecordedWrite(at, node_id, uid, "opcode", name=int(opcode), raw=argument)
            case RestartNodeRequest():
                yield RecordedWrite(at, node_id, uid, "restart")
            case ArrayCommand(commands):
                for one in commands:
                    kind = one.command_type
                    what = CommandType(kind).name.lower() if kind in CommandType else f"type {int(kind)}"
                    actuator = f"actuator {one.actuator_id}"
                    yield RecordedWrite(at, None, "", "array_command", what, actuator, value=one.command_value)
            case _:
                return
