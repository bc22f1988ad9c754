"""The numbers of the simulated motor, gear and horn. No document gives them; they are made plausible."""

from dataclasses import dataclass
from typing import Final

from hornbill.schema.model import ServoModel

STEP_S: Final = 0.001
"""Integration step, and the period of the servo's own control loops."""

TORQUE_LAG_S: Final = 0.003
"""How fast torque follows what the controller asks for: winding, driver, filter. Much gain meets it and hunts."""

BACKLASH_DEG: Final = 0.2
"""Play of the gear at the horn, where the angle sensor sits; the default dead band of 0.3° just swallows it."""

BREAKAWAY: Final = 0.03
"""Torque that a horn at rest withstands, as a share of stall torque."""
COULOMB: Final = 0.02
"""Friction of a moving horn, as a share of stall torque."""
VISCOUS: Final = 0.3
"""Friction that grows with speed: its share of stall torque at no-load speed."""
WEAK_BRAKE: Final = 0.5
"""Braking (0x20 = 2) against shorting the motor: 4.13 calls it weak."""

_TOP_RPM: Final = {"BLA21": 150.0, "BLA15": 110.0, "BLA34": 80.0}
_RISE_S: Final = {"BLA21": 0.030, "BLA15": 0.025, "BLA34": 0.035}
_RISE_OTHER_S: Final = 0.030
_D_COUNTS: Final = 30  # no default counts as less, or the whole range of 0x2D would be far beyond what damps
_DEG_PER_S: Final = 6.0  # in one rpm


_ANGLE_LOOP_PER_S: Final = 100.0  # wanted speed per degree at the default P gain, cascade
_FULL_TORQUE_DEG: Final = 6.0  # error that asks for stall torque at the default P gain, without cascade
_SPEED_LOOP_PER_S: Final = 200.0  # acceleration per speed error at the default speed P gain
_D_SHARE: Final = 0.5  # of the speed is taken off the wanted one at the default D gain
_INTEGRAL_PER_S: Final = 0.015  # torque share a second per °/s of deviation at the default speed I gain
_INTEGRAL_LIMIT: Final = 0.2  # torque share that the default of 0x33 lets the I part add, at least
_INTEGRAL_COUNT: Final = 0.0001  # and what one count does, at least: no limit at all at the default of BLA15


@dataclass(frozen=True, slots=True)
class Plant:
    """Torque is a share of stall torque at nominal voltage, 1.0 is what 0x0A calls 100 %; speeds are in °/s.

    `synchronous` is the speed at which the motor's own voltage equals the nominal supply; with friction the
    horn stays a little below. `gain` is the acceleration in °/s² that stall torque gives. `stall_a` is the motor
    current that goes with 100 % torque, in A. `top_rpm` is the speed at nominal voltage without load. What one
    count of 0x2C, 0x2D, 0x30, 0x31 and 0x33 does is in `angle_p` (cascade), `angle_p_direct`, `angle_d`, `speed_p`,
    `speed_i` and `speed_i_limit`.
    """

    top_rpm: float
    synchronous: float
    gain: float
    stall_a: float
    nominal_v: float
    angle_p: float
    angle_p_direct: float
    angle_d: float
    speed_p: float
    speed_i: float
    speed_i_limit: float


def plant_of(model: ServoModel) -> Plant:
    """The plant of a model: about 150 rpm at nominal voltage for BLA21 (4.2), less for BLA15, and for BLA34
    the 80 rpm that its range of 0x01 ends at; so for any other series.

    100 % torque goes with the default of the current limit 0x2A, so that a lower limit takes torque away (4.20).
    The counts of the gains are scaled so that every model is well damped with its own defaults.
    """
    top_rpm = _TOP_RPM.get(model.series, float(model.parameters["command_speed"].maximum or 0))
    synchronous = top_rpm * _DEG_PER_S * (1.0 + VISCOUS) / (1.0 - COULOMB)
    gain = synchronous / _RISE_S.get(model.series, _RISE_OTHER_S)

    def default(key: str) -> int:
        return model.parameters[key].default or 1

    return Plant(
        top_rpm=top_rpm,
        synchronous=synchronous,
        gain=gain,
        stall_a=default("overcurrent_limit") / model.parameters["overcurrent_limit"].per_unit,
        nominal_v=model.nominal_v,
        angle_p=_ANGLE_LOOP_PER_S / default("angle_p_gain"),
        angle_p_direct=1.0 / _FULL_TORQUE_DEG / default("angle_p_gain"),
        angle_d=_D_SHARE / max(default("angle_d_gain"), _D_COUNTS),
        speed_p=_SPEED_LOOP_PER_S / gain / default("speed_p_gain"),
        speed_i=_INTEGRAL_PER_S / default("speed_i_gain"),
        speed_i_limit=max(_INTEGRAL_LIMIT / default("speed_i_limit"), _INTEGRAL_COUNT),
    )
