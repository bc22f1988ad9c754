"""The four services of a servo (tables 2-5 to 2-16)."""

from collections.abc import Callable, Collection
from typing import Final

from hornbill.schema.model import ServoModel
from hornbill.sim import address
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.memory import Memory
from hornbill.sim.registers import Registers, Request
from hornbill.units import Instant
from hornbill.wire.messages import NodeStatus
from hornbill.wire.services import (
    EMPTY,
    MAGIC,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    HardwareVersion,
    Opcode,
    RestartNodeRequest,
    RestartNodeResponse,
    SoftwareVersion,
    ValueKind,
    integer,
)

Response = GetNodeInfoResponse | RestartNodeResponse | ExecuteOpcodeResponse | GetSetResponse

REFUSED: Final = GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
"""Table 2-16, column "fail": no values, no name."""

_ADDRESSES: Final = {f"0x{at:02X}": at for at in range(256)}
_NAMES: Final = {at: name for name, at in _ADDRESSES.items()}


class Services:
    """Responds to requests. Requested actions of the servo are stored in `registers.pending`."""

    def __init__(
        self,
        model: ServoModel,
        firmware: int,
        uid: bytes,
        registers: Registers,
        memory: Memory,
        refuse_keys: Collection[str],
    ) -> None:
        self._registers = registers
        self._memory = memory
        self._refuse_keys = refuse_keys
        hardware = model.hardware_version
        # 300 and 28050 do not fit two bytes: thousands, and the rest in tens (software) or ones (hardware).
        self._software = SoftwareVersion(firmware // 1000, firmware % 1000 // 10)
        self._hardware = HardwareVersion(hardware // 1000, hardware % 1000, uid)
        self._name = f"jp.co.futaba.{model.name.lower()}"

    def node_info(self, status: NodeStatus) -> GetNodeInfoResponse:
        """Table 2-6. The name is not documented; this one has the usual form."""
        return GetNodeInfoResponse(status, self._software, self._hardware, self._name)

    def restart(self, request: RestartNodeRequest) -> RestartNodeResponse:
        """Table 2-10: ok = 0 unless the magic number matches."""
        ok = request.magic_number == MAGIC
        if ok:
            self._registers.pending = Request.RESTART
        return RestartNodeResponse(ok)

    def opcode(self, request: ExecuteOpcodeRequest, behaviour: Behaviour) -> ExecuteOpcodeResponse:
        """Table 2-13: ok = 0 for opcodes other than SAVE and ERASE, or an argument other than 0."""
        ok = request.opcode in (Opcode.SAVE, Opcode.ERASE) and request.argument == 0
        if ok and request.opcode == Opcode.ERASE:
            self._registers.erase()
        elif ok:
            restarts = behaviour.save_opcode_restarts
            self._registers.pending = Request.SAVE_AND_RESTART if restarts else Request.SAVE
        return ExecuteOpcodeResponse(0, ok)

    def get_set(self, request: GetSetRequest, behaviour: Behaviour, now: Instant) -> GetSetResponse | None:
        """Table 2-16: the value after the request, by name or, without a name, by index. None: no response."""
        at = self._address(request, behaviour)
        if at is None or self._is_refused(at):
            return REFUSED
        if at not in self._memory.rows and self._memory.absent(at, behaviour) == "silent":
            return None
        kind, value = request.value
        if kind == ValueKind.EMPTY:
            raw = self._registers.read(at)
        elif kind == ValueKind.INTEGER and isinstance(value, int):
            raw = self._registers.write(at, value, now)
        else:
            raw = None  # table 2-15: servos use no other kinds
        if raw is None:
            return REFUSED
        return GetSetResponse(integer(raw), EMPTY, EMPTY, EMPTY, _NAMES[at])

    def _address(self, request: GetSetRequest, behaviour: Behaviour) -> int | None:
        name = request.name
        if not name:
            return request.index if request.index <= address.LAST else None
        if behaviour.lower_case_names:
            name = "0x" + name[2:].upper() if name[:2].lower() == "0x" else name
        return _ADDRESSES.get(name)

    def _is_refused(self, at: int) -> bool:
        row = self._memory.rows.get(at)
        return row is not None and row.key in self._refuse_keys


RESPONDS_FIRST: Final[dict[Request, Callable[[Behaviour], bool]]] = {
    Request.RESTART: lambda behaviour: behaviour.acknowledges_restart,
    Request.SAVE: lambda behaviour: behaviour.acknowledges_save,
    Request.SAVE_AND_RESTART: lambda behaviour: behaviour.acknowledges_save,
}
"""Whether the response is sent before the requested action."""
