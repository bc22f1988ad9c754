"""Writes to servos in the frames of a recording."""

from hornbill.domain.recording import RecordedWrite
from hornbill.schema.catalog import Catalog
from hornbill.servo.recorder.writes import WriteFinder
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import LoggedFrame
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from hornbill.wire.services import EMPTY, ExecuteOpcodeRequest, GetSetRequest, Opcode, RestartNodeRequest, integer
from hornbill.wire.transfer import Transfer, split
from hornbill.wire.types import AnyStructure

UID = "0" * 31 + "a"


def test_requests_of_the_host_that_can_change_a_servo_are_writes() -> None:
    finder = WriteFinder(Catalog.load(), {11: UID})

    def found(structure: AnyStructure, sent: bool = True) -> list[RecordedWrite]:
        destination = 11 if structure.KIND is not Kind.MESSAGE else 0
        transfer = Transfer(structure.KIND, structure.TYPE.id, 127, destination, 16, 3, structure.encode())
        frames = split(transfer, structure.TYPE)
        return finder.find(LoggedFrame(frame._replace(at=1001.0), "can0", sent) for frame in frames)

    assert found(GetSetRequest(0, integer(610), "0x38")) == [
        RecordedWrite(1001.0, 11, UID, "parameter", "angle_limit_cw", "0x38", 610, 61.0)
    ]
    assert found(GetSetRequest(0, EMPTY, "0x38")) == []
    assert found(GetSetRequest(0, integer(610), "0x38"), sent=False) == []
    assert found(ExecuteOpcodeRequest(Opcode.SAVE)) == [RecordedWrite(1001.0, 11, UID, "opcode", "", 0, 0)]
    assert found(RestartNodeRequest()) == [RecordedWrite(1001.0, 11, UID, "restart")]
    moved = ArrayCommand((ActuatorCommand(7, CommandType.UNITLESS, 0.5), ActuatorCommand(8, CommandType.SPEED, -1.0)))
    assert found(moved) == [
        RecordedWrite(1001.0, None, "", "array_command", "unitless", "actuator 7", "", 0.5),
        RecordedWrite(1001.0, None, "", "array_command", "speed", "actuator 8", "", -1.0),
    ]
