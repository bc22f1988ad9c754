"""One simulated servo and a tester that exchanges DroneCAN frames with it, on its own clock."""

from collections.abc import Iterable
from functools import cache
from typing import TypeVar

from hornbill.domain.plant import PlantConstants
from hornbill.schema.catalog import Catalog
from hornbill.sim.behaviour import Behaviour
from hornbill.sim.bench.recipe import Recipe
from hornbill.sim.servo import SimulatedServo
from hornbill.units import Raw
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import (
    ActuatorCommand,
    ActuatorStatus,
    AllocationMessage,
    ArrayCommand,
    CommandType,
    NodeStatus,
)
from hornbill.wire.reassembly import Reassembler
from hornbill.wire.services import (
    EMPTY,
    MAGIC,
    ExecuteOpcodeRequest,
    ExecuteOpcodeResponse,
    GetNodeInfoRequest,
    GetNodeInfoResponse,
    GetSetRequest,
    GetSetResponse,
    RestartNodeRequest,
    RestartNodeResponse,
    Value,
    integer,
)
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure, decode

__all__ = ["FIRMWARE", "FREE", "MODELS", "NODE", "QUIET", "START", "TESTER", "Desk", "catalog", "integer"]

TESTER = 126
NODE = 42
START = 1000.0
FIRMWARE = ("1.010", "1.100", "1.200", "1.300")
MODELS = (
    "BLA21-06U-A0", "BLA21-06U-AB", "BLA21-12U-A0", "BLA21-12U-AB",
    "BLA21-28U-A0", "BLA21-28U-AB", "BLA15-06U-A0", "BLA15-12U-A0", "BLA34-12U-AB", "BLA34-28U-AB",
)  # fmt: skip
QUIET = {"timeout_action": 0, "soft_start": 0}
"""ROM of a servo that rests before the first command and continues after the last."""
FREE = QUIET | {"speed_torque_control": 1}
"""The same, with speed and torque commands."""


T = TypeVar("T", bound=AnyStructure)


@cache
def catalog() -> Catalog:
    """The tables, read once."""
    return Catalog.load()


