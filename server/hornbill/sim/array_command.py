"""Which entries of an ArrayCommand a servo takes, and what register value each one is (tables 2-20 and 2-21)."""

import math
from collections.abc import Iterator
from typing import Final

from hornbill.sim import address
from hornbill.sim.behaviour import TENTHS_PER_UNIT, Behaviour
from hornbill.sim.memory import Memory
from hornbill.units import Raw
from hornbill.wire.messages import ArrayCommand, CommandType

_EVERYBODY: Final = 255
_TENTHS_PER_UNITLESS: Final = 1800.0


def taken(message: ArrayCommand, memory: Memory, behaviour: Behaviour) -> Iterator[tuple[int, Raw]]:
    """Register and raw value of each command for this servo, in the order of the message.

    Values that are no number, and those out of range unless they are clamped, are not taken.
    """
    own = memory.get(address.SERVO_ID)
    for actuator_id, kind, value in ((c.actuator_id, c.command_type, c.command_value) for c in message.commands):
        mine = actuator_id == own and (own != 0 or behaviour.array_command_id_0)
        if actuator_id != _EVERYBODY and not mine:
            continue
        wanted = _register(kind, value, behaviour)
        if wanted is None:
            continue
        admitted = memory.admit(*wanted, behaviour)
        if admitted is not None:
            yield wanted[0], admitted


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
