"""Measured supply and board temperature, and protection (4.7, 4.8)."""

from math import exp
from random import Random
from typing import Final

from hornbill.sim import address
from hornbill.sim.mechanics.conditions import Conditions
from hornbill.sim.mechanics.plant import Plant
from hornbill.sim.memory import Memory
from hornbill.units import Raw

DEAD_BELOW_V: Final = 3.0
"""At or below this supply voltage the electronics stop (4.8)."""

_DROOP: Final = 0.06  # of nominal voltage, at stall torque
_NOISE_V: Final = 0.02
_RISE_K: Final = 60.0  # above ambient, in continuous stall
_THERMAL_S: Final = 120.0
_TEMPERATURE_ERROR_K: Final = 5.0
_VOLTAGE_ERROR_V: Final = 0.5
_LIMITS: Final = ("temperature_high", "temperature_low", "voltage_high", "voltage_low")


class Protection:
    """Temperature and voltage of one servo. `temperature` is the raw value of 0x0B, `voltage` of 0x0C.

    `supply` is the voltage at the motor relative to nominal and `board_c` the temperature, °C, both without errors of
    the sensors.
    """

    __slots__ = ("_plant", "_random", "_rise", "board_c", "supply", "temperature", "voltage")

    def __init__(self, plant: Plant, random: Random, conditions: Conditions) -> None:
        self._plant = plant
        self._random = random
        self.board_c = 0.0
        self._rise = 0.0
        self.temperature: Raw = 0
        self.voltage: Raw = 0
        self.supply = 0.0
        self.measure(conditions, 0.0, 0.0, 0.0)

    def measure(self, conditions: Conditions, elapsed: float, heat: float, torque: float) -> None:
        """Advance by `elapsed` seconds with `heat` of the motor (s at stall). `torque` is its present share."""
        self._rise = self._rise * exp(-elapsed / _THERMAL_S) + _RISE_K * heat / _THERMAL_S
        error = conditions.sensor_error
        self.board_c = conditions.temperature_c + self._rise
        board = self.board_c + _TEMPERATURE_ERROR_K * error
        nominal = self._plant.nominal_v
        sag = _DROOP * nominal + conditions.plant.supply_ohm * self._plant.stall_a
        volts = max(conditions.voltage_v - sag * abs(torque), 0.0)
        self.supply = round(volts / nominal, 3)
        seen = volts + _VOLTAGE_ERROR_V * error + self._random.gauss(0.0, _NOISE_V)
        self.temperature = min(max(round(board), -40), 120)
        self.voltage = min(max(round(seen * 10.0), 0), 500)

    def limits(self, memory: Memory) -> tuple[list[str], bool]:
        """Keys of the fault bits of reached limits (4.12), and whether one is exceeded, so that output is off (4.7,
        4.8)."""
        get = memory.get
        over = (
            self.temperature - get(address.TEMPERATURE_LIMIT_UPPER),
            get(address.TEMPERATURE_LIMIT_LOWER) - self.temperature,
            self.voltage - get(address.VOLTAGE_LIMIT_UPPER),
            get(address.VOLTAGE_LIMIT_LOWER) - self.voltage,
        )
        most = max(over)
        if most < 0:
            return [], False
        return [key for key, by in zip(_LIMITS, over, strict=True) if by >= 0], most > 0
