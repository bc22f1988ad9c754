"""The simulated motor of a model. Its parameters are not documented; these are plausible values. What differs from horn
to horn is in `domain.plant.PlantConstants`."""

from dataclasses import dataclass
from typing import Final

from hornbill.domain.plant import DEFAULT_PLANT
from hornbill.schema.model import ServoModel

STEP_S: Final = 0.001
"""Integration step, and the period of the servo's own control loops."""

WEAK_BRAKE: Final = 0.5
"""Braking (0x20 = 2) relative to a shorted motor: 4.13 calls it weak."""

_TOP_RPM: Final = {"BLA21": 150.0, "BLA15": 110.0}
_RISE_S: Final = {"BLA21": 0.030, "BLA15": 0.025, "BLA34": 0.035}
_RISE_OTHER_S: Final = 0.030
_D_COUNTS: Final = 30  # lower bound of the default, or the range of 0x2D would far exceed useful damping
_DEG_PER_S: Final = 6.0  # in one rpm


_ANGLE_LOOP_PER_S: Final = 100.0  # speed setpoint per degree at the default P gain, cascade
_FULL_TORQUE_DEG: Final = 6.0  # error for stall torque at the default P gain, without cascade
_SPEED_LOOP_PER_S: Final = 200.0  # acceleration per speed error at the default speed P gain
_D_SHARE: Final = 0.5  # share of the speed subtracted from the setpoint at the default D gain
_INTEGRAL_PER_S: Final = 0.015  # torque share a second per °/s of deviation at the default speed I gain
_INTEGRAL_LIMIT: Final = 0.2  # minimum torque share of the integral term at the default of 0x33
_INTEGRAL_COUNT: Final = 0.0001  # minimum per step: effectively no limit at the default of BLA15


@dataclass(frozen=True, slots=True)
class Plant:
    """Torque is a share of stall torque at nominal voltage (1.0 is 100 % in 0x0A); speeds are in °/s.

    `synchronous` is the speed at which the back-EMF equals the nominal supply; with friction the horn is slightly
    slower. `gain` is the acceleration at stall torque, °/s². `stall_a` is the motor current at 100 % torque, A.
    `top_rpm` is the speed at nominal voltage without load and with default friction. The effect of one step of 0x2C,
    0x2D, 0x30, 0x31 and 0x33 is in `angle_p` (cascade), `angle_p_direct`, `angle_d`, `speed_p`, `speed_i` and
    `speed_i_limit`.
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
    """The plant of a model: about 150 rpm at nominal voltage for BLA21 (4.2), less for BLA15. For BLA34, 80 rpm, the
    end of its range of 0x01; likewise for any other series.

    100 % torque corresponds to the default of the overcurrent limit 0x2A, so that a lower limit reduces torque (4.20).
    Gains are scaled so that every model is well damped with its defaults.
    """
    top_rpm = _TOP_RPM.get(model.series, float(model.parameters["command_speed"].maximum or 0))
    synchronous = top_rpm * _DEG_PER_S * (1.0 + DEFAULT_PLANT.viscous) / (1.0 - DEFAULT_PLANT.coulomb)
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