class Desk:
    """A servo and its tester. `now` moves only with `wait`; `received` is every transfer the servo ever sent."""

    def __init__(
        self,
        model: str = "BLA21-06U-A0",
        firmware: str = "1.300",
        *,
        node_id: int = NODE,
        servo_id: int = 7,
        rom: dict[str, Raw] | None = None,
        angle_deg: float = 0.0,
        seed: int = 1,
        behaviour: Behaviour | None = None,
        up: bool = True,
    ) -> None:
        """`up`: powered and started. `node_id` 0: none."""
        recipe = Recipe(
            model, firmware, servo_id=servo_id, node_id=node_id, rom=rom or {}, angle_deg=angle_deg,
            behaviour=behaviour, any_firmware=True,
        )  # fmt: skip
        self.servo: SimulatedServo = recipe.build(catalog(), seed)
        self.now = START
        self.received: list[Transfer] = []
        self._reassembler = Reassembler()
        self._transfer_id = 0
        if up:
            self.servo.power_on(self.now)
            self.wait(0.2)

    def under(self, **conditions: float | PlantConstants | None) -> "Desk":
        """This desk, with these `Conditions` in effect."""
        for name, value in conditions.items():
            assert hasattr(self.servo.conditions, name), name
            setattr(self.servo.conditions, name, value)
        self.wait(0.1)
        return self

    def power_cycle(self, off_s: float = 1.0) -> None:
        """Switch the supply off and on."""
        self.servo.power_off(self.now)
        self.wait(off_s)
        self.servo.power_on(self.now)
        self.wait(0.2)

    # Shorthands.

    def go(self, raw: Raw, longest: float = 5.0) -> None:
        """Command an angle (0.1°) and wait until the horn rests."""
        self.write("0x00", raw)
        self.settle(longest)

    def run(self, name: str, raw: Raw, seconds: float) -> None:
        """Write a register, then let time pass."""
        self.write(name, raw)
        self.wait(seconds)

    def save(self, by: str = "0x12") -> None:
        """Save by 0x12 or by the opcode SAVE, which must be acknowledged, and wait for the restart."""
        assert (self.write("0x12", 1) if by == "0x12" else self.opcode(0)) == 1
        self.wait(0.3)

    def turn(self, degrees: float) -> bool:
        """Turn the horn manually. False if the motor holds it."""
        return self.servo.turn_manually(degrees, self.now)

    def value(self, name: str) -> Raw:
        """A register that has a value."""
        raw = self.read(name)
        assert raw is not None, name
        return raw

    def reads(self, *names: str) -> list[Raw | None]:
        """Several registers."""
        return [self.read(name) for name in names]

    # Time.

    def wait(self, seconds: float) -> list[Transfer]:
        """Let time pass. Returns the transfers sent meanwhile, with their instants."""
        end, before = self.now + seconds, len(self.received)
        while (due := self.servo.next_due()) <= end:
            self.now = max(self.now, due)
            self.servo.advance(self.now)
            self.collect()
        self.now = end
        self.servo.advance(end)
        self.collect()
        return self.received[before:]

    def settle(self, longest: float = 5.0) -> None:
        """Wait until the horn rests."""
        for _ in range(int(longest / 0.05)):
            self.wait(0.05)
            if self.servo.asleep:
                return
        raise AssertionError(f"the horn still moves after {longest} s")

    def collect(self) -> list[Transfer]:
        """Transfers in the outbox of the servo."""
        transfers = self._reassembler.feed([frame._replace(at=self.now) for frame in self.servo.take_outbox()])
        self.received += transfers
        return transfers

    # Bytes.

    def frames_of(self, structure: AnyStructure, *, source: int = TESTER, priority: int = 20) -> list[Frame]:
        """The frames of a message, or of a request to the servo."""
        self._transfer_id = (self._transfer_id + 1) & 31
        kind = structure.KIND
        destination = 0 if kind is Kind.MESSAGE else int(self.servo.node_id) or NODE
        transfer = Transfer(
            kind, structure.TYPE.id, source, destination, priority, self._transfer_id, structure.encode()
        )  # fmt: skip
        return split(transfer, structure.TYPE)

    def send(self, structure: AnyStructure, *, source: int = TESTER, priority: int = 20) -> list[Transfer]:
        """Send a message or a request to the servo. Returns its immediate transfers."""
        return self.raw_frames(self.frames_of(structure, source=source, priority=priority))

    def raw_frames(self, frames: Iterable[Frame]) -> list[Transfer]:
        """Deliver any frames to the servo."""
        self.servo.on_frames(list(frames), self.now)
        return self.collect()

    def request(self, structure: AnyStructure, response: type[T]) -> T | None:
        """The immediate response to a request, None if there is none."""
        for transfer in self.send(structure):
            decoded = decode(transfer)
            if isinstance(decoded, response) and transfer.transfer_id == self._transfer_id:
                return decoded
        return None

    # Services.

    def get_set(self, name: str, value: Value = EMPTY, *, index: int = 0) -> GetSetResponse | None:
        """One GetSet request."""
        return self.request(GetSetRequest(index, value, name), GetSetResponse)

    def read(self, name: str) -> Raw | None:
        """A register's integer, None if the servo refuses; fails if it does not respond."""
        return self._integer(self.get_set(name), name)

    def write(self, name: str, raw: Raw) -> Raw | None:
        """The value in the response to a write, None if refused."""
        return self._integer(self.get_set(name, integer(raw)), name)

    def send_write(self, name: str, raw: Raw) -> list[Transfer]:
        """A write, and all immediate transfers."""
        return self.send(GetSetRequest(0, integer(raw), name))

    def _integer(self, response: GetSetResponse | None, name: str) -> Raw | None:
        assert response is not None, f"no response for {name}"
        if response.value == EMPTY:
            assert response == GetSetResponse(EMPTY, EMPTY, EMPTY, EMPTY, "")
            return None
        assert response.name == name
        assert isinstance(response.value.value, int)
        return response.value.value

    def node_info(self) -> GetNodeInfoResponse | None:
        """GetNodeInfo."""
        return self.request(GetNodeInfoRequest(), GetNodeInfoResponse)

    def restart(self, magic: int = MAGIC) -> bool | None:
        """RestartNode's flag."""
        response = self.request(RestartNodeRequest(magic), RestartNodeResponse)
        return None if response is None else response.ok

    def opcode(self, opcode: int, argument: int = 0) -> bool | None:
        """ExecuteOpcode's flag."""
        response = self.request(ExecuteOpcodeRequest(opcode, argument), ExecuteOpcodeResponse)
        return None if response is None else response.ok

    # Messages.

    def array(self, actuator_id: int, kind: CommandType | int, value: float) -> None:
        """An ArrayCommand of one entry."""
        self.send(ArrayCommand((ActuatorCommand(actuator_id, kind, value),)))

    def allocation(self, node_id: int, unique_id: bytes, *, source: int = TESTER) -> None:
        """An allocator's response; source 0 with at most six bytes is another requesting node."""
        self.send(AllocationMessage(node_id, False, unique_id), source=source)

    def statuses(self, transfers: list[Transfer]) -> list[ActuatorStatus]:
        """The Status messages among these."""
        return [each for each in map(decode, transfers) if isinstance(each, ActuatorStatus)]

    def node_statuses(self, transfers: list[Transfer]) -> list[NodeStatus]:
        """The NodeStatus messages among these."""
        return [each for each in map(decode, transfers) if isinstance(each, NodeStatus)]
