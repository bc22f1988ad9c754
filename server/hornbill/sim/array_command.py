"""Entries of an ArrayCommand for a servo, and their register values (tables 2-20 and 2-21)."""

import math
from collections.abc import Iterator
from typing import Final

from hornbill.sim import address
from hornbill.sim.behaviour import TENTHS_PER_UNIT, Behaviour
from hornbill.sim.memory import Memory
from hornbill.units import Raw
from hornbill.wire.messages import ArrayCommand, CommandType

_ALL_SERVOS: Final = 255
_TENTHS_PER_UNITLESS: Final = 1800.0


def addresses(payload: bytes, memory: Memory) -> bool:
    """Whether an encoded ArrayCommand has a command for this servo or for all. Most of a full bus have none."""
    ids = ArrayCommand.actuator_ids(payload)
    return memory.get(address.SERVO_ID) in ids or _ALL_SERVOS in ids


def accepted_commands(message: ArrayCommand, memory: Memory, behaviour: Behaviour) -> Iterator[tuple[int, Raw]]:
    """Register and raw value of each command for this servo, in message order.

    Values that are not finite are ignored, as are values out of range unless they are clamped.
    """
    own = memory.get(address.SERVO_ID)
    for each in message.commands:
        actuator_id, kind, value = each.actuator_id, each.command_type, each.command_value
        mine = actuator_id == own and (own != 0 or behaviour.array_command_id_0)
        if actuator_id != _ALL_SERVOS and not mine:
            continue
        command = _register(kind, value, behaviour)
        if command is None:
            continue
        admitted = memory.admit(*command, behaviour)
        if admitted is not None:
            yield command[0], admitted


def _register(kind: int, value: float, behaviour: Behaviour) -> tuple[int, Raw] | None:
    if not math.isfinite(value):
        return None
    match kind:
        case CommandType.UNITLESS:
            if not -1.0 <= value <= 1.0:
                if behaviour.out_of_range == "refuse":
                    return None
                value = math.copysign(1.0, value)
            return address.COMMAND_ANGLE, round(value * _TENTHS_PER_UNITLESS)
        case CommandType.POSITION:
            return address.COMMAND_ANGLE, round(value * TENTHS_PER_UNIT[behaviour.position_unit])
        case CommandType.FORCE:
            return address.COMMAND_TORQUE, round(value)
        case CommandType.SPEED:
            return address.COMMAND_SPEED, round(value)
        case _:
            return None
