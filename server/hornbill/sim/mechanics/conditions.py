"""Conditions of a simulated servo set by the bench, such as temperature or lost responses."""

from dataclasses import dataclass, field, replace
from typing import Final

from hornbill.domain.plant import PlantConstants

ROOM_C: Final = 25.0


@dataclass(slots=True)
class Conditions:
    """Fields may be set at any time. The servo checks them 20 times a second and with every request."""

    voltage_v: float
    """Supply without load, V. At or below 3 V the servo does not work (4.8)."""
    temperature_c: float = ROOM_C
    """Ambient temperature, °C. The board has this temperature at once and becomes warmer under load."""
    plant: PlantConstants = field(default_factory=PlantConstants)
    """Load, friction and other constants of the horn."""
    pwm_us: float | None = None
    """Width of the pulses at the PWM input, µs. None: no pulses."""
    mute: bool = False
    """Whether frames of the servo are dropped. It still receives and acts."""
    drop_responses_pct: float = 0.0
    """Share of lost service responses, 0..100 %."""
    response_delay_s: float = 0.0
    """Delay of service responses, s. The servo continues to receive and move meanwhile."""
    restart_delay_s: float = 0.0
    """Additional duration of each start, s."""
    software_update: bool = False
    """Whether a software update is in progress (mode of table 2-19): no motor output, only node info and restart are
    served, everything else is refused. The document names the mode but not its behaviour; this is the minimum of a
    servo without its firmware. Only a bench sets it: nothing here writes 0x49."""
    refuse_keys: set[str] = field(default_factory=set[str])
    """Keys of parameters that GetSet refuses although the servo has them."""
    sensor_error: float = 0.0
    """Error of the temperature and voltage sensors, -1..1 of the ±5 °C and ±0.5 V of 4.7 and 4.8."""

    @property
    def load_pct(self) -> float:
        """Constant load of the plant, % of stall torque, + clockwise seen from the name plate."""
        return self.plant.load_pct

    @load_pct.setter
    def load_pct(self, load_pct: float) -> None:
        self.plant = replace(self.plant, load_pct=load_pct)

    @property
    def load_inertia(self) -> float:
        """Inertia of the plant, as a multiple of the servo's own at the horn."""
        return self.plant.inertia

    @load_inertia.setter
    def load_inertia(self, inertia: float) -> None:
        self.plant = replace(self.plant, inertia=inertia)
