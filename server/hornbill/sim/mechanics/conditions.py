"""What a bench does to a servo, from a warm chamber to a cable that loses answers."""

from dataclasses import dataclass, field
from typing import Final

ROOM_C: Final = 25.0


@dataclass(slots=True)
class Conditions:
    """Set the fields at any time; the servo looks at them 20 times a second and with every request."""

    voltage_v: float
    """Supply at no load, in volts. At 3 V and below the servo is dead (4.8)."""
    temperature_c: float = ROOM_C
    """Surroundings, in °C: the board takes this temperature at once and warms above it under load."""
    load_pct: float = 0.0
    """Constant torque on the horn in % of the servo's greatest, + pushes CW as seen from the name plate."""
    load_inertia: float = 0.0
    """Inertia on the horn, as a multiple of the servo's own as its horn feels it."""
    pwm_us: float | None = None
    """Width of the pulses at the PWM input in µs; None: no pulse."""
    mute: bool = False
    """The servo hears, acts, and nothing it sends reaches the bus."""
    drop_responses_pct: float = 0.0
    """How many of its answers to services are lost, 0..100 %."""
    answer_delay_s: float = 0.0
    """How long the servo thinks before it answers a service. It goes on hearing and moving meanwhile."""
    restart_delay_s: float = 0.0
    """Added to the time each start takes."""
    software_update: bool = False
    """Its software is being replaced (mode of table 2-19): it has no motor output, serves node info and restart
    alone, and says no to everything else. The document gives the mode and not what goes with it; this is the least
    a servo without its program can do. Only a bench brings it about: nothing here writes 0x49."""
    refuse_keys: set[str] = field(default_factory=set[str])
    """Parameters (by key) that GetSet refuses although the servo has them."""
    sensor_error: float = 0.0
    """Error of the temperature and voltage sensors, -1..1 of the ±5 °C and ±0.5 V of 4.7 and 4.8."""
