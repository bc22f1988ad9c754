"""A command that moves every servo at once, or every servo without a servo id, does not pass the guard by default."""

import pytest

from hornbill.errors import ForbiddenParameter, OutOfRange
from hornbill.wire.datatype import Kind
from hornbill.wire.frame import Frame
from hornbill.wire.messages import ActuatorCommand, ArrayCommand, CommandType
from hornbill.wire.transfer import Transfer, split
from unit.node.recording import port


def message(command: ArrayCommand) -> list[Frame]:
    return split(Transfer(Kind.MESSAGE, 1010, 127, 0, 17, 0, command.encode()), ArrayCommand.TYPE)


def commands(*actuators: int) -> ArrayCommand:
    return ArrayCommand([ActuatorCommand(each, CommandType.POSITION, 1.0) for each in actuators])


@pytest.mark.parametrize("actuators", [(255,), (1, 255), (*range(1, 15), 255), (255, 1, 2)])
def test_a_command_to_every_servo_is_refused(actuators: tuple[int, ...]) -> None:
    guarded, inner = port()
    with pytest.raises(OutOfRange) as caught:
        guarded.send(message(commands(*actuators)))
    assert inner.sent == []
    assert caught.value.facts == {"minimum": 1, "maximum": 254, "unit": "", "requested": 255, "cause": "id_of_all"}
    assert caught.value.detail == "Actuator id 255 would move every servo on the bus. Use 1 to 254."


@pytest.mark.parametrize("actuators", [(0,), (1, 0), (*range(1, 15), 0), (0, 255)])
@pytest.mark.parametrize("allow_broadcast", [False, True])
def test_a_command_to_id_0_is_refused_whatever_is_allowed(actuators: tuple[int, ...], allow_broadcast: bool) -> None:
    guarded, inner = port(allow_broadcast=allow_broadcast)
    with pytest.raises(OutOfRange) as caught:
        guarded.send(message(commands(*actuators)))
    assert inner.sent == []
    assert caught.value.facts == {"minimum": 1, "maximum": 254, "unit": "", "requested": 0, "cause": "id_of_all_new"}
    assert caught.value.detail == (
        "Actuator id 0 is that of every servo without a servo id: all of them may move together. Give the "
        "servo an id (parameter 0x45), and use that: 1 to 254."
    )


def test_a_command_in_the_form_of_can_fd_is_refused() -> None:
    """There a count stands first and shifts the actuator ids by four bits, where nobody would look for them."""
    guarded, inner = port()
    shifted = bytes.fromhex("1ff1003c00")
    frames = split(Transfer(Kind.MESSAGE, 1010, 127, 0, 17, 0, shifted), ArrayCommand.TYPE)
    with pytest.raises(ForbiddenParameter):
        guarded.send(frames)
    assert inner.sent == []


def test_a_command_to_every_servo_passes_where_it_was_allowed() -> None:
    guarded, inner = port(allow_broadcast=True)
    guarded.send(message(commands(255)))
    assert len(inner.sent) == 1


def test_commands_to_single_servos_pass_whatever_their_values() -> None:
    guarded, inner = port()
    frames = message(ArrayCommand([ActuatorCommand(n, 255, float("nan")) for n in range(1, 16)]))
    for frame in frames:
        guarded.send([frame])
    assert inner.sent == frames


def test_a_command_to_every_servo_is_refused_frame_by_frame_too() -> None:
    guarded, inner = port()
    *begin, last = message(commands(1, 2, 3, 255))
    guarded.send(begin)
    with pytest.raises(OutOfRange):
        guarded.send([last])
    assert inner.sent == begin
