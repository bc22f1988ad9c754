"""Conversion of registers to orders for the motor: units, direction, origin, and applicable limits."""

from typing import Final

from hornbill.sim import address
from hornbill.sim.mechanics.motion import Controller, Orders
from hornbill.sim.mechanics.plant import Plant
from hornbill.sim.memory import Memory
from hornbill.units import Raw

_FURTHEST: Final = 360_000_000
_RPM: Final = 6.0  # °/s
_DEAD_BAND_RPM: Final = 0.001
"""One step of 0x32. Its unit is not documented, and the default of 600 must not keep the angle loop from its target."""
_LEFTOVER: Final = 1e-6


class AngleFrame:
    """Relation of the servo's angle to the plant's: reverse (4.16), origin (4.36), and turns not counted."""

    __slots__ = ("_origin", "_uncounted", "sign")

    def __init__(self) -> None:
        self.sign = 1.0
        self._origin = 0.0
        self._uncounted = 0.0

    def update(self, memory: Memory) -> None:
        """Apply 0x23 and 0x44. The origin is in the direction in which the servo counts."""
        sign = -1.0 if memory.get(address.REVERSE) else 1.0
        self._uncounted *= sign * self.sign
        self.sign = sign
        self._origin = memory.get(address.ORIGIN) / 10.0

    def forget_turns(self, plant_deg: float) -> None:
        """Reset to the absolute angle within -180.0° to +179.9° (4.1)."""
        self._uncounted = 0.0
        self._uncounted = 360.0 * ((self.tenths(plant_deg) + 1800) // 3600)

    def tenths(self, plant_deg: float) -> Raw:
        """The servo's angle in 0.1°, including turns."""
        tenths = round((self.sign * plant_deg - self._origin - self._uncounted) * 10.0)
        return min(max(tenths, -_FURTHEST), _FURTHEST)

    def degrees(self, tenths: Raw) -> float:
        """The plant's angle at which the servo reads `tenths`."""
        return self.sign * (tenths / 10.0 + self._origin + self._uncounted)


def orders_for(
    memory: Memory,
    plant: Plant,
    frame: AngleFrame,
    kind: int,
    target: Raw,
    *,
    output: int,
    cascade: bool,
    supply: float,
) -> Orders:
    """Orders to reach `target`, a register value of command `kind` within the angle limits.

    `output` is 0 on, 1 off, 2 brake.
    """
    get = memory.get
    current = get(address.OVERCURRENT_LIMIT, 0) / 10.0 / plant.stall_a or 1.0
    if output:
        controller = Controller.OFF if output == 1 else Controller.BRAKE
        return Orders(controller, current_limit=current, volts=supply)
    sign = frame.sign
    if kind == address.COMMAND_ANGLE:
        controller = Controller.ANGLE_CASCADE if cascade else Controller.ANGLE_DIRECT
        goal = frame.degrees(target)
    elif not cascade:
        # 0x25 was turned off during a speed or torque command, which is then ignored (4.18): brake.
        return Orders(Controller.TORQUE, current_limit=current, volts=supply)
    elif kind == address.COMMAND_SPEED:
        controller, goal = Controller.SPEED, sign * target * _RPM
    else:
        controller, goal = Controller.TORQUE, sign * target / 100.0
    # With reverse on, the limits of the two sides of the plant are swapped.
    speeds = sorted((sign * get(address.SPEED_LIMIT_CCW) * _RPM, sign * get(address.SPEED_LIMIT_CW) * _RPM))
    torques = sorted((sign * get(address.TORQUE_LIMIT_CCW) / 100.0, sign * get(address.TORQUE_LIMIT_CW) / 100.0))
    return Orders(
        controller,
        goal,
        smooth=get(address.SMOOTHING) == 1,
        angle_p=get(address.ANGLE_P_GAIN) * (plant.angle_p if cascade else plant.angle_p_direct),
        angle_d=get(address.ANGLE_D_GAIN) * plant.angle_d,
        dead_band=get(address.ANGLE_DEAD_BAND) / 10.0 + _LEFTOVER,
        boost=get(address.ANGLE_BOOST, 0) / 1000.0,
        speed_p=get(address.SPEED_P_GAIN) * plant.speed_p,
        speed_i=get(address.SPEED_I_GAIN) * plant.speed_i,
        speed_dead_band=get(address.SPEED_DEAD_BAND) * _DEAD_BAND_RPM * _RPM,
        speed_i_limit=get(address.SPEED_I_LIMIT) * plant.speed_i_limit,
        speed_low=speeds[0],
        speed_high=speeds[1],
        torque_low=torques[0],
        torque_high=torques[1],
        current_limit=current,
        volts=supply,
    )
